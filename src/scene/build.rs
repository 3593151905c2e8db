//! Scenes built by hand: parts are added one by one, and each gets its id.

use super::{Camera, CameraId, Instance, InstanceId, Light, LightId, Material, MaterialId, Mesh, MeshId, Scene};

impl Scene {
    /// A scene of meshes in world space with their materials, lights and one camera.
    pub fn from_parts(parts: Vec<(Mesh, Material)>, lights: Vec<Light>, camera: Camera) -> Self {
        let mut scene = Self { lights, cameras: vec![camera], ..Self::default() };
        for (mesh, material) in parts {
            scene.add(&mesh, material);
        }
        scene
    }

    /// Adds a mesh in world space, its material (shared with an equal one already there) and an instance of it.
    pub fn add(&mut self, mesh: &Mesh, material: Material) -> InstanceId {
        let known = self.materials.iter().position(|m| *m == material).map(MaterialId::at);
        let material = known.unwrap_or_else(|| self.add_material(material));
        let mesh = self.add_mesh(Mesh { material, ..mesh.clone() });
        self.add_instance(Instance::of(mesh))
    }

    /// Adds a mesh. It is not seen until an instance places it; [`Mesh::material`] may be added before or after it.
    pub fn add_mesh(&mut self, mesh: Mesh) -> MeshId {
        push(&mut self.meshes, mesh, MeshId::at)
    }

    /// Adds an instance of a mesh.
    pub fn add_instance(&mut self, instance: Instance) -> InstanceId {
        push(&mut self.instances, instance, InstanceId::at)
    }

    /// Adds a material.
    pub fn add_material(&mut self, material: Material) -> MaterialId {
        push(&mut self.materials, material, MaterialId::at)
    }

    /// Adds a light.
    pub fn add_light(&mut self, light: Light) -> LightId {
        push(&mut self.lights, light, LightId::at)
    }

    /// Adds a camera.
    pub fn add_camera(&mut self, camera: Camera) -> CameraId {
        push(&mut self.cameras, camera, CameraId::at)
    }
}

fn push<T, Id>(list: &mut Vec<T>, part: T, id: impl Fn(usize) -> Id) -> Id {
    list.push(part);
    id(list.len() - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{TextureRef, World};

    #[test]
    fn scenes_share_materials_and_keep_attributes_aligned() {
        let quad = Mesh::quad([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        let textured = Material {
            base_color_texture: Some(TextureRef {
                texture: 0,
                uv_set: 0,
                transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            }),
            ..Material::default()
        };
        let parts =
            vec![(quad.clone(), Material::mirror()), (quad.clone(), textured), (quad.clone(), Material::mirror())];
        let camera = Camera::look_at([0.0, 0.0, 5.0], [0.0; 3], [0.0, 1.0, 0.0], 0.7);
        let scene = Scene::from_parts(parts, Vec::new(), camera);
        let world = World::of(&scene);
        assert_eq!(scene.materials.len(), 2);
        assert_eq!(world.material, [0, 0, 1, 1, 0, 0]);
        assert_eq!(world.uvs[0].len(), 12);
        assert_eq!(world.uvs[0][3], [1.0, 1.0]);
        assert_eq!(world.uvs[0][7], [1.0, 1.0]);
        assert_eq!(world.triangles[5], [8, 11, 10]);
        assert_eq!(scene.cameras[0].right, [1.0, 0.0, 0.0]);
        assert_eq!(scene.cameras[0].up, [0.0, 1.0, 0.0]);
    }
}
