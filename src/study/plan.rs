//! What a study has to do: its scenes, and its renders in the order in which they run.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::config::{DecompositionPlan, Reference, SceneEntry, Study};
use super::output::read_peers;
use super::reference::Source;
use super::results::{Budget, Peer};
use super::store::{Entry, Fingerprint, Store};
use crate::error::{Error, Result};
use crate::graph::Runtime;
use crate::render::Settings;
use crate::render::names::choose_camera;
use crate::scene::{self, Limits, Scene, World};

/// A scene, ready to be rendered.
pub struct LoadedScene {
    /// As in the file.
    pub entry: SceneEntry,
    /// Its content.
    pub scene: Scene,
    /// Index of the camera.
    pub camera: usize,
    /// Time of loading in seconds.
    pub seconds: f64,
    /// What its renders are compared with.
    pub reference: Source,
}

/// A piece of work that is done as a whole.
#[derive(Debug, Clone, PartialEq)]
pub enum Work {
    /// Renders the reference of a scene.
    Reference,
    /// Renders one variant with one seed and measures all budgets.
    Render {
        /// Index of the variant.
        variant: usize,
        /// Seed.
        seed: u32,
    },
    /// Renders one variant with many seeds.
    Decomposition {
        /// Index of the variant.
        variant: usize,
    },
}

/// A piece of work on a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    /// Index of the scene.
    pub scene: usize,
    /// What is done.
    pub work: Work,
    /// Under what its result is stored; for a reference what its file is called by.
    pub key: String,
}

/// A study with its scenes, what it has to do and what has been done.
pub struct Plan<'a> {
    /// What was asked for.
    pub study: &'a Study,
    /// The device.
    pub runtime: &'a Runtime,
    /// Scenes that are there.
    pub scenes: Vec<LoadedScene>,
    /// Sentences about scenes that are not, and about those that are.
    pub notes: Vec<String>,
    /// All work, in order.
    pub units: Vec<Unit>,
    /// What has been measured.
    pub store: Store,
    /// Measurements of other renderers.
    pub peers: Vec<Peer>,
}

impl<'a> Plan<'a> {
    /// Loads scenes, looks for references and reads what has been measured. Writes nothing.
    ///
    /// # Errors
    /// [`Error::Scene`] with the name of a scene that is not there or whose reference is not; those of loading scenes
    /// and references; [`Error::Usage`] for a camera that does not exist.
    pub fn new(study: &'a Study, runtime: &'a Runtime) -> Result<Self> {
        let mut notes = vec![];
        let mut present = vec![];
        for entry in &study.scenes {
            match missing(entry) {
                None => present.push(entry),
                Some(path) if entry.optional => {
                    notes.push(format!("scene '{}' is left out: {} is not there", entry.name, path.display()));
                }
                Some(path) => {
                    let what = format!("scene '{}': {} is not there", entry.name, path.display());
                    return Err(Error::scene(&study.path, what));
                }
            }
        }
        if present.is_empty() {
            return Err(Error::scene(&study.path, "none of its scenes is there"));
        }
        let names: Vec<&str> = present.iter().map(|entry| entry.name.as_str()).collect();
        let peers = match &study.peers {
            Some(path) if path.is_file() => read_peers(path, &names)?,
            Some(path) => {
                notes.push(format!("no measurements of other renderers: {} is not there", path.display()));
                vec![]
            }
            None => vec![],
        };
        let store = Store::open(&study.output.join("store.jsonl"))?;
        let scenes = present.into_iter().map(|entry| load(study, entry)).collect::<Result<Vec<_>>>()?;
        for loaded in &scenes {
            notes.extend(loaded.scene.warnings.iter().map(|warning| format!("{}: {warning}", loaded.entry.name)));
        }
        let mut plan = Self { study, runtime, scenes, notes, units: vec![], store, peers };
        plan.units = plan.units();
        Ok(plan)
    }

    /// References first; then renders, variants side by side within a seed, so that what disturbs the machine disturbs
    /// all variants alike; then bias and variance.
    fn units(&self) -> Vec<Unit> {
        let mut units = vec![];
        for (scene, loaded) in self.scenes.iter().enumerate() {
            if loaded.reference.render.is_some() {
                units.push(Unit { scene, work: Work::Reference, key: loaded.reference.key.clone() });
            }
        }
        let variants = 0..self.study.variants.len();
        let seeds = if self.study.budgets.is_empty() { &[][..] } else { &self.study.seeds };
        for &seed in seeds {
            for scene in 0..self.scenes.len() {
                for variant in variants.clone() {
                    let content = format!("render {:?} {:?}", self.settings(scene, variant, seed), self.study.budgets);
                    let key = self.key(scene, &content);
                    units.push(Unit { scene, work: Work::Render { variant, seed }, key });
                }
            }
        }
        let Some(wanted) = &self.study.decomposition else { return units };
        for (scene, loaded) in self.scenes.iter().enumerate() {
            for variant in variants.clone() {
                let names = (&loaded.entry.name, &self.study.variants[variant].name);
                if wanted.scenes.contains(names.0) && wanted.variants.contains(names.1) {
                    let settings = self.settings(scene, variant, 0);
                    let DecompositionPlan { seeds, passes, .. } = wanted;
                    let key = self.key(scene, &format!("decomposition {settings:?} {seeds:?} {passes:?}"));
                    units.push(Unit { scene, work: Work::Decomposition { variant }, key });
                }
            }
        }
        units
    }

    /// The settings of a session.
    pub fn settings(&self, scene: usize, variant: usize, seed: u32) -> Settings {
        let loaded = &self.scenes[scene];
        let variant_settings = &self.study.variants[variant];
        Settings { seed, ..variant_settings.resolve(&loaded.scene, loaded.camera, loaded.entry.size) }
    }

    /// The key of what `content` describes: it changes with scene, reference and device.
    fn key(&self, scene: usize, content: &str) -> String {
        let loaded = &self.scenes[scene];
        let parts = [&scene_key(&loaded.scene), &loaded.reference.key, &self.device(), content];
        parts.iter().fold(Fingerprint::default(), |key, part| key.with(part.as_bytes())).text()
    }

    /// Device and driver.
    pub fn device(&self) -> String {
        let info = self.runtime.device().info();
        format!("{}, {}", info.name, info.driver)
    }

    /// Whether its result is known.
    pub fn is_done(&self, unit: &Unit) -> bool {
        match unit.work {
            Work::Reference => self.scenes[unit.scene].reference.file.is_file(),
            _ => self.store.get(&unit.key).is_some(),
        }
    }

    /// What it is, for people.
    pub fn describe(&self, unit: &Unit) -> String {
        let scene = &self.scenes[unit.scene].entry.name;
        let name = |variant: usize| &self.study.variants[variant].name;
        match unit.work {
            Work::Reference => format!("{scene}: reference"),
            Work::Render { variant, seed } => format!("{scene}: {}, seed {seed}", name(variant)),
            Work::Decomposition { variant } => format!("{scene}: {}, bias and variance", name(variant)),
        }
    }

    /// Rendering time that it will take, in seconds, if anything is known about it.
    pub fn estimate(&self, unit: &Unit) -> Option<f64> {
        let by_passes = |passes: u64| Some(self.pace(unit)? * passes as f64);
        match unit.work {
            Work::Reference => {
                let (passes, seconds) = self.scenes[unit.scene].reference.render.as_ref()?.0.limits();
                [passes.and_then(by_passes), seconds].into_iter().flatten().reduce(f64::min)
            }
            Work::Render { .. } => {
                let cost = |budget: &Budget| match *budget {
                    Budget::Seconds(seconds) => Some(seconds),
                    Budget::Passes(passes) => by_passes(passes),
                };
                self.study.budgets.iter().filter_map(cost).reduce(f64::max)
            }
            Work::Decomposition { .. } => {
                let wanted = self.study.decomposition.as_ref()?;
                by_passes(wanted.passes.last()? * wanted.seeds.len() as u64)
            }
        }
    }

    /// Seconds per pass, from what has been measured of this variant in this scene, or else of any.
    fn pace(&self, unit: &Unit) -> Option<f64> {
        let scene = &self.scenes[unit.scene].entry.name;
        let variant = match unit.work {
            Work::Reference => None,
            Work::Render { variant, .. } | Work::Decomposition { variant } => Some(&self.study.variants[variant].name),
        };
        let mut paces = BTreeMap::new();
        for entry in self.store.entries() {
            let Entry::Measurements(measurements) = entry else { continue };
            let Some(last) =
                measurements.last().filter(|measurement| measurement.scene == *scene && measurement.passes > 0)
            else {
                continue;
            };
            paces.insert(&last.variant, last.seconds / last.passes as f64);
        }
        let any = paces.values().next().copied();
        variant.and_then(|variant| paces.get(variant).copied()).or(any)
    }
}

/// The first file of a scene that is not there.
fn missing(entry: &SceneEntry) -> Option<&PathBuf> {
    let reference = match &entry.reference {
        Reference::File(path) => Some(path),
        Reference::Render(_) => None,
    };
    let mut files =
        [Some(&entry.file), entry.environment.as_ref().map(|map| &map.path), reference].into_iter().flatten();
    files.find(|path| !path.is_file())
}

fn load(study: &Study, entry: &SceneEntry) -> Result<LoadedScene> {
    let begin = Instant::now();
    let scene = scene::load_with_environment(&entry.file, entry.environment.as_ref(), &Limits::default())?;
    let seconds = begin.elapsed().as_secs_f64();
    let names: Vec<&str> = scene.cameras.iter().map(|camera| camera.name.as_str()).collect();
    let camera = choose_camera(&entry.camera, &names)?;
    let reference = Source::of(entry, (&scene, camera), &scene_key(&scene), &references(&study.output))?;
    if reference.render.is_none() {
        reference.read(entry)?;
    }
    Ok(LoadedScene { entry: entry.clone(), scene, camera, seconds, reference })
}

/// The folder of the references that the study renders itself.
pub fn references(output: &Path) -> PathBuf {
    output.join("references")
}

/// A number for what a scene looks like; the names of its files do not count.
fn scene_key(scene: &Scene) -> String {
    let g = &World::of(scene);
    let mut key = Fingerprint::default();
    let floats: [&[u8]; 6] = [
        bytemuck::cast_slice(&g.positions),
        bytemuck::cast_slice(&g.normals),
        bytemuck::cast_slice(&g.tangents),
        bytemuck::cast_slice(&g.uvs[0]),
        bytemuck::cast_slice(&g.uvs[1]),
        bytemuck::cast_slice(&g.colors),
    ];
    for part in floats.into_iter().chain([bytemuck::cast_slice(&g.triangles), bytemuck::cast_slice(&g.material)]) {
        key = key.with(part);
    }
    for image in &scene.images {
        key = key.with(&image.width.to_le_bytes()).with(bytemuck::cast_slice(&image.rgba));
    }
    if let Some(environment) = &scene.environment {
        key = key.with(&environment.width.to_le_bytes()).with(bytemuck::cast_slice(&environment.radiance));
    }
    let rest = format!("{:?} {:?} {:?} {:?}", scene.materials, scene.textures, scene.lights, scene.cameras);
    key.with(rest.as_bytes()).text()
}
