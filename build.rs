fn main() { let c = shaderc::Compiler::new().unwrap(); let a = c.compile_into_spirv("#version 460\nvoid main(){}", shaderc::ShaderKind::Compute, "x", "main", None).unwrap(); assert!(a.len()>0);
let _ = spirq::ReflectConfig::new(); }
