//! Compiles every kernel of glsl/kernels, reflects it, and emits one Rust file that `src/kernels/generated.rs`
//! includes; reads the constants that host and kernels share, and emits them for `src/constants.rs`.

#[path = "src/shader/mod.rs"]
mod shader;

use std::path::PathBuf;
use std::{env, fs, process};

fn main() {
    if let Err(message) = run() {
        // Cargo shows the standard error of a failed build script as it is.
        eprintln!("\n{message}");
        process::exit(1);
    }
}

fn run() -> Result<(), String> {
    let root = PathBuf::from(env::var("CARGO_MANIFEST_DIR").map_err(|e| e.to_string())?).join("glsl");
    let out = PathBuf::from(env::var("OUT_DIR").map_err(|e| e.to_string())?);
    println!("cargo:rerun-if-changed=glsl");
    println!("cargo:rerun-if-changed=src/shader");
    let spirv = out.join("spirv");
    let _ = fs::remove_dir_all(&spirv); // modules of deleted kernels must not be validated
    fs::create_dir_all(&spirv).map_err(|e| format!("{}: {e}", spirv.display()))?;
    let compiler = shader::Compiler::new(&root)?;
    let mut kernels = Vec::new();
    for file in shader::kernel_files(&root)? {
        let words = compiler.compile(&file)?;
        let kernel = shader::reflect(&file, &words)?;
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let path = spirv.join(format!("{}.spv", kernel.name));
        fs::write(&path, bytes).map_err(|e| format!("{}: {e}", path.display()))?;
        kernels.push(kernel);
    }
    let text = shader::emit(&kernels)?;
    fs::write(out.join("kernels.rs"), text).map_err(|e| format!("kernels.rs: {e}"))?;
    let constants = shader::constants::emit(&shader::constants::read(&root)?);
    fs::write(out.join("constants.rs"), constants).map_err(|e| format!("constants.rs: {e}"))
}
