//! Environment maps: what is drawn against rays through texels, the choice of centres against known rooms, the search
//! against its reference on the host.

use nephroid::low_level::graph::Graph;
use nephroid::low_level::kernels::bvh_host::{HostBvh, TriangleTag, build_sah, pack_triangles};
use nephroid::low_level::kernels::generated::{BvhTriangle, MapTexel, Ray, RayHit};
use nephroid::low_level::kernels::maps::{self, COUNTS, Maps, Search, Seen, Shape};
use nephroid::low_level::kernels::maps_reference as reference;
use nephroid::low_level::kernels::trace::{self, MISS, Tree};

use crate::support::device::runtime;
use crate::support::harness::Harness;
use crate::support::proof;
use crate::support::random::Random;

type V3 = [f32; 3];

/// A room of boxes: triangles, their tree, and its radius.
struct Room {
    tree: HostBvh,
    packed: Vec<BvhTriangle>,
    radius: f32,
}

fn cuboid(corners: &mut Vec<V3>, low: V3, high: V3) {
    for axis in 0..3 {
        for side in [low, high] {
            let at = |u: f32, v: f32| {
                let mut p = [0.0; 3];
                p[axis] = side[axis];
                p[(axis + 1) % 3] = u;
                p[(axis + 2) % 3] = v;
                p
            };
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            let [p, q, r, s] = [at(low[a], low[b]), at(high[a], low[b]), at(high[a], high[b]), at(low[a], high[b])];
            corners.extend([p, q, r, p, r, s]);
        }
    }
}

impl Room {
    fn new(boxes: &[(V3, V3)]) -> Self {
        let mut corners = Vec::new();
        boxes.iter().for_each(|(low, high)| cuboid(&mut corners, *low, *high));
        let triangles: Vec<[u32; 3]> = (0..corners.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let tree = build_sah(&corners, &triangles);
        let packed = pack_triangles(&corners, &triangles, &tree.order, |_| TriangleTag::default());
        Self { tree, packed, radius: 4.0 }
    }

    /// A room with two boxes in it.
    fn furnished() -> Self {
        Self::new(&[
            ([-2.0, 0.0, -2.0], [2.0, 3.0, 2.0]),
            ([-1.2, 0.0, -0.8], [-0.4, 1.6, 0.2]),
            ([0.3, 0.0, 0.4], [1.1, 0.7, 1.2]),
        ])
    }

    /// Maps of these centres, and what [`maps::seen`] says of them if they have one layer.
    fn maps(&self, shape: Shape, centres: &[V3]) -> (Vec<MapTexel>, Vec<f32>, Vec<[u32; 2]>) {
        let runtime = runtime();
        let mut g = Graph::new();
        let triangles = g.upload("triangles", &self.packed);
        let places = g.upload("centres", &places(centres));
        let mut texels = g.buffer("texels", shape.texels());
        maps::draw(&mut g, (&triangles, self.packed.len() as u32), (shape, self.radius), &places, &mut texels);
        let seen = (shape.layers == 1).then(|| {
            let (areas, masks) = maps::seen(&mut g, &triangles, Maps { shape, centres: &places, texels: &texels });
            (g.readback(&areas), g.readback(&masks))
        });
        let texels = g.readback(&texels);
        let plan = g.plan().expect("a valid plan");
        let mut executable = runtime.prepare(&plan).expect("memory");
        executable.run().expect("no validation message");
        proof::ran(&plan.dump());
        let (areas, masks) =
            seen.map_or((vec![], vec![]), |(areas, masks)| (executable.read(&areas), executable.read(&masks)));
        (executable.read(&texels), areas, masks)
    }

    /// What the device says of rays, by these maps.
    fn judged(&self, (shape, search): (Shape, Search), centres: &[V3], texels: &[MapTexel], rays: &[Ray]) -> Judged {
        let runtime = runtime();
        let mut g = Graph::new();
        let (nodes, triangles) = (g.upload("nodes", &self.tree.nodes), g.upload("triangles", &self.packed));
        let (places, texels) = (g.upload("centres", &places(centres)), g.upload("texels", texels));
        let rays = g.upload("rays", rays);
        let maps = Maps { shape, centres: &places, texels: &texels };
        let tree = Tree { nodes: &nodes, triangles: &triangles };
        let (hits, counts) = maps::judge(&mut g, tree, (maps, search), &rays);
        let (hits, counts) = (g.readback(&hits), g.readback(&counts));
        let plan = g.plan().expect("a valid plan");
        let mut executable = runtime.prepare(&plan).expect("memory");
        executable.run().expect("no validation message");
        proof::ran(&plan.dump());
        Judged { hits: executable.read(&hits), counts: executable.read(&counts) }
    }

    /// Rays from places that one of the centres sees, to the side from which it sees them.
    fn rays(&self, count: usize) -> Vec<Ray> {
        let mut random = Random(7);
        let dot = |a: V3, b: V3| (0..3).map(|k| a[k] * b[k]).sum::<f32>();
        (0..count)
            .map(|i| {
                let (centre, to, d) = (CENTRES[i % CENTRES.len()], random.direction(), random.direction());
                let hit = trace::traverse(&self.tree.nodes, &self.packed, &trace::ray(centre, to, f32::INFINITY));
                let t = &self.packed[hit.triangle as usize];
                let edge = |v: [f32; 4]| -> V3 { std::array::from_fn(|k| v[k] - t.v0[k]) };
                let (u, v) = (edge(t.v1), edge(t.v2));
                let normal: V3 =
                    std::array::from_fn(|k| u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3]);
                let turned = dot(normal, d) * dot(normal, to) > 0.0;
                let d = if turned { d.map(|x| -x) } else { d };
                let at: V3 = std::array::from_fn(|k| centre[k] + hit.t * to[k] + 1e-4 * d[k]);
                trace::ray(at, d, f32::INFINITY)
            })
            .collect()
    }
}

struct Judged {
    hits: Vec<RayHit>,
    counts: Vec<u32>,
}

impl Judged {
    fn count(&self, name: &str) -> u32 {
        self.counts[COUNTS.iter().position(|known| *known == name).expect("a count")]
    }
}

fn places(centres: &[V3]) -> Vec<[f32; 4]> {
    centres.iter().map(|[x, y, z]| [*x, *y, *z, 0.0]).collect()
}

const CENTRES: [V3; 3] = [[0.1, 1.5, -0.3], [-1.6, 0.4, 1.3], [1.5, 2.2, -1.7]];

/// Of texels, those that name another place than the ray through their middle meets.
fn wrong(found: &[MapTexel], wanted: &[MapTexel]) -> usize {
    let same = |a: &MapTexel, b: &MapTexel| {
        (a.triangle == MISS && b.triangle == MISS) || (a.distance - b.distance).abs() <= 1e-4 * b.distance
    };
    found.iter().zip(wanted).filter(|(a, b)| !same(a, b)).count()
}

#[test]
fn texels_are_what_rays_through_them_meet() {
    if Harness::skips_drawing() {
        return;
    }
    let room = Room::furnished();
    for resolution in [8, 33] {
        let shape = Shape { centres: 3, resolution, layers: 1 };
        let (texels, ..) = room.maps(shape, &CENTRES);
        for (centre, map) in CENTRES.iter().zip(texels.chunks(shape.texels_of_map() as usize)) {
            let wanted = reference::by_rays((&room.tree.nodes, &room.packed), *centre, resolution);
            // Where an edge passes within rounding of a texel's middle, either side may be drawn.
            let few = wanted.len() / 100;
            assert!(wrong(map, &wanted) <= few, "{} of {}", wrong(map, &wanted), wanted.len());
            assert!(map.iter().all(|texel| texel.triangle != MISS), "a closed room has no sky");
            let moved = reference::by_rays((&room.tree.nodes, &room.packed), [0.4, 1.5, -0.3], resolution);
            assert!(wrong(map, &moved) > few, "another place must be noticed");
        }
    }
    // Half open: upwards there is nothing.
    let floor = Room::new(&[([-2.0, -1.0, -2.0], [2.0, 0.0, 2.0])]);
    let (texels, ..) = floor.maps(Shape { centres: 1, resolution: 16, layers: 1 }, &[[0.0, 1.0, 0.0]]);
    let wanted = reference::by_rays((&floor.tree.nodes, &floor.packed), [0.0, 1.0, 0.0], 16);
    assert!(wrong(&texels, &wanted) <= 3 && texels.iter().filter(|t| t.triangle == MISS).count() > 600);
    proof::by(reference::by_rays, &["maps_draw_vert", "maps_draw_frag", "maps_pack"]);
}

#[test]
fn layers_lie_behind_each_other() {
    if Harness::skips_drawing() {
        return;
    }
    let room = Room::furnished();
    let shape = Shape { centres: 2, resolution: 24, layers: 3 };
    let (texels, ..) = room.maps(shape, &CENTRES[..2]);
    let of_map = shape.texels_of_map() as usize;
    let (mut second, mut third) = (0, 0);
    for i in 0..2 * of_map {
        let [a, b, c] = [texels[i], texels[i + 2 * of_map], texels[i + 4 * of_map]];
        assert!(b.distance > a.distance && (c.distance > b.distance || b.triangle == MISS), "texel {i}");
        second += usize::from(b.triangle != MISS);
        third += usize::from(c.triangle != MISS);
        // The second layer is what a ray meets that begins behind the first.
        if b.triangle != MISS && i % 7 == 0 {
            let (centre, d) = (CENTRES[i / of_map], reference::direction((i % of_map) as u32, 24));
            let length = d.iter().map(|x| x * x).sum::<f32>().sqrt();
            let start: V3 = std::array::from_fn(|k| centre[k] + d[k] / length * (a.distance * 1.0002));
            let hit = trace::traverse(&room.tree.nodes, &room.packed, &trace::ray(start, d.map(|x| x / length), 99.0));
            let expected = a.distance * 1.0002 + hit.t;
            assert!(hit.triangle == MISS || (b.distance - expected).abs() < 0.02 * expected, "texel {i}: {b:?}");
        }
    }
    assert!(second > 100 && third > 20 && third < second, "{second}, {third}");
}

/// Areas add up to those of the surfaces; a centre behind a wall sees what others do not.
#[test]
fn areas_and_masks_say_who_sees_what() {
    if Harness::skips_drawing() {
        return;
    }
    // Two rooms beside each other, each closed: 6 faces of 4 x 4 and of 2 x 2.
    let rooms = Room::new(&[([0.0; 3], [4.0, 4.0, 4.0]), ([5.0, 0.0, 0.0], [7.0, 2.0, 2.0])]);
    let centres = [[1.0, 2.0, 2.5], [3.0, 1.0, 1.0], [6.0, 1.0, 1.2]];
    let shape = Shape { centres: 3, resolution: 32, layers: 1 };
    let (_, areas, masks) = rooms.maps(shape, &centres);
    // The boxes are looked at from inside, so some faces show their back, which counts less: by a known factor.
    let seen = Seen { candidates: 3, areas: &areas, seen_by: &masks };
    let [first, second, third] = [0, 1, 2].map(|c| seen.new_area(c, &[]));
    assert!((first / second - 1.0).abs() < 0.05 && (first / third - 4.0).abs() < 0.3, "{first} {second} {third}");
    assert!(seen.new_area(1, &[0]) < 0.02 * second, "what one sees, the other sees: {}", seen.new_area(1, &[0]));
    assert!((seen.new_area(2, &[0, 1]) / third - 1.0).abs() < 1e-6, "and nobody sees into the other room");
    let choice = seen.choose(2);
    assert!(choice.chosen.contains(&2) && choice.chosen.len() == 2, "{choice:?}");
    assert!(seen.covered(&choice.chosen, &[0, 1, 2]) > 0.97 && seen.covered(&[0, 1], &[0, 1, 2]) < 0.85);
    // With nothing in between every texel sees its own centre.
    let own = |i: usize| masks[i][0] >> (i / shape.texels_of_map() as usize) & 1 == 1;
    assert!((0..masks.len()).all(own), "a centre sees what its map shows");
    proof::by_answer(&["maps_seen"]);
}

/// As many maps as the settings allow, searched by steps: some drivers cut long loops without a word, and maps that are
/// not looked at would count as nothing.
#[test]
fn no_map_of_many_is_left_out() {
    if Harness::skips_drawing() {
        return;
    }
    let room = Room::furnished();
    let centres: Vec<V3> = (0..32).map(|i| CENTRES[i % 3].map(|x| x * (0.97 - 0.01 * i as f32))).collect();
    let shape = Shape { centres: 32, resolution: 8, layers: 4 };
    let (texels, ..) = room.maps(shape, &centres);
    let rays = room.rays(256);
    let found = room.judged((shape, Search::STEPS), &centres, &texels, &rays);
    let each: u32 = ["none", "beside", "later", "right", "early"].map(|name| found.count(name)).iter().sum();
    assert_eq!(each, 256 * 128, "by every map once");
    assert!(found.count("all_right") > 200, "{:?}", found.counts);
}

#[test]
fn searches_are_those_of_the_reference() {
    if Harness::skips_drawing() {
        return;
    }
    let room = Room::furnished();
    let shape = Shape { centres: 3, resolution: 64, layers: 2 };
    let (texels, ..) = room.maps(shape, &CENTRES);
    let rays = room.rays(1500);
    for search in [Search::PAPER, Search::STEPS] {
        let found = room.judged((shape, search), &CENTRES, &texels, &rays);
        let (mut same, mut hits) = (0, 0);
        for (ray, hit) in rays.iter().zip(&found.hits) {
            let [origin, d] = [ray.origin, ray.direction].map(|v| [v[0], v[1], v[2]]);
            let wanted = reference::nearest((&texels, shape), &room.packed, &CENTRES, (origin, d, search));
            hits += usize::from(wanted.is_some());
            // Functions of the device differ in the last bits, and a step then ends in the texel beside.
            same += usize::from(match wanted {
                None => hit.triangle == MISS,
                Some((_, wanted)) => hit.triangle != MISS && (hit.t - wanted.t).abs() <= 1e-3 * wanted.t + 1e-4,
            });
        }
        let of_rays = rays.len() as u32;
        let all = ["all_right", "all_wrong", "all_lost", "all_escaped", "all_phantom"].map(|name| found.count(name));
        println!("{search:?}: {same} of {} as by the reference, {hits} found; {:?}", rays.len(), found.counts);
        assert!(same * 1000 >= rays.len() * 995, "{search:?}: {same} of {}", rays.len());
        assert_eq!(all.iter().sum::<u32>(), of_rays, "every ray is judged once");
        let each = ["none", "beside", "later", "right", "early"].map(|name| found.count(name));
        assert_eq!(each.iter().sum::<u32>(), of_rays * shape.centres * shape.layers, "by every map once");
        // A closed room that three centres see most of: the paper's search finds half of the hits there, steps more.
        let least = if search.steps == 0 { 45 } else { 75 };
        assert!(all[0] * 100 > of_rays * least && all[3] == 0 && all[4] == 0, "{all:?}");
        // Maps of another place know little.
        let elsewhere = CENTRES.map(|[x, y, z]| [-x, y, -z]);
        let confused = room.judged((shape, search), &elsewhere, &texels, &rays);
        assert!(confused.count("all_right") * 10 < all[0] * 8, "{:?}", confused.counts);
    }
    proof::by(reference::nearest, &["maps_judge"]);
}
