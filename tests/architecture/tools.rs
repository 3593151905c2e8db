//! The scripts in tools/, played out with a `PATH` of fakes. tools/setup on a system that lacks packages installs as
//! root or through sudo without a password, and otherwise prints the command and stops with code 3. tools/test shows
//! where it stands, what it skips and how many tests passed.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;
use std::process::{Command, Output};

use crate::support::{self, repository};

/// What a run of the tests needs on Debian beside a compiler.
const PACKAGES: [&str; 7] = [
    "libvulkan1",
    "libshaderc-dev",
    "glslang-dev",
    "spirv-tools",
    "vulkan-validationlayers",
    "shellcheck",
    "mesa-vulkan-drivers",
];

/// A machine made of shell scripts.
struct Machine {
    folder: tempfile::TempDir,
}

impl Machine {
    /// Debian with a compiler, cargo and `installed` packages; `user` is what `id -u` prints.
    fn debian(user: u32, installed: &[&str]) -> Self {
        let machine = Self { folder: tempfile::tempdir().expect("a temporary folder") };
        fs::create_dir_all(machine.path("bin")).expect("bin");
        fs::create_dir_all(machine.path("libs")).expect("libs");
        fs::write(machine.path("os-release"), "ID=debian\nVERSION_ID=\"13\"\n").expect("os-release");
        machine.command("id", &format!("echo {user}"));
        machine.command("cargo", "exit 0");
        machine.command("ar", "exit 1");
        machine.command("cc", "case $1 in -print-file-name=*) echo /lib/libstdc++.so ;; *) exit 1 ;; esac");
        let lines: String = installed.iter().map(|name| format!("echo 'installed {name}'\n")).collect();
        machine.command("dpkg-query", &format!("case $2 in *Version*) exit 1 ;; esac\n{lines}exit 1"));
        machine.command("apt-cache", "echo '  Candidate: 1.0'");
        machine.command("apt-get", &format!("echo \"$*\" >>'{}'", machine.path("apt.log").display()));
        machine.command("cmake", "exit 0");
        machine.command("git", "exit 0");
        machine.command("python3", "exit 0");
        machine.command("c++", "exit 0");
        machine.command("shellcheck", "exit 0");
        for tool in [
            "bash", "sh", "dirname", "mkdir", "sed", "grep", "tr", "sort", "head", "tail", "cut", "cat", "rm",
            "mktemp", "env", "chmod", "date", "find", "ls", "sleep", "tee", "wc",
        ] {
            let real = ["/usr/bin", "/bin"].iter().map(|at| Path::new(at).join(tool)).find(|path| path.exists());
            symlink(real.expect("a standard tool"), machine.path("bin").join(tool)).expect("a link");
        }
        machine
    }

    fn path(&self, name: &str) -> std::path::PathBuf {
        self.folder.path().join(name)
    }

    fn command(&self, name: &str, script: &str) {
        let file = self.path("bin").join(name);
        fs::write(&file, format!("#!/bin/sh\n{script}\n")).expect("a fake command");
        fs::set_permissions(&file, fs::Permissions::from_mode(0o755)).expect("an executable");
    }

    /// Runs the set-up for the tests; with the user's own shader compiler library or without.
    fn setup(&self, own_shaderc: bool) -> Output {
        self.setup_command(own_shaderc).output().expect("bash starts")
    }

    fn setup_command(&self, own_shaderc: bool) -> Command {
        let mut command = self.script("tools/setup", &["test"]);
        if own_shaderc {
            command.env("SHADERC_LIB_DIR", self.path("libs"));
        }
        command
    }

    /// A script of the repository on this machine.
    fn script(&self, name: &str, arguments: &[&str]) -> Command {
        let mut command = Command::new(self.path("bin").join("bash"));
        command
            .arg(repository(name))
            .args(arguments)
            .env_clear()
            .env("PATH", self.path("bin"))
            .env("HOME", self.folder.path())
            .env("CARGO_TARGET_DIR", self.path("target"))
            .env("NEPHROID_OS_RELEASE", self.path("os-release"));
        command
    }

    /// Runs tools/test where `cargo` is a shell script that sees its own arguments.
    fn test(&self, arguments: &[&str], cargo: &str) -> (Option<i32>, String) {
        self.command("cargo", cargo);
        let mut command = self.script("tools/test", arguments);
        let output = command.env("SHADERC_LIB_DIR", self.path("libs")).output().expect("bash starts");
        (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned() + &words(&output))
    }

    /// What was asked of apt-get, one line a call.
    fn apt_calls(&self) -> Vec<String> {
        fs::read_to_string(self.path("apt.log")).unwrap_or_default().lines().map(String::from).collect()
    }
}

fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn without_root_the_exact_command_is_printed_and_the_code_is_3() {
    for sudo in [None, Some("exit 1")] {
        let machine = Machine::debian(1000, &["libvulkan1", "glslang-dev", "vulkan-validationlayers"]);
        if let Some(script) = sudo {
            machine.command("sudo", script);
        }
        let output = machine.setup(false);
        let expected = "\n    sudo apt-get update && sudo apt-get install -y --no-install-recommends \
                        libshaderc-dev mesa-vulkan-drivers shellcheck spirv-tools\n";
        assert_eq!(output.status.code(), Some(3), "{}", words(&output));
        assert!(words(&output).contains(expected), "{}", words(&output));
        assert_eq!(machine.apt_calls(), Vec::<String>::new(), "nothing may be installed");
    }
}

#[test]
fn root_installs_what_is_missing_and_nothing_else() {
    let machine = Machine::debian(0, &["libvulkan1", "spirv-tools", "shellcheck"]);
    let output = machine.setup(true);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    assert_eq!(machine.apt_calls(), ["install -y --no-install-recommends mesa-vulkan-drivers vulkan-validationlayers"]);
}

#[test]
fn sudo_without_a_password_installs_and_the_backports_are_taken() {
    let machine = Machine::debian(1000, &PACKAGES[..6]);
    machine.command("sudo", "[ \"$1\" = -n ] && exit 0\nexec \"$@\"");
    machine
        .command("apt-cache", "echo '  Candidate: 22.3.6-1'\necho '  100 http://mirror bookworm-backports/main amd64'");
    let output = machine.setup(true);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    assert_eq!(machine.apt_calls(), ["install -y --no-install-recommends -t bookworm-backports mesa-vulkan-drivers"]);
}

#[test]
fn package_lists_are_fetched_only_where_a_package_is_unknown() {
    let machine = Machine::debian(0, &PACKAGES[..6]);
    machine.command("apt-cache", "echo '  Candidate: (none)'");
    assert_eq!(machine.setup(true).status.code(), Some(0));
    assert_eq!(machine.apt_calls(), ["update", "install -y --no-install-recommends mesa-vulkan-drivers"]);
}

#[test]
fn a_complete_system_is_left_alone_and_a_chosen_driver_is_a_driver() {
    let machine = Machine::debian(1000, &PACKAGES);
    let output = machine.setup(true);
    assert_eq!((output.status.code(), words(&output)), (Some(0), String::new()));

    let without_driver = Machine::debian(1000, &PACKAGES[..6]);
    assert_eq!(without_driver.setup(true).status.code(), Some(3));
    let output =
        without_driver.setup_command(true).env("VK_DRIVER_FILES", "/some/driver.json").output().expect("bash starts");
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
}

#[test]
fn a_build_from_source_is_announced_in_one_line() {
    let machine = Machine::debian(1000, &PACKAGES);
    let output = machine.setup(false);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    assert_eq!(words(&output).lines().count(), 1);
    assert!(words(&output).contains("15 CPU minutes"), "{}", words(&output));
}

/// The real ar takes the name of an archive up to a space. Whoever keeps the repository in `a folder` may have a file
/// `a`.
#[test]
fn libraries_are_merged_in_a_folder_with_a_space_and_no_other_file_is_touched() {
    let machine = Machine::debian(1000, &PACKAGES);
    let real = |tool: &str| ["/usr/bin", "/bin"].iter().map(|at| Path::new(at).join(tool)).find(|path| path.exists());
    let Some(ar) = real("ar") else { return support::skip("merging libraries needs ar") };
    fs::remove_file(machine.path("bin/ar")).expect("a fake");
    symlink(&ar, machine.path("bin/ar")).expect("a link");
    for tool in ["cp", "ln", "mv"] {
        symlink(real(tool).expect("a standard tool"), machine.path("bin").join(tool)).expect("a link");
    }
    // A probe links against an archive that holds both members.
    machine.command(
        "cc",
        "case $1 in -print-file-name=*) echo /lib/libstdc++.so; exit ;; -print-multiarch) exit ;; esac
         grep -q one.o \"$2\" && grep -q two.o \"$2\" && printf '#!/bin/sh\\n' >\"$4\" && chmod 755 \"$4\"",
    );
    let sdk = machine.path("an sdk/lib");
    fs::create_dir_all(&sdk).expect("a folder");
    for (archive, member) in [("libshaderc_combined.a", "one.o"), ("libglslang.a", "two.o")] {
        fs::write(sdk.join(member), member).expect("a member");
        let made = Command::new(&ar).arg("rc").arg(sdk.join(archive)).arg(sdk.join(member)).status().expect("ar");
        assert!(made.success());
    }
    fs::write(machine.path("a"), "mine").expect("a file of someone else");
    let mut setup = machine.setup_command(false);
    setup.env("CARGO_TARGET_DIR", machine.path("a target")).env("VULKAN_SDK", machine.path("an sdk"));
    let output = setup.output().expect("bash starts");
    assert_eq!((output.status.code(), words(&output)), (Some(0), String::new()));
    let merged = fs::read(machine.path("a target/shaderc/libshaderc_combined.a")).expect("an archive");
    assert!(merged.starts_with(b"!<arch>"));
    assert_eq!(fs::read_to_string(machine.path("a")).expect("still there"), "mine");
    let names: Vec<_> = fs::read_dir(machine.path("a target/shaderc"))
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name().into_string().expect("UTF-8"))
        .collect();
    assert_eq!(names.len(), 2, "the archive and where it is from: {names:?}");
}

#[test]
fn without_cargo_the_way_to_get_it_is_printed() {
    let machine = Machine::debian(0, &[]);
    fs::remove_file(machine.path("bin/cargo")).expect("cargo was there");
    let output = machine.setup(false);
    assert_eq!(output.status.code(), Some(3));
    assert!(words(&output).contains("install Rust 1.95"), "{}", words(&output));
}

/// A cargo whose unit tests, and every other program of tests, print what the real one does.
const CARGO: &str = r#"case "$*" in
    *--no-run*) echo "   Compiling nephroid v0.1.0" ;;
    test*--lib*) echo "     Running unittests src/lib.rs (target/debug/deps/nephroid-1)"; echo "running 3 tests"
        echo "test a ... ok"; echo "test b ... ok"; echo "test c ... ok"; echo
        echo "test result: ok. 3 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.01s" ;;
    test*) echo "     Running tests/cli/main.rs (target/debug/deps/cli-1)"; echo "running 2 tests"
        echo "test d ... skipped: d needs ../shared/scenes/ring"; echo ok; echo "skipped: d needs ../shared/scenes/ring"
        echo "test e ... LAST"; echo noise
        echo "test result: ok. 2 passed; 0 failed; 1 ignored; 0 measured; 10 filtered out; finished in 7.50s" ;;
    run*) for last; do :; done; echo picture >"$last" ;;
esac
exit 0"#;

#[test]
fn a_run_of_the_tests_shows_results_skips_and_sums() {
    let machine = Machine::debian(1000, &PACKAGES);
    let (code, text) = machine.test(&["quick"], CARGO);
    assert_eq!(code, Some(0), "{text}");
    for line in [
        "  unittests src/lib.rs\n    running 3 tests\n    test result: ok. 3 passed; 0 failed; 0 ignored;",
        "  tests/cli\n    running 2 tests\n",
        "    test result: ok. 2 passed; 0 failed; 1 ignored;",
        "passed  one render ",
        // Twice in each of two steps, said once.
        " s\nskipped: d needs ../shared/scenes/ring\n7 passed, 0 failed\nall checks passed in ",
    ] {
        assert!(text.contains(line), "{line:?} is not in\n{text}");
    }
    assert!(!text.contains("noise") && !text.contains("test a ... ok"), "{text}");
}

#[test]
fn a_failing_test_ends_the_run_with_its_output() {
    let machine = Machine::debian(1000, &PACKAGES);
    let lines = "echo noise; echo 'test f ... FAILED'; echo 'not successful: f (signal: 11, SIGSEGV)'";
    let failing = CARGO.replace("echo noise", lines).replace("ok. 2", "FAILED. 2");
    let failing = failing.replace("2 passed; 0 failed", "2 passed; 1 failed").replace("exit 0", "exit 0 # end");
    let failing = failing.replace("finished in 7.50s\"", "finished in 7.50s\"; exit 101");
    let (code, text) = machine.test(&["quick"], &failing);
    assert_eq!(code, Some(1), "{text}");
    for part in ["    test f ... FAILED\n", "\nnoise\n", "5 passed, 1 failed\nFAILED: layers and plans (exit code 101)"]
    {
        assert!(text.contains(part), "{part:?} is not in\n{text}");
    }
    assert!(!text.contains("one render"), "a failing step is the last: {text}");
    // Who sees the end alone sees what failed.
    let (before, _) = text.rsplit_once("\n\npassed  format").expect("the closing");
    let last: Vec<&str> = before.lines().rev().take(4).collect();
    assert!(last[0] == "test f ... FAILED" && last[1].ends_with("(signal: 11, SIGSEGV)"), "{last:?}");
    let said = text.lines().rfind(|line| line.starts_with("FAILED: "));
    let log = said.and_then(|line| line.rsplit(' ').next()).expect("where the log is");
    assert!(fs::read_to_string(log).expect("a log").contains("noise"), "the log is kept: {log}");
}

#[test]
fn a_run_of_all_tests_builds_before_and_checks_modules_after() {
    let machine = Machine::debian(1000, &PACKAGES);
    machine.command("spirv-val", "exit 0");
    let (code, text) = machine.test(&[], CARGO);
    assert_eq!(code, Some(1), "{text}");
    let steps: Vec<&str> = text.lines().filter(|line| line.starts_with("passed  ")).collect();
    let names: Vec<_> = steps.iter().map(|line| line[8..48].trim_end()).collect();
    assert_eq!(
        names,
        [
            "format",
            "shell scripts",
            "clippy",
            "the library alone",
            "build",
            "tests",
            "examples in the documentation",
            "kernels, subgroups of 4",
            "kernels, subgroups of 16",
            "tests of whole renders",
            "damaged files, two minutes",
            "examples",
        ],
        "{text}"
    );
    // No module was built here.
    assert!(text.contains("FAILED: spirv-val"), "{text}");
    let (code, text) = machine.test(&[], &CARGO.replace("case \"$*\" in", "case \"$*\" in\n    *fuzz*) exit 7 ;;"));
    assert!(code == Some(1) && text.contains("FAILED: damaged files, two minutes"), "{text}");
    let failing =
        CARGO.replace("case \"$*\" in", "case \"$*\" in\n    *'--test render -- --skip'*) echo broken; exit 7 ;;");
    let (code, text) = machine.test(&[], &failing);
    let said = text.contains("\nbroken\n") && text.contains("FAILED: tests of whole renders (exit code 1)");
    assert!(code == Some(1) && said, "{text}");
    let (code, text) = machine.test(&[], &CARGO.replace("echo picture >", "echo "));
    assert!(code == Some(1) && text.contains("FAILED: examples"), "an example that draws nothing: {text}");
}

#[test]
fn the_tests_explain_their_arguments() {
    let machine = Machine::debian(1000, &[]);
    for help in ["--help", "-h", "help"] {
        let (code, text) = machine.test(&[help], "exit 1");
        assert!(code == Some(0) && text.starts_with("usage: tools/test [quick | deep]\n"), "{text}");
    }
    for wrong in [&["fast"][..], &["quick", "all"], &[""]] {
        let (code, text) = machine.test(wrong, "exit 1");
        assert!(code == Some(2) && text.starts_with("tools/test: cannot understand: "), "{text}");
        assert!(text.contains("usage: tools/test [quick | deep]\n"), "{text}");
    }
}
