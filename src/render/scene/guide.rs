//! From where light from infinity reaches what the picture shows: where its photons start, and which directions of the
//! environment samples of the lights take.
//!
//! Such light enters the scene's sphere everywhere, and little of it gets through the windows of a room, or onto the
//! part of a large ground that is seen. So paths from the camera tell of points that are seen or light what is seen
//! ([`super::view`]), and rays from there towards the lights tell which of them the light reaches, and from where. The
//! points are put into spheres. For each directional light and for each cell of the environment the spheres have
//! probabilities, and the cells have, for all spheres and for each; photons are aimed at a sphere by these, and samples
//! of the environment have those of the nearest sphere. A part of either takes no notice of them, so the guide changes
//! the noise of the picture only. For photons that part starts in halos: spheres around all others, each twice as large
//! as the one before, up to that of the scene. What a photon stands for then grows with the square of the distance at
//! which it passes, and what it brings falls by that.
//!
//! Cells are squares in the random numbers from which the environment's directions are made. So they are small where
//! the environment is bright, and the probability of a direction under the guide is its own times that of its cell.
//!
//! This is done on the host, with some ten thousand rays: from one scene and camera it is the same on every device.
//! Guiding by what is seen: Jensen 1995, "Importance Driven Path Tracing using the Photon Map"; here with one step, on
//! the lights' side.

use glam::{DVec3, Vec3};

use super::host::Host;
use super::view::{SeenPoint, spread};
use crate::constants::{
    GUIDE_CELLS, GUIDE_PARALLEL, GUIDE_PLAIN, GUIDE_SIDE, GUIDE_SPHERE, LIGHT_DIRECTIONAL, LIGHT_ENVIRONMENT,
};
use crate::kernels::generated::Light;
use crate::scene::Scene;

/// Spheres at most that are not divided; all spheres.
const MOST_LEAVES: usize = 64;
const MOST_SPHERES: usize = 2 * MOST_LEAVES - 1;
/// What a divided sphere gets, beside each of its parts' shares: between the parts are gaps.
const SHARE_OF_DIVIDED: f64 = 0.2;
/// Lit points in a sphere at least, counted once for each direction.
const LEAST_IN_SPHERE: usize = 8;
/// Directions of the environment that a point is tested for in a round, one in each of so many cells. The next points
/// and the next round take others.
const TESTS: u32 = 16;
/// Rounds at most.
const ROUNDS: u32 = 2;
/// Rounds after which every point would have been tested for every cell.
const ALL_ROUNDS: u32 = GUIDE_CELLS / TESTS;
/// Lit points that are enough.
const ENOUGH: usize = 2048;
/// Without a guide, photons are this many times rarer where they are useful, or there is no guide: what it costs would
/// not pay.
const LEAST_GAIN: f64 = 6.0;
/// The same of samples of the environment.
const LEAST_GAIN_OF_SAMPLES: f64 = 2.0;
/// What all spheres together say of a cell counts as so many lit points in each, and what all columns together say of a
/// sphere, too.
const PRIOR: f64 = 4.0;
/// Halos at most.
const MOST_HALOS: usize = 24;
/// Least radius of a sphere, in roundings of a coordinate of the size of the scene's radius.
const ROUNDINGS: f64 = 96.0;
/// A sphere is larger than what it was made around.
const MARGIN: f64 = 1.2;

/// The columns of the guide: [`GUIDE_PARALLEL`] of directional lights, then the cells.
const FIRST_CELL: usize = GUIDE_PARALLEL as usize;
const COLUMNS: usize = FIRST_CELL + GUIDE_CELLS as usize;

/// Spheres and their probabilities.
#[derive(Debug, Clone, PartialEq)]
pub struct Guide {
    /// As glsl/lib/guide.glsl reads them.
    pub words: Vec<f32>,
    pub spheres: u32,
    /// The first of them, which are not divided.
    pub leaves: u32,
    pub halos: u32,
    /// Photons are guided.
    pub leads_photons: bool,
    /// Samples of the environment are guided.
    pub leads_samples: bool,
    /// Greatest flux of a photon from infinity within the first halo, where there is most to see, relative to that of a
    /// photon without a guide.
    pub greatest: f64,
}

/// Light that reaches a point.
struct Lit {
    place: DVec3,
    /// Unit direction towards the light.
    towards: DVec3,
    column: usize,
    /// Cosine at the surface.
    weight: f64,
}

impl Guide {
    /// The guide of a view; `None` where it would not pay.
    pub fn of(scene: &Scene, host: &Host, lights: &[Light], seen: &[SeenPoint]) -> Option<Self> {
        let lit = lit_points(scene, host, lights, seen);
        let groups = groups(&lit)?;
        let spheres = spheres(&lit, &groups, host.tree.radius.into());
        let weights = Weights::of(&lit, &groups);
        let leads_photons = gain(&lit, &groups, &spheres, &weights, host.tree.radius.into()) >= LEAST_GAIN;
        let leads_samples = gain_of_samples(&lit, &groups, &weights) >= LEAST_GAIN_OF_SAMPLES;
        let halos = halos(&lit, Vec3::from(host.tree.center).as_dvec3(), host.tree.radius.into());
        let shares = halo_weights(halos.len());
        let first = shares[0] / shares.iter().sum::<f64>();
        let greatest = (halos[0].1 / f64::from(host.tree.radius)).powi(2) / (f64::from(GUIDE_PLAIN) * first);
        let words = words(&spheres, &halos, &weights);
        let (spheres, halos, leaves) = (spheres.len() as u32, halos.len() as u32, groups.leaves as u32);
        (leads_photons || leads_samples).then_some(Self {
            words,
            spheres,
            leaves,
            halos,
            leads_photons,
            leads_samples,
            greatest,
        })
    }
}

/// Light in each sphere.
struct Weights {
    /// For each column, by sphere.
    columns: Vec<Vec<f64>>,
    /// For each cell.
    cells: Vec<f64>,
    /// For each sphere that is not divided, by cell: its own with some of all spheres'.
    in_leaf: Vec<Vec<f64>>,
}

impl Weights {
    fn of(lit: &[Lit], groups: &Groups) -> Self {
        let mut columns = vec![vec![0.0; groups.all.len()]; COLUMNS];
        for (sphere, group) in groups.all.iter().enumerate() {
            group.iter().for_each(|&i| columns[lit[i].column][sphere] += groups.share(sphere) * lit[i].weight);
        }
        let in_all: Vec<f64> = (0..groups.all.len()).map(|i| columns.iter().map(|column| column[i]).sum()).collect();
        let of_all: f64 = in_all.iter().sum();
        for column in columns.iter_mut().filter(|column| column.iter().any(|weight| *weight > 0.0)) {
            column.iter_mut().zip(&in_all).for_each(|(weight, all)| *weight += PRIOR * all / of_all);
        }
        let cells: Vec<f64> = columns[FIRST_CELL..].iter().map(|column| column.iter().sum()).collect();
        let total: f64 = cells.iter().sum();
        let count = GUIDE_CELLS as usize;
        // Where nothing is known, all are alike.
        let prior = |cell: usize| PRIOR * if total > 0.0 { cells[cell] / total } else { 1.0 / count as f64 };
        let own = |sphere: usize| (0..count).map(|cell| columns[FIRST_CELL + cell][sphere] + prior(cell)).collect();
        let in_leaf = (0..groups.leaves).map(own).collect();
        Self { columns, cells, in_leaf }
    }
}

fn words(spheres: &[(DVec3, f64)], halos: &[(DVec3, f64)], weights: &Weights) -> Vec<f32> {
    let mut words: Vec<f32> = vec![];
    for (center, radius) in spheres.iter().chain(halos) {
        words.extend([center.x, center.y, center.z, *radius].map(|x| x as f32));
    }
    words.extend(cumulative(&halo_weights(halos.len())));
    for cells in std::iter::once(&weights.cells).chain(&weights.in_leaf) {
        let rows: Vec<f64> = cells.chunks(GUIDE_SIDE as usize).map(|row| row.iter().sum()).collect();
        words.extend(cumulative(&rows));
        cells.chunks(GUIDE_SIDE as usize).for_each(|row| words.extend(cumulative(row)));
    }
    weights.columns.iter().for_each(|column| words.extend(cumulative(column)));
    // As long for every view, so that a move of the camera needs no other buffer.
    let cells = (GUIDE_SIDE + GUIDE_CELLS) as usize;
    let balls = (MOST_SPHERES + MOST_HALOS) * GUIDE_SPHERE as usize + MOST_HALOS;
    words.resize(balls + (1 + MOST_LEAVES) * cells + COLUMNS * MOST_SPHERES, 0.0);
    words
}

/// Cumulative probabilities in proportion to these; all 0 where their sum is. From the last that is not 0 on they are
/// exactly 1, so that no other is ever found.
fn cumulative(weights: &[f64]) -> Vec<f32> {
    let total: f64 = weights.iter().sum();
    let last = weights.iter().rposition(|weight| *weight > 0.0).unwrap_or(weights.len());
    let mut so_far = 0.0;
    let step = |(k, weight): (usize, &f64)| {
        so_far += weight;
        if k >= last { 1.0 } else { (so_far / total.max(f64::MIN_POSITIVE)) as f32 }
    };
    weights.iter().enumerate().map(step).collect()
}

fn lit_points(scene: &Scene, host: &Host, lights: &[Light], seen: &[SeenPoint]) -> Vec<Lit> {
    let mut lit = vec![];
    let mut test = |point: &SeenPoint, column: usize, towards: Vec3| {
        let cosine = point.normal.dot(towards);
        let reached = cosine > 0.0 && point.is_lit_from(scene, host, towards);
        if reached {
            let (place, towards) = (point.place.as_dvec3(), towards.as_dvec3());
            lit.push(Lit { place, towards, column, weight: cosine.into() });
        }
        usize::from(reached)
    };
    for light in lights.iter().filter(|light| light.guide > 0) {
        let first = light.guide as usize - 1;
        match (light.kind, &host.sky) {
            (LIGHT_DIRECTIONAL, _) => {
                let towards = -Vec3::from(light.direction);
                seen.iter().for_each(|point| _ = test(point, first, towards));
            }
            (LIGHT_ENVIRONMENT, Some(sky)) => {
                let mut found = 0;
                for round in 0..ROUNDS {
                    for (k, point) in (0..).zip(seen) {
                        for cell in (0..TESTS).map(|j| j * ALL_ROUNDS + (k + round) % ALL_ROUNDS) {
                            found += test(point, first + cell as usize, sky.direction(within(cell, k)).into());
                        }
                    }
                    if found >= ENOUGH {
                        break;
                    }
                }
            }
            _ => {}
        }
    }
    lit
}

/// Numbers within a cell, others for each point.
fn within(cell: u32, point: u32) -> [f32; 2] {
    let corner = [cell % GUIDE_SIDE, cell / GUIDE_SIDE];
    let inside = spread(point);
    std::array::from_fn(|k| ((f64::from(corner[k]) + inside[k]) / f64::from(GUIDE_SIDE)) as f32)
}

/// Lit points, by index, that lie near each other.
struct Groups {
    /// All, those that are not divided before the others.
    all: Vec<Vec<usize>>,
    leaves: usize,
}

impl Groups {
    /// What the light in a group counts for its sphere.
    fn share(&self, sphere: usize) -> f64 {
        if sphere < self.leaves { 1.0 } else { SHARE_OF_DIVIDED }
    }
}

/// Groups of lit points; `None` where there are too few to tell of.
fn groups(lit: &[Lit]) -> Option<Groups> {
    let all: Vec<usize> = (0..lit.len()).collect();
    if lit.len() < LEAST_IN_SPHERE || extent(lit, &all).1 <= 0.0 {
        return None;
    }
    let mut groups: Vec<Vec<usize>> = vec![all];
    let mut divided = vec![];
    while groups.len() < MOST_LEAVES {
        // The one that would have the most of what other light passes through.
        let size = |group: &Vec<usize>| group.len() as f64 * extent(lit, group).1.powi(2);
        let splits = groups.iter().enumerate().filter(|(_, group)| group.len() >= 2 * LEAST_IN_SPHERE);
        let largest = splits.map(|(k, group)| (k, size(group))).filter(|(_, size)| *size > 0.0);
        let Some((k, _)) = largest.max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        let mut group = groups.swap_remove(k);
        let axis = extent(lit, &group).2;
        group.sort_by(|&a, &b| lit[a].place[axis].total_cmp(&lit[b].place[axis]).then(a.cmp(&b)));
        divided.push(group.clone());
        let rest = group.split_off(group.len() / 2);
        groups.extend([group, rest]);
    }
    let leaves = groups.len();
    groups.extend(divided);
    Some(Groups { all: groups, leaves })
}

/// The middle of a group's box, the greatest distance from it, and the longest axis.
fn extent(lit: &[Lit], group: &[usize]) -> (DVec3, f64, usize) {
    let places = || group.iter().map(|&i| lit[i].place);
    let (min, max) = places().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(a, b), p| (a.min(p), b.max(p)));
    let middle = 0.5 * (min + max);
    let radius = places().map(|p| p.distance(middle)).fold(0.0, f64::max);
    let sides = max - min;
    let axis = (0..3).max_by(|&a, &b| sides[a].total_cmp(&sides[b])).unwrap_or(0);
    (middle, radius, axis)
}

/// The least radius of a sphere or halo in a scene of this radius.
fn least_radius(radius: f64) -> f64 {
    ROUNDINGS * f64::from(f32::EPSILON) * radius
}

/// A sphere around each group. None is much smaller than those that would tile what is lit: the points are samples. Nor
/// than what the rounding of a start outside of the scene's sphere can miss: the density of starts would not be that of
/// what gets there.
fn spheres(lit: &[Lit], groups: &Groups, radius: f64) -> Vec<(DVec3, f64)> {
    let all: Vec<usize> = (0..lit.len()).collect();
    let least = 0.5 * extent(lit, &all).1 / (MOST_LEAVES as f64).sqrt();
    let least = least.max(least_radius(radius));
    let sphere = |group: &Vec<usize>| {
        let (middle, radius, _) = extent(lit, group);
        (middle, (MARGIN * radius).max(least))
    };
    groups.all.iter().map(sphere).collect()
}

/// Spheres around all lit points, each twice as large as the one before; the last is the scene's.
fn halos(lit: &[Lit], center: DVec3, radius: f64) -> Vec<(DVec3, f64)> {
    let all: Vec<usize> = (0..lit.len()).collect();
    let (middle, extent, _) = extent(lit, &all);
    let doubled = (1..MOST_HALOS as i32).map(|k| extent * 2f64.powi(k));
    let inner = doubled.filter(|r| (least_radius(radius)..0.7 * radius).contains(r)).map(|r| (middle, r));
    inner.chain(std::iter::once((center, radius))).collect()
}

/// Half of what halos get is the less the larger they are, half is the same for all.
fn halo_weights(halos: usize) -> Vec<f64> {
    (1..=halos as i32).map(|k| 0.5f64.powi(k) + 1.0 / halos as f64).collect()
}

/// How many times as many photons reach the lit points with a guide as without one, where all follow it: the geometric
/// mean. What a point itself has told does not count: one more point would not have it.
fn gain(lit: &[Lit], groups: &Groups, spheres: &[(DVec3, f64)], weights: &Weights, radius: f64) -> f64 {
    let all: f64 = weights.cells.iter().sum();
    let mut holds = vec![vec![]; lit.len()];
    groups.all.iter().enumerate().for_each(|(sphere, group)| group.iter().for_each(|&i| holds[i].push(sphere)));
    geometric_mean(lit, 0..lit.len(), |i| {
        let (point, column) = (&lit[i], &weights.columns[lit[i].column]);
        let own = |sphere| if holds[i].contains(&sphere) { groups.share(sphere) * point.weight } else { 0.0 };
        let owned: f64 = holds[i].iter().map(|&sphere| own(sphere)).sum();
        let total = column.iter().sum::<f64>() - owned;
        let is_cell = point.column >= FIRST_CELL;
        let preference = if is_cell { total / (all - owned) * f64::from(GUIDE_CELLS) } else { 1.0 };
        let aims = |center: DVec3, r: f64| (point.place - center).cross(point.towards).length() <= r;
        let hit = spheres.iter().zip(column).enumerate().filter(|(_, ((center, r), _))| aims(*center, *r));
        let density = hit.map(|(sphere, ((_, r), weight))| (weight - own(sphere)) / total * (radius / r).powi(2));
        preference * density.sum::<f64>()
    })
}

/// The same of samples of the environment.
fn gain_of_samples(lit: &[Lit], groups: &Groups, weights: &Weights) -> f64 {
    let mut preference = vec![1.0; lit.len()];
    for (group, cells) in groups.all.iter().zip(&weights.in_leaf) {
        let total: f64 = cells.iter().sum();
        for &i in group.iter().filter(|&&i| lit[i].column >= FIRST_CELL) {
            let own = lit[i].weight;
            preference[i] = f64::from(GUIDE_CELLS) * (cells[lit[i].column - FIRST_CELL] - own) / (total - own);
        }
    }
    let by_sky = |i: &usize| lit[*i].column >= FIRST_CELL;
    geometric_mean(lit, (0..lit.len()).filter(by_sky), |i| preference[i])
}

/// The mean over some lit points by their weights; not a number for none.
fn geometric_mean(lit: &[Lit], some: impl Iterator<Item = usize>, value: impl Fn(usize) -> f64) -> f64 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for i in some {
        sum += lit[i].weight * value(i).max(f64::MIN_POSITIVE).ln();
        weights += lit[i].weight;
    }
    (sum / weights).exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::scene::lights::LightTable;
    use crate::render::scene::view::{FINE, seen_points};
    use crate::scene::{Camera, Environment, Light as SceneLight, Material, Mesh};

    /// The guide of a scene of these white parts under a sun and an even sky, in a unit of this length.
    fn guide(parts: Vec<Mesh>, eye: [f32; 3], unit: f32) -> Option<Guide> {
        let scaled = |mut mesh: Mesh| {
            mesh.positions.iter_mut().for_each(|p| *p = p.map(|x| x * unit));
            (mesh, Material::lambert([0.7; 3]))
        };
        let camera = Camera::look_at(eye.map(|x| x * unit), [0.0; 3], [0.0, 1.0, 0.0], 0.7);
        let sun = SceneLight::Directional { direction: [0.6, -0.8, 0.0], irradiance: [1.0; 3] };
        let environment = Some(Environment { width: 4, height: 2, radiance: vec![[1.0; 3]; 8] });
        let parts = parts.into_iter().map(scaled).collect();
        let scene = Scene { environment, ..Scene::from_parts(parts, vec![sun], camera) };
        let mut host = Host::default();
        host.update_world(&scene);
        host.build_tree();
        host.update_materials(&scene);
        host.update_sky(&scene);
        let table = LightTable::of(&scene, &host);
        assert_eq!(table.lights.iter().filter(|light| light.guide > 0).count(), 2);
        Guide::of(&scene, &host, &table.lights, &seen_points(&scene, &host, &scene.cameras[0], FINE))
    }

    fn ground(half: f32) -> Mesh {
        Mesh::quad([-half, 0.0, half], [2.0 * half, 0.0, 0.0], [0.0, 0.0, -2.0 * half])
    }

    fn ball() -> Mesh {
        Mesh::sphere([0.0, 1.0, 0.0], 1.0, 16, 32)
    }

    const EYE: [f32; 3] = [0.0, 3.0, 6.0];

    #[test]
    fn what_is_seen_whole_or_not_lit_has_none() {
        assert!(guide(vec![ball(), ground(2.0)], EYE, 1.0).is_none());
        let closed = Mesh::cuboid([-9.0; 3], [9.0; 3]).flipped();
        assert!(guide(vec![ball(), closed], EYE, 1.0).is_none());
    }

    #[test]
    fn a_large_ground_has_one_that_follows_the_unit() {
        let parts = || vec![ball(), ground(2000.0)];
        let one = guide(parts(), EYE, 1.0).expect("a guide");
        assert!(one.leads_photons && one.leaves > 16 && one.halos > 3, "{} of {}", one.leaves, one.spheres);
        for unit in [2f32.powi(-20), 2f32.powi(20)] {
            let other = guide(parts(), EYE, unit).expect("a guide");
            let balls = (one.spheres + one.halos) as usize * GUIDE_SPHERE as usize;
            assert!((0..balls).all(|k| other.words[k] == unit * one.words[k]), "spheres");
            assert_eq!(other.words[balls..], one.words[balls..], "probabilities");
        }
        // Halos hold the others, up to the whole scene.
        let radius = |k: u32| one.words[(k * GUIDE_SPHERE + 3) as usize];
        assert!((one.spheres + 1..one.spheres + one.halos).all(|k| radius(k) > radius(k - 1)));
        assert!(radius(one.spheres + one.halos - 1) > 2000.0);
    }

    #[test]
    fn probabilities_are_whole_or_none() {
        assert_eq!(cumulative(&[0.0, 1.0, 3.0, 0.0]), [0.0, 0.25, 1.0, 1.0]);
        assert_eq!(cumulative(&[1e-300, 1e-300]), [0.5, 1.0]);
        assert_eq!(cumulative(&[0.0, 0.0]), [0.0, 0.0]);
        let weights = halo_weights(24);
        assert!(weights.is_sorted_by(|a, b| a >= b) && weights[23] > 0.02 * weights.iter().sum::<f64>());
    }
}
