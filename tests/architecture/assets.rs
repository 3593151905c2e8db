//! The scenes in `assets/` are what `tools/scenes` writes, byte for byte, and small.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::{repository, skip};

/// The bytes of every .glb in a folder, by file name.
fn scenes(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let files = std::fs::read_dir(folder).expect("the folder of scenes").map(|entry| entry.expect("an entry").path());
    files
        .filter(|path| path.extension().is_some_and(|extension| extension == "glb"))
        .map(|path: PathBuf| {
            let name = path.file_name().expect("a file name").to_string_lossy().into_owned();
            (name, std::fs::read(&path).expect("a readable scene"))
        })
        .collect()
}

/// Says how two sets of scenes differ, `None` if they are equal.
fn difference(committed: &BTreeMap<String, Vec<u8>>, written: &BTreeMap<String, Vec<u8>>) -> Option<String> {
    let names: Vec<_> = committed.keys().collect();
    let written_names: Vec<_> = written.keys().collect();
    if names != written_names {
        return Some(format!("assets/ holds {names:?}, tools/scenes writes {written_names:?}"));
    }
    committed.iter().find_map(|(name, bytes)| {
        let other = &written[name];
        let first = bytes.iter().zip(other).position(|(a, b)| a != b);
        let at = first.or((bytes.len() != other.len()).then_some(bytes.len().min(other.len())))?;
        Some(format!("{name} differs from byte {at} on ({} and {} bytes); run tools/scenes", bytes.len(), other.len()))
    })
}

#[test]
fn the_generator_writes_the_committed_bytes() {
    if Command::new("python3").arg("--version").output().is_err() {
        // Without it the committed files are all there is to use.
        return skip("the generator of scenes needs python3");
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let run = Command::new("python3")
        .arg(repository("tools/scenes"))
        .arg("--into")
        .arg(folder.path())
        .output()
        .expect("python3 starts");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    assert_eq!(difference(&scenes(&repository("assets")), &scenes(folder.path())), None);
}

#[test]
fn a_changed_byte_a_missing_and_a_longer_scene_are_noticed() {
    let committed = BTreeMap::from([("a.glb".to_string(), vec![1, 2, 3]), ("b.glb".to_string(), vec![4])]);
    let sabotage = |change: fn(&mut BTreeMap<String, Vec<u8>>)| {
        let mut copy = committed.clone();
        change(&mut copy);
        difference(&committed, &copy)
    };
    assert_eq!(sabotage(|_| ()), None);
    assert!(sabotage(|s| s.get_mut("a.glb").expect("a.glb")[1] = 9).is_some_and(|d| d.contains("byte 1 ")));
    assert!(sabotage(|s| s.get_mut("b.glb").expect("b.glb").push(0)).is_some_and(|d| d.contains("byte 1 ")));
    assert!(sabotage(|s| drop(s.remove("b.glb"))).is_some());
}

#[test]
fn the_scenes_are_small() {
    let sizes: Vec<_> = scenes(&repository("assets")).into_iter().map(|(name, data)| (name, data.len())).collect();
    assert!(!sizes.is_empty());
    for (name, size) in &sizes {
        assert!(*size < 1_500_000, "{name} has {size} bytes");
    }
    assert!(sizes.iter().map(|(_, size)| size).sum::<usize>() < 5_500_000, "{sizes:?}");
}
