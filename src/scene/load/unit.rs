//! Scenes that are too large, too small or too far from the origin for single precision: they are read again in another
//! unit, about their centre. Squares and ratios of lengths are then far from overflow, and rounding is that of a scene
//! at the origin.

use glam::{DMat4, DVec3};

use super::notes::Outcome;
use crate::scene::frame::Bounds;
use crate::scene::{Light, Projection, Scene};

/// Scenes with a radius from one over this up to this are read in their own unit.
const LARGEST: f64 = (1u64 << 40) as f64;
/// Scenes whose centre is nearer to the origin than this many of their radii are read where they are.
const FARTHEST: f64 = 16.0;

/// Where a scene is read about, and in which unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unit {
    center: DVec3,
    radius: f64,
    /// New units in a unit of the file, a power of two.
    scale: f64,
}

impl Unit {
    /// What the triangles of a scene ask for, if they do.
    pub fn needed(scene: &Scene) -> Option<Self> {
        let (low, high) = bounds(scene)?;
        let (center, radius) = (0.5 * low + 0.5 * high, (0.5 * high - 0.5 * low).length());
        if !(radius > 0.0 && radius.is_finite()) {
            return None;
        }
        let far = center.abs().max_element() > FARTHEST * radius;
        let odd = !(LARGEST.recip()..=LARGEST).contains(&radius);
        let center = if far { center } else { DVec3::ZERO };
        let scale = if odd { (-radius.log2().round()).exp2() } else { 1.0 };
        (far || odd).then_some(Self { center, radius, scale })
    }

    /// New units in a unit of the file.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// From the unit of the file to the new one.
    pub fn root(&self) -> DMat4 {
        DMat4::from_scale(DVec3::splat(self.scale)) * DMat4::from_translation(-self.center)
    }

    /// Brings what is no place into the new unit: intensities, absorption, image planes. Fails where single precision
    /// has no number for the result.
    pub fn apply(&self, scene: &mut Scene) -> Outcome<()> {
        for light in &mut scene.lights {
            if let Light::Point { intensity, .. } | Light::Spot { intensity, .. } = light {
                for value in intensity {
                    scaled(value, self.scale * self.scale, "the intensity of a lamp")?;
                }
            }
        }
        for camera in &mut scene.cameras {
            if let Projection::Orthographic { xmag, ymag } = &mut camera.projection {
                scaled(xmag, self.scale, "the width of a camera")?;
                scaled(ymag, self.scale, "the height of a camera")?;
            }
        }
        for value in scene.materials.iter_mut().flat_map(|material| &mut material.absorption) {
            scaled(value, self.scale.recip(), "absorption")?;
        }
        Ok(())
    }

    /// What the user should know.
    pub fn note(&self) -> String {
        let Self { center: DVec3 { x, y, z }, radius, scale } = self;
        let far = if self.center == DVec3::ZERO { String::new() } else { format!(" at ({x:.3e}, {y:.3e}, {z:.3e})") };
        let unit = if *scale == 1.0 { "its unit".into() } else { format!("units of {:.3e}", scale.recip()) };
        format!(
            "single precision does not suit a scene of radius {radius:.3e}{far}: it is rendered about its centre in \
             {unit}, which lengths in settings and layers are in"
        )
    }
}

fn scaled(value: &mut f32, factor: f64, what: &str) -> Outcome<()> {
    let result = (f64::from(*value) * factor) as f32;
    if !result.is_finite() || (result == 0.0 && *value != 0.0) {
        return Err(format!("{what} is {value:e}, which single precision cannot hold in a unit that fits the scene"));
    }
    *value = result;
    Ok(())
}

/// A box around the boxes of all instances, in double precision; `None` without any.
fn bounds(scene: &Scene) -> Option<(DVec3, DVec3)> {
    let finite = |p: &&[f32; 3]| p.iter().all(|x| x.is_finite());
    let local = scene.meshes.iter().map(|mesh| Bounds::around(mesh.positions.iter().filter(finite).copied()));
    let local: Vec<Option<Bounds>> = local.collect();
    let corners = scene.instances.iter().filter_map(|instance| {
        let Bounds { min, max } = local[instance.mesh.index()]?;
        let matrix = instance.transform.map_or(DMat4::IDENTITY, |transform| transform.matrix());
        let corner = move |i: usize| {
            let p: [f64; 3] = std::array::from_fn(|k| f64::from(if i >> k & 1 == 0 { min[k] } else { max[k] }));
            matrix.transform_point3(p.into())
        };
        Some((0..8).map(corner))
    });
    corners.flatten().map(|p| (p, p)).reduce(|(low, high), (p, _)| (low.min(p), high.max(p)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::shapes::Mesh;
    use crate::scene::{Camera, Instance, Material, Transform};

    /// A cube of edge 2 with this map, a lamp, and a parallel camera.
    fn scene(map: Transform) -> Scene {
        let mut scene = Scene::default();
        scene.add_material(Material { absorption: [1.0; 3], ..Material::glass(1.5) });
        let mesh = scene.add_mesh(Mesh::cuboid([-1.0; 3], [1.0; 3]));
        scene.add_instance(Instance::of(mesh).at(map));
        scene.lights.push(Light::Point { position: [0.0; 3], intensity: [1.0; 3] });
        let mut camera = Camera::look_at([0.0, 0.0, 9.0], [0.0; 3], [0.0, 1.0, 0.0], 1.0);
        camera.projection = Projection::Orthographic { xmag: 1.0, ymag: 0.5 };
        scene.cameras.push(camera);
        scene
    }

    #[test]
    fn ordinary_scenes_stay_as_they_are() {
        for factor in [1e-11, 1.0, 1e11] {
            assert_eq!(Unit::needed(&scene(Transform::scaling([factor; 3]))), None);
        }
        assert_eq!(Unit::needed(&scene(Transform::translation([20.0, 0.0, 0.0]))), None);
        assert_eq!(Unit::needed(&Scene::default()), None);
    }

    #[test]
    fn places_and_units_are_those_of_the_scene() {
        let far = Unit::needed(&scene(Transform::translation([1e6, 0.0, 0.0]))).expect("far from the origin");
        assert_eq!((far.scale, far.center), (1.0, DVec3::new(1e6, 0.0, 0.0)));
        for factor in [1e-30, 1e20, 1e30] {
            let unit = Unit::needed(&scene(Transform::scaling([factor; 3]))).expect("an odd size");
            assert_eq!(unit.center, DVec3::ZERO);
            let radius = unit.root().transform_vector3(DVec3::splat(factor)).length();
            assert!((0.7..1.5).contains(&radius), "{radius}");
            assert!(unit.note().contains("units of"), "{}", unit.note());
        }
    }

    #[test]
    fn what_depends_on_the_unit_follows() {
        let unit = Unit { center: DVec3::ZERO, radius: 1.0, scale: 0.25 };
        let mut scene = scene(Transform::IDENTITY);
        unit.apply(&mut scene).expect("ordinary numbers");
        assert_eq!(scene.lights[0], Light::Point { position: [0.0; 3], intensity: [0.0625; 3] });
        assert_eq!(scene.cameras[0].projection, Projection::Orthographic { xmag: 0.25, ymag: 0.125 });
        assert_eq!(scene.materials[0].absorption, [4.0; 3]);
        let tiny = Unit { scale: (-100f64).exp2(), ..unit };
        assert!(tiny.apply(&mut scene).is_err_and(|cause| cause.contains("intensity")));
    }
}
