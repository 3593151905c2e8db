//! Counts for `nephroid info`.

use std::fmt;
use std::mem::size_of_val;

use super::{Light, Scene, World};

/// How much of what a scene holds, and its bytes on the host.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Summary {
    /// Meshes, which instances share.
    pub meshes: u64,
    /// Instances of meshes.
    pub instances: u64,
    /// Triangles after instancing.
    pub triangles: u64,
    /// Vertices after instancing.
    pub vertices: u64,
    /// Triangles whose material emits.
    pub emissive_triangles: u64,
    /// Materials in use.
    pub materials: u64,
    /// Image and sampler pairs.
    pub textures: u64,
    /// Decoded images.
    pub images: u64,
    /// Point, spot and directional lights.
    pub punctual_lights: [u64; 3],
    /// Cameras.
    pub cameras: u64,
    /// Width and height of the environment map.
    pub environment: Option<[u32; 2]>,
    /// Bytes of vertex attributes, indices and material indices, after instancing.
    pub geometry_bytes: u64,
    /// Bytes of decoded images.
    pub image_bytes: u64,
    /// Bytes of the environment map.
    pub environment_bytes: u64,
}

impl Summary {
    /// Counts a scene.
    pub fn of(scene: &Scene) -> Self {
        let g = &World::of(scene);
        let emits = |m: &&u32| scene.materials[**m as usize].emissive != [0.0; 3];
        let lights = |kind: fn(&&Light) -> bool| scene.lights.iter().filter(kind).count() as u64;
        let geometry_bytes = [
            size_of_val(g.positions.as_slice()),
            size_of_val(g.normals.as_slice()),
            size_of_val(g.tangents.as_slice()),
            size_of_val(g.uvs[0].as_slice()),
            size_of_val(g.uvs[1].as_slice()),
            size_of_val(g.colors.as_slice()),
            size_of_val(g.triangles.as_slice()),
            size_of_val(g.material.as_slice()),
        ];
        Self {
            meshes: scene.meshes.len() as u64,
            instances: scene.instances.len() as u64,
            triangles: g.triangles.len() as u64,
            vertices: g.positions.len() as u64,
            emissive_triangles: g.material.iter().filter(emits).count() as u64,
            materials: scene.materials.len() as u64,
            textures: scene.textures.len() as u64,
            images: scene.images.len() as u64,
            punctual_lights: [
                lights(|l| matches!(l, Light::Point { .. })),
                lights(|l| matches!(l, Light::Spot { .. })),
                lights(|l| matches!(l, Light::Directional { .. })),
            ],
            cameras: scene.cameras.len() as u64,
            environment: scene.environment.as_ref().map(|e| [e.width, e.height]),
            geometry_bytes: geometry_bytes.iter().sum::<usize>() as u64,
            image_bytes: scene.images.iter().map(|i| size_of_val(i.rgba.as_slice()) as u64).sum(),
            environment_bytes: scene.environment.as_ref().map_or(0, |e| size_of_val(e.radiance.as_slice()) as u64),
        }
    }

    /// Bytes of everything counted.
    pub fn bytes(&self) -> u64 {
        self.geometry_bytes + self.image_bytes + self.environment_bytes
    }
}

impl fmt::Display for Summary {
    /// One line per kind, without a trailing newline.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [point, spot, directional] = self.punctual_lights;
        writeln!(
            f,
            "geometry: {} triangles, {} vertices, {} bytes",
            self.triangles, self.vertices, self.geometry_bytes
        )?;
        writeln!(f, "materials: {}", self.materials)?;
        writeln!(f, "textures: {} of {} images, {} bytes", self.textures, self.images, self.image_bytes)?;
        let emissive = self.emissive_triangles;
        write!(f, "lights: {point} point, {spot} spot, {directional} directional, {emissive} emissive triangles")?;
        match self.environment {
            Some([w, h]) => writeln!(f, ", environment {w} x {h}, {} bytes", self.environment_bytes)?,
            None => writeln!(f, ", no environment")?,
        }
        write!(f, "cameras: {}", self.cameras)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::shapes::Mesh;
    use crate::scene::{Environment, Material};

    #[test]
    fn counts_and_bytes() {
        let quad = Mesh::quad([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        let mut scene = Scene::default();
        scene.add(&quad, Material::lambert([0.5; 3]));
        scene.add(&quad, Material::emitter([1.0; 3]));
        scene.lights.push(Light::Point { position: [0.0; 3], intensity: [1.0; 3] });
        scene.environment = Some(Environment::constant([1.0; 3]));
        let summary = Summary::of(&scene);
        assert_eq!((summary.triangles, summary.vertices, summary.emissive_triangles), (4, 8, 2));
        assert_eq!(summary.punctual_lights, [1, 0, 0]);
        assert_eq!(summary.geometry_bytes, 8 * 24 + 4 * 16);
        assert_eq!(summary.bytes(), 256 + 24);
        let text = summary.to_string();
        assert!(text.starts_with("geometry: 4 triangles, 8 vertices, 256 bytes\n") && text.ends_with("cameras: 0"));
        assert!(text.contains("2 emissive triangles, environment 2 x 1, 24 bytes"));
    }
}
