//! Tables of what rough lobes reflect, as far as a scene has such lobes.

use std::collections::{BTreeMap, BTreeSet};

use crate::constants::{LOBE_COSINES, LOBE_ROUGHNESSES};
use crate::kernels::lobes::table;
use crate::kernels::scene_data::Variant;
use crate::scene::needs::SMOOTH_ROUGHNESS;
use crate::scene::{Material, Scene};

/// Indices of rough glass with a table each. Scenes with more share tables between those that are near each other.
const MOST_BOUNDARIES: usize = 16;

/// The tables of a scene.
#[derive(Clone, Default)]
pub struct Lobes {
    /// What the kernels read; empty where nothing reflects other than by Lambert's law.
    pub words: Vec<u32>,
    /// For each material where the table of its boundary begins; 0 if it needs none.
    pub boundaries: Vec<u32>,
    /// Index of each material whose boundary may be rough.
    rough: Vec<Option<f32>>,
}

impl Lobes {
    /// Words of the table of reflection.
    pub const REFLECTION: u32 = 2 * LOBE_ROUGHNESSES * (LOBE_COSINES + 1);

    /// Works the tables out, where they are not those of a former state. Returns whether they have changed.
    pub fn update(&mut self, scene: &Scene, variant: &Variant) -> bool {
        let used = scene.used_materials();
        let index = |(m, used): (&Material, bool)| (used && variant.glossy).then(|| rough_index(m)).flatten();
        let rough: Vec<Option<f32>> = scene.materials.iter().zip(used).map(index).collect();
        if rough == self.rough && variant.glossy != self.words.is_empty() {
            return false;
        }
        self.words = if variant.glossy { table::reflection_words().to_vec() } else { vec![] };
        let shared = shared_indices(&rough);
        let mut begins: BTreeMap<u32, u32> = BTreeMap::new();
        let mut begin = |ior: f32| {
            *begins.entry(ior.to_bits()).or_insert_with(|| {
                let begin = self.words.len() as u32;
                self.words.extend(table::boundary_words(f64::from(ior)));
                begin
            })
        };
        self.boundaries = rough.iter().map(|ior| ior.map_or(0, |ior| begin(shared(ior)))).collect();
        self.rough = rough;
        true
    }
}

/// Index of refraction of a material whose boundary may be rough. A thin sheet scatters as reflection does.
fn rough_index(m: &Material) -> Option<f32> {
    (m.transmission > 0.0 && m.volume && !m.unlit && m.roughness >= SMOOTH_ROUGHNESS).then_some(m.ior)
}

/// The index whose table stands for an index: itself, or where there are many the nearest of a few, in steps that are
/// even in the square root of the reflectance.
fn shared_indices(all: &[Option<f32>]) -> impl Fn(f32) -> f32 + use<> {
    let distinct: BTreeSet<u32> = all.iter().flatten().map(|ior| ior.to_bits()).collect();
    let many = distinct.len() > MOST_BOUNDARIES;
    move |ior| {
        let root = (ior - 1.0) / (ior + 1.0);
        let steps = MOST_BOUNDARIES as f32;
        let shared = ((root * steps).round() / steps).min(1.0 - 0.5 / steps);
        if many { (1.0 + shared) / (1.0 - shared) } else { ior }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::shapes::Mesh;

    fn scene(materials: impl Iterator<Item = Material>) -> Scene {
        let mut scene = Scene::default();
        let quad = Mesh::quad([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        for material in materials {
            scene.add(&quad, material);
        }
        scene
    }

    fn frosted(ior: f32) -> Material {
        Material { roughness: 0.5, ..Material::glass(ior) }
    }

    #[test]
    fn tables_are_made_for_what_a_scene_has() {
        let glossy = Variant { glossy: true, ..Variant::default() };
        let of = |scene: &Scene, variant: &Variant| {
            let mut lobes = Lobes::default();
            lobes.update(scene, variant);
            assert!(!lobes.update(scene, variant), "nothing has changed");
            lobes
        };
        let diffuse = scene([Material::lambert([0.5; 3])].into_iter());
        assert!(of(&diffuse, &Variant::default()).words.is_empty());
        let smooth = of(&scene([Material::glass(1.5), Material::mirror()].into_iter()), &glossy);
        assert_eq!((smooth.words.len() as u32, &smooth.boundaries[..]), (Lobes::REFLECTION, &[0, 0][..]));
        let rougher = Material { roughness: 0.7, ..frosted(1.5) };
        let twice = of(&scene([frosted(1.5), frosted(1.33), rougher].into_iter()), &glossy);
        let table = Lobes::REFLECTION / 2;
        assert_eq!(twice.words.len() as u32, Lobes::REFLECTION + 2 * table);
        assert_eq!(twice.boundaries, [Lobes::REFLECTION, Lobes::REFLECTION + table, Lobes::REFLECTION]);
    }

    #[test]
    fn many_indices_share_tables() {
        let indices: Vec<_> = (0..1000u16).map(|i| Some(1.0 + 0.1 * f32::from(i))).collect();
        let shared = shared_indices(&indices);
        let tables: BTreeSet<u32> = indices.iter().flatten().map(|ior| shared(*ior).to_bits()).collect();
        assert!(tables.len() <= MOST_BOUNDARIES + 1);
        assert!((shared(1.5) - 1.46).abs() < 0.1 && shared(1e9).is_finite());
    }
}
