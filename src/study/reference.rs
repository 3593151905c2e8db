//! References: read from a file, or rendered once and kept.

use std::path::{Path, PathBuf};

use super::config::{Reference, ReferenceRender, SceneEntry};
use super::measure::Meter;
use super::store::Fingerprint;
use crate::error::{Error, Result};
use crate::graph::Runtime;
use crate::input;
use crate::picture::exr::{self, RenderInfo};
use crate::picture::image::Picture;
use crate::picture::output::Output;
use crate::picture::tonemap::ToneMap;
use crate::render::Settings;
use crate::scene::Scene;

/// Bytes of a reference's file.
const MOST_BYTES: u64 = 2 << 30;

/// A reference, before it is read.
pub struct Source {
    /// The picture.
    pub file: PathBuf,
    /// What identifies its content.
    pub key: String,
    /// How to render it, if it is ours.
    pub render: Option<(ReferenceRender, Settings)>,
}

impl Source {
    /// The reference of a scene whose content is known as `scene_key`; references of our own are kept in `folder`.
    ///
    /// # Errors
    /// [`Error::Io`] if a file cannot be read.
    pub fn of(entry: &SceneEntry, (scene, camera): (&Scene, usize), scene_key: &str, folder: &Path) -> Result<Self> {
        match &entry.reference {
            Reference::File(path) => {
                let bytes = input::read(path, MOST_BYTES)?;
                Ok(Self { file: path.clone(), key: Fingerprint::default().with(&bytes).text(), render: None })
            }
            Reference::Render(render) => {
                let settings = Settings { seed: render.seed, ..render.settings.resolve(scene, camera, entry.size) };
                let content = format!("{settings:?} {:?}", render.limits());
                let key = Fingerprint::default().with(scene_key.as_bytes()).with(content.as_bytes()).text();
                let name = format!("{}-{}.exr", file_name(&entry.name), &key[..12]);
                Ok(Self { file: folder.join(name), key, render: Some(((**render).clone(), settings)) })
            }
        }
    }

    /// Reads it and checks that pictures of this size can be compared with it.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Scene`] if it cannot be read, has another size, or nothing to see.
    pub fn read(&self, entry: &SceneEntry) -> Result<Picture> {
        let (picture, _) = exr::read(&self.file)?;
        let wrong =
            |what: String| Err(Error::scene(&self.file, format!("as the reference of '{}': {what}", entry.name)));
        if (picture.width, picture.height) != (entry.size.width, entry.size.height) {
            return wrong(format!("{}x{} pixels, not {}", picture.width, picture.height, entry.size));
        }
        let Some(beauty) = picture.beauty() else { return wrong("no colour (R, G, B)".into()) };
        let sum: f64 = beauty.data.iter().map(|x| f64::from(*x)).sum();
        match sum.is_finite() && sum > 0.0 {
            true => Ok(picture),
            false => wrong("black, or a number that is not finite".into()),
        }
    }

    /// Renders it, if it is ours and not there yet. `proceed` is told passes and seconds and says whether to go on.
    ///
    /// # Errors
    /// Those of the device and of writing the file, [`Error::Interrupted`] if `proceed` says no.
    pub fn make(&self, runtime: &Runtime, scene: &Scene, mut proceed: impl FnMut(u64, f64) -> bool) -> Result<()> {
        let Some((render, settings)) = self.render.as_ref().filter(|_| !self.file.is_file()) else { return Ok(()) };
        let output = Output::check(&self.file)?;
        let mut meter = Meter::new(runtime, scene, settings)?;
        let (passes, seconds) = render.limits();
        let done = |meter: &Meter| {
            passes.is_some_and(|n| meter.passes() >= n) || seconds.is_some_and(|limit| meter.seconds() >= limit)
        };
        while !done(&meter) {
            if !proceed(meter.passes(), meter.seconds()) {
                return Err(Error::Interrupted);
            }
            meter.pass()?;
        }
        runtime.device().check_validation()?;
        let info = RenderInfo {
            passes: meter.passes(),
            seed: settings.seed.into(),
            seconds: meter.seconds(),
            device: runtime.device().info().name.clone(),
            scene: scene.path.display().to_string(),
        };
        output.write(&meter.picture()?, &info.metadata(), ToneMap::default())
    }
}

/// A name as a part of a file's name.
pub fn file_name(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || "._=-".contains(c) { c } else { '_' }).collect()
}
