//! Scenes that move: a pose as changes, and passes at moments of the shutter.

use std::sync::Arc;

use super::Session;
use super::Updated;
use super::changes::{Change, Changes, Effect};
use crate::error::{Error, Result};
use crate::render::settings::{Settings, Shutter};
use crate::scene::{Pose, Scene, Vertices};

impl From<Pose> for Changes {
    /// The changes that bring a render of the scene into this pose.
    fn from(pose: Pose) -> Self {
        let Pose { transforms, visible, vertices, lights, cameras, materials } = pose;
        let mut changes = Vec::new();
        changes.extend(transforms.into_iter().map(|(id, transform)| Change::Transform(id, Some(transform))));
        changes.extend(visible.into_iter().map(|(id, visible)| Change::Visible(id, visible)));
        for (id, Vertices { positions, normals, tangents }) in vertices {
            if !tangents.is_empty() {
                changes.push(Change::Tangents(id, tangents));
            }
            changes.push(Change::Vertices(id, positions, normals));
        }
        changes.extend(lights.into_iter().map(|(id, light)| Change::Light(id, light)));
        changes.extend(cameras.into_iter().map(|(id, camera)| Change::Camera(id, camera)));
        changes.extend(materials.into_iter().map(|(id, material)| Change::Material(id, Box::new(material))));
        Self(changes)
    }
}

/// Whether passes of the scene differ in what they show.
pub(super) fn is_blurred(scene: &Scene, settings: &Settings) -> bool {
    settings.shutter.is_some() && scene.motion.as_ref().is_some_and(|motion| !motion.is_still())
}

/// Brings a scene to where it is when the shutter opens.
pub(super) fn open(scene: &mut Scene, settings: &Settings) {
    if let Some(shutter) = settings.shutter.filter(|shutter| shutter.is_valid()) {
        scene.move_to(shutter.open);
    }
}

impl Session {
    /// The scene as it is at a time of its motion, as changes from how it is now: for [`Session::update`].
    pub fn changes_to(&self, time: f64) -> Changes {
        let motion = self.scene.motion.as_ref();
        motion.map_or_else(Changes::new, |motion| motion.pose(time, &self.scene).into())
    }

    /// Shows the scene as it is at a time of its motion, or with a shutter at moments from then on (`time` is then when
    /// it opens). Passes that follow are, to the bit, those of a new session of the scene at that time with this
    /// shutter; the film starts again, unless nothing is seen to differ.
    ///
    /// # Errors
    /// Those of [`Session::update`].
    pub fn show(&mut self, time: f64, shutter: Option<Shutter>) -> Result<Updated> {
        let to = |session: &Self| session.changes_to(time).with(Change::Shutter(shutter));
        let theirs = self.other.as_ref().map(|other| to(&other.session));
        self.update_each(to(self), theirs)
    }

    /// Changes of the scene as it is when the shutter opens, whatever the last pass has shown.
    pub(super) fn since_opening(&self, changes: Changes) -> Changes {
        match self.settings.shutter.filter(|_| is_blurred(&self.scene, &self.settings)) {
            Some(shutter) => Changes([self.changes_to(shutter.open).0, changes.0].concat()),
            None => changes,
        }
    }

    /// Brings the scene to the moment of a pass. The film goes on, in its own units whatever the lights are now.
    pub(super) fn follow_motion(&mut self, index: u64) -> Result<()> {
        let Some(shutter) = self.settings.shutter.filter(|_| is_blurred(&self.scene, &self.settings)) else {
            return Ok(());
        };
        let changes = self.changes_to(shutter.moment(index, self.settings.seed));
        let mut effect = Effect::default();
        for mut change in changes.0 {
            if let Some(fault) = change.fault(&self.scene) {
                return Err(Error::Usage(format!("pass {index}: {fault}")));
            }
            change.exchange(Arc::make_mut(&mut self.scene), &mut self.settings);
            effect = effect.and(change.stale(&self.scene, &self.settings));
        }
        if effect != Effect::default() {
            // The picture is that of all moments, and what was chosen for it stays.
            self.redo(Effect { film: false, leaf: false, ..effect }, Some(self.device_scene.exponents))?;
        }
        Ok(())
    }
}
