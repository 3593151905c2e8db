//! What a scene lacks is added: a camera that frames it, a sky that lights it.

use glam::Vec3;

use super::world::Survey;
use super::{Camera, Environment, Material, Projection, Scene, World};

/// Axis-aligned bounds in scene units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates.
    pub min: [f32; 3],
    /// Largest coordinates.
    pub max: [f32; 3],
}

impl Bounds {
    /// Bounds of points, `None` if there are none.
    pub fn around(mut points: impl Iterator<Item = [f32; 3]>) -> Option<Self> {
        let first = points.next()?;
        Some(points.fold(Self { min: first, max: first }, |b, p| Self {
            min: std::array::from_fn(|k| b.min[k].min(p[k])),
            max: std::array::from_fn(|k| b.max[k].max(p[k])),
        }))
    }

    /// The middle of the box.
    pub fn center(&self) -> [f32; 3] {
        // Halved before adding: the sum of two large coordinates may overflow.
        std::array::from_fn(|k| 0.5 * self.min[k] + 0.5 * self.max[k])
    }

    /// Radius of the sphere around [`Bounds::center`] that contains the box.
    pub fn radius(&self) -> f32 {
        let half: [f64; 3] = std::array::from_fn(|k| 0.5 * (f64::from(self.max[k]) - f64::from(self.min[k])));
        half.iter().map(|x| x * x).sum::<f64>().sqrt() as f32
    }
}

/// Vertical field of view of the framing camera, in radians.
const FRAMING_FOV: f32 = 0.7;
/// From the scene to the framing camera: a three-quarter view from the right, a little above.
const FRAMING_VIEW: Vec3 = Vec3::new(0.6, 0.45, 1.0);

/// How a warning ends where an environment map would help.
pub(crate) const MAP_HELPS: &str = "an environment map would light it";

impl Scene {
    /// Bounds of all visible triangles, `None` if there are none. Flattens the scene: who has its [`World`] asks that.
    pub fn bounds(&self) -> Option<Bounds> {
        World::of(self).bounds()
    }

    /// For each material whether a triangle of a visible instance has it.
    pub fn used_materials(&self) -> Vec<bool> {
        let mut used = vec![false; self.materials.len()];
        let visible = self.instances.iter().filter(|instance| instance.visible);
        for mesh in visible.map(|instance| &self.meshes[instance.mesh.index()]).filter(|m| !m.triangles.is_empty()) {
            used[mesh.material.index()] = true;
        }
        used
    }

    /// True if anything emits: a punctual light, an environment that is not black, or a triangle whose material does.
    pub fn has_light(&self) -> bool {
        let used = self.used_materials();
        let emits = |(m, used): (&Material, bool)| used && m.emissive != [0.0; 3];
        let shines = |e: &Environment| e.radiance.iter().any(|t| *t != [0.0; 3]);
        !self.lights.is_empty()
            || self.motion.as_ref().is_some_and(|motion| motion.may_shine())
            || self.environment.as_ref().is_some_and(shines)
            || self.materials.iter().zip(used).any(emits)
    }

    /// Gives a scene without any light the default sky, with a warning. An environment that was chosen stays, even
    /// if it is black.
    pub fn ensure_light(&mut self) {
        if self.environment.is_none() && !self.has_light() {
            self.environment = Some(Environment::default_sky());
            self.warnings.push("the scene has no light: a default sky lights it".into());
        }
    }

    /// Tells of a scene that only emissive surfaces light, and next to nothing: labels and lamps of instruments are no
    /// lights. `survey` is the scene's.
    pub(super) fn dim_light(&self, survey: &Survey) -> Option<String> {
        /// Radiance of white surfaces that is seen as black.
        const BLACK: f64 = 0.005;
        if self.environment.is_some() || !self.lights.is_empty() || !self.has_light() {
            return None;
        }
        // The radiance of a white surface that all light falls on evenly.
        let typical = survey.emitted / survey.area;
        (typical < BLACK).then(|| {
            format!("only what surfaces emit lights the scene, and white is about {typical:.1e} there: {MAP_HELPS}")
        })
    }

    /// Gives a scene without a camera one that frames it, with a warning.
    pub fn ensure_camera(&mut self) {
        if self.cameras.is_empty() {
            self.cameras.push(self.framing_camera());
            self.warnings.push("the scene has no camera: a three-quarter view frames it".into());
        }
    }

    /// A camera whose image, of any shape, contains the bounding sphere of the triangles.
    pub fn framing_camera(&self) -> Camera {
        let (center, radius) = self.bounds().map_or(([0.0; 3], 1.0), |b| (b.center(), b.radius()));
        let distance = 1.02 * radius.max(f32::MIN_POSITIVE) / (0.5 * FRAMING_FOV).sin();
        let position = Vec3::from(center) + FRAMING_VIEW.normalize() * distance;
        let mut camera = Camera::look_at([0.0; 3], (-FRAMING_VIEW).into(), [0.0, 1.0, 0.0], FRAMING_FOV);
        camera.position = position.into();
        camera.projection = Projection::Perspective { yfov: FRAMING_FOV, aspect: Some(1.0) };
        camera.name = "framing".into();
        camera
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Light;
    use crate::scene::shapes::Mesh;
    use crate::scene::world::survey;

    fn boxed(scale: f32) -> Scene {
        let mut scene = Scene::default();
        let corner = |x: f32| [x * scale, 2.0 * x * scale, 3.0 * x * scale];
        scene.add(&Mesh::cuboid(corner(-1.0), corner(1.0)), Material::lambert([0.5; 3]));
        scene
    }

    #[test]
    fn the_framing_camera_sees_every_vertex() {
        for scale in [1e-6, 1.0, 1e6] {
            let scene = boxed(scale);
            let camera = scene.framing_camera();
            let tan = (0.5 * FRAMING_FOV).tan();
            for p in &World::of(&scene).positions {
                let d = Vec3::from(*p) - Vec3::from(camera.position);
                let depth = d.dot(camera.forward.into());
                assert!(depth > 0.0);
                assert!(d.dot(camera.up.into()).abs() < tan * depth && d.dot(camera.right.into()).abs() < tan * depth);
            }
        }
    }

    #[test]
    fn an_empty_scene_gets_a_finite_camera() {
        let mut scene = Scene::default();
        assert!(scene.bounds().is_none());
        scene.ensure_camera();
        assert!(scene.cameras[0].position.iter().all(|x| x.is_finite()) && scene.warnings.len() == 1);
    }

    #[test]
    fn scenes_that_labels_light_are_told_of() {
        let told = |scene: &Scene| scene.dim_light(&survey(scene));
        let mut scene = boxed(1.0);
        assert_eq!(told(&scene), None, "a sky will light it");
        let label = Mesh::quad([0.0; 3], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]);
        scene.add(&label, Material::emitter([0.5; 3]));
        assert!(told(&scene).is_some_and(|text| text.ends_with(MAP_HELPS)));
        let mut lit = scene.clone();
        lit.environment = Some(Environment::default_sky());
        assert_eq!(told(&lit), None);
        scene.add(&label, Material::emitter([1e4; 3]));
        assert_eq!(told(&scene), None, "a small lamp that is bright");
    }

    #[test]
    fn only_dark_scenes_get_the_sky() {
        let mut dark = boxed(1.0);
        dark.ensure_light();
        assert!(dark.environment.is_some() && dark.warnings.len() == 1);
        let mut lamp = boxed(1.0);
        lamp.lights.push(Light::Point { position: [0.0; 3], intensity: [1.0; 3] });
        let mut emitter = boxed(1.0);
        emitter.add(&Mesh::cuboid([9.0; 3], [10.0; 3]), Material::emitter([1.0; 3]));
        for scene in [&mut lamp, &mut emitter] {
            scene.ensure_light();
            assert!(scene.environment.is_none() && scene.warnings.is_empty());
        }
        // A material that no triangle uses is no light; a black environment was chosen.
        let mut unused = boxed(1.0);
        unused.materials.push(Material::emitter([1.0; 3]));
        assert!(!unused.has_light());
        unused.environment = Some(Environment::constant([0.0; 3]));
        unused.ensure_light();
        assert_eq!(unused.environment, Some(Environment::constant([0.0; 3])));
    }
}
