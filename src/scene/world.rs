//! A scene as rays meet it: the triangles of all visible instances in world space.

use std::ops::Range;

use super::flatten::{self, Flat, Placement, Tangents};
use super::frame::Bounds;
use super::{Instance, InstanceId, Mesh, Scene, Skipped};

/// Triangles with their vertex attributes in world space, instance by instance.
///
/// A triangle has two names: its instance with its place in the mesh, which no change of the scene alters, and its
/// place in [`World::triangles`]. [`World::triangle`] and [`World::origin`] translate. Places shift only where an
/// instance before it is shown or hidden, or loses or gains triangles without area.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct World {
    /// Vertex positions.
    pub positions: Vec<[f32; 3]>,
    /// Unit shading normals, one per vertex.
    pub normals: Vec<[f32; 3]>,
    /// Tangents with handedness in w, one per vertex; empty when no material has a normal texture.
    pub tangents: Vec<[f32; 4]>,
    /// Texture coordinate sets 0 and 1, one per vertex; empty when no texture uses the set.
    pub uvs: [Vec<[f32; 2]>; 2],
    /// Linear vertex colours (RGBA); empty when no mesh has them.
    pub colors: Vec<[f32; 4]>,
    /// Vertex indices; counter-clockwise seen from the front (mirrored instances are already turned).
    pub triangles: Vec<[u32; 3]>,
    /// Material index of each triangle.
    pub material: Vec<u32>,
    /// What each instance of the scene has of it, in their order.
    pub parts: Vec<Part>,
    /// Triangles that were left out, by what they lack.
    pub skipped: Skipped,
    /// Whether normals without a direction were replaced by those of triangles.
    pub replaced_normals: bool,
}

/// The part of a [`World`] that one instance has.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Part {
    /// Its triangles; none where it is not visible.
    pub triangles: Range<u32>,
    /// Its vertices.
    pub vertices: Range<u32>,
    /// For each of its triangles the one of the mesh, where some of them were left out.
    kept: Option<Vec<u32>>,
    skipped: Skipped,
    replaced_normals: bool,
}

/// Optional attributes that every vertex of the world has.
pub(super) struct Needed {
    pub uvs: [bool; 2],
    pub tangents: bool,
    pub colors: bool,
}

impl Needed {
    /// What any material or mesh asks for, whether it is visible or not: the layout of the world does not depend on
    /// that.
    pub fn of(scene: &Scene) -> Self {
        let refs = || scene.materials.iter().flat_map(|m| m.texture_refs());
        Self {
            uvs: [0, 1].map(|set| refs().any(|r| r.uv_set == set)),
            tangents: scene.materials.iter().any(|m| m.normal_texture.is_some()),
            colors: scene.meshes.iter().any(|mesh| !mesh.colors.is_empty()),
        }
    }
}

impl World {
    /// Every visible instance of `scene`, in order.
    ///
    /// # Panics
    /// If the scene names something that it does not have, which [`Scene::validate`] finds.
    pub fn of(scene: &Scene) -> Self {
        let needed = Needed::of(scene);
        let mut world = Self::default();
        for instance in &scene.instances {
            let mesh = &scene.meshes[instance.mesh.index()];
            let flat = flattened(scene, instance, &needed);
            world.append(mesh, flat, &needed);
        }
        world.count();
        world
    }

    /// Flattens one instance of the scene again, whose transform or vertices have changed since. False if it has other
    /// numbers of triangles or vertices now: then nothing is done, and the world has to be made anew.
    ///
    /// # Panics
    /// If `instance` is not in the scene, or the scene has other instances, meshes or materials than when the world was
    /// made.
    pub fn replace(&mut self, scene: &Scene, instance: InstanceId) -> bool {
        let needed = Needed::of(scene);
        let placed = &scene.instances[instance.index()];
        let flat = flattened(scene, placed, &needed);
        let part = &self.parts[instance.index()];
        if flat.vertices.triangles.len() != part.triangles.len() || flat.vertices.positions.len() != part.vertices.len()
        {
            return false;
        }
        let mut alone = Self::default();
        alone.append(&scene.meshes[placed.mesh.index()], flat, &needed);
        let (first, vertices) = (part.vertices.start, index_range(&part.vertices));
        let triangles = index_range(&part.triangles);
        self.positions[vertices.clone()].copy_from_slice(&alone.positions);
        self.normals[vertices.clone()].copy_from_slice(&alone.normals);
        for (all, own) in self.uvs.iter_mut().zip(&alone.uvs).filter(|(_, own)| !own.is_empty()) {
            all[vertices.clone()].copy_from_slice(own);
        }
        if needed.colors {
            self.colors[vertices.clone()].copy_from_slice(&alone.colors);
        }
        if needed.tangents {
            self.tangents[vertices].copy_from_slice(&alone.tangents);
        }
        for (all, own) in self.triangles[triangles].iter_mut().zip(&alone.triangles) {
            *all = own.map(|i| first + i);
        }
        let Part { kept, skipped, replaced_normals, .. } = alone.parts.remove(0);
        let part = &mut self.parts[instance.index()];
        (part.kept, part.skipped, part.replaced_normals) = (kept, skipped, replaced_normals);
        self.count();
        true
    }

    /// Sums of the parts.
    fn count(&mut self) {
        self.skipped = Skipped::default();
        self.parts.iter().for_each(|part| self.skipped.add(part.skipped));
        self.replaced_normals = self.parts.iter().any(|part| part.replaced_normals);
    }

    /// The triangle `triangle` of an instance's mesh; `None` if it is not visible or was left out.
    pub fn triangle(&self, instance: InstanceId, triangle: u32) -> Option<u32> {
        let part = self.parts.get(instance.index())?;
        let place = match &part.kept {
            Some(kept) => kept.binary_search(&triangle).ok()? as u32,
            None => triangle,
        };
        let id = part.triangles.start.checked_add(place)?;
        part.triangles.contains(&id).then_some(id)
    }

    /// The instance of a triangle of the world and the triangle of its mesh.
    pub fn origin(&self, triangle: u32) -> Option<(InstanceId, u32)> {
        let index = self.parts.partition_point(|part| part.triangles.end <= triangle);
        let part = self.parts.get(index)?;
        let place = triangle - part.triangles.start;
        Some((InstanceId::at(index), part.kept.as_ref().map_or(place, |kept| kept[place as usize])))
    }

    /// Bounds of all triangles, `None` if there are none.
    pub fn bounds(&self) -> Option<Bounds> {
        Bounds::around(self.triangles.iter().flatten().map(|&i| self.positions[i as usize]))
    }

    /// Corners of a triangle.
    pub fn corners(&self, triangle: u32) -> [[f32; 3]; 3] {
        self.triangles[triangle as usize].map(|corner| self.positions[corner as usize])
    }

    /// Area of a triangle in square scene units.
    pub fn area(&self, triangle: u32) -> f64 {
        let [a, b, c] = self.corners(triangle).map(|p| glam::DVec3::from(p.map(f64::from)));
        0.5 * (b - a).cross(c - a).length()
    }

    fn append(&mut self, mesh: &Mesh, flat: Flat, needed: &Needed) {
        let Flat { vertices, tangents, kept, skipped, replaced_normals } = flat;
        let (first, first_triangle) = (self.positions.len() as u32, self.triangles.len() as u32);
        for (set, uvs) in mesh.uvs.iter().enumerate().filter(|(set, _)| needed.uvs[*set]) {
            let uv = |&v: &u32| uvs.get(v as usize).copied().unwrap_or_default();
            self.uvs[set].extend(vertices.source.iter().map(uv));
        }
        if needed.colors {
            let color = |&v: &u32| mesh.colors.get(v as usize).copied().unwrap_or([1.0; 4]);
            self.colors.extend(vertices.source.iter().map(color));
        }
        self.tangents.extend(tangents);
        self.positions.extend(vertices.positions);
        self.normals.extend(vertices.normals);
        self.triangles.extend(vertices.triangles.iter().map(|t| t.map(|i| first + i)));
        self.material.resize(self.triangles.len(), mesh.material.0);
        let triangles = first_triangle..self.triangles.len() as u32;
        let vertices = first..self.positions.len() as u32;
        self.parts.push(Part { triangles, vertices, kept, skipped, replaced_normals });
    }
}

fn index_range(range: &Range<u32>) -> Range<usize> {
    range.start as usize..range.end as usize
}

impl Scene {
    /// Triangles of all visible instances, those included that a world leaves out.
    pub fn triangle_count(&self) -> u64 {
        let visible = self.instances.iter().filter(|instance| instance.visible);
        visible.map(|instance| self.meshes[instance.mesh.index()].triangles.len() as u64).sum()
    }

    /// Triangles that a world leaves out.
    pub(crate) fn skipped_triangles(&self) -> u64 {
        let skipped = survey(self).skipped;
        skipped.degenerate_triangles + skipped.non_finite_triangles
    }
}

/// What is known of a world without making it.
#[derive(Debug, Default)]
pub(super) struct Survey {
    pub skipped: Skipped,
    pub replaced_normals: bool,
    /// Area of all triangles, in square scene units.
    pub area: f64,
    /// The same, each triangle times the largest component of what its material emits.
    pub emitted: f64,
}

/// Looks at each instance of a scene as it is in the world, one after the other.
pub(super) fn survey(scene: &Scene) -> Survey {
    // Tangents and texture coordinates make no difference here.
    let needed = Needed { uvs: [false; 2], tangents: false, colors: false };
    let mut survey = Survey::default();
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh.index()];
        let mut alone = World::default();
        alone.append(mesh, flattened(scene, instance, &needed), &needed);
        alone.count();
        survey.skipped.add(alone.skipped);
        survey.replaced_normals |= alone.replaced_normals;
        let area: f64 = (0..alone.triangles.len() as u32).map(|triangle| alone.area(triangle)).sum();
        survey.area += area;
        let emissive = scene.materials[mesh.material.index()].emissive;
        survey.emitted += area * f64::from(emissive.into_iter().fold(0.0, f32::max));
    }
    survey
}

/// An instance in the world; nothing where it is not visible.
fn flattened(scene: &Scene, instance: &Instance, needed: &Needed) -> Flat {
    if !instance.visible {
        return Flat::default();
    }
    let mesh = &scene.meshes[instance.mesh.index()];
    let placement = instance.transform.map_or(Placement::World, |transform| Placement::Rigid(transform.matrix()));
    let tangents = Tangents(scene.materials[mesh.material.index()].normal_texture);
    flatten::place(mesh, &placement, needed.tangents.then_some(&tangents))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, MaterialId, Transform};

    fn square() -> Mesh {
        Mesh::quad([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    }

    /// A square, the same square with a triangle without area before its others, at another place, and a third one.
    fn scene() -> Scene {
        let mut scene = Scene::default();
        scene.add_material(Material::lambert([0.5; 3]));
        let mut damaged = square();
        damaged.triangles.insert(0, [0, 0, 1]);
        for (mesh, x) in [(square(), 0.0), (damaged, 5.0), (square(), 9.0)] {
            let mesh = scene.add_mesh(mesh);
            scene.add_instance(Instance::of(mesh).at(Transform::translation([x, 0.0, 0.0])));
        }
        scene
    }

    #[test]
    fn triangles_have_two_names() {
        let world = World::of(&scene());
        assert_eq!((world.triangles.len(), world.skipped.degenerate_triangles), (6, 1));
        let names: Vec<_> = (0..7).map(|id| world.origin(id).map(|(instance, t)| (instance.0, t))).collect();
        let expected = [(0, 0), (0, 1), (1, 1), (1, 2), (2, 0), (2, 1)];
        assert_eq!(names[..6], expected.map(Some));
        assert_eq!(names[6], None);
        for (id, (instance, triangle)) in (0..).zip(expected) {
            assert_eq!(world.triangle(InstanceId(instance), triangle), Some(id));
        }
        assert_eq!(world.triangle(InstanceId(1), 0), None, "it was left out");
        assert_eq!(world.triangle(InstanceId(0), 2), None);
        assert_eq!(world.triangle(InstanceId(0), u32::MAX), None);
        assert_eq!(world.triangle(InstanceId(3), 0), None);
    }

    #[test]
    fn instances_are_replaced_in_place() {
        let mut scene = scene();
        let mut world = World::of(&scene);
        scene.instances[1].transform = Some(Transform::scaling([-1.0, 2.0, 1.0]));
        scene.meshes[2].positions[1] = [1.5, 0.0, 0.5];
        assert!(world.replace(&scene, InstanceId(1)) && world.replace(&scene, InstanceId(2)));
        assert_eq!(world, World::of(&scene));
        // One triangle less, and one vertex less.
        let before = world.clone();
        scene.meshes[0].positions[2] = [0.0; 3];
        assert!(!world.replace(&scene, InstanceId(0)) && world == before);
        scene.instances[2].visible = false;
        assert!(!world.replace(&scene, InstanceId(2)) && world == before);
    }

    #[test]
    fn what_is_hidden_is_not_there() {
        let mut scene = scene();
        scene.instances[1].visible = false;
        let world = World::of(&scene);
        assert_eq!(world.parts[1].triangles, 2..2);
        assert_eq!(world.origin(2), Some((InstanceId(2), 0)));
        assert_eq!(world.triangle(InstanceId(1), 1), None);
        assert_eq!((world.triangles.len(), world.skipped), (4, Skipped::default()));
    }

    #[test]
    fn a_mesh_in_world_space_stays_as_it_is() {
        let mut scene = Scene::default();
        scene.add_material(Material::lambert([0.5; 3]));
        let mut odd = square();
        odd.normals = vec![[0.0, 0.0, 2.0]; 4];
        // The first triangle alone has this corner.
        odd.positions[1] = [-0.0, f32::NAN, 1e-30];
        let mesh = scene.add_mesh(odd.clone());
        scene.add_instance(Instance::of(mesh));
        let world = World::of(&scene);
        let bits = |list: &[[f32; 3]]| list.iter().flatten().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!((bits(&world.positions), &world.normals), (bits(&odd.positions), &odd.normals));
        assert_eq!((&world.triangles, &world.material), (&odd.triangles, &vec![MaterialId(0).0; 2]));
        scene.instances[0].transform = Some(Transform::IDENTITY);
        let moved = World::of(&scene);
        assert_eq!(moved.normals, [[0.0, 0.0, 1.0]; 4]);
        assert_eq!((moved.triangles.len(), moved.skipped.non_finite_triangles), (1, 1));
    }
}
