//! Spheres around groups of specular surfaces, at which caustic photons are aimed.

use std::collections::HashMap;

use crate::kernels::generated::Caster;
use crate::scene::needs::is_specular;
use crate::scene::{Material, Scene, World};

/// Most spheres; nearer groups are joined beyond it.
const MOST: usize = 32;

/// Weakest reflectance at normal incidence that makes a surface worth aiming at by itself. A varnish with the usual 4 %
/// is followed when a caustic photon meets it, but does not attract photons.
const FAINT: f32 = 0.045;

fn is_strong(m: &Material) -> bool {
    let dielectric = ((m.ior - 1.0) / (m.ior + 1.0)).powi(2) * m.specular;
    is_specular(m) && (m.transmission > 0.0 || m.metallic > 0.0 || dielectric > FAINT)
}

#[derive(Clone, Copy)]
struct Group {
    min: [f64; 3],
    max: [f64; 3],
}

impl Group {
    fn join(&self, other: &Self) -> Self {
        Self {
            min: std::array::from_fn(|k| self.min[k].min(other.min[k])),
            max: std::array::from_fn(|k| self.max[k].max(other.max[k])),
        }
    }

    fn radius(&self) -> f64 {
        0.5 * (0..3).map(|k| (self.max[k] - self.min[k]).powi(2)).sum::<f64>().sqrt()
    }
}

/// Casters of a scene: connected groups of specular triangles. Aims at all specular surfaces where only faint ones
/// exist, because then they alone make the caustics. `kept` says which triangles are in the tree.
pub fn casters(scene: &Scene, world: &World, kept: &[bool]) -> Vec<Caster> {
    let used = scene.used_materials();
    if !scene.materials.iter().zip(used).any(|(m, used)| used && is_specular(m)) {
        return vec![];
    }
    let specular = |strong: bool| -> Vec<bool> {
        scene.materials.iter().map(|m| if strong { is_strong(m) } else { is_specular(m) }).collect()
    };
    // Light that only a faint varnish reflects must be aimed at too, or its caustics would be lost.
    let all = groups(world, kept, &specular(false));
    let strong = groups(world, kept, &specular(true));
    let mut chosen = join_near(all);
    let strong = join_near(strong);
    let weight = |g: &Group| g.radius().powi(2);
    // Half of the photons at what shines, the rest at everything specular: no caster is left without.
    let (total, strong_total) = (chosen.iter().map(weight).sum::<f64>(), strong.iter().map(weight).sum::<f64>());
    let same = strong.len() == chosen.len();
    let mut weighted: Vec<(Group, f64)> =
        chosen.drain(..).map(|g| (g, weight(&g) / total * if same || strong.is_empty() { 1.0 } else { 0.2 })).collect();
    if !same {
        weighted.extend(strong.iter().map(|g| (*g, weight(g) / strong_total * 0.8)));
    }
    normalise(&weighted)
}

fn normalise(weighted: &[(Group, f64)]) -> Vec<Caster> {
    let total: f64 = weighted.iter().map(|(_, w)| w).sum();
    let mut cumulative = 0.0;
    weighted
        .iter()
        .map(|(g, w)| {
            cumulative += w / total;
            Caster {
                center: std::array::from_fn(|k| (0.5 * (g.min[k] + g.max[k])) as f32),
                // A little larger than the box, so that rounding does not cut the rim.
                radius: (g.radius() * (1.0 + 1e-5)) as f32,
                probability: (w / total) as f32,
                cumulative: cumulative as f32,
            }
        })
        .collect()
}

/// Boxes of the connected components (by vertex position) of the triangles with a chosen material.
fn groups(world: &World, kept: &[bool], chosen: &[bool]) -> Vec<Group> {
    let mut parent: Vec<usize> = Vec::new();
    let mut vertex_of: HashMap<[u32; 3], usize> = HashMap::new();
    let mut positions: Vec<[f32; 3]> = Vec::new();
    fn root(parent: &mut [usize], mut x: usize) -> usize {
        while parent[x] != x {
            parent[x] = parent[parent[x]];
            x = parent[x];
        }
        x
    }
    for ((corners, material), kept) in world.triangles.iter().zip(&world.material).zip(kept) {
        if !*kept || !chosen[*material as usize] {
            continue;
        }
        let nodes = corners.map(|corner| {
            let p = world.positions[corner as usize];
            *vertex_of.entry(p.map(f32::to_bits)).or_insert_with(|| {
                parent.push(parent.len());
                positions.push(p);
                parent.len() - 1
            })
        });
        let first = root(&mut parent, nodes[0]);
        for node in &nodes[1..] {
            let other = root(&mut parent, *node);
            parent[other.max(first)] = other.min(first);
        }
    }
    let mut boxes: Vec<Option<Group>> = vec![None; parent.len()];
    for (node, p) in positions.iter().enumerate() {
        let point = Group { min: p.map(f64::from), max: p.map(f64::from) };
        let slot = root(&mut parent, node);
        boxes[slot] = Some(boxes[slot].map_or(point, |g| g.join(&point)));
    }
    boxes.into_iter().flatten().filter(|g| g.radius() > 0.0).collect()
}

/// Joins boxes until at most [`MOST`] remain: always the pair in the list's order whose joint sphere grows least.
fn join_near(mut groups: Vec<Group>) -> Vec<Group> {
    // Many small pieces (a chandelier) are first joined in cells of a grid, so that the pairwise search stays short.
    if groups.len() > 512 {
        let whole = groups.iter().skip(1).fold(groups[0], |a, b| a.join(b));
        let mut cells: std::collections::BTreeMap<[i32; 3], Group> = std::collections::BTreeMap::new();
        for g in &groups {
            let cell = std::array::from_fn(|k| {
                let extent = (whole.max[k] - whole.min[k]).max(f64::MIN_POSITIVE);
                ((0.5 * (g.min[k] + g.max[k]) - whole.min[k]) / extent * 5.999) as i32
            });
            cells.entry(cell).and_modify(|joint| *joint = joint.join(g)).or_insert(*g);
        }
        groups = cells.into_values().collect();
    }
    while groups.len() > MOST {
        let mut best = (f64::INFINITY, 0, 1);
        for a in 0..groups.len() {
            for b in a + 1..groups.len() {
                let growth = groups[a].join(&groups[b]).radius();
                if growth < best.0 {
                    best = (growth, a, b);
                }
            }
        }
        let removed = groups.remove(best.2);
        groups[best.1] = groups[best.1].join(&removed);
    }
    groups
}
