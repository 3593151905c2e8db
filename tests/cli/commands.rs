//! The program from outside: exit codes and messages that need no device (device.rs has those that do).

use std::path::Path;
use std::process::{Command, Output};

use nephroid::low_level::picture::exr::{self, Metadata};
use nephroid::low_level::picture::image::{Channels, Picture};

use crate::support::shared;

fn nephroid(line: &str, folder: &Path) -> Output {
    let program = env!("CARGO_BIN_EXE_nephroid");
    Command::new(program).args(line.split_whitespace()).current_dir(folder).output().expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

/// The exit code is `code`, nothing goes to standard output and one sentence with `part` to standard error.
fn assert_refused(line: &str, folder: &Path, code: i32, part: &str) {
    let output = nephroid(line, folder);
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{line}: {message}");
    assert!(message.starts_with("nephroid: ") && message.contains(part), "{line}: {message}");
    assert_eq!(message.lines().count(), 1, "{line}: {message}");
    assert_eq!(text(&output.stdout), "", "{line}");
}

/// A folder with a scene file that nobody gets to read, and two pictures `a.exr` and `b.exr`.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("scene.glb"), "").expect("written");
    for (name, width, value) in [("a.exr", 2, 1.5), ("b.exr", 2, 1.0), ("wide.exr", 3, 1.0)] {
        let mut picture = Picture::new(width, 2);
        picture.push("", Channels::Rgb, vec![value; 6 * width as usize]);
        let path = folder.path().join(name);
        let file = std::fs::File::create(&path).expect("created");
        exr::write(file, &path, &picture, &Metadata::new()).expect("written");
    }
    folder
}

#[test]
fn usage_errors_exit_with_1() {
    let folder = folder();
    for (line, part) in [
        ("", "a command is missing"),
        ("paint", "unrecognized subcommand 'paint'"),
        ("render scene.glb", "--output <FILE>"),
        ("render -o a.exr", "<SCENE>"),
        ("render scene.glb -o out.exr --siez 4x4", "a similar argument exists: '--size'"),
        ("render scene.glb -o out.exr --size 4", "expected WIDTHxHEIGHT"),
        ("render scene.glb -o out.exr --time 30parsecs", "expected a time"),
        ("render scene.glb -o out.exr --passes 0", "greater than 0"),
        ("render scene.glb -o out.exr --photons -5", "greater than 0"),
        ("render scene.glb -o out.exr --time -5", "expected a time"),
        ("render scene.glb -o out.exr --kernel gauss", "[possible values: constant, cone, epanechnikov]"),
        ("render scene.glb -o out.exr --aov albedo,colour", "'colour'"),
        ("render scene.glb -o out.exr --exposure bright", "expected stops"),
        ("render scene.glb -o out.exr --aperture f/2.8", "--focus"),
        ("render scene.glb -o out.exr --aperture wide --focus 1", "expected f/N or a radius"),
        ("render scene.glb -o out.exr --aperture f/2.8 --focus 0", "expected a length"),
        ("render scene.glb -o out.exr --bloom 2", "between 0 and 1"),
        ("render scene.glb -o out.exr --ssao -1", "expected a length"),
        ("render scene.glb -o out.exr --cdl-slope 1,2", "three with commas"),
        ("render scene.glb -o out.jpg", "must end in .exr or .png"),
        ("render scene.glb -o out.exr -o ./out.exr", "named twice"),
        ("compare a.exr", "<REFERENCE>"),
        ("compare a.exr b.exr --layer caustic", "lacks layer 'caustic'"),
        ("compare a.exr wide.exr", "2 x 2 pixels, the reference 3 x 2"),
        ("compare a.exr b.exr --block 0", "--block"),
        ("compare a.exr b.exr --fail-above psnr=30", "'psnr' is not one of mse"),
        ("compare a.exr b.exr --fail-above mse", "expected METRIC=LIMIT"),
        ("compare a.exr b.exr --fail-above mse=-1", "at least 0"),
        ("compare a.exr b.exr --no-flip --fail-above flip=0.1", "no --no-flip"),
        ("compare a.exr b.exr --pixels-per-degree 0", "pixels per degree"),
        ("compare a.exr b.exr --heat-map map.exr", "must end in .png"),
        ("compare a.exr b.exr --heat-map-of flip", "--heat-map <FILE>"),
        ("compare a.exr b.exr --heat-map map.png --heat-map-max 0", "above 0"),
        ("compare a.exr b.exr --heat-map map.png --heat-map-of flip --no-flip", "no --no-flip"),
    ] {
        assert_refused(line, folder.path(), 1, part);
    }
}

#[test]
fn bad_files_exit_with_2_and_leave_nothing() {
    let folder = folder();
    std::fs::write(folder.path().join("random.exr"), b"v/1\x01not a picture").expect("written");
    for (line, part) in [
        ("render no.glb -o out.exr", "no.glb: cannot read"),
        ("render . -o out.exr", ".: not a regular file"),
        ("render scene.glb -o no/out.exr", "no/out.exr: cannot create"),
        ("render scene.glb -o out.exr --environment no.hdr", "no.hdr: cannot read"),
        ("render scene.glb -o out.exr --report no/report.json", "no/report.json: cannot create"),
        ("info no.glb", "no.glb: cannot read"),
        ("compare no.exr b.exr", "no.exr: cannot read"),
        ("compare random.exr b.exr", "random.exr: OpenEXR of version 110 is not supported"),
        ("compare scene.glb b.exr", "scene.glb: OpenEXR file"),
        ("compare a.exr b.exr --heat-map no/map.png", "no/map.png: cannot create"),
    ] {
        assert_refused(line, folder.path(), 2, part);
    }
    let names = std::fs::read_dir(folder.path()).expect("a folder").count();
    assert_eq!(names, 5, "scene, three pictures and the random file");
}

#[test]
fn help_and_version_exit_with_0() {
    let folder = folder();
    for line in [
        "--help",
        "-h",
        "help render",
        "render --help",
        "compare -h",
        "info --help",
        "devices --help",
        "bench --help",
        "bench estimators --help",
        "bench trees --help",
        "bench update --help",
    ] {
        let output = nephroid(line, folder.path());
        assert_eq!(output.status.code(), Some(0), "{line}");
        assert!(text(&output.stdout).contains("Usage: nephroid"), "{line}");
        assert_eq!(text(&output.stderr), "", "{line}");
    }
    let version = nephroid("--version", folder.path());
    assert_eq!(version.status.code(), Some(0));
    assert_eq!(text(&version.stdout), concat!("nephroid ", env!("CARGO_PKG_VERSION"), "\n"));
}

#[test]
fn compare_measures() {
    let folder = folder();
    let output = nephroid("compare a.exr b.exr --json", folder.path());
    assert_eq!(output.status.code(), Some(0));
    let value: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!((&value["mse"], &value["mean_ratio"]), (&0.25.into(), &1.5.into()));
    let table = text(&nephroid("compare b.exr b.exr", folder.path()).stdout);
    assert!(table.contains("relmse trimmed  0.0000e0"), "{table}");
    assert!(table.contains("mean ratio      1.000000"), "{table}");
}

#[test]
fn a_limit_decides_the_exit_code_and_the_table_is_printed_all_the_same() {
    let folder = folder();
    // a.exr is 1.5, b.exr 1.0: mse 0.25, mean ratio 1.5.
    for (limits, code) in [
        ("--fail-above mse=0.25", 0),
        ("--fail-above mse=0.2499", 5),
        ("--fail-above mean_ratio=0.5 --fail-above max=0.5", 0),
        ("--fail-above mean_ratio=0.49", 5),
        ("--fail-above mse=1 --fail-above hdr_flip=1e-3", 5),
        ("--fail-above flip=0", 0),
        ("--no-flip --fail-above smape=0.1 --json", 5),
    ] {
        let output = nephroid(&format!("compare a.exr b.exr {limits}"), folder.path());
        let (stdout, stderr) = (text(&output.stdout), text(&output.stderr));
        assert_eq!(output.status.code(), Some(code), "{limits}: {stderr}");
        assert!(stdout.contains("mse") && stdout.contains("reference"), "{limits}: {stdout}");
        assert_eq!(stderr.lines().count(), usize::from(code != 0), "{limits}: {stderr}");
        assert!(code == 0 || stderr.contains("above the limit of"), "{limits}: {stderr}");
    }
    let output = nephroid("compare b.exr a.exr --fail-above mse=0.1", folder.path());
    assert_eq!(text(&output.stderr), "nephroid: mse is 2.500000e-1, above the limit of 1e-1\n");
}

#[test]
fn heat_maps_are_pictures_of_the_same_size() {
    let folder = folder();
    for of in ["relative", "signed", "flip", "hdr-flip"] {
        let line = format!("compare a.exr b.exr --heat-map map.png --heat-map-of {of} --heat-map-max 0.3 --json");
        let output = nephroid(&line, folder.path());
        assert_eq!(output.status.code(), Some(0), "{of}: {}", text(&output.stderr));
        let value: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!((&value["heat_map"]["of"], &value["heat_map"]["high"]), (&of.into(), &0.3.into()));
        let map = image::open(folder.path().join("map.png")).expect("a PNG").to_rgb8();
        assert_eq!(map.dimensions(), (2, 2));
        let [r, g, b] = map.get_pixel(0, 0).0;
        match of {
            // 0.5 / sqrt(1.01) is beyond the scale.
            "relative" => assert!(r > 240 && g > 230 && b > 150, "{r} {g} {b}"),
            "signed" => assert!(r > 200 && b < 100, "too bright is red: {r} {g} {b}"),
            // Cut off at 1 the pictures are equal.
            "flip" => assert!(r.max(g).max(b) < 40, "{r} {g} {b}"),
            _ => assert!(r > 60 && r < 230, "{r} {g} {b}"),
        }
    }
}

#[test]
fn references_of_the_test_scenes_equal_themselves() {
    let Some(reference) = shared::path("scenes/ring/reference.exr") else { return };
    let line = format!("compare {0} {0} --json", reference.display());
    let output = nephroid(&line, Path::new("."));
    let value: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!((&value["relmse"], &value["pixels"]), (&0.0.into(), &76800.into()));
}
