//! Rays and triangles: cases 34 to 36 and 49.

use std::f64::consts::PI;

use super::lab::{Lab, settings};
use super::scenes::{floor, from_above, sun};
use super::{Case, Within};
use crate::error::Result;
use crate::graph::Graph;
use crate::kernels::bvh_host::{HostBvh, TriangleTag, build_sah, pack_triangles};
use crate::kernels::generated::{BvhTriangle, Ray, RayHit};
use crate::kernels::trace::{self, MISS, Tree};
use crate::scene::shapes::Mesh;
use crate::scene::{Material, Scene};

pub(super) const CASES: &[Case] = &[
    Case {
        number: 34,
        title: "a closed mesh, rays aimed at its vertices and edges",
        reason: "none leaves (Woop, Benthin and Wald 2013)",
        parameter: None,
        run: watertight,
    },
    Case {
        number: 35,
        title: "rays that leave a triangle, scaled 10^-8 ... 10^8 and sheared",
        reason: "none meets its own triangle: origins move by a bound of the rounding, not by a constant",
        parameter: Some("scale"),
        run: self_hits,
    },
    Case {
        number: 36,
        title: "coplanar duplicates, and one that is an ulp nearer",
        reason: "the lowest id wins, whatever the tree",
        parameter: None,
        run: ties,
    },
    Case {
        number: 49,
        title: "a grating of 10^5 slits",
        reason: "half of it is open; edges lie on a grid of 6e-8, 1 % of a slit",
        parameter: None,
        run: grating,
    },
];

type V3 = [f32; 3];

/// Numbers in [0, 1) that are the same in every run.
struct Numbers(u32);

impl Numbers {
    fn next(&mut self) -> f32 {
        // The constants of Numerical Recipes; the upper bits are good enough to place points.
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / (1 << 24) as f32
    }

    fn point(&mut self) -> V3 {
        [0; 3].map(|_| 2.0 * self.next() - 1.0)
    }
}

struct Built {
    tree: HostBvh,
    packed: Vec<BvhTriangle>,
}

impl Built {
    fn of(positions: &[V3], triangles: &[[u32; 3]]) -> Self {
        let tree = build_sah(positions, triangles);
        let packed = pack_triangles(positions, triangles, &tree.order, |_| TriangleTag::default());
        Self { tree, packed }
    }

    /// Closest hits on the device of rays, or of rays that first leave `hits`.
    fn trace(&self, lab: &mut Lab, rays: &[Ray], leaving: Option<&[RayHit]>) -> Result<Vec<RayHit>> {
        let mut g = Graph::new();
        let (nodes, triangles) = (g.upload("nodes", &self.tree.nodes), g.upload("triangles", &self.packed));
        let given = g.upload("rays", rays);
        let mut rays = g.buffer("moved_rays", given.len());
        g.copy(&given, &mut rays);
        if let Some(hits) = leaving {
            let hits = g.upload("hits", hits);
            trace::spawn(&mut g, &triangles, &hits, &mut rays);
        }
        let mut hits = g.buffer("found", given.len());
        trace::closest(&mut g, Tree { nodes: &nodes, triangles: &triangles }, &rays, &mut hits);
        let hits = g.readback(&hits);
        lab.run(g, |executable| executable.read(&hits))
    }
}

fn watertight(lab: &mut Lab) -> Result<()> {
    let sphere = Mesh::sphere([0.01, -0.02, 0.03], 1.0, 24, 48);
    let count = lab.pick(20_000, 100_000);
    let mut numbers = Numbers(1);
    let mut aimed = |mesh: &Mesh| {
        let at = |i: u32| mesh.positions[i as usize];
        let one = |k: usize| {
            let t = mesh.triangles[k % mesh.triangles.len()];
            let (a, b) = (at(t[k % 3]), at(t[(k + 1) % 3]));
            let s = [0.0, 0.5, numbers.next()][k % 3];
            let origin = numbers.point().map(|x| 0.3 * x);
            let direction = std::array::from_fn(|c| a[c] + s * (b[c] - a[c]) - origin[c]);
            trace::ray(origin, direction, f32::INFINITY)
        };
        (0..count).map(one).collect::<Vec<Ray>>()
    };
    let rays = aimed(&sphere);
    let hits = Built::of(&sphere.positions, &sphere.triangles).trace(lab, &rays, None)?;
    let leaks = |hits: &[RayHit]| hits.iter().filter(|hit| hit.triangle == MISS).count() as f64;
    lab.found(format!("leaks of {count} rays"), leaks(&hits), 0.0, Within::Exact);
    let mut holed = sphere.clone();
    holed.triangles.remove(17);
    let hits = Built::of(&holed.positions, &holed.triangles).trace(lab, &rays, None)?;
    lab.found("leaks of a mesh with a hole", leaks(&hits), 1.0, Within::AtLeast);
    Ok(())
}

fn self_hits(lab: &mut Lab) -> Result<()> {
    let mut numbers = Numbers(3);
    for exponent in (-8..=8).step_by(lab.pick(8, 2)) {
        let scale = 10f32.powi(exponent);
        let (mut positions, mut triangles) = (vec![], vec![]);
        for index in 0..1000u32 {
            let centre = numbers.point().map(|x| x * scale * [0.0, 1.0, 100.0][index as usize % 3]);
            let (squash, shear) = ([1.0, 1.0, 0.01][index as usize % 3], 2.0 * numbers.next() - 1.0);
            for _ in 0..3 {
                let [x, y, z] = numbers.point();
                let p = [x + shear * y, squash * y - shear * z, z + shear * x];
                positions.push(std::array::from_fn(|k| centre[k] + scale * p[k]));
            }
            triangles.push([3 * index, 3 * index + 1, 3 * index + 2]);
        }
        let built = Built::of(&positions, &triangles);
        let (mut hits, mut rays) = (vec![], vec![]);
        for index in 0..built.packed.len() {
            let (mut b1, mut b2) = (numbers.next(), numbers.next());
            if b1 + b2 > 1.0 {
                (b1, b2) = (1.0 - b1, 1.0 - b2);
            }
            let at = &built.packed[index];
            let mut direction = numbers.point();
            if index % 4 == 0 {
                // Nearly inside of the plane.
                let near = 10f32.powi(-((index / 4 % 7) as i32));
                direction = std::array::from_fn(|k| (at.v1[k] - at.v0[k]) / scale + near * direction[k]);
            }
            hits.push(RayHit { t: 1.0, b1, b2, triangle: index as u32 });
            rays.push(trace::ray([0.0; 3], direction, f32::INFINITY));
        }
        let found = built.trace(lab, &rays, Some(&hits))?;
        let own = found.iter().enumerate().filter(|(index, hit)| hit.triangle == *index as u32).count();
        lab.found(format!("self-hits of {} rays, scale 1e{exponent}", rays.len()), own as f64, 0.0, Within::Exact)
            .at(f64::from(scale));
    }
    Ok(())
}

fn ties(lab: &mut Lab) -> Result<()> {
    let mut numbers = Numbers(12);
    let base: Vec<V3> = (0..120).map(|_| numbers.point()).collect();
    let mut positions = vec![];
    for copy in 0..6 {
        // Copy 3 is one ulp nearer to the plane z = 0 in every corner.
        positions.extend(base.iter().map(|&[x, y, z]| [x, y, if copy == 3 { z.next_down() } else { z }]));
    }
    let triangles: Vec<[u32; 3]> = (0..240).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let built = Built::of(&positions, &triangles);
    let rays: Vec<Ray> = (0..3000)
        .map(|_| {
            let (origin, target) = (numbers.point().map(|x| 3.0 * x), numbers.point());
            trace::ray(origin, std::array::from_fn(|k| target[k] - origin[k]), f32::INFINITY)
        })
        .collect();
    let hits = built.trace(lab, &rays, None)?;
    let ids: Vec<u32> =
        hits.iter().filter(|hit| hit.triangle != MISS).map(|hit| built.tree.order[hit.triangle as usize]).collect();
    let wrong = ids.iter().filter(|&&id| !(id < 40 || (120..160).contains(&id))).count();
    lab.found("hits", ids.len() as f64, 500.0, Within::AtLeast);
    lab.found("hits of a duplicate that is not the first", wrong as f64, 0.0, Within::Exact);
    lab.holds("one ulp nearer wins sometimes", ids.iter().any(|id| *id >= 120));
    let again = built.trace(lab, &rays, None)?;
    let same = hits.iter().zip(&again).all(|(a, b)| (a.triangle, a.t.to_bits()) == (b.triangle, b.t.to_bits()));
    lab.holds("a second run is the same", same);
    Ok(())
}

fn grating(lab: &mut Lab) -> Result<()> {
    let slits = lab.pick(20_000u32, 100_000);
    let mut bars = Mesh::default();
    for i in 0..slits {
        let at = |k: u32| (f64::from(2 * i + k) / f64::from(2 * slits) * 2.0 - 1.0) as f32;
        let first = bars.positions.len() as u32;
        for (x, z) in [(at(0), -1.0), (at(1), -1.0), (at(1), 1.0), (at(0), 1.0)] {
            bars.positions.push([x, 0.5, z]);
            bars.normals.push([0.0, 1.0, 0.0]);
            bars.uvs[0].push([0.0; 2]);
        }
        bars.triangles.extend([[first, first + 2, first + 1], [first, first + 3, first + 2]]);
    }
    let parts = vec![(floor(0.9, 0.0), Material::lambert([0.5; 3])), (bars, Material::lambert([0.0; 3]))];
    let scene = Scene::from_parts(parts, vec![sun([0.0, -1.0, 0.0])], from_above([0.0, 0.25, 0.0], 0.5));
    let shot = lab.shot(&scene, &settings(64, 64, 1_000), 0..lab.pick(8, 16))?;
    let share = shot.mean("direct") * PI / 0.5;
    lab.found(format!("transmitted share, {slits} slits"), share, 0.5, Within::Part(0.01)).not(1.0);
    Ok(())
}
