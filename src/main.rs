//! The `nephroid` command line program.

fn main() -> std::process::ExitCode {
    nephroid::cli::main(std::env::args_os())
}
