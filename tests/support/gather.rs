//! Photons and eye hits made up by tests, gathered by any estimator, beside the specification in double precision.

use nephroid::low_level::graph::{Buf, DeviceClass, Graph, Persistent};
use nephroid::low_level::kernels::compact;
use nephroid::low_level::kernels::deposits::{COUNTERS, Deposits};
use nephroid::low_level::kernels::gather::reference::Disc;
use nephroid::low_level::kernels::gather::{Band, Points, Program, Walk, Weight};
use nephroid::low_level::kernels::generated::{Aabb, Camera, EyeHit, Pass, Photon};

use super::harness::{Harness, same_commands};
use super::random::Random;
use super::view::{Frame, View};

/// Gathered light of a slot: caustic, then other; photons tested and accepted in the fourth components.
pub type Light = [[f32; 4]; 2];

/// A program for Lambert surfaces that counts pairs.
pub fn lambert(harness: &Harness, weight: Weight) -> Program {
    Program {
        glossy: false,
        smooth_normals: false,
        blinn_phong: false,
        weight,
        count_pairs: true,
        walk: Walk::FULL,
        loop_limit: harness.loop_limit(),
    }
}

/// What an estimator, declared by `declare`, gathers at `hits` (one slot each, all listed) from `photons`.
///
/// Two runs must give the same bits, on graphs for both kinds of device.
pub fn gathered(
    harness: &Harness,
    hits: &[EyeHit],
    photons: &[Disc],
    declare: impl Fn(&mut Graph, Points<'_>, &mut Deposits, &mut Buf<[f32; 4]>),
) -> Vec<Light> {
    let (stored, boxes): (Vec<Photon>, Vec<Aabb>) = photons.iter().map(Disc::stored).unzip();
    let (stored, boxes, hits_memory) = (harness.input(&stored), harness.input(&boxes), harness.input(hits));
    let list: Vec<u32> = (0..hits.len() as u32).collect();
    let (list, output) = (harness.input(&list), harness.output::<[f32; 4]>(2 * hits.len()));
    harness.run(&[&output], |g| {
        let mut deposits = deposits(g, &stored, &boxes);
        let (hits_buffer, list) = (g.import_read(&hits_memory), g.import_read(&list));
        let count = counted(g, hits.len() as u32);
        let args = compact::dispatch_args(g, &count, hits.len() as u32, 64);
        let pass = g.upload("pass", &[Pass { radius_scale: 1.0, ..Pass::default() }]);
        let mut target = g.import(output.memory());
        let lobes = g.upload("lobes", &[0u32]);
        let points = Points { hits: &hits_buffer, list: &list, count: &count, args: &args, pass: &pass, lobes: &lobes };
        declare(g, points, &mut deposits, &mut target);
        g.keep(&target);
    });
    harness.content(&output).chunks(2).map(|pair| [pair[0], pair[1]]).collect()
}

/// What an estimator, declared by `declare`, gathers at `hits` from `photons`. The hits are given to it at the pixels
/// where `view` sees them, in as many frames as no pixel has two; each band is a graph of its own.
///
/// Two runs must give the same bits; graphs for the two kinds of device may add in another order.
pub fn gathered_at(
    harness: &Harness,
    view: &View,
    (hits, photons): (&[EyeHit], &[Disc]),
    declare: impl Fn(&mut Graph, (Points<'_>, Band<'_>), &mut Deposits, &mut Buf<[f32; 4]>),
) -> Vec<Light> {
    let mut result = vec![[[f32::NAN; 4]; 2]; hits.len()];
    for frame in view.frames(hits) {
        let classes = [DeviceClass::Cpu, DeviceClass::Gpu];
        let lights = one_frame(harness, (view, &frame, &classes), hits, photons, &declare);
        let [cpu, gpu] = <[_; 2]>::try_from(lights).expect("light for each class");
        let wide = |light: &Light| light.map(|l| [f64::from(l[0]), f64::from(l[1]), f64::from(l[2])]);
        let expected: Vec<_> = cpu.iter().map(wide).collect();
        assert_eq!(difference(&gpu, &expected, 1e-5), None, "kinds of device differ");
        assert!(cpu.iter().zip(&gpu).all(|(a, b)| a[1][3] == b[1][3]), "kinds of device accept other photons");
        frame.places.iter().zip(cpu).for_each(|((_, index), light)| result[*index] = light);
    }
    result
}

/// As [`gathered_at`], on graphs for one kind of device: for what depends on how large tiles are there.
pub fn gathered_on(
    harness: &Harness,
    (view, class): (&View, DeviceClass),
    (hits, photons): (&[EyeHit], &[Disc]),
    declare: impl Fn(&mut Graph, (Points<'_>, Band<'_>), &mut Deposits, &mut Buf<[f32; 4]>),
) -> Vec<Light> {
    let mut result = vec![[[f32::NAN; 4]; 2]; hits.len()];
    for frame in view.frames(hits) {
        let mut found = one_frame(harness, (view, &frame, &[class]), hits, photons, &declare);
        frame.places.iter().zip(found.remove(0)).for_each(|((_, index), light)| result[*index] = light);
    }
    result
}

/// The light of the hits of a frame, in their order there, on graphs for each of the classes; graphs with the commands
/// of the first one's are not run.
fn one_frame(
    harness: &Harness,
    (view, frame, classes): (&View, &Frame, &[DeviceClass]),
    hits: &[EyeHit],
    photons: &[Disc],
    declare: &impl Fn(&mut Graph, (Points<'_>, Band<'_>), &mut Deposits, &mut Buf<[f32; 4]>),
) -> Vec<Vec<Light>> {
    let (stored, boxes): (Vec<Photon>, Vec<Aabb>) = photons.iter().map(Disc::stored).unzip();
    let [first_pixel, pixels] = frame.band;
    let mut slots = vec![<EyeHit as bytemuck::Zeroable>::zeroed(); pixels as usize];
    frame.places.iter().for_each(|(pixel, index)| slots[*pixel as usize] = hits[*index]);
    let (stored, boxes, hits_memory) = (harness.input(&stored), harness.input(&boxes), harness.input(&slots));
    let list: Vec<u32> = frame.places.iter().map(|(pixel, _)| *pixel).collect();
    let (list, output) = (harness.input(&list), harness.output::<[f32; 4]>(2 * pixels as usize));
    let declare = |g: &mut Graph| {
        let mut deposits = deposits(g, &stored, &boxes);
        let (hits_buffer, list) = (g.import_read(&hits_memory), g.import_read(&list));
        let count = counted(g, list.len());
        let args = compact::dispatch_args(g, &count, list.len(), 64);
        let camera = g.upload("camera", &[Camera { first_pixel, pixels, ..view.camera }]);
        let pass = g.upload("pass", &[Pass { radius_scale: 1.0, ..Pass::default() }]);
        let mut target = g.import(output.memory());
        let lobes = g.upload("lobes", &[0u32]);
        let points = Points { hits: &hits_buffer, list: &list, count: &count, args: &args, pass: &pass, lobes: &lobes };
        let size = [view.camera.width, view.camera.height];
        let band = Band { camera: &camera, size, first_pixel, pixels };
        declare(g, (points, band), &mut deposits, &mut target);
        g.keep(&target);
    };
    let lights = |class| {
        harness.run_on(class, &[&output], declare);
        let all = harness.content(&output);
        frame.places.iter().map(|(pixel, _)| [all[2 * *pixel as usize], all[2 * *pixel as usize + 1]]).collect()
    };
    let mut found: Vec<Vec<Light>> = vec![];
    for &class in classes {
        let known = found.first().filter(|_| same_commands(declare)).cloned();
        found.push(known.unwrap_or_else(|| lights(class)));
    }
    found
}

/// Deposits as many as there is room for.
pub fn deposits(g: &mut Graph, stored: &Persistent<Photon>, boxes: &Persistent<Aabb>) -> Deposits {
    Deposits {
        photons: g.import(stored),
        boxes: g.import(boxes),
        count: counted(g, stored.len()),
        overflow: counted(g, 0),
        counters: g.buffer("counters", COUNTERS.len() as u32),
        truncated: vec![],
        energies: vec![],
    }
}

fn counted(g: &mut Graph, value: u32) -> Buf<u32> {
    let mut count = g.buffer("count", 1);
    g.fill(&mut count, value);
    count
}

/// The first slot and number where `found` differs from `expected` by more than `tolerance`, relative to the largest
/// component of the pair of slots' light.
pub fn difference(found: &[Light], expected: &[[[f64; 3]; 2]], tolerance: f64) -> Option<String> {
    assert_eq!(found.len(), expected.len());
    found.iter().zip(expected).enumerate().find_map(|(slot, (f, e))| {
        let scale = e.iter().flatten().fold(0.0f64, |a, x| a.max(x.abs()));
        (0..6).find_map(|at| {
            let (f, e) = (f64::from(f[at / 3][at % 3]), e[at / 3][at % 3]);
            let close = (f - e).abs() <= tolerance * scale;
            (!close).then(|| format!("slot {slot}, number {at}: {f:e}, not {e:e}"))
        })
    })
}

/// Photons of one radius or of many on the floor y = 0 of the unit square and on a wall beside it, with hits among
/// them, a third of which have boundaries.
pub fn room(photons: usize, hits: usize, radius: impl Fn(&mut Random) -> [f32; 2]) -> (Vec<Disc>, Vec<EyeHit>) {
    use nephroid::low_level::kernels::gather::reference::{BOUNDARY_FAR, Boundaries, lambert_hit};
    let mut random = Random(7);
    let place = |r: &mut Random| {
        let (u, v, wall) = (r.unit(), r.unit(), r.unit() < 0.3);
        if wall { ([0.0, u, v], [1.0, 0.0, 0.0]) } else { ([u, 0.0, v], [0.0, 1.0, 0.0]) }
    };
    let discs = (0..photons)
        .map(|i| {
            let (position, normal) = place(&mut random);
            let direction = random.direction();
            let towards = (0..3).map(|k| direction[k] * normal[k]).sum::<f32>();
            let direction = if towards > 0.0 { direction.map(|x| -x) } else { direction };
            let flux = [random.unit(), random.unit(), random.unit()];
            Disc { position, normal, radii: radius(&mut random), flux, direction, caustic: i % 3 == 0 }
        })
        .collect();
    let hits = (0..hits).map(|i| {
        let (position, normal) = place(&mut random);
        let across = if normal[0] == 0.0 { [0.6, 0.0, -0.8] } else { [0.0, 0.8, 0.6] };
        let reach = [0, 1, 2, 3].map(|k| if ((i / 3) >> k) & 1 == 1 { 0.4 * random.unit() } else { BOUNDARY_FAR });
        let e = if i % 3 == 0 { Boundaries { across, reach, unit: 0.5 }.stored() } else { [0; 4] };
        EyeHit { e, ..lambert_hit(position, normal, [0.3, 0.2, 0.1]) }
    });
    (discs, hits.collect())
}
