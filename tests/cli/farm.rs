//! The scripts of tools/farm do what they say: the Open Job Description template, run by openjd-cli, and the Slurm
//! script, run with the variables that Slurm sets. Both divide a tiny render and put it together again, bit for bit.
#![cfg(unix)]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use nephroid::low_level::film::film_file;

use crate::support::program::{Program, names_in};
use crate::support::{device, repository, skip};

/// What every task gets besides scene, size and passes.
fn flags() -> String {
    format!("--photons 4000 --quiet --device {}", device::name())
}

/// The film of one render of five passes.
fn one_render(program: &Program) -> nephroid::low_level::film::accumulate::Film {
    let line =
        format!("render @cornell-glass.glb --size 24x16 --passes 5 {} -o one.exr --checkpoint one.film", flags());
    program.succeeds(&line);
    film_file::read(&program.path("one.film")).expect("a film").film
}

fn script(name: &str) -> PathBuf {
    repository("tools/farm").join(name)
}

fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

/// openjd-cli in a virtual environment under the folder of builds; `None`, with a sentence, where it cannot be
/// installed.
fn openjd() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("openjd");
    let tool = folder.join("bin/openjd");
    let steps = [
        ("python3", vec!["-m", "venv"], Some(folder.clone())),
        (folder.join("bin/pip").to_str()?, vec!["install", "--quiet", "openjd-cli==0.8.*"], None),
    ]
    .map(|(command, args, path)| (command.to_owned(), args, path));
    for (command, args, path) in steps {
        if tool.exists() {
            break;
        }
        let output = Command::new(&command).args(args).args(path).output();
        let failure = match output {
            Ok(output) if output.status.success() => continue,
            Ok(output) => words(&output).lines().last().unwrap_or_default().to_owned(),
            Err(cause) => cause.to_string(),
        };
        skip(&format!("the job template needs openjd-cli, which cannot be installed: {command}: {failure}"));
        return None;
    }
    Some(tool)
}

#[test]
fn the_job_template_renders_parts_and_merges_them() {
    let program = Program::new();
    let Some(openjd) = openjd() else { return };
    let template = script("nephroid.openjd.yaml");
    let check = |path: &Path| Command::new(&openjd).arg("check").arg(path).output().expect("openjd starts");
    let checked = check(&template);
    assert!(checked.status.success(), "{}", words(&checked));
    let text = std::fs::read_to_string(&template).expect("the template");
    let broken = program.path("broken.yaml");
    std::fs::write(&broken, text.replace("{{Task.Param.First}}", "{{Task.Param.Frist}}")).expect("written");
    assert!(!check(&broken).status.success(), "the check can fail");

    let expected = one_render(&program);
    let out = program.path("a folder");
    let run = || {
        let mut command = Command::new(&openjd);
        command.arg("run").arg(&template);
        for (name, value) in [
            ("Scene", program.asset("cornell-glass.glb").display().to_string()),
            ("OutputFolder", out.display().to_string()),
            ("Name", "box".into()),
            ("Size", "24x16".into()),
            ("Passes", "5".into()),
            ("PassesPerTask", "2".into()),
            ("Flags", flags()),
            ("Nephroid", env!("CARGO_BIN_EXE_nephroid").into()),
        ] {
            command.arg("-p").arg(format!("{name}={value}"));
        }
        let output = command.current_dir(program.folder()).output().expect("openjd starts");
        assert!(output.status.success(), "{}", words(&output));
    };
    run();
    assert_eq!(names_in(&out), ["box.exr", "box.png", "parts"]);
    assert_eq!(names_in(&out.join("parts")), ["000000000.exr", "000000002.exr", "000000004.exr"]);
    assert_eq!(film_file::read(&out.join("box.exr")).expect("a film").film, expected);
}

/// Numbers that come from outside are numbers, and not what a shell makes of them.
#[test]
fn the_slurm_script_evaluates_no_variable() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = |passes: &str, per_task: &str, task: Option<&str>| {
        let mut command = Command::new("bash");
        command.arg(script("nephroid.slurm")).current_dir(folder.path()).env_remove("SLURM_ARRAY_TASK_ID");
        command.env("SCENE", "a.gltf").env("OUTPUT", "out").env("PASSES", passes).env("PASSES_PER_TASK", per_task);
        command.env("FLAGS", "--aov *").env("NEPHROID", "echo").envs(task.map(|task| ("SLURM_ARRAY_TASK_ID", task)));
        command.output().expect("bash starts")
    };
    for wrong in ["0", "", "-1", "08", "1e3", "x", "1 2", "99999999999999999999", "a[$(touch harm)]", "$(touch harm)"] {
        for output in [run(wrong, "2", Some("0")), run("5", wrong, None), run("5", "2", Some(wrong))] {
            // A default stands for no value, and no task is the merge; a task may be 0.
            let is_default = wrong.is_empty() || wrong == "0";
            assert!(!output.status.success() || is_default, "{wrong}: {}", words(&output));
        }
        assert!(!run(wrong, "2", Some("0")).status.success(), "{wrong}");
    }
    assert!(words(&run("5", "0", None)).contains("PASSES_PER_TASK is no whole number from 1 to 999999999: 0"));
    assert!(!folder.path().join("harm").exists());
    let output = String::from_utf8(run("5", "2", Some("1")).stdout).expect("UTF-8");
    assert!(output.contains("--pass-range 2..4") && output.contains("--aov * "), "no pattern of files: {output}");
}

#[test]
fn the_slurm_script_renders_parts_and_merges_them() {
    let program = Program::new();
    let slurm = script("nephroid.slurm");
    let out = program.path("a folder");
    let run = |task: Option<u32>, lacks: &str| -> Output {
        let mut command = Command::new("bash");
        command.arg(&slurm).current_dir(program.folder());
        for (name, value) in [
            ("SCENE", program.asset("cornell-glass.glb").display().to_string()),
            ("OUTPUT", out.display().to_string()),
            ("PASSES", "5".into()),
            ("PASSES_PER_TASK", "2".into()),
            ("SIZE", "24x16".into()),
            ("FLAGS", flags()),
            ("NEPHROID", env!("CARGO_BIN_EXE_nephroid").into()),
        ] {
            if name != lacks {
                command.env(name, value);
            }
        }
        command.env_remove("SLURM_ARRAY_TASK_ID").envs(task.map(|task| ("SLURM_ARRAY_TASK_ID", task.to_string())));
        command.output().expect("bash starts")
    };
    let succeeds = |task| {
        let output = run(task, "");
        assert!(output.status.success(), "{}", words(&output));
    };
    let fails = |task, lacks: &str, part: &str| {
        let output = run(task, lacks);
        assert!(!output.status.success() && words(&output).contains(part), "{}", words(&output));
    };
    let expected = one_render(&program);
    [2, 0].into_iter().for_each(|task| succeeds(Some(task)));
    // A task is missing, one is started again, one is beyond the end, settings are left out.
    fails(None, "", "000000002.exr: cannot read");
    succeeds(Some(0));
    succeeds(Some(1));
    fails(Some(3), "", "the array needs 3 tasks");
    fails(Some(0), "SCENE", "the scene");
    fails(None, "OUTPUT", "the folder for results");
    assert!(out.join("parts/000000000.checkpoint").exists());
    succeeds(None);
    assert_eq!(names_in(&out), ["parts", "render.exr", "render.png"]);
    assert_eq!(names_in(&out.join("parts")), ["000000000.exr", "000000002.exr", "000000004.exr"]);
    assert_eq!(film_file::read(&out.join("render.exr")).expect("a film").film, expected);
}
