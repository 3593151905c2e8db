//! The file of a study: what is rendered, and what it is compared with.

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use toml::Spanned;

use super::results::Budget;
use super::variant::{Count, Grid, Positive, VariantSettings, Written};
use crate::error::{Error, Result};
use crate::input;
use crate::render::names::Size;
use crate::scene::EnvironmentFile;

/// A checked study. Paths are those of the file, from the folder that the file is in.
#[derive(Debug, Clone, PartialEq)]
pub struct Study {
    /// The file.
    pub path: PathBuf,
    /// Title of the report.
    pub title: String,
    /// Folder of the results.
    pub output: PathBuf,
    /// Scenes; names are unique.
    pub scenes: Vec<SceneEntry>,
    /// Variants; names are unique.
    pub variants: Vec<VariantSettings>,
    /// What each render measures on its way: times in ascending order, then passes in ascending order. Empty for a
    /// study of nothing but bias and variance.
    pub budgets: Vec<Budget>,
    /// Seeds of the renders.
    pub seeds: Vec<u32>,
    /// Bias and variance apart.
    pub decomposition: Option<DecompositionPlan>,
    /// Measurements of other renderers (CSV with the columns scene, renderer, method, seconds, relmse, relmse_trimmed).
    pub peers: Option<PathBuf>,
    /// Whether the last picture of each render is kept as an EXR.
    pub keep_pictures: bool,
    /// Whether HDR-FLIP is measured: it takes seconds for each point.
    pub flip: bool,
}

/// A scene of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneEntry {
    /// Name in the results.
    pub name: String,
    /// glTF file.
    pub file: PathBuf,
    /// Pixels.
    pub size: Size,
    /// Camera by name or index; the first one otherwise.
    pub camera: String,
    /// Environment map.
    pub environment: Option<EnvironmentFile>,
    /// What its renders are compared with.
    pub reference: Reference,
    /// Left out where a file of it is missing, instead of an error.
    pub optional: bool,
}

/// A reference picture.
#[derive(Debug, Clone, PartialEq)]
pub enum Reference {
    /// An EXR.
    File(PathBuf),
    /// A long render by the study itself, kept in the output folder.
    Render(Box<ReferenceRender>),
}

/// A reference of our own.
#[derive(Debug, Clone, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReferenceRender {
    /// Passes; if there is a time too, what comes first.
    passes: Option<Written<Count>>,
    /// Rendering time in seconds.
    seconds: Option<Written<Positive>>,
    /// Seed; other than those of the study.
    #[serde(default = "reference_seed")]
    pub seed: u32,
    /// Settings, as those of a variant.
    #[serde(default)]
    pub settings: VariantSettings,
}

/// Passes of `reference = "self"`.
const REFERENCE_PASSES: u64 = 1024;

/// Far from the seeds that people choose.
fn reference_seed() -> u32 {
    0x5eed_0001
}

impl ReferenceRender {
    fn standard() -> Self {
        Self { passes: None, seconds: None, seed: reference_seed(), settings: VariantSettings::default() }
    }

    /// When it ends: passes and seconds, what comes first; at least one is set.
    pub fn limits(&self) -> (Option<u64>, Option<f64>) {
        let passes = self.passes.as_ref().map(|passes| u64::from(passes.value.0));
        let seconds = self.seconds.as_ref().map(|seconds| seconds.value.0);
        (passes.or(seconds.is_none().then_some(REFERENCE_PASSES)), seconds)
    }
}

impl<'de> Deserialize<'de> for Reference {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Reference;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("the path of an EXR, \"self\", or a table with passes, seconds, seed, settings")
            }

            fn visit_str<E>(self, text: &str) -> std::result::Result<Reference, E> {
                Ok(match text {
                    "self" => Reference::Render(Box::new(ReferenceRender::standard())),
                    path => Reference::File(path.into()),
                })
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> std::result::Result<Reference, A::Error> {
                let render = ReferenceRender::deserialize(MapAccessDeserializer::new(map))?;
                Ok(Reference::Render(Box::new(render)))
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// Bias and variance of these scenes, variants and passes.
#[derive(Debug, Clone, PartialEq)]
pub struct DecompositionPlan {
    /// Seeds, at least 2.
    pub seeds: Vec<u32>,
    /// Passes, ascending.
    pub passes: Vec<u64>,
    /// Names of scenes.
    pub scenes: BTreeSet<String>,
    /// Names of variants.
    pub variants: BTreeSet<String>,
}

/// The file as it is written.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    title: String,
    output: PathBuf,
    scene: Vec<SceneTable>,
    #[serde(default)]
    variant: Vec<Spanned<VariantSettings>>,
    #[serde(default)]
    grid: Vec<Grid>,
    #[serde(default)]
    budgets: Budgets,
    #[serde(default = "one")]
    seeds: Written<Count>,
    decomposition: Option<DecompositionTable>,
    peers: Option<PathBuf>,
    #[serde(default)]
    keep_pictures: bool,
    #[serde(default)]
    flip: bool,
}

fn one() -> Written<Count> {
    Written { text: "1".into(), value: Count(1) }
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneTable {
    name: Spanned<String>,
    file: PathBuf,
    size: Written<Size>,
    #[serde(default)]
    camera: Option<String>,
    environment: Option<PathBuf>,
    environment_rotation: Option<f32>,
    environment_scale: Option<Written<Positive>>,
    reference: Spanned<Reference>,
    #[serde(default)]
    optional: bool,
}

#[derive(Default, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Budgets {
    seconds: Vec<Written<Positive>>,
    passes: Vec<Written<Count>>,
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct DecompositionTable {
    seeds: Option<Spanned<Written<Count>>>,
    passes: Vec<Written<Count>>,
    scenes: Option<Vec<Spanned<String>>>,
    variants: Option<Vec<Spanned<String>>>,
}

/// Seeds of a decomposition, if it does not say.
const DECOMPOSITION_SEEDS: u32 = 16;

/// Bytes of the file of a study.
const MOST_BYTES: u64 = 1 << 20;

/// Reads and checks the file of a study; whether its scenes exist is not looked at.
///
/// # Errors
/// [`Error::Io`] if it cannot be read, [`Error::Scene`] with line and cause if it does not describe a study.
pub fn load(path: &Path) -> Result<Study> {
    let text = input::read_text(path, MOST_BYTES)?;
    Source { path, text: &text }.study()
}

/// The text of a study, to say where something is wrong.
struct Source<'a> {
    path: &'a Path,
    text: &'a str,
}

impl Source<'_> {
    /// An error about a part of the text.
    fn wrong(&self, span: Option<Range<usize>>, what: &str) -> Error {
        let Some(at) = span.map(|span| span.start.min(self.text.len())) else { return Error::scene(self.path, what) };
        let number = self.text[..at].matches('\n').count();
        let line = self.text.lines().nth(number).unwrap_or_default().trim();
        Error::scene(self.path, format!("line {}: `{line}`: {what}", number + 1))
    }

    fn study(&self) -> Result<Study> {
        let file: File =
            toml::from_str(self.text).map_err(|e| self.wrong(e.span(), &e.message().replace('\n', "; ")))?;
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let variants = self.variants(&file)?;
        let scenes = file.scene.iter().map(|table| self.scene(folder, table)).collect::<Result<Vec<_>>>()?;
        let mut names = BTreeSet::new();
        if let Some(table) = file.scene.iter().find(|table| !names.insert(table.name.get_ref().clone())) {
            return Err(self.wrong(Some(table.name.span()), "a scene of this name is there already"));
        }
        let known: BTreeSet<String> = variants.iter().map(|variant| variant.name.clone()).collect();
        let decomposition =
            file.decomposition.as_ref().map(|table| self.decomposition(table, &names, &known)).transpose()?;
        let budgets = budgets(&file.budgets);
        for (missing, what) in [
            (scenes.is_empty(), "no [[scene]]"),
            (variants.is_empty(), "no [[variant]] and no [[grid]]"),
            (budgets.is_empty() && decomposition.is_none(), "no budgets: nothing to measure"),
        ] {
            if missing {
                return Err(Error::scene(self.path, what));
            }
        }
        Ok(Study {
            path: self.path.to_owned(),
            title: file.title,
            output: folder.join(file.output),
            scenes,
            variants,
            budgets,
            seeds: (1..=file.seeds.value.0).collect(),
            decomposition,
            peers: file.peers.map(|path| folder.join(path)),
            keep_pictures: file.keep_pictures,
            flip: file.flip,
        })
    }

    fn scene(&self, folder: &Path, table: &SceneTable) -> Result<SceneEntry> {
        if table.name.get_ref().is_empty() {
            return Err(self.wrong(Some(table.name.span()), "a scene needs a name"));
        }
        let reference = match table.reference.get_ref() {
            Reference::File(path) => Reference::File(folder.join(path)),
            Reference::Render(render) if !render.settings.name.is_empty() => {
                return Err(self.wrong(Some(table.reference.span()), "the settings of a reference have no name"));
            }
            Reference::Render(render) => Reference::Render(render.clone()),
        };
        Ok(SceneEntry {
            name: table.name.get_ref().clone(),
            file: folder.join(&table.file),
            size: table.size.value,
            camera: table.camera.clone().unwrap_or_else(|| "0".into()),
            environment: self.environment(folder, table)?,
            reference,
            optional: table.optional,
        })
    }

    fn environment(&self, folder: &Path, table: &SceneTable) -> Result<Option<EnvironmentFile>> {
        let (rotation, scale) = (table.environment_rotation, &table.environment_scale);
        let wrong = |what| Err(self.wrong(Some(table.name.span()), what));
        if table.environment.is_none() && (rotation.is_some() || scale.is_some()) {
            return wrong("an environment is turned or scaled, but none is named");
        }
        if rotation.is_some_and(|angle| !angle.is_finite()) {
            return wrong("the angle of an environment is not finite");
        }
        let (rotation, scale) = (rotation.unwrap_or(0.0), scale.as_ref().map_or(1.0, |scale| scale.value.0 as f32));
        let file = |path: &PathBuf| EnvironmentFile { path: folder.join(path), rotation, scale };
        Ok(table.environment.as_ref().map(file))
    }

    fn variants(&self, file: &File) -> Result<Vec<VariantSettings>> {
        let mut variants: Vec<VariantSettings> = vec![];
        let written = file.variant.iter().map(|variant| (variant.get_ref().clone(), Some(variant.span())));
        let product = file.grid.iter().flat_map(Grid::variants).map(|variant| (variant, None));
        for (variant, span) in written.chain(product) {
            if variant.name.is_empty() {
                return Err(self.wrong(span, "a variant needs a name, a grid at least one list"));
            }
            if variants.iter().any(|known| known.name == variant.name) {
                return Err(self.wrong(span, &format!("variant '{}' is there already", variant.name)));
            }
            variants.push(variant);
        }
        Ok(variants)
    }

    fn decomposition(
        &self,
        table: &DecompositionTable,
        scenes: &BTreeSet<String>,
        variants: &BTreeSet<String>,
    ) -> Result<DecompositionPlan> {
        let chosen = |names: &Option<Vec<Spanned<String>>>, known: &BTreeSet<String>, kind: &str| {
            let Some(names) = names else { return Ok(known.clone()) };
            if let Some(name) = names.iter().find(|name| !known.contains(name.get_ref())) {
                return Err(self.wrong(Some(name.span()), &format!("there is no {kind} '{}'", name.get_ref())));
            }
            Ok(names.iter().map(|name| name.get_ref().clone()).collect())
        };
        let seeds = table.seeds.as_ref().map_or(DECOMPOSITION_SEEDS, |seeds| seeds.get_ref().value.0);
        if seeds < 2 {
            return Err(self.wrong(table.seeds.as_ref().map(Spanned::span), "a variance needs at least 2 seeds"));
        }
        if table.passes.is_empty() {
            return Err(Error::scene(self.path, "[decomposition] has no passes"));
        }
        Ok(DecompositionPlan {
            seeds: (1..=seeds).collect(),
            passes: ascending(&table.passes),
            scenes: chosen(&table.scenes, scenes, "scene")?,
            variants: chosen(&table.variants, variants, "variant")?,
        })
    }
}

fn ascending(passes: &[Written<Count>]) -> Vec<u64> {
    passes.iter().map(|passes| u64::from(passes.value.0)).collect::<BTreeSet<_>>().into_iter().collect()
}

fn budgets(table: &Budgets) -> Vec<Budget> {
    let mut seconds: Vec<f64> = table.seconds.iter().map(|seconds| seconds.value.0).collect();
    seconds.sort_by(f64::total_cmp);
    seconds.dedup();
    let passes = ascending(&table.passes);
    seconds.into_iter().map(Budget::Seconds).chain(passes.into_iter().map(Budget::Passes)).collect()
}
