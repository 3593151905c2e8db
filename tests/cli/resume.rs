//! Renders that are stopped, killed, divided and put together again give the bits of one that ran through.
//!
//! `NEPHROID_TEST_DEVICE` chooses the device (default `cpu`).

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use nephroid::low_level::film::film_file::{self, FilmFile};
use serde_json::Value;

use crate::support::program::{Program, names_in};

/// A small render of a scene with caustics; `%` is the device, `@` the folder of assets.
const SMALL: &str = "@cornell-glass.glb --size 24x16 --photons 4000 --device % -q";

fn film(program: &Program, name: &str) -> FilmFile {
    film_file::read(&program.path(name)).expect("a whole film")
}

fn report(program: &Program, name: &str) -> Value {
    let text = std::fs::read_to_string(program.path(name)).expect("a report");
    serde_json::from_str(&text).expect("JSON")
}

/// Everything in a report that does not depend on the clock or the memory of one run.
fn counts(mut report: Value) -> Value {
    let all = report.as_object_mut().expect("an object");
    all.retain(|name, _| !name.starts_with("seconds") && !["bytes", "after_the_render"].contains(&name.as_str()));
    report
}

#[test]
fn a_resumed_render_is_as_if_it_had_never_been_stopped() {
    let program = Program::new();
    let small = format!("render {SMALL} --aov all");
    program.succeeds(&format!("{small} --passes 7 -o one.exr --report one.json --checkpoint one.film"));
    program.succeeds(&format!("{small} --passes 3 -o some.exr --checkpoint some.film"));
    let go_on = format!("{small} --passes 7 -o all.exr --report all.json --resume some.film --checkpoint some.film");
    let said = program.succeeds(&go_on);
    assert!(said.starts_with("7 passes in "), "{said}");
    assert_eq!(film(&program, "some.film").film, film(&program, "one.film").film);
    assert!(!film(&program, "one.film").film.layers.is_empty(), "with layers");
    assert_eq!(program.picture("all.exr"), program.picture("one.exr"));
    assert_ne!(program.picture("all.exr"), program.picture("some.exr"), "the check can fail");
    assert_eq!(counts(report(&program, "all.json")), counts(report(&program, "one.json")));
    let seconds = |name: &str| film(&program, name).totals.seconds;
    assert!(seconds("some.film") > 0.0 && report(&program, "all.json")["seconds"].as_f64() > Some(0.0));

    // Nothing is left to do: the same picture again, and the file stays what it was.
    program.succeeds(&go_on);
    assert_eq!(film(&program, "some.film").film, film(&program, "one.film").film);
    assert_eq!(program.picture("all.exr"), program.picture("one.exr"));
    // The time is a total as well: it is over before the first pass.
    let said = program.succeeds(&format!("{small} --time 1ms -o over.exr --resume some.film"));
    assert!(said.starts_with("7 passes in "), "{said}");
}

#[test]
fn parts_add_up_to_one_render_bit_for_bit() {
    let program = Program::new();
    let small = format!("render {SMALL} --aov albedo,caustic");
    program.succeeds(&format!("{small} --passes 8 -o one.exr --checkpoint one.film"));
    for (name, range) in [("a", "0..3"), ("b", "3..4"), ("c", "4..8")] {
        program.succeeds(&format!("{small} -o {name}.exr --pass-range {range}"));
    }
    let said = program.succeeds("merge c.exr a.exr -o ca.exr");
    assert_eq!(said.trim_end(), "2 parts, passes 0..3,4..8: ca.exr");
    let said = program.succeeds("merge b.exr ca.exr -o all.exr -o all.png --passes 8");
    assert_eq!(said.trim_end(), "2 parts, passes 0..8: all.exr, all.png");
    let (all, one) = (film(&program, "all.exr"), film(&program, "one.film"));
    assert_eq!(all.film, one.film);
    let mut flipped = all.film.clone();
    flipped.sums[100][4].0 ^= 1 << 40;
    assert_ne!(flipped, one.film, "the check can fail");
    let mut totals = all.totals.clone();
    totals.seconds = one.totals.seconds;
    totals.repeated = one.totals.repeated;
    // Energies are sums of floating-point numbers: another order of the parts rounds otherwise.
    for (name, energy) in &mut totals.energies {
        let whole = one.totals.energies[name];
        assert!((*energy - whole).abs() <= 1e-12 * whole.abs(), "{name}: {energy} for {whole}");
        *energy = whole;
    }
    assert_eq!(totals, one.totals, "counts add up, too");
    let (picture, expected) = (program.picture("all.exr"), program.picture("one.exr"));
    for layer in ["", "albedo", "caustic"] {
        assert_eq!(picture.layer(layer).expect(layer), expected.layer(layer).expect(layer), "{layer}");
    }
    assert_eq!(image::open(program.path("all.png")).expect("a PNG").to_rgb8().dimensions(), (24, 16));

    // A hole is filled before anything else.
    program.succeeds(&format!("{small} --passes 8 -o filled.exr --resume ca.exr --checkpoint filled.film"));
    assert_eq!(film(&program, "filled.film").film, one.film);
    // Without the film it is a picture and no part any more.
    program.succeeds("merge a.exr b.exr c.exr -o plain.exr --picture-only");
    assert_eq!(program.picture("plain.exr"), picture);
    program.refuses("merge plain.exr -o no.exr", 2, "plain.exr: a picture without a film");
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let program = Program::new();
    let small = format!("render {SMALL}");
    program.succeeds(&format!("{small} -o a.exr --pass-range 0..2"));
    program.succeeds(&format!("{small} -o b.exr --pass-range 1..3"));
    program.succeeds(&format!("{small} -o seed.exr --pass-range 2..3 --seed 1"));
    program.succeeds(&format!("{} -o photons.exr --pass-range 2..3", small.replace("4000", "5000")));
    std::fs::write(program.path("broken.exr"), "not a picture").expect("written");
    let before = names_in(program.folder());
    for (line, code, part) in [
        ("merge a.exr b.exr -o no.exr", 2, "b.exr: passes 1..2 are in a.exr, too"),
        ("merge a.exr a.exr -o no.exr", 2, "a.exr: passes 0..2 are in a.exr, too"),
        ("merge a.exr seed.exr -o no.exr", 2, "seed.exr: a part of another render: seed is 1 in it and 0 in a.exr"),
        ("merge a.exr photons.exr -o no.exr", 2, "photons is 5000 in it and 4000 in a.exr"),
        ("merge a.exr broken.exr -o no.exr", 2, "broken.exr: "),
        ("merge a.exr none.exr -o no.exr", 2, "none.exr: cannot read"),
        ("merge a.exr -o no.exr --passes 3", 2, "pass 2 is missing"),
        ("merge a.exr -o no.exr --passes 1", 2, "there are more"),
        ("merge a.exr -o a.exr", 1, "'a.exr' is named twice"),
        ("merge a.exr -o no.jpg", 1, "must end in .exr or .png"),
    ] {
        program.refuses(line, code, part);
    }
    for (flags, code, part) in [
        ("--seed 3 --resume a.exr --passes 3", 2, "a.exr: a film of another render: seed is 0 there and 3 here"),
        ("--size 25x16 --resume a.exr --passes 3", 2, "size is 24x16 there and 25x16 here"),
        ("--aov depth --resume a.exr --passes 3", 2, "layers is no there and yes here"),
        ("--estimator tiled --resume a.exr --passes 3", 2, "estimator is automatic there and tiled here"),
        ("--aperture 0.1 --focus 3 --resume a.exr --passes 3", 2, "lens is none there and radius 0.1 focus 3 here"),
        ("--resume a.exr --pass-range 1..5", 2, "its passes 0..2 are not within --pass-range 1..5"),
        ("--resume none.exr --passes 3", 2, "none.exr: cannot read"),
        ("--resume none.exr --checkpoint other.exr --passes 3", 2, "none.exr: cannot read"),
        ("--resume broken.exr --passes 3", 2, "broken.exr: "),
        ("--resume no.exr --passes 3 --checkpoint no.exr", 1, "named twice"),
        ("--checkpoint no/folder.exr", 2, "no/folder.exr: cannot create"),
        ("--pass-range 0..3 --passes 3", 1, "--pass-range"),
        ("--pass-range 3..3", 1, "expected A..B"),
        ("--checkpoint-interval 1s", 1, "--checkpoint"),
    ] {
        // A flag may be given only once.
        let small = if flags.contains("--size") { small.replace("--size 24x16", "") } else { small.clone() };
        program.refuses(&format!("{small} -o no.exr {flags}"), code, part);
    }
    program.refuses(&format!("{small} -o no.png --pass-range 0..3"), 1, "--pass-range needs an --output in .exr");
    let other = small.replace("cornell-glass", "cornell");
    program.refuses(&format!("{other} -o no.exr --resume a.exr --passes 3"), 2, "another render: scene is content ");
    assert_eq!(names_in(program.folder()), before, "nothing was written");

    // A copy elsewhere under another name is the same scene.
    std::fs::copy(program.asset("cornell-glass.glb"), program.path("copy.glb")).expect("copied");
    program.succeeds(&format!("{} -o yes.exr --resume a.exr --passes 3", small.replace("@cornell-glass", "copy")));
}

/// Kills the process again and again, with no chance to clean up, at moments that fall into set-up, passes and writes.
#[test]
fn kill_9_at_any_moment_loses_no_more_than_the_work_since_the_last_checkpoint() {
    const PASSES: u64 = 80;
    let program = Program::new();
    let line = format!("render {SMALL} --passes {PASSES}").replace("24x16", "16x12").replace("4000", "1000");
    program.succeeds(&format!("{line} -o one.exr --checkpoint one.film"));
    let line = format!("{line} -o all.exr --checkpoint kept.film --resume kept.film --checkpoint-interval 1ms");
    let (mut held, mut kills) = (0, 0);
    // Delays after the program has started, spread by the golden ratio.
    for attempt in 1.. {
        assert!(attempt < 60, "it never gets to its end");
        let mut child = program.command(&line).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
        let fraction = (f64::from(attempt) * 0.618_034).fract();
        let delay = Duration::from_secs_f64(0.3 + 0.3 * f64::from(attempt) * fraction);
        let begin = std::time::Instant::now();
        let ended = loop {
            if let Some(status) = child.try_wait().expect("a child") {
                break Some(status);
            }
            if begin.elapsed() > delay {
                break None;
            }
            std::thread::sleep(Duration::from_millis(3));
        };
        if let Some(status) = ended {
            assert!(status.success(), "{status}");
            break;
        }
        child.kill().expect("SIGKILL");
        child.wait().expect("it is dead");
        kills += 1;
        if program.path("kept.film").exists() {
            let passes = film(&program, "kept.film").film.passes;
            assert!(passes.count() >= held, "{} passes after {held}", passes.count());
            held = passes.count();
        }
        assert!(!program.path("all.exr").exists(), "a whole picture or none");
    }
    assert!(kills >= 3 && held > 0, "{kills} kills, {held} passes in the last checkpoint");
    assert_eq!(film(&program, "kept.film").film, film(&program, "one.film").film);
    assert_eq!(program.picture("all.exr"), program.picture("one.exr"));
    // What the dead left behind goes when the file is written the next time.
    std::thread::sleep(Duration::from_millis(1100));
    program.succeeds(&line);
    assert_eq!(names_in(program.folder()), ["all.exr", "kept.film", "one.exr", "one.film"]);
}

#[test]
#[cfg(unix)]
fn ctrl_c_writes_a_checkpoint() {
    let program = Program::new();
    let line = format!("render {SMALL} -o a.exr --pass-range 0..100000 --checkpoint a.film --checkpoint-interval 10ms");
    let mut child = program.command(&line).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
    for _ in 0..600 {
        if program.path("a.film").exists() || child.try_wait().expect("a child").is_some() {
            break;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    let status = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs");
    assert!(status.success());
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    let (checkpoint, part) = (film(&program, "a.film"), film(&program, "a.exr"));
    assert_eq!(checkpoint.film, part.film);
    let passes = checkpoint.film.passes.count();
    program.succeeds(&format!("render {SMALL} -o b.exr --pass-range 0..{passes}"));
    assert_eq!(film(&program, "b.exr").film, part.film);
    program.refuses("merge a.exr -o no.exr --passes 100000", 2, &format!("pass {passes} is missing"));
}

#[test]
fn a_checkpoint_that_cannot_be_written_does_not_end_the_render() {
    let program = Program::new();
    std::fs::create_dir(program.path("gone")).expect("created");
    let line = format!("render {SMALL} -o a.exr --time 10m --checkpoint gone/a.film --checkpoint-interval 1ms");
    let mut child = program
        .command(&line.replace(" -q", ""))
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts");
    let mut lines = std::io::BufRead::lines(std::io::BufReader::new(child.stderr.take().expect("a pipe")));
    let mut wait_for =
        |part: &str| lines.by_ref().map(|line| line.expect("UTF-8")).find(|line| line.contains(part)).expect(part);
    wait_for("pass ");
    // Only files of the program itself are in there.
    while std::fs::remove_dir_all(program.path("gone")).is_err() {}
    let warning = wait_for("warning");
    assert!(warning.contains("no checkpoint: gone/a.film: cannot create"), "{warning}");
    let status = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs");
    assert!(status.success());
    let last = wait_for("nephroid: ");
    assert!(last.contains("gone/a.film: cannot create"), "{last}");
    assert_eq!(child.wait().expect("it ends").code(), Some(2));
    assert!(program.path("a.exr").exists(), "the picture is there");
}

#[test]
fn the_comparison_of_files_sees_every_bit() {
    assert!(Path::new(env!("CARGO_BIN_EXE_nephroid")).exists());
    let program = Program::new();
    program.succeeds(&format!("render {SMALL} -o a.exr --pass-range 0..1"));
    let mut bytes = std::fs::read(program.path("a.exr")).expect("read");
    let last = bytes.len() - 20;
    bytes[last] ^= 1;
    std::fs::write(program.path("damaged.exr"), bytes).expect("written");
    program.refuses("merge damaged.exr -o no.exr", 2, "damaged.exr: ");
}
