//! Sequences of frames: resumed, divided, made a film.
//!
//! `NEPHROID_TEST_DEVICE` chooses the device (default `cpu`).

use std::process::Stdio;
use std::time::Duration;

use nephroid::low_level::film::film_file;
use nephroid::low_level::picture::exr::{self, Value};
use serde_json::json;

use crate::support::moving::Moving;
use crate::support::program::{Program, names_in};

/// Frames of [`scene`]; `%` is the device.
const SMALL: &str = "animate scene.glb --size 24x16 --method path --device % -q --fps 4";

/// A program beside a triangle that crosses the picture in a second, before a sky.
fn program() -> Program {
    let program = Program::new();
    let file = Moving::triangle()
        .with("/cameras", json!([{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}]))
        .with(
            "/nodes",
            json!([{"mesh": 0}, {"camera": 0, "translation": [0.5, 0.5, 4]}, {"mesh": 0, "translation": [-1, 0, -1]}]),
        )
        .with("/scenes/0/nodes", json!([0, 1, 2]))
        .pointer("/cameras/0/perspective/yfov", &[0.0, 1.0], "SCALAR", &[0.7, 0.6])
        .node(0, "translation", &[0.0, 1.0], "VEC3", &[-0.5, 0.0, 0.0, 1.0, 0.2, 0.0]);
    std::fs::write(program.path("scene.glb"), file.bytes()).expect("written");
    program
}

fn frames(program: &Program, stem: &str, count: u64) -> Vec<nephroid::Picture> {
    (0..count).map(|frame| program.picture(&format!("{stem}_{frame:02}.exr"))).collect()
}

#[test]
fn frames_that_are_there_are_not_rendered_again() {
    let program = program();
    let lens = "--aperture f/0.5 --focus 4";
    let line = format!("{SMALL} {lens} --passes 3 -o a_##.exr -o a_##.png");
    let said = program.succeeds(&line);
    assert!(said.starts_with("5 frames in ") && said.trim_end().ends_with(": a_##.exr"), "{said}");
    let names = names_in(program.folder());
    assert_eq!(names[..4], ["a_00.exr", "a_00.png", "a_01.exr", "a_01.png"]);
    assert_eq!(names.len(), 11, "no checkpoint and no claim is left: {names:?}");
    let first = frames(&program, "a", 5);
    assert!(first.windows(2).all(|pair| pair[0] != pair[1]), "the triangle moves");
    let (_, about) = exr::read(&program.path("a_03.exr")).expect("a frame");
    assert_eq!((&about["frame"], &about["time"]), (&Value::Count(3), &Value::Number(0.75)));
    let bytes = |name: &str| std::fs::read(program.path(name)).expect("a file");
    let before = bytes("a_02.exr");
    for lost in ["a_01.exr", "a_03.png"] {
        std::fs::remove_file(program.path(lost)).expect("removed");
    }
    std::fs::write(program.path("a_04.exr"), &before[..before.len() / 2]).expect("cut");
    let said = program.succeeds(&line);
    assert!(said.starts_with("3 frames in ") && said.contains(", 2 that were there: "), "{said}");
    assert_eq!(bytes("a_02.exr"), before);
    assert_eq!(frames(&program, "a", 5), first, "frames of later runs are those of the first");
    // One frame by `render` is the same, also where the lens follows the camera.
    let one = SMALL.replace("animate", "render").replace("--fps 4", "--at 0.5");
    program.succeeds(&format!("{one} {lens} --passes 3 -o one.exr"));
    assert_eq!(program.picture("one.exr"), first[2]);
    // Frames of other settings are not taken for these, and not replaced.
    program.refuses(&format!("{line} --seed 3"), 1, "'a_00.exr' is no frame of this render");
    program.succeeds(&format!("{line} --seed 3 --force"));
    assert_ne!(frames(&program, "a", 1)[0], first[0]);
}

#[test]
fn parts_are_the_frames_of_the_whole() {
    let program = program();
    let line = format!("{SMALL} --passes 3 --shutter 0.5");
    program.succeeds(&format!("{line} -o whole_##.exr"));
    program.succeeds(&format!("{line} -o part_##.exr --part 2/2"));
    assert_eq!(names_in(program.folder()).iter().filter(|name| name.starts_with("part")).count(), 2);
    program.succeeds(&format!("{line} -o part_##.exr --part 1/2"));
    assert_eq!(frames(&program, "part", 5), frames(&program, "whole", 5));
    let sharp = format!("{SMALL} --passes 3 -o sharp_##.exr");
    program.succeeds(&sharp);
    program.refuses(&format!("{SMALL} --passes 3 --shutter 0.25 -o whole_##.exr"), 1, "is no frame of this render");
    assert_ne!(frames(&program, "sharp", 2)[1], frames(&program, "whole", 2)[1], "motion blur");
    assert_eq!(frames(&program, "sharp", 5)[4], frames(&program, "whole", 5)[4], "beyond the last key nothing moves");
}

/// A sequence that is killed in a frame goes on with the passes of its checkpoint, to the same bits.
#[test]
fn a_killed_sequence_goes_on() {
    let program = program();
    let line = format!("{SMALL} --passes 600 --shutter 1 --frames 1..3");
    program.succeeds(&format!("{line} -o whole_##.exr"));
    let again = format!("{line} -o killed_##.exr --checkpoint-interval 1ms");
    let mut child = program.command(&again).stdout(Stdio::null()).spawn().expect("started");
    let film = program.path("killed_02.film.exr");
    while !film.exists() {
        assert!(child.try_wait().expect("a status").is_none(), "it ends before it is killed");
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().expect("killed");
    child.wait().expect("gone");
    let held = film_file::read(&film).expect("a whole film").film.passes.count();
    assert!(held > 0 && held < 600 && !program.path("killed_02.exr").exists(), "{held} passes");
    let said = program.succeeds(&again);
    assert!(said.starts_with("1 frame in ") && said.contains(", 1 that were there: "), "{said}");
    assert!(!film.exists());
    for frame in ["01", "02"] {
        let picture = |stem: &str| program.picture(&format!("{stem}_{frame}.exr"));
        assert_eq!(picture("killed"), picture("whole"), "{frame}");
    }
}

/// Ctrl-C ends a sequence between passes, with the frame in work in its checkpoint.
#[cfg(unix)]
#[test]
fn an_interrupted_sequence_keeps_its_frame() {
    let program = program();
    let line = format!("{SMALL} --passes 400 --frames 2..3");
    program.succeeds(&format!("{line} -o whole_##.exr"));
    let mut child = program.command(&format!("{line} -o cut_##.exr")).stdout(Stdio::null()).spawn().expect("started");
    // The claim of the frame is there when its passes begin.
    while !program.path(".cut_02.film.exr.lock").exists() {
        std::thread::sleep(Duration::from_millis(1));
    }
    std::thread::sleep(Duration::from_millis(300));
    let signal = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(signal.expect("kill starts").success());
    assert_eq!(child.wait().expect("gone").code(), Some(130));
    let names: Vec<String> = names_in(program.folder()).into_iter().filter(|name| name.contains("cut")).collect();
    assert!(names.is_empty() || names == ["cut_02.film.exr"], "no frame, and no claim is left: {names:?}");
    program.succeeds(&format!("{line} -o cut_##.exr"));
    assert_eq!(program.picture("cut_02.exr"), program.picture("whole_02.exr"));
}

/// Parts of a blurred render are of one render: each pass knows its moment.
#[test]
fn parts_of_a_blurred_picture_add_up() {
    let program = program();
    let line = SMALL.replace("animate", "render").replace("--fps 4", "--at 0.2 --shutter-seconds 0.5");
    program.succeeds(&format!("{line} --passes 6 -o whole.exr"));
    program.succeeds(&format!("{line} --pass-range 0..2 -o a.exr"));
    program.succeeds(&format!("{line} --pass-range 2..6 -o b.exr"));
    program.succeeds("merge a.exr b.exr -o all.exr --passes 6");
    let layer = |name: &str| program.picture(name).layers[0].clone();
    assert_eq!(layer("all.exr"), layer("whole.exr"));
    let other = line.replace("0.5", "0.4");
    program.succeeds(&format!("{other} --pass-range 2..6 -o c.exr"));
    program.refuses("merge a.exr c.exr -o no.exr", 2, "shutter is 0.2 s to");
}

#[test]
fn what_makes_no_sequence_is_refused() {
    let program = program();
    for (flags, code, part) in [
        ("-o a.exr", 1, "needs ####"),
        ("-o a_#_#.exr", 1, "more than one place"),
        ("-o a_##.jpg", 1, "must end in .exr or .png"),
        ("-o a_##.exr -o ./a_##.exr", 1, "is named twice"),
        ("-o no/a_##.exr", 2, "cannot create"),
        ("-o a_##.exr --fps 0", 1, "expected frames a second"),
        ("-o a_##.exr --frames 5..2", 1, "expected A..B"),
        ("-o a_##.exr --part 3/2", 1, "expected K/N"),
        ("-o a_##.exr --shutter 2", 1, "expected a share"),
        ("-o a_##.exr --animation Run", 2, "no animation 'Run'"),
        ("-o a.mp4 --part 1/2", 1, "needs all frames"),
    ] {
        program.refuses(&format!("{} {flags}", SMALL.replace(" --fps 4", "")), code, part);
    }
    assert_eq!(names_in(program.folder()), ["scene.glb"]);
    let still = Moving::triangle().with("/animations", json!([]));
    std::fs::write(program.path("scene.glb"), still.bytes()).expect("written");
    program.refuses(&format!("{SMALL} -o a_##.exr"), 1, "nothing moves in the scene: --frames says");
}

#[test]
fn still_pixels_flicker_only_with_fresh_noise() {
    let program = program();
    let line = format!("{SMALL} --passes 4 --aov depth,normal,albedo");
    let index = |stem: &str, first: u64| {
        let names: Vec<String> = (first..first + 3).map(|frame| format!("{stem}_{frame:02}.exr")).collect();
        let said = program.succeeds(&format!("flicker {} --json", names.join(" ")));
        let json: serde_json::Value = serde_json::from_str(&said).expect("JSON");
        (json["flicker"].as_f64().expect("a number"), json["still_share"].as_f64().expect("a share"))
    };
    program.succeeds(&format!("{line} --frames 0..7 -o same_##.exr"));
    program.succeeds(&format!("{line} --frames 0..7 -o fresh_##.exr --coherent=false"));
    // From frame 4 on nothing moves.
    let ((same, share), (fresh, _)) = (index("same", 4), index("fresh", 4));
    println!("flicker of what stays: {same:.5} with the same random numbers, {fresh:.5} with fresh ones");
    assert!(same == 0.0 && share == 1.0 && fresh > 0.001, "{same} {share} {fresh}");
    let ((same, share), (fresh, _)) = (index("same", 0), index("fresh", 0));
    println!("flicker beside what moves: {same:.5} and {fresh:.5} over {share:.2} of the pixels");
    assert!(same < fresh && share > 0.3 && share < 1.0, "{same} {share} {fresh}");
    program.refuses("flicker same_00.exr same_01.exr", 1, "3 values required");
}

/// A stand-in for ffmpeg that writes down how it was called, and the film; and none at all.
#[cfg(unix)]
#[test]
fn films_are_made_by_ffmpeg() {
    use std::os::unix::fs::PermissionsExt;
    let program = program();
    let tools = program.path("tools");
    std::fs::create_dir(&tools).expect("a folder");
    let line = format!("{SMALL} --passes 1 -o walk.mp4");
    let run = || program.command(&line).env("PATH", &tools).output().expect("the program starts");
    let said = String::from_utf8(run().stderr).expect("UTF-8");
    assert!(said.contains("'walk.mp4' needs the program ffmpeg") && said.contains("-o walk_####.png"), "{said}");
    let stand_in = tools.join("ffmpeg");
    let script =
        "#!/bin/sh\n[ \"$1\" = -version ] && exit 0\necho \"$@\" >called\nfor last; do :; done\necho film >\"$last\"\n";
    std::fs::write(&stand_in, script).expect("written");
    std::fs::set_permissions(&stand_in, std::fs::Permissions::from_mode(0o755)).expect("set");
    let output = run();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(String::from_utf8_lossy(&output.stdout).trim_end().ends_with(": walk.mp4"));
    assert_eq!(std::fs::read_to_string(program.path("walk.mp4")).expect("the film"), "film\n");
    let called = std::fs::read_to_string(program.path("called")).expect("called");
    for part in
        ["-framerate 4 -start_number 0 -i walk.frames/frame_%06d.png", "-frames:v 5 ", "yuv420p walk.unfinished.mp4"]
    {
        assert!(called.contains(part), "{called}");
    }
    assert_eq!(names_in(&program.path("walk.frames")).len(), 5);
    std::fs::write(&stand_in, "#!/bin/sh\n[ \"$1\" = -version ] && exit 0\necho no codec >&2\nexit 1\n")
        .expect("written");
    let output = run();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(2) && said.contains("ffmpeg failed and said: no codec"), "{said}");
    assert_eq!(std::fs::read_to_string(program.path("walk.mp4")).expect("the film before"), "film\n");
}
