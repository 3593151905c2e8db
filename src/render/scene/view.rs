//! How large the part of a scene is that a view shows: footprints are limited by that.
//!
//! The scene's sphere says nothing of it: a ground of a kilometre or a stray vertex makes it far larger than what is
//! looked at. Where most vertices are says more, but a bulb of a thousand triangles would make the floor under it the
//! stray. So a few hundred paths start at the camera and go on by diffuse reflection, to see what is seen and what can
//! light it. A view of a tiny part of an open scene is no reason for tiny footprints either: photons are as far apart
//! there as elsewhere. The larger of the two counts, up to the scene's sphere. What the paths have seen also guides
//! light from infinity ([`super::guide`]).

use glam::Vec3;

use super::host::Host;
use crate::kernels::trace::{MISS, offset_ray_origin, ray, traverse_by};
use crate::scene::{Alpha, Camera, Material, Projection, Scene};

/// Paths along each axis of the picture that tell how large footprints may be.
pub const COARSE: [u32; 2] = [16, 12];
/// The same of paths that guide light.
pub const FINE: [u32; 2] = [32, 24];
/// Diffuse surfaces at which a path ends.
const MOST_VERTICES: u32 = 4;
/// Surfaces of any kind at which a path ends.
const MOST_EVENTS: u32 = 24;
/// Metal smoother than this counts as a mirror.
const MIRROR_ROUGHNESS: f32 = 0.3;
/// Radii of what is seen that count for the limit: so all views of a room have the same footprints.
const SEEN_RADII: f32 = 2.0;

/// Length by which footprints of a view are limited, greater than 0, in scene units.
pub fn footprint_unit(seen: &[SeenPoint], host: &Host) -> f32 {
    seen_length(seen).max(host.tree.crowd_radius).min(host.tree.radius)
}

/// What is seen counts so much; 0 where nothing is.
fn seen_length(seen: &[SeenPoint]) -> f32 {
    let places: Vec<Vec3> = seen.iter().map(|point| point.place).collect();
    SEEN_RADII * middle_radius(&places)
}

/// A point of a surface that is neither clear nor a mirror, on a path from the camera.
#[derive(Debug, Clone, Copy)]
pub struct SeenPoint {
    pub place: Vec3,
    /// Unit normal of the triangle, on the side that is seen.
    pub normal: Vec3,
    corners: [[f32; 3]; 3],
    at: [f32; 2],
}

impl SeenPoint {
    /// Whether light from infinity that travels against `towards` gets here: past what is clear, or there in part.
    pub fn is_lit_from(&self, scene: &Scene, host: &Host, towards: Vec3) -> bool {
        let mut origin = offset_ray_origin(self.corners, self.at, towards.into());
        for _ in 0..MOST_EVENTS {
            let Some(met) = meet(scene, host, origin.into(), towards) else { return true };
            if !is_clear(met.material) && met.material.alpha == Alpha::Opaque {
                return false;
            }
            origin = offset_ray_origin(met.corners, met.at, towards.into());
            if !origin.iter().all(|x| x.is_finite()) {
                return false;
            }
        }
        false
    }
}

/// Half the diagonal of the box that holds the middle three quarters of points along each axis: a few that lie far
/// beyond all others do not count. 0 for no points.
fn middle_radius(points: &[Vec3]) -> f32 {
    let Some(last) = points.len().checked_sub(1) else { return 0.0 };
    let cut = last / 8;
    let half = [0, 1, 2].map(|axis| {
        let mut along: Vec<f32> = points.iter().map(|point| point[axis]).collect();
        along.sort_unstable_by(f32::total_cmp);
        0.5 * (f64::from(along[last - cut]) - f64::from(along[cut]))
    });
    half.iter().map(|x| x * x).sum::<f64>().sqrt() as f32
}

/// Points on surfaces that are neither clear nor mirrors, of as many paths from the camera.
pub fn seen_points(scene: &Scene, host: &Host, camera: &Camera, grid: [u32; 2]) -> Vec<SeenPoint> {
    let mut points = Vec::new();
    for path in 0..grid[0] * grid[1] {
        let (origin, direction) = first_ray(camera, path, grid);
        follow(scene, host, path, origin, direction, &mut points);
    }
    points
}

/// The ray through the middle of a cell of the picture, which is taken to be square.
fn first_ray(camera: &Camera, path: u32, grid: [u32; 2]) -> (Vec3, Vec3) {
    let cell = [path % grid[0], path / grid[0]];
    let [x, y] = [0, 1].map(|k| 2.0 * (cell[k] as f32 + 0.5) / grid[k] as f32 - 1.0);
    let [half_width, half_height] = camera.projection.half_size(1.0);
    let aside = x * half_width * Vec3::from(camera.right) + y * half_height * Vec3::from(camera.up);
    let (position, forward) = (Vec3::from(camera.position), Vec3::from(camera.forward));
    match camera.projection {
        Projection::Perspective { .. } => (position, (forward + aside).normalize_or(forward)),
        Projection::Orthographic { .. } => (position + aside, forward),
    }
}

/// The nearest surface on a ray.
struct Met<'a> {
    t: f32,
    corners: [[f32; 3]; 3],
    /// Barycentrics of the second and third corner.
    at: [f32; 2],
    material: &'a Material,
}

fn meet<'a>(scene: &'a Scene, host: &Host, origin: Vec3, direction: Vec3) -> Option<Met<'a>> {
    let order = &host.tree.bvh.order;
    let triangle = |index: u32| (host.world.corners(order[index as usize]), order[index as usize]);
    let hit = traverse_by(&host.tree.bvh.nodes, triangle, &ray(origin.into(), direction.into(), f32::INFINITY));
    if hit.triangle == MISS {
        return None;
    }
    let (corners, id) = triangle(hit.triangle);
    let material = &scene.materials[host.world.material[id as usize] as usize];
    Some(Met { t: hit.t, corners, at: [hit.b1, hit.b2], material })
}

fn follow(scene: &Scene, host: &Host, path: u32, mut origin: Vec3, mut direction: Vec3, points: &mut Vec<SeenPoint>) {
    let mut vertices = 0;
    for _ in 0..MOST_EVENTS {
        let Some(Met { t, corners, at, material }) = meet(scene, host, origin, direction) else { return };
        let front = front_normal(corners);
        let normal = if front.dot(direction) > 0.0 { -front } else { front };
        if is_clear(material) || (material.is_one_sided() && front.dot(direction) > 0.0) {
            // Straight on: which way glass bends it does not change what is behind it by much.
        } else if material.metallic > 0.5 && material.roughness < MIRROR_ROUGHNESS {
            direction -= 2.0 * direction.dot(normal) * normal;
        } else {
            points.push(SeenPoint { place: origin + t * direction, normal, corners, at });
            vertices += 1;
            if vertices == MOST_VERTICES {
                return;
            }
            direction = diffuse(normal, path, vertices);
        }
        origin = offset_ray_origin(corners, at, direction.into()).into();
        if !(origin.is_finite() && direction.is_finite()) {
            return;
        }
    }
}

fn is_clear(material: &Material) -> bool {
    material.transmission > 0.5
}

/// Unit normal of the front; of triangles so small or large that it is no number, any direction.
fn front_normal(corners: [[f32; 3]; 3]) -> Vec3 {
    let [a, b, c] = corners.map(|p| glam::DVec3::from(p.map(f64::from)));
    (b - a).cross(c - a).normalize_or(glam::DVec3::Z).as_vec3()
}

/// Two numbers of [0, 1) that are spread evenly over the indices: an additive recurrence (Roberts 2018: the plastic
/// number).
pub fn spread(index: u32) -> [f64; 2] {
    [0.754_877_666_246_693, 0.569_840_290_998_053].map(|step| (0.5 + f64::from(index) * step).fract())
}

/// A direction of the hemisphere about `normal` with density in proportion to the cosine.
fn diffuse(normal: Vec3, path: u32, vertex: u32) -> Vec3 {
    let [u, v] = spread(path * MOST_VERTICES + vertex).map(|x| x as f32);
    let (sin, cos) = (std::f32::consts::TAU * u).sin_cos();
    let (across, along) = normal.any_orthonormal_pair();
    (v.sqrt() * (cos * across + sin * along) + (1.0 - v).sqrt() * normal).normalize_or(normal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Mesh;

    fn known(objects: Vec<(Mesh, Material)>, eye: [f32; 3], target: [f32; 3]) -> (Scene, Host) {
        let camera = Camera::look_at(eye, target, [0.0, 1.0, 0.0], 0.7);
        let scene = Scene::from_parts(objects, vec![], camera);
        let mut host = Host::default();
        host.update_world(&scene);
        host.build_tree();
        (scene, host)
    }

    /// The length for a scene of these objects, seen from `eye`, in its radii and in scene units.
    fn unit(objects: Vec<(Mesh, Material)>, eye: [f32; 3], target: [f32; 3]) -> (f32, f32) {
        let (scene, host) = known(objects, eye, target);
        let unit = footprint_unit(&seen_points(&scene, &host, &scene.cameras[0], COARSE), &host);
        (unit / host.tree.radius, unit)
    }

    /// What of it comes from what is seen, in its radii.
    fn seen(objects: Vec<(Mesh, Material)>, eye: [f32; 3], target: [f32; 3]) -> f32 {
        let (scene, host) = known(objects, eye, target);
        seen_length(&seen_points(&scene, &host, &scene.cameras[0], COARSE)) / host.tree.radius
    }

    fn white() -> Material {
        Material::lambert([0.7; 3])
    }

    /// A horizontal square about the origin that faces up.
    fn ground(half: f32) -> Mesh {
        Mesh::quad([-half, 0.0, half], [2.0 * half, 0.0, 0.0], [0.0, 0.0, -2.0 * half])
    }

    fn ball(radius: f32) -> Mesh {
        Mesh::sphere([0.0, radius, 0.0], radius, 24, 48)
    }

    const EYE: [f32; 3] = [0.0, 3.0, 6.0];

    #[test]
    fn a_scene_that_is_seen_whole_has_its_radius() {
        for size in [1e-6, 1.0, 1e6] {
            let eye = EYE.map(|x| x * size);
            let (of_radius, _) = unit(vec![(ball(size), white()), (ground(2.0 * size), white())], eye, [0.0; 3]);
            assert_eq!(of_radius, 1.0, "size {size}");
        }
    }

    #[test]
    fn a_tiny_bulb_of_many_triangles_does_not_count_for_the_floor() {
        let (of_radius, _) = unit(vec![(ball(1e-3), white()), (ground(2.0), white())], EYE, [0.0; 3]);
        assert_eq!(of_radius, 1.0);
    }

    #[test]
    fn what_is_far_beyond_the_view_does_not_count() {
        let near = || vec![(ball(1.0), white()), (ground(2.0), white())];
        let expected = unit(near(), EYE, [0.0; 3]).1;
        for far in [1e3f32, 1e6, 1e12] {
            let mut with_stray = near();
            let corners = [[0.0, 0.0, -1.0], [0.1, 0.0, -1.0], [far, far, -far]];
            with_stray
                .push((Mesh { positions: corners.to_vec(), triangles: vec![[0, 1, 2]], ..Mesh::default() }, white()));
            let on_ground = vec![(ball(1.0), white()), (ground(far), white())];
            for (name, scene) in [("stray vertex", with_stray), ("ground", on_ground)] {
                let (_, unit) = unit(scene, EYE, [0.0, 0.0, 0.5]);
                assert!((0.5 * expected..=4.0 * expected).contains(&unit), "{name} {far}: {unit} for {expected}");
            }
        }
    }

    #[test]
    fn a_view_through_glass_or_by_a_mirror_counts_what_is_behind() {
        let room = || (Mesh::cuboid([-2.0; 3], [2.0; 3]).flipped(), white());
        let from_inside = |material| seen(vec![room(), (Mesh::cuboid([-0.01; 3], [0.01; 3]), material)], [0.0; 3], EYE);
        let (clear, closed) = (from_inside(Material::glass(1.5)), from_inside(white()));
        assert!(clear > 0.8 && closed < 0.01, "{clear} and {closed}");
        let mirror = Material { metallic: 1.0, roughness: 0.0, ..white() };
        let pane = Mesh::quad([-0.01, -0.01, 1.89], [0.02, 0.0, 0.0], [0.0, 0.02, 0.0]);
        let reflected = seen(vec![room(), (pane, mirror)], [0.0, 0.0, 1.9], [0.0; 3]);
        assert!(reflected > 0.8, "{reflected}");
    }

    #[test]
    fn a_close_view_in_a_room_counts_the_room() {
        let room = Mesh::cuboid([-2.0; 3], [2.0; 3]).flipped();
        let seen = seen(vec![(room, white())], [0.0, -1.9, 0.0], [0.01, -2.0, 0.01]);
        assert!(seen > 0.8, "{seen}");
    }

    #[test]
    fn a_view_of_nothing_has_the_radius_of_the_scene() {
        let away = [0.0, 9.0, 9.0];
        assert_eq!(seen(vec![(ball(1.0), white())], EYE, away), 0.0);
        assert_eq!(unit(vec![(ball(1.0), white())], EYE, away).0, 1.0);
        assert_eq!(middle_radius(&[]), 0.0);
    }
}
