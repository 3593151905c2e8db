//! Rays on the triangles of a scene: primary rays in Morton order, shadow rays and diffuse rays from their hits.

use glam::Vec3;

use super::{Effort, Floor, MEASURED, Rate, device_class, planned, time_plan};
use crate::error::Result;
use crate::graph::{Buf, Graph, Persistent, Runtime};
use crate::kernels::bvh_host::{HostBvh, TriangleTag, pack_triangles};
use crate::kernels::generated::{BvhNode, BvhTriangle, Ray, RayHit};
use crate::kernels::trace::{self, MISS, Tree};
use crate::scene::{Light, Projection, Scene, World};

/// A scene's tree on the device.
struct Target<'a> {
    runtime: &'a Runtime,
    effort: Effort,
    nodes: Persistent<BvhNode>,
    triangles: Persistent<BvhTriangle>,
}

/// Measures the three kinds of rays; those without a ray are left out.
pub(super) fn rays(
    runtime: &Runtime,
    effort: Effort,
    (scene, world): (&Scene, &World),
    tree: &HostBvh,
    begin: &mut dyn FnMut(&str),
) -> Result<Vec<Rate>> {
    let packed = pack_triangles(&world.positions, &world.triangles, &tree.order, |_| TriangleTag::default());
    if packed.is_empty() {
        return Ok(vec![]);
    }
    let target = Target {
        runtime,
        effort,
        nodes: runtime.persistent_from("nodes", &tree.nodes)?,
        triangles: runtime.persistent_from("triangles", &packed)?,
    };
    begin("primary rays");
    let primary = primary_rays(scene, effort.rays);
    let (mut rates, hits) = target.run("primary rays", &primary, trace::closest, hit)?;
    let (shadow, diffuse) = secondary((scene, world), tree, &primary, &hits);
    if shadow.is_empty() {
        return Ok(rates);
    }
    begin("shadow rays");
    rates.extend(target.run("shadow rays", &shadow, trace::any, |answer| *answer != 0)?.0);
    begin("diffuse rays");
    rates.extend(target.run("diffuse rays", &diffuse, trace::closest, hit)?.0);
    Ok(rates)
}

fn hit(hit: &RayHit) -> bool {
    hit.triangle != MISS
}

impl Target<'_> {
    /// Times one pass over the rays; returns the rate, with the share of rays that hit, and what the pass wrote.
    fn run<T: bytemuck::Pod>(
        &self,
        name: &'static str,
        rays: &[Ray],
        pass: impl Fn(&mut Graph, Tree<'_>, &Buf<Ray>, &mut Buf<T>),
        is_hit: impl Fn(&T) -> bool,
    ) -> Result<(Vec<Rate>, Vec<T>)> {
        let memory = self.runtime.persistent_from("rays", rays)?;
        let mut g = Graph::new().with_device_class(device_class(self.runtime));
        let (nodes, triangles) = (g.import_read(&self.nodes), g.import_read(&self.triangles));
        let (rays_buf, mut answers) = (g.import_read(&memory), g.buffer::<T>("answers", rays.len() as u32));
        let tree = Tree { nodes: &nodes, triangles: &triangles };
        g.scope(MEASURED, |g| pass(g, tree, &rays_buf, &mut answers));
        let readback = g.readback(&answers);
        let (seconds, executable) = time_plan(self.runtime, self.effort.repeats, &planned(g))?;
        let answers = executable.read(&readback);
        let share = answers.iter().filter(|answer| is_hit(answer)).count() as f64 / rays.len() as f64;
        let note = format!("{:.0} % hit", 100.0 * share);
        let rate = Rate { name, items: rays.len() as u64, unit: "rays", seconds, floor: Floor::Unknown, note };
        Ok((vec![rate], answers))
    }
}

/// Rays through the pixels of a square picture, neighbours close to each other.
fn primary_rays(scene: &Scene, side: u32) -> Vec<Ray> {
    let Some(camera) = scene.cameras.first() else { return vec![] };
    let [position, right, up, forward] = [camera.position, camera.right, camera.up, camera.forward].map(Vec3::from);
    let place = |p: u32| (p as f32 + 0.5) / side as f32 * 2.0 - 1.0;
    let ray = |code: u32| {
        let (x, y) = (place(even_bits(code)), -place(even_bits(code >> 1)));
        let (origin, direction) = match camera.projection {
            Projection::Perspective { yfov, .. } => {
                let half = (0.5 * yfov).tan();
                (position, (right * (x * half) + up * (y * half) + forward).normalize())
            }
            Projection::Orthographic { ymag, .. } => (position + right * (x * ymag) + up * (y * ymag), forward),
        };
        trace::ray(origin.into(), direction.into(), f32::INFINITY)
    };
    (0..side * side).map(ray).collect()
}

/// Bits 0, 2, 4 ... of a Morton code.
fn even_bits(mut x: u32) -> u32 {
    x &= 0x5555_5555;
    for (shift, mask) in [(1, 0x3333_3333), (2, 0x0f0f_0f0f), (4, 0x00ff_00ff), (8, 0xffff)] {
        x = (x | (x >> shift)) & mask;
    }
    x
}

/// Random numbers in a fixed order (PCG, O'Neill 2014).
pub(super) struct Numbers(pub u32);

impl Numbers {
    /// From 0 up to 1.
    pub fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((self.0 >> ((self.0 >> 28) + 4)) ^ self.0).wrapping_mul(277_803_737);
        (((word >> 22) ^ word) >> 8) as f32 / 16_777_216.0
    }

    /// A direction around a normal, distributed by the cosine.
    pub fn direction(&mut self, normal: Vec3) -> Vec3 {
        let (radius, angle) = (self.next().sqrt(), self.next() * std::f32::consts::TAU);
        let (u, v) = normal.any_orthonormal_pair();
        let height = (1.0 - radius * radius).max(0.0).sqrt();
        u * (radius * angle.cos()) + v * (radius * angle.sin()) + normal * height
    }
}

/// Shadow rays to one point of a light, and rays with a cosine distribution, from every hit.
fn secondary((scene, world): (&Scene, &World), tree: &HostBvh, rays: &[Ray], hits: &[RayHit]) -> (Vec<Ray>, Vec<Ray>) {
    let light = light_point(scene, world);
    let mut numbers = Numbers(1);
    let (mut shadow, mut diffuse) = (Vec::new(), Vec::new());
    for (ray, hit) in rays.iter().zip(hits).filter(|(_, h)| hit(h)) {
        let corners = world.corners(tree.order[hit.triangle as usize]);
        let [a, b, c] = corners.map(Vec3::from);
        let [x, y, z, _] = ray.direction;
        let normal = (b - a).cross(c - a).normalize();
        let normal = if normal.dot(Vec3::new(x, y, z)) > 0.0 { -normal } else { normal };
        let origin = trace::offset_ray_origin(corners, [hit.b1, hit.b2], normal.into());
        // A ray that reached the light's own triangle would always be blocked.
        shadow.push(trace::ray(origin, (light - Vec3::from(origin)).into(), 0.999));
        diffuse.push(trace::ray(origin, numbers.direction(normal).into(), f32::INFINITY));
    }
    (shadow, diffuse)
}

/// A point that light comes from: the first punctual light, else the middle of the first triangle that emits, else a
/// place above the scene.
fn light_point(scene: &Scene, world: &World) -> Vec3 {
    let (center, radius) = world.bounds().map_or((Vec3::ZERO, 1.0), |b| (b.center().into(), b.radius()));
    match scene.lights.first() {
        Some(Light::Point { position, .. } | Light::Spot { position, .. }) => return (*position).into(),
        Some(Light::Directional { direction, .. }) => return center - Vec3::from(*direction) * (2.0 * radius),
        None => (),
    }
    let emits = |&material: &u32| scene.materials[material as usize].emissive != [0.0; 3];
    match world.material.iter().position(emits) {
        Some(id) => world.corners(id as u32).map(Vec3::from).into_iter().sum::<Vec3>() / 3.0,
        None => center + Vec3::new(0.3, 1.5, 0.4) * radius,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::blobs;
    use crate::kernels::bvh_host::build_sah;

    #[test]
    fn secondary_rays_leave_the_surface_they_start_on() {
        let scene = blobs(8, 16);
        let world = World::of(&scene);
        let tree = build_sah(&world.positions, &world.triangles);
        let packed = pack_triangles(&world.positions, &world.triangles, &tree.order, |_| TriangleTag::default());
        let primary = primary_rays(&scene, 32);
        let hits: Vec<RayHit> = primary.iter().map(|ray| trace::traverse(&tree.nodes, &packed, ray)).collect();
        let (shadow, diffuse) = secondary((&scene, &world), &tree, &primary, &hits);
        let count = hits.iter().filter(|h| hit(h)).count();
        assert!(count > 700 && shadow.len() == count && diffuse.len() == count, "{count} of 1024 hit");
        let found = |ray: &Ray| trace::traverse(&tree.nodes, &packed, ray);
        for (from, ray) in hits.iter().filter(|h| hit(h)).zip(&diffuse) {
            assert_ne!(found(ray).triangle, from.triangle, "a ray meets the triangle that it leaves");
        }
        let blocked = shadow.iter().filter(|ray| hit(&found(ray))).count();
        // Sides of the blobs that face the camera but not the lamp, and their shadows on the floor.
        assert!(blocked * 10 > count && blocked * 10 < 9 * count, "{blocked} of {count} do not see the lamp");
    }
}
