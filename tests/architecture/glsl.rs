//! What ARCHITECTURE.md promises about random numbers in GLSL: salts have names, and each name has a number of its own.

use super::layers::files;

/// What is wrong with the salts of a file: a number mixed into a seed where a name should be, or a number used twice.
fn salt_faults(file: &str, text: &str) -> Vec<String> {
    let mut faults = Vec::new();
    let mut known = Vec::new();
    for (at, line) in text.lines().enumerate() {
        if line.contains("seed") && line.contains("^ 0x") {
            faults.push(format!("{file}:{}: a salt without a name (lib/salts.glsl)", at + 1));
        }
        if let Some((name, value)) = line.strip_prefix("const uint SALT_").and_then(|rest| rest.split_once(" = ")) {
            let value = value.split(';').next().unwrap_or_default();
            if known.contains(&value) {
                faults.push(format!("{file}:{}: SALT_{name} is {value}, like another salt", at + 1));
            }
            known.push(value);
        }
    }
    faults
}

#[test]
fn salts_have_names_and_differ() {
    let sources = files("glsl", &["glsl", "comp"]);
    let salts = sources.iter().find(|(file, _)| file == "glsl/lib/salts.glsl").expect("the file of salts");
    assert!(salts.1.matches("const uint SALT_").count() >= 12, "not all salts were found");
    let faults: Vec<_> = sources.iter().flat_map(|(file, text)| salt_faults(file, text)).collect();
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn the_checker_of_salts_sees_faults() {
    assert_eq!(salt_faults("a.comp", "    float u = unit_float(hash(seed ^ 0x1u));").len(), 1);
    assert_eq!(salt_faults("a.comp", "    float u = unit_float(hash(seed ^ SALT_LOBE));").len(), 0);
    assert_eq!(salt_faults("a.glsl", "const uint SALT_A = 0x1u; // one\nconst uint SALT_B = 0x2u;").len(), 0);
    assert_eq!(salt_faults("a.glsl", "const uint SALT_A = 0x1u; // one\nconst uint SALT_B = 0x1u;").len(), 1);
}
