//! The `nephroid` command line program.

use nephroid::low_level::vk::MemoryOrExit;

/// Without memory the program ends with a sentence and its exit code for that, not with an abort.
#[global_allocator]
static MEMORY: MemoryOrExit = MemoryOrExit;

fn main() -> std::process::ExitCode {
    nephroid::cli::main(std::env::args_os())
}
