//! The program from outside, on a device: info, devices, whole renders, and what happens when they are stopped.
//!
//! `NEPHROID_TEST_DEVICE` chooses the device (default `cpu`).

use std::io::{BufRead, BufReader, Lines};
use std::path::Path;
use std::process::{Child, ChildStderr, Command, Output, Stdio};

use nephroid::low_level::picture::exr;
use nephroid::low_level::picture::image::Picture;
use serde_json::Value;

use crate::support::program::turn;
use crate::support::{device, repository};

/// The program in `folder`; `@` stands for the folder of assets, `%` for the device.
fn command(line: &str, folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_nephroid"));
    let assets = repository("assets/");
    let word = |word: &str| word.replace('@', &assets.display().to_string()).replace('%', &device::name());
    command.args(line.split_whitespace().map(word)).current_dir(folder);
    command
}

fn run(line: &str, folder: &Path) -> Output {
    command(line, folder).output().expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

/// Standard output of a run that succeeds.
pub(super) fn success(line: &str, folder: &Path) -> String {
    let output = run(line, folder);
    assert_eq!(output.status.code(), Some(0), "{line}: {}", text(&output.stderr));
    text(&output.stdout)
}

pub(super) fn json(line: &str, folder: &Path) -> Value {
    serde_json::from_str(&success(line, folder)).expect("JSON")
}

/// The exit code is `code` and standard error one sentence with `part`.
fn assert_refused(line: &str, folder: &Path, code: i32, part: &str) {
    let output = run(line, folder);
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{line}: {message}");
    assert!(message.starts_with("nephroid: ") && message.contains(part), "{line}: {message}");
    assert_eq!(message.lines().count(), 1, "{line}: {message}");
}

pub(super) fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

pub(super) fn names_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

fn picture(folder: &Path, name: &str) -> Picture {
    exr::read(&folder.join(name)).expect("a whole picture").0
}

#[test]
fn devices_are_listed_with_one_default() {
    let _turn = turn();
    let folder = folder();
    let list = json("devices --json", folder.path());
    let list = list.as_array().expect("a list");
    assert_eq!(list.iter().filter(|device| device["default"] == true).count(), 1);
    for (index, device) in list.iter().enumerate() {
        assert_eq!(device["index"], index);
        assert!(device["name"].as_str().is_some_and(|name| !name.is_empty()));
    }
    let table = success("devices", folder.path());
    assert_eq!(table.matches("chosen by default").count(), 1, "{table}");
    assert!(table.contains(list[0]["name"].as_str().expect("a name")), "{table}");
}

#[test]
fn without_a_driver_devices_exits_with_3() {
    let folder = folder();
    let mut program = command("devices", folder.path());
    for name in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"] {
        program.env(name, folder.path().join("none.json"));
    }
    let output = program.env_remove("VK_ADD_DRIVER_FILES").output().expect("the program starts");
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{message}");
    assert!(message.starts_with("nephroid: no usable Vulkan device: ") && message.lines().count() == 1, "{message}");
}

#[test]
fn info_names_what_a_diffuse_scene_leaves_out() {
    let folder = folder();
    let facts = json("info @cornell.glb --json", folder.path());
    assert!(facts["triangles"].as_u64().is_some_and(|n| n > 10) && facts["host_bytes"]["all"].as_u64() > Some(1000));
    assert!(facts["lights"]["emissive_triangles"].as_u64() > Some(0));
    let left_out: Vec<&str> =
        facts["left_out"].as_array().expect("a list").iter().map(|name| name.as_str().expect("a name")).collect();
    for name in ["caustics", "transmission", "textures", "environment light"] {
        assert!(left_out.contains(&name), "{name} in {left_out:?}");
    }
    let savings = facts["savings"].as_array().expect("a list");
    let saving = |name: &str| savings.iter().find(|saving| saving["name"] == name).expect(name);
    let caustic = saving("caustic photons");
    assert!(caustic["passes"].as_u64() > Some(100), "{caustic}");
    assert_eq!(caustic["kernels"], serde_json::json!(["photon_bounce", "photon_emit"]));
    for name in ["glass", "textures", "environment light"] {
        assert!(!saving(name)["kernels"].as_array().expect("a list").is_empty(), "{name}");
    }
    let (lean, full) = (&facts["program"], &facts["program_with_everything"]);
    assert!(lean["passes"].as_u64() < full["passes"].as_u64());
    // Shared memory is no measure: with caustics there are other photons, whose buffers fit together in another way.
    let transients = |program: &serde_json::Value| program["bytes"]["transients_without_sharing"].as_u64();
    assert!(transients(lean).is_some() && transients(lean) < transients(full));
    let words = success("info @cornell.glb --size 64x48", folder.path());
    for part in [
        "photon pass at 64x48",
        "photons and paths in turns",
        "left out: caustic photons (",
        "left out: glass (",
        "device memory",
    ] {
        assert!(words.contains(part), "{part} in {words}");
    }
    // The comparison can tell scenes apart.
    let glass = success("info @cornell-glass.glb", folder.path());
    assert!(!glass.contains("left out: caustic photons") && !glass.contains("left out: glass"), "{glass}");
}

#[test]
fn info_lists_warnings() {
    let folder = folder();
    let scene = r#"{"asset":{"version":"2.0"},"extensionsUsed":["KHR_materials_sheen"],"scenes":[{"nodes":[]}]}"#;
    std::fs::write(folder.path().join("odd.gltf"), scene).expect("written");
    let output = run("info odd.gltf", folder.path());
    let words = text(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(words.contains("warning: ") && words.contains("KHR_materials_sheen"), "{words}");
}

#[test]
fn a_render_writes_whole_files_and_the_same_pixels_again() {
    let _turn = turn();
    let folder = folder();
    let render = |files: &str| {
        let line = format!("render @cornell.glb --size 32x24 --passes 3 --aov all --quiet --device % {files}");
        success(&line, folder.path())
    };
    let last = render("-o a.exr -o a.png --report report.json --trace trace.json");
    assert!(last.starts_with("3 passes in ") && last.trim_end().ends_with("a.exr, a.png"), "{last}");
    assert_eq!(names_in(folder.path()), ["a.exr", "a.png", "report.json", "trace.json"]);
    let a = picture(folder.path(), "a.exr");
    assert_eq!((a.width, a.height), (32, 24));
    let layers: Vec<&str> = a.layers.iter().map(|layer| layer.name.as_str()).collect();
    for name in ["", "albedo", "normal", "depth", "direct", "indirect", "caustic", "error"] {
        assert!(layers.contains(&name), "{name} in {layers:?}");
    }
    let png = image::open(folder.path().join("a.png")).expect("a PNG").to_rgb8();
    assert_eq!(png.dimensions(), (32, 24));
    assert!(png.pixels().any(|pixel| pixel.0.iter().any(|&x| x > 100)), "something is bright");
    check_report(folder.path());
    render("-o b.exr");
    assert_eq!(a, picture(folder.path(), "b.exr"), "the same seed");
    render("-o c.exr --seed 1");
    assert_ne!(a, picture(folder.path(), "c.exr"), "another seed");
}

fn check_report(folder: &Path) {
    let read =
        |name: &str| -> Value { serde_json::from_slice(&std::fs::read(folder.join(name)).expect(name)).expect("JSON") };
    let report = read("report.json");
    // Two passes of photons, one of paths.
    assert_eq!((&report["passes"], &report["seed"]), (&3.into(), &0.into()));
    assert_eq!(report["choice"]["opening"], serde_json::json!({ "photons": 2, "paths": 1 }));
    assert_eq!((&report["choice"]["paths"], &report["choice"]["then"]), (&"hybrid".into(), &Value::Null));
    for name in ["photons_emitted", "photons_stored", "plan_passes"] {
        assert!(report[name].as_u64() > Some(0), "{name}");
    }
    assert_eq!(report["values_not_finite"], 0);
    assert_eq!(report["estimator"]["name"], "bvh");
    let kept = report["estimator"]["bytes"]["kept_per_photon"].as_f64();
    assert!(kept > Some(64.0), "a photon in leaf order, and its share of the tree: {kept:?}");
    assert_eq!(report["photons_per_pass"]["caustic"], 0, "nothing in this box focuses light");
    assert!(report["seconds"].as_f64() > Some(0.0) && report["bytes"]["device_peak"].as_u64() > Some(0));
    for name in ["guards", "kept", "left_out", "warnings", "seconds_of_last_pass", "scene", "device", "version"] {
        assert!(!report[name].is_null(), "{name}");
    }
    let trace = read("trace.json");
    let events = trace["traceEvents"].as_array().expect("events");
    let once = [("global photons", 2), ("photon map", 2), ("eye paths", 2), ("gather", 2), ("paths", 1), ("film", 3)];
    for (scope, passes) in once {
        let count = events.iter().filter(|event| event["name"] == scope).count();
        assert_eq!(count, passes, "{scope}, once a pass that has it");
    }
    assert!(events.iter().all(|event| event["ts"].as_f64() >= Some(0.0) && event["dur"].as_f64() >= Some(0.0)));
}

#[test]
fn what_cannot_be_had_is_found_before_rendering() {
    let _turn = turn();
    let folder = folder();
    std::fs::write(folder.path().join("bad.glb"), b"glTF\x02\0\0\0cut off").expect("written");
    for (line, code, part) in [
        ("render @cornell.glb -o no/out.exr --time 1h", 2, "no/out.exr: cannot create"),
        ("render @cornell.glb -o out.exr --report no/out.json --time 1h", 2, "no/out.json: cannot create"),
        ("render @cornell.glb -o out.exr --time 1h --device voodoo", 3, "no name contains 'voodoo'"),
        ("render @cornell.glb -o out.exr --time 1h --device 99", 3, "there is no device 99"),
        ("render @cornell.glb -o out.exr --time 1h --camera side", 1, "no camera 'side'"),
        ("render bad.glb -o out.exr --time 1h", 2, "bad.glb: "),
        ("info bad.glb", 2, "bad.glb: "),
        ("bench --quick bad.glb", 2, "bad.glb: "),
        ("bench --quick --device voodoo", 3, "no name contains 'voodoo'"),
        ("bench estimators --quick bad.glb", 2, "bad.glb: "),
        ("bench estimators --json --csv bad.glb", 1, "only one of --json and --csv"),
        ("bench estimators --svg plots bad.glb", 1, "--growth"),
        ("render @cornell.glb -o out.exr --global-smoothing -3", 1, "--global-smoothing"),
    ] {
        assert_refused(line, folder.path(), code, part);
    }
    assert_eq!(names_in(folder.path()), ["bad.glb"], "nothing was written");
}

/// Bits of the layer `name` of an EXR.
fn bits(picture: &Picture, name: &str) -> Vec<u32> {
    picture.layer(name).expect("a layer").data.iter().map(|x| x.to_bits()).collect()
}

#[test]
fn passes_after_the_render_change_what_they_say_and_are_written_down() {
    let _turn = turn();
    let folder = folder();
    let line = "render @cornell.glb --size 32x24 --passes 2 --method photons --device % -q";
    success(&format!("{line} -o plain.exr -o plain.png --aov all --report plain.json"), folder.path());
    let passes = "--ssao 1.5 --aperture 0.3 --focus 6 --depth-of-field screen --bloom 0.2 --saturation 0 --antialias";
    success(&format!("{line} -o post.exr -o post.png --report post.json {passes}"), folder.path());
    success(&format!("{line} -o all.exr --aov all {passes}"), folder.path());
    success(&format!("{line} -o shown.exr -o shown.png --saturation 0 --antialias"), folder.path());
    let (plain, all) = (picture(folder.path(), "plain.exr"), picture(folder.path(), "all.exr"));
    let metadata = |name: &str| exr::read(&folder.path().join(name)).expect("a whole picture").1;
    let report = |name: &str| -> Value {
        serde_json::from_str(&std::fs::read_to_string(folder.path().join(name)).expect("written")).expect("JSON")
    };

    // Linear passes change the beauty layer alone, and need no layer in the file.
    assert_ne!(bits(&plain, ""), bits(&all, ""));
    for layer in ["albedo", "normal", "depth", "direct", "indirect", "caustic", "error"] {
        assert_eq!(bits(&plain, layer), bits(&all, layer), "{layer}");
    }
    let post = picture(folder.path(), "post.exr");
    assert_eq!(post.layers.iter().map(|layer| layer.name.as_str()).collect::<Vec<_>>(), ["", "error"]);
    assert_eq!(bits(&post, ""), bits(&all, ""));
    let written =
        "ssao radius 1.5 strength 1; screen-space depth of field, aperture radius 0.3 focus 6; bloom 0.2 size 0.08";
    assert_eq!(metadata("post.exr").get("post"), Some(&exr::Value::Text(written.into())));
    let after = &report("post.json")["after_the_render"];
    assert_eq!(after["linear"].as_array().map(Vec::len), Some(3), "{after}");
    assert_eq!(after["png"].as_array().map(Vec::len), Some(2), "{after}");

    // Those of the display change the PNG alone.
    assert_eq!(bits(&plain, ""), bits(&picture(folder.path(), "shown.exr"), ""));
    let pixels = |name: &str| image::open(folder.path().join(name)).expect("a whole PNG").to_rgb8();
    assert!(pixels("shown.png").pixels().all(|p| p.0[0] == p.0[1] && p.0[1] == p.0[2]), "grey");
    assert!(pixels("plain.png").pixels().any(|p| p.0[0] != p.0[1]), "the cornell box has colours");

    // Without passes nothing is said in the file.
    for name in ["plain.exr", "shown.exr"] {
        assert!(!metadata(name).contains_key("post") && !metadata(name).contains_key("lens"), "{name}");
    }
    assert_eq!(report("plain.json")["after_the_render"]["linear"], serde_json::json!([]));
}

#[test]
fn a_lens_blurs_and_is_written_down() {
    let _turn = turn();
    let folder = folder();
    let line = "render @cornell.glb --size 32x24 --passes 2 --method photons --device % -q";
    success(&format!("{line} -o pinhole.exr"), folder.path());
    success(&format!("{line} -o lens.exr --aperture 0.5 --focus 4 --report lens.json"), folder.path());
    success(&format!("{line} -o number.exr --aperture f/1.4 --focus 4"), folder.path());
    let (pinhole, lens) = (picture(folder.path(), "pinhole.exr"), picture(folder.path(), "lens.exr"));
    assert_ne!(bits(&pinhole, ""), bits(&lens, ""));
    let metadata = |name: &str| exr::read(&folder.path().join(name)).expect("a whole picture").1;
    let expected = exr::Value::Text("aperture radius 0.5 focus 4".into());
    assert_eq!(metadata("lens.exr").get("lens"), Some(&expected));
    assert!(matches!(metadata("number.exr").get("lens"), Some(other @ exr::Value::Text(_)) if *other != expected));
    assert!(!metadata("pinhole.exr").contains_key("lens"));

    let parallel = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"camera":0}],
        "cameras":[{"type":"orthographic","orthographic":{"xmag":1,"ymag":1,"znear":0.1,"zfar":10}}]}"#;
    std::fs::write(folder.path().join("parallel.gltf"), parallel).expect("written");
    for how in ["lens", "screen"] {
        let line =
            format!("render parallel.gltf --device % -q -o no.exr --aperture 0.1 --focus 1 --depth-of-field {how}");
        assert_refused(&line, folder.path(), 1, "orthographic");
    }
    assert!(!folder.path().join("no.exr").exists());
    success(
        "render parallel.gltf --size 4x4 --passes 1 --method photons --device % -q -o yes.exr --ssao 1 --bloom 0.1",
        folder.path(),
    );
}

#[test]
fn a_render_ends_at_its_target_error_and_says_so() {
    let _turn = turn();
    let folder = folder();
    let line = "render @cornell.glb --size 32x24 --photons 10000 --device %";
    let output = run(&format!("{line} --target-error 0.3 --time 5m -o a.exr --report a.json"), folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let last = text(&output.stdout);
    assert!(last.contains(" % (estimated), stopped at the target error: a.exr"), "{last}");
    let report: Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("a.json")).expect("written")).expect("JSON");
    assert_eq!((&report["stop_reason"], &report["error"]["target"]), (&"target error reached".into(), &0.3.into()));
    let error = report["error"]["estimated"].as_f64().expect("known");
    assert!(error > 0.0 && error <= 0.3 && report["passes"].as_u64() >= Some(8), "{report}");
    let (picture, metadata) = exr::read(&folder.path().join("a.exr")).expect("a whole picture");
    // Numbers are read from JSON to within the last bit.
    let exr::Value::Number(written) = metadata["estimated_error"] else { panic!("{metadata:?}") };
    assert!((written - error).abs() <= 1e-12 * error, "{written} and {error}");
    assert_eq!(metadata["stop_reason"], exr::Value::Text("target error reached".into()));
    assert_eq!(metadata["error_confidence"], exr::Value::Number(0.9));
    let bounds = &picture.layer("error").expect("in every EXR").data;
    assert!(bounds.iter().all(|x| x.is_finite() && *x >= 0.0) && bounds.iter().any(|x| *x > 0.0));

    // Limits cap the target, and one pass does not know its error.
    let last = success(&format!("{line} -q --target-error 0.0001 --passes 1 -o b.exr"), folder.path());
    assert!(last.starts_with("1 pass in ") && last.contains("error unknown, stopped by passes"), "{last}");
    assert!(!exr::read(&folder.path().join("b.exr")).expect("whole").1.contains_key("estimated_error"));
}

/// Starts a long render and returns it when its first pass is done.
#[cfg(unix)]
fn begun(line: &str, folder: &Path) -> (Child, Lines<BufReader<ChildStderr>>) {
    let mut child =
        command(line, folder).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program starts");
    let mut progress = BufReader::new(child.stderr.take().expect("a pipe")).lines();
    let first = progress.by_ref().map(|line| line.expect("UTF-8")).find(|line| line.starts_with("pass "));
    let first = first.expect("a line of progress");
    assert!(first.contains("left"), "{first}");
    (child, progress)
}

#[cfg(unix)]
fn send(signals: &[&str], child: &Child) {
    // One shell: the signals are milliseconds apart.
    let all: String = signals.iter().map(|signal| format!("kill -{signal} {};", child.id())).collect();
    assert!(Command::new("sh").args(["-c", &all]).status().expect("sh runs").success());
}

#[test]
#[cfg(unix)]
fn signals_in_quick_succession_lose_no_picture() {
    let _turn = turn();
    for signals in [&["HUP", "TERM"][..], &["INT", "INT", "INT"], &["TERM", "TERM", "HUP", "INT"]] {
        let folder = folder();
        let line = "render @cornell.glb --size 32x24 --method photons --time 10m -o a.exr --device %";
        let (child, progress) = begun(line, folder.path());
        send(signals, &child);
        let rest: Vec<String> = progress.map_while(Result::ok).collect();
        assert_eq!(child.wait_with_output().expect("it ends").status.code(), Some(130), "{signals:?}: {rest:?}");
        assert_eq!(picture(folder.path(), "a.exr").width, 32, "{signals:?}");
    }
}

#[test]
#[cfg(unix)]
fn a_limit_on_the_size_of_files_is_an_error_and_no_crash() {
    let _turn = turn();
    let folder = folder();
    // Compiled kernels first: the driver would lose them to the limit.
    success(
        "render @cornell.glb --size 256x256 --passes 1 --photons 1k --method photons -o a.exr --device % -q",
        folder.path(),
    );
    let mut program = command(
        "render @cornell.glb --size 256x256 --passes 1 --photons 1k --method photons -o b.exr --device % -q",
        folder.path(),
    );
    let words: Vec<_> = program.get_args().map(|word| word.to_owned()).collect();
    program = Command::new("bash");
    program.args(["-c", "ulimit -f 16; exec \"$@\"", "bash", env!("CARGO_BIN_EXE_nephroid")]).args(words);
    let output = program.current_dir(folder.path()).output().expect("bash starts");
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("b.exr: cannot write: File too large"), "{message}");
    assert_eq!(names_in(folder.path()), ["a.exr"], "nothing half");
}

#[test]
#[cfg(unix)]
fn ctrl_c_writes_what_is_finished() {
    let _turn = turn();
    let folder = folder();
    let line = "render @cornell.glb --size 32x24 --time 10m -o a.exr -o a.png --device %";
    let (child, progress) = begun(line, folder.path());
    send(&["INT"], &child);
    let rest: Vec<String> = progress.map_while(Result::ok).collect();
    let output = child.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(130), "{rest:?}");
    assert!(text(&output.stdout).contains("a.exr, a.png"), "{}", text(&output.stdout));
    assert_eq!(names_in(folder.path()), ["a.exr", "a.png"], "whole files and nothing else");
    let picture = picture(folder.path(), "a.exr");
    assert_eq!((picture.width, picture.height), (32, 24));
    assert!(picture.layers[0].data.iter().all(|x| x.is_finite()) && picture.layers[0].data.iter().any(|x| *x > 0.0));
    assert_eq!(image::open(folder.path().join("a.png")).expect("a whole PNG").to_rgb8().dimensions(), (32, 24));
}
