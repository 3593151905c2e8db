//! `nephroid info`: what a scene holds and what rendering it needs. No device is asked.

use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};

use super::console::print;
use super::environment::EnvironmentArgs;
use super::inputs::check_readable;
use super::moment::seconds;
use super::numbers::bytes;
use super::reading::ReadingArgs;
use super::values::{self, Size};
use crate::error::{Error, Result, escaped};
use crate::graph::DeviceClass;
use crate::render::{Outline, Saving, Savings, Settings, savings};
use crate::scene::{Motion, Needs, Scene, Summary};

const EXAMPLES: &str = "\
Examples:
  nephroid info cup.glb
  nephroid info car.gltf --environment sky.exr --size 1920x1080
  nephroid info cup.glb --json";

/// Flags of `nephroid info`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct InfoArgs {
    /// glTF 2.0 scene (.gltf or .glb)
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,

    /// The environment map to assume.
    #[command(flatten)]
    pub environment: EnvironmentArgs,

    /// How the scene is read.
    #[command(flatten)]
    pub reading: ReadingArgs,

    /// Show the scene as its animation has it at this time, in seconds
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true)]
    pub at: Option<f64>,

    /// Picture size to assume, in pixels
    #[arg(long, value_name = "WxH", default_value = "640x480", value_parser = values::size)]
    pub size: Size,

    /// Print JSON instead of text
    #[arg(long)]
    pub json: bool,
}

/// Everything that is printed.
struct Facts<'a> {
    scene: &'a Scene,
    size: Size,
    summary: Summary,
    needs: Needs,
    /// What is saved; for the software device, whose plans are the same but for the length of serial runs.
    savings: Savings,
}

/// Prints triangles, lights, materials and bytes, and which parts of the renderer the scene leaves out.
///
/// # Errors
/// Those of loading the scene.
pub fn run(args: &InfoArgs) -> Result<()> {
    check_readable(&args.scene)?;
    args.environment.environment.iter().try_for_each(|path| check_readable(path))?;
    let mut scene = args.reading.load(&args.scene, &args.environment)?;
    args.at.into_iter().for_each(|at| scene.move_to(at));
    if scene.cameras.is_empty() {
        return Err(Error::scene(&args.scene, "no camera"));
    }
    let settings = Settings { width: args.size.width, height: args.size.height, ..Settings::default() };
    let savings = savings(&scene, &settings, DeviceClass::Cpu)?;
    let (summary, needs) = (Summary::of(&scene), Needs::of(&scene));
    let facts = Facts { scene: &scene, size: args.size, summary, needs, savings };
    print(&if args.json { format!("{:#}", facts.json()) } else { facts.text() })
}

impl Facts<'_> {
    fn text(&self) -> String {
        let mut lines = vec![self.scene.path.display().to_string()];
        lines.extend(self.content());
        lines.extend(list("needs", &self.needs.kept()));
        lines.extend(list("does not need", &self.needs.left_out()));
        let paths = if self.needs.left_out().contains(&"caustics") {
            "no photons for the passes of paths"
        } else {
            "photons for the passes of paths where those find no caustics by themselves"
        };
        let turns = ["photons and paths in turns (the first passes of a render tell how much of either)", paths];
        lines.extend(list("by default", &turns));
        lines.push(String::new());
        lines.extend(program(&self.savings, self.size));
        lines.push(String::new());
        lines.extend(left_out(&self.savings.left_out));
        lines.extend(self.scene.warnings.iter().map(|warning| format!("warning: {warning}")));
        lines.join("\n")
    }

    fn content(&self) -> Vec<String> {
        let s = &self.summary;
        let [point, spot, directional] = s.punctual_lights;
        let environment = match s.environment {
            Some([w, h]) => format!("environment of {w} x {h} texels ({})", bytes(s.environment_bytes)),
            None => "no environment".into(),
        };
        let skipped = match self.savings.skipped_triangles {
            0 => String::new(),
            n => format!(" ({n} without area, left out)"),
        };
        vec![
            format!("  triangles    {}{skipped}", s.triangles),
            format!("  vertices     {}", s.vertices),
            format!(
                "  lights       {point} point, {spot} spot, {directional} directional, {} emissive triangles, \
                 {environment}",
                s.emissive_triangles
            ),
            format!("  materials    {}", s.materials),
            format!("  textures     {} of {} images ({})", s.textures, s.images, bytes(s.image_bytes)),
            format!("  cameras      {}", s.cameras),
            format!("  variants     {}", variants(&self.scene.variants)),
            format!("  animations   {}", animations(self.scene.motion.as_deref())),
            format!("  on the host  {}", bytes(s.bytes())),
        ]
    }

    fn json(&self) -> Value {
        let s = &self.summary;
        let [point, spot, directional] = s.punctual_lights;
        json!({
            "scene": self.scene.path.display().to_string(),
            "size": [self.size.width, self.size.height],
            "triangles": s.triangles, "triangles_skipped": self.savings.skipped_triangles, "vertices": s.vertices,
            "materials": s.materials, "textures": s.textures, "images": s.images, "cameras": s.cameras,
            "variants": self.scene.variants,
            "animations": self.scene.motion.as_deref().map(animations_json),
            "lights": {
                "point": point, "spot": spot, "directional": directional,
                "emissive_triangles": s.emissive_triangles, "environment": s.environment,
            },
            "host_bytes": {
                "geometry": s.geometry_bytes, "images": s.image_bytes, "environment": s.environment_bytes,
                "all": s.bytes(),
            },
            "kept": self.needs.kept(), "left_out": self.needs.left_out(),
            "program": outline_json(&self.savings.lean), "program_with_everything": outline_json(&self.savings.full),
            "savings": self.savings.left_out.iter().map(saving_json).collect::<Value>(),
            "warnings": self.scene.warnings,
        })
    }
}

/// Names of variants of the materials in quotes, or "none".
fn variants(names: &[String]) -> String {
    const MOST: usize = 20;
    let quoted: Vec<String> = names.iter().take(MOST).map(|name| format!("'{}'", escaped(name))).collect();
    match names.len() {
        0 => "none".into(),
        1..=MOST => quoted.join(", "),
        count => format!("{}, and {} more", quoted.join(", "), count - MOST),
    }
}

/// Names of the animations, which are played, and for how long.
fn animations(motion: Option<&Motion>) -> String {
    let Some(motion) = motion else { return "none".into() };
    let (played, [start, end]) = (motion.animations().iter().filter(|(_, played)| *played).count(), motion.span());
    let names: Vec<String> = motion.animations().iter().map(|(name, _)| name.clone()).collect();
    match played {
        0 => variants(&names),
        _ if played == names.len() => format!("{}, {start:.3} s to {end:.3} s", variants(&names)),
        _ => {
            let on: Vec<String> =
                motion.animations().iter().filter(|(_, on)| *on).map(|(name, _)| name.clone()).collect();
            format!("{} of {}, {start:.3} s to {end:.3} s", variants(&on), variants(&names))
        }
    }
}

fn animations_json(motion: &Motion) -> Value {
    let all = motion.animations().iter().map(|(name, played)| json!({ "name": name, "played": played }));
    json!({ "span": motion.span(), "all": all.collect::<Value>() })
}

/// `title: a, b, c`, broken into lines; nothing without names.
fn list(title: &str, names: &[&str]) -> Vec<String> {
    const WIDTH: usize = 100;
    let mut lines: Vec<String> = Vec::new();
    for (index, name) in names.iter().enumerate() {
        let comma = if index + 1 < names.len() { "," } else { "" };
        match lines.last_mut().filter(|line| line.len() + name.len() + 2 <= WIDTH) {
            Some(line) => line.push_str(&format!(" {name}{comma}")),
            None => {
                let title = if lines.is_empty() { title } else { "" };
                lines.push(format!("  {title:<14} {name}{comma}"));
            }
        }
    }
    lines
}

/// The table of the program: what one pass is made of.
fn program(savings: &Savings, size: Size) -> Vec<String> {
    let (lean, full) = (&savings.lean, &savings.full);
    let row = |name: &str, lean: String, full: String| format!("  {name:<22} {lean:>12} {full:>16}");
    let count = |name, of: fn(&Outline) -> usize| row(name, of(lean).to_string(), of(full).to_string());
    let size_of = |name, of: fn(&Outline) -> u64| row(name, bytes(of(lean)), bytes(of(full)));
    let mut lines = vec![
        row(&format!("photon pass at {size}"), "this scene".into(), "with everything".into()),
        count("dispatches and copies", |o| o.passes),
        count("barriers", |o| o.phases as usize),
        count("kernels", |o| o.kernels.len()),
        count("compiled variants", Outline::pipelines),
        size_of("scene on the device", |o| o.scene_bytes.iter().map(|(_, bytes)| bytes).sum()),
        size_of("photons, paths, trees", |o| o.transient_bytes),
        size_of("- without sharing", |o| o.unshared_bytes),
        size_of("film", |o| o.film_bytes),
        size_of("device memory", Outline::bytes),
    ];
    for (name, passes) in &full.scopes {
        let here = lean.scopes.iter().find(|(known, _)| known == name).map_or(0, |(_, passes)| *passes);
        lines.push(row(&format!("- {name}"), here.to_string(), passes.to_string()));
    }
    lines
}

fn left_out(savings: &[Saving]) -> Vec<String> {
    let mut lines = Vec::new();
    for saving in savings {
        let plural = |n: usize, word: &str, many: &str| format!("{n} {}", if n == 1 { word } else { many });
        let mut parts = Vec::new();
        if saving.passes > 0 {
            parts.push(plural(saving.passes, "pass", "passes"));
        }
        if saving.pipelines > 0 {
            parts.push(plural(saving.pipelines, "compiled kernel", "compiled kernels"));
        }
        if saving.bytes > 0 {
            parts.push(bytes(saving.bytes));
        }
        let saved = if parts.is_empty() { "code only".into() } else { parts.join(", ") };
        lines.push(format!("  left out: {} ({saved})", saving.name));
        if !saving.kernels.is_empty() {
            lines.extend(list("  from kernels", &saving.kernels));
        }
    }
    lines
}

fn outline_json(outline: &Outline) -> Value {
    let kernels = outline.kernels.iter().map(
        |kernel| json!({ "name": kernel.name, "variants": kernel.variants.len(), "dispatches": kernel.dispatches }),
    );
    let named = |pairs: Vec<(&str, Value)>| {
        Value::Object(pairs.into_iter().map(|(name, value)| (name.to_owned(), value)).collect())
    };
    json!({
        "passes": outline.passes, "barriers": outline.phases, "compiled_variants": outline.pipelines(),
        "kernels": kernels.collect::<Value>(),
        "passes_by_scope": named(outline.scopes.iter().map(|(name, n)| (*name, (*n).into())).collect()),
        "bytes": {
            "scene": named(outline.scene_bytes.iter().map(|(name, n)| (*name, (*n).into())).collect()),
            "transients": outline.transient_bytes,
            "transients_without_sharing": outline.unshared_bytes, "film": outline.film_bytes, "all": outline.bytes(),
        },
    })
}

fn saving_json(saving: &Saving) -> Value {
    json!({
        "name": saving.name, "passes": saving.passes, "compiled_kernels": saving.pipelines,
        "kernels": saving.kernels, "bytes": saving.bytes,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_broken_and_aligned() {
        assert!(list("needs", &[]).is_empty());
        assert_eq!(list("needs", &["a", "b c"]), ["  needs          a, b c"]);
        let long = vec!["texture coordinates"; 9];
        let lines = list("needs", &long);
        assert!(lines.len() > 1 && lines.iter().all(|line| line.len() <= 100));
        assert!(lines[1].starts_with("                 texture") && lines[0].ends_with(','));
    }

    #[test]
    fn savings_are_named() {
        let saving =
            Saving { name: "caustics", passes: 52, pipelines: 1, kernels: vec!["photon_emit"], bytes: 3 << 19 };
        let lines = left_out(&[saving.clone(), Saving { passes: 0, pipelines: 0, bytes: 0, ..saving }]);
        assert_eq!(lines[0], "  left out: caustics (52 passes, 1 compiled kernel, 1.5 MiB)");
        assert_eq!(lines[1], "    from kernels photon_emit");
        assert_eq!(lines[2], "  left out: caustics (code only)");
    }
}
