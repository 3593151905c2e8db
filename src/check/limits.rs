//! Sums, counters and structures at the ends of their ranges: cases 26 to 28, 32, 43 and 44.

use super::lab::{Lab, settings};
use super::scenes::{lamp, room};
use super::{Case, Within};
use crate::error::{Error, Result};
use crate::film::exact::ExactSum;
use crate::graph::{Buf, Graph};
use crate::kernels::compact;
use crate::kernels::deposits::Deposits;
use crate::kernels::gather::hash::{Options, hash, hash_grid};
use crate::kernels::gather::reference::{Disc, lambert_hit};
use crate::kernels::gather::{Points, Program, Walk, Weight, brute};
use crate::kernels::generated::{Aabb, EyeHit, Pass, Photon};
use crate::kernels::{Items, reduce, scan};
use crate::picture::exr;
use crate::picture::image::{Channels, Picture};
use crate::render::{Estimator, Session, Settings};
use crate::scene::{Light, Material, Scene};

pub(super) const CASES: &[Case] = &[
    Case {
        number: 26,
        title: "film of 2^24 + 1 passes of 0.1",
        reason: "0.1; sums are exact integers, where a sum of single floats is off by 8.8 % at 10^7 passes",
        parameter: None,
        run: film_sums,
    },
    Case {
        number: 27,
        title: "counters of photons beyond 2^24 and 2^32",
        reason: "exact",
        parameter: None,
        run: counters,
    },
    Case {
        number: 28,
        title: "values of 7e4 and 1e9 in a picture's file",
        reason: "EXR files of this renderer hold single floats, so values beyond half floats come back as they are",
        parameter: None,
        run: bright_files,
    },
    Case {
        number: 32,
        title: "hash grid, extent over radius 10^13",
        reason: "brute force; sums of single floats in another order",
        parameter: None,
        run: wide_grid,
    },
    Case {
        number: 43,
        title: "past limits of devices: groups along an axis, 128 MiB of a binding, bands of a picture",
        reason: "split is whole: exact",
        parameter: None,
        run: split,
    },
    Case {
        number: 44,
        title: "all photons in one place",
        reason: "brute force; nothing is dropped without being counted",
        parameter: None,
        run: crowd,
    },
];

fn film_sums(lab: &mut Lab) -> Result<()> {
    let passes = (1_u32 << lab.pick(20, 24)) + 1;
    let (mut naive, mut exact) = (0.0_f32, ExactSum::default());
    for _ in 0..passes {
        naive += 0.1;
        exact = exact.plus(0.1);
    }
    let mean = |sum: f64| sum / f64::from(passes);
    lab.found("mean", mean(exact.to_f64()), f64::from(0.1_f32), Within::Part(1e-12)).not(mean(f64::from(naive)));
    Ok(())
}

fn counters(lab: &mut Lab) -> Result<()> {
    let device = lab.runtime().device().clone();
    let scene = room(Material::lambert([0.5; 3]), vec![lamp()]);
    let photons = 1000u32;
    let settings = settings(4, 4, photons);
    let mut session = Session::new(&device, scene, settings)?;
    session.run_pass(0)?;
    for start in [1u64 << 24, (1 << 32) - 5, u64::from(u32::MAX) * 1000] {
        let mut totals = session.statistics()?.totals();
        (totals.photons, totals.deposits) = (start, start);
        let film = session.film()?;
        session.resume(&film, &totals)?;
        let next = film.passes.count();
        session.run_pass(next)?;
        let found = session.statistics()?.photons;
        let off = found.wrapping_sub(start + u64::from(photons)) as f64;
        lab.found(format!("photons after {start} and a pass: difference"), off, 0.0, Within::Exact);
    }
    // On the device: more than single floats can count.
    let n = (1u32 << 24) + lab.pick(3, 1 << 20);
    let mut g = Graph::new();
    let mut ones = g.buffer("ones", n);
    g.fill(&mut ones, 1);
    let mut sum = g.buffer("sum", 1);
    reduce::u32s(&mut g, Items::All, reduce::Op::Sum, &ones, &mut sum);
    let sum = g.readback(&sum);
    let found = lab.run(g, |executable| executable.read(&sum)[0])?;
    lab.found("sum of ones on the device", f64::from(found), f64::from(n), Within::Exact);
    Ok(())
}

fn bright_files(lab: &mut Lab) -> Result<()> {
    let values = [7e4f32, 1e9, 65_504.0, 1e-9, 0.0, 3e38];
    let mut picture = Picture::new(2, 1);
    picture.push("", Channels::Rgb, values.to_vec());
    let file = tempfile::NamedTempFile::new().map_err(|e| Error::io(std::env::temp_dir(), "create a file in", e))?;
    let sink = file.reopen().map_err(|source| Error::io(file.path(), "open", source))?;
    exr::write(sink, file.path(), &picture, &Default::default())?;
    let (read, _) = exr::read(file.path())?;
    for (found, expected) in read.layer("").map_or(&[][..], |layer| &layer.data).iter().zip(values) {
        lab.found(format!("{expected:e}"), f64::from(*found), f64::from(expected), Within::Exact);
    }
    Ok(())
}

/// A level disc that receives light from above.
fn disc(position: [f32; 3], radius: f32, flux: f32) -> Disc {
    Disc {
        position,
        normal: [0.0, 1.0, 0.0],
        radii: [radius, 0.5 * radius],
        flux: [flux; 3],
        direction: [0.0, -1.0, 0.0],
        caustic: false,
    }
}

/// What `estimator` gathers at hits: the red channel of light that is no caustic.
fn gathered(
    lab: &mut Lab,
    hits: &[EyeHit],
    discs: &[Disc],
    estimator: impl Fn(&mut Graph, Program, Points<'_>, &Deposits, &mut Buf<[f32; 4]>),
) -> Result<Vec<f64>> {
    let (photons, boxes): (Vec<Photon>, Vec<Aabb>) = discs.iter().map(Disc::stored).unzip();
    let mut g = Graph::new();
    let count = |g: &mut Graph, n: usize| g.upload("count", &[n as u32]);
    let copied = count(&mut g, discs.len());
    let mut deposits = Deposits::new(&mut g, discs.len() as u32);
    g.copy(&copied, &mut deposits.count);
    let (photons, boxes) = (g.upload("photons", &photons), g.upload("boxes", &boxes));
    g.copy(&photons, &mut deposits.photons);
    g.copy(&boxes, &mut deposits.boxes);
    let (listed, all) = (count(&mut g, hits.len()), (0..hits.len() as u32).collect::<Vec<_>>());
    let (hits, list) = (g.upload("hits", hits), g.upload("list", &all));
    let args = compact::dispatch_args(&mut g, &listed, all.len() as u32, 64);
    let pass = g.upload("pass", &[Pass { radius_scale: 1.0, ..Pass::default() }]);
    let lobes = g.upload("lobes", &[0u32]);
    let points = Points { hits: &hits, list: &list, count: &listed, args: &args, pass: &pass, lobes: &lobes };
    let program = Program {
        glossy: false,
        smooth_normals: false,
        blinn_phong: false,
        weight: Weight::Epanechnikov,
        count_pairs: false,
        walk: Walk::FULL,
        loop_limit: lab.runtime().device().loop_limit(),
    };
    let mut target = g.buffer("gathered", 2 * all.len() as u32);
    g.fill(&mut target, 0);
    estimator(&mut g, program, points, &deposits, &mut target);
    let target = g.readback(&target);
    let found = lab.run(g, |executable| executable.read(&target))?;
    Ok(found.chunks(2).map(|pair| f64::from(pair[1][0])).collect())
}

/// Light at the hits by brute force, and by the hash grid.
fn by_brute_force_and_hash(lab: &mut Lab, hits: &[EyeHit], discs: &[Disc]) -> Result<[Vec<f64>; 2]> {
    let expected = gathered(lab, hits, discs, |g, program, points, deposits, target| {
        brute(g, program, points, (&deposits.photons, &deposits.count), target);
    })?;
    let found = gathered(lab, hits, discs, |g, program, points, deposits, target| {
        let grid = hash_grid(g, deposits, Options::default(), None);
        hash(g, program, points, (&grid, deposits), target);
    })?;
    Ok([expected, found])
}

fn wide_grid(lab: &mut Lab) -> Result<()> {
    let mut discs = vec![];
    for (k, scale) in [1e13f32, 3e10, 2e7, 4e6, 1e5, 1.0].into_iter().enumerate() {
        for i in 0..80u32 {
            let angle = 2.399_963 * i as f32 + k as f32;
            let place = |x: f32| scale * x * (0.2 + i as f32 / 100.0);
            // Spread over the whole scale, and a crowd at one place of it.
            discs.push(disc([place(angle.cos()), 0.0, place(angle.sin())], 1.0, 1.0));
            discs.push(disc([scale + 2.0 * angle.cos(), 0.0, 2.0 * angle.sin()], 1.0, 0.5));
        }
    }
    let hits: Vec<EyeHit> = discs.iter().map(|d| lambert_hit(d.position, d.normal, [1.0; 3])).collect();
    let [expected, found] = by_brute_force_and_hash(lab, &hits, &discs)?;
    let off = found.iter().zip(&expected).map(|(a, b)| (a - b).abs() / b.abs().max(1e-30)).fold(0.0, super::lab::worse);
    lab.found("largest difference to brute force", off, 1e-6, Within::AtMost);
    lab.found("hits with light", expected.iter().filter(|x| **x > 0.0).count() as f64, 900.0, Within::AtLeast);
    Ok(())
}

fn crowd(lab: &mut Lab) -> Result<()> {
    let n = lab.pick(50_000, 200_000);
    let discs: Vec<Disc> = (0..n).map(|i| disc([0.25, 0.0, 0.25], 0.1, 1.0 + (i % 7) as f32)).collect();
    let hits: Vec<EyeHit> =
        [0.25, 0.27, 0.3, 0.34].map(|x| lambert_hit([x, 0.0, 0.25], [0.0, 1.0, 0.0], [1.0; 3])).to_vec();
    let [expected, found] = by_brute_force_and_hash(lab, &hits, &discs)?;
    // At the centre the weight is 2 / (pi a b): the sum in double precision.
    let flux: f64 = discs.iter().map(|d| f64::from(d.flux[0])).sum();
    let centre = flux * 2.0 / (std::f64::consts::PI * 0.1 * 0.05);
    lab.found("at the centre, by brute force", expected[0], centre, Within::Part(1e-4));
    for (k, (found, expected)) in found.iter().zip(&expected).enumerate() {
        lab.found(format!("hit {k}, hash grid and brute force"), *found, *expected, Within::Part(1e-4));
    }
    // Whole renders: a spotlight by way of a mirror puts all photons of a pass in one place.
    let light = Light::Spot {
        position: [0.0, 3.0, 0.0],
        direction: [0.0, 1.0, 0.0],
        intensity: [1.0; 3],
        inner_angle: 1e-3,
        outer_angle: 2e-3,
    };
    let mirror = crate::scene::shapes::Mesh::quad([-0.003, 4.0, -0.003], [0.006, 0.0, 0.0], [0.0, 0.0, 0.006]);
    let parts = vec![(super::scenes::floor(2.0, 0.0), Material::lambert([0.5; 3])), (mirror, Material::mirror())];
    let scene = Scene::from_parts(parts, vec![light], super::scenes::from_above([0.0, 2.0, 0.0], 0.02));
    let mut means = vec![];
    for estimator in [Estimator::Brute, Estimator::Bvh, Estimator::Hash, Estimator::Tiled] {
        let settings = Settings { estimator: Some(estimator), ..settings(8, 8, 20_000) };
        means.push((estimator.name(), lab.shot(&scene, &settings, 0..1)?.mean("caustic")));
    }
    lab.holds("whole render: there is light", means[0].1 > 0.0);
    for (name, mean) in &means[1..] {
        lab.found(format!("whole render, {name} and brute force"), *mean, means[0].1, Within::Part(1e-5));
    }
    Ok(())
}

fn split(lab: &mut Lab) -> Result<()> {
    // More groups of 256 than the 65,535 that an axis has, and a buffer beyond 128 MiB where the device has one.
    let longest = lab.runtime().device().info().limits.storage_range / 4;
    let wanted = (1u64 << 25) + 257;
    let n = wanted.min(longest).min(lab.pick(1 << 24, wanted) + 257) as u32;
    let mut g = Graph::new();
    let mut ones = g.buffer("ones", n);
    g.fill(&mut ones, 1);
    let (mut sums, mut total) = (g.buffer("sums", n), g.buffer("total", 1));
    scan::exclusive(&mut g, Items::All, &ones, &mut sums, &mut total);
    let mut greatest = g.buffer("greatest", 1);
    reduce::u32s(&mut g, Items::All, reduce::Op::Max, &sums, &mut greatest);
    let (greatest, total) = (g.readback(&greatest), g.readback(&total));
    let (greatest, total) = lab.run(g, |executable| (executable.read(&greatest)[0], executable.read(&total)[0]))?;
    lab.found(format!("prefix sum of {n} ones: total"), f64::from(total), f64::from(n), Within::Exact);
    lab.found("its last entry", f64::from(greatest), f64::from(n - 1), Within::Exact);
    // A picture of several bands against the same pixels of one band: the camera is parallel, so that a part of the
    // picture is a picture.
    let mut scene = room(Material::lambert([0.5; 3]), vec![lamp()]);
    scene.cameras = vec![super::scenes::from_above([0.0, 2.4, 0.0], 1.0)];
    let side = 1024;
    let settings = Settings { layers: false, ..settings(side, side, 0) };
    let device = lab.runtime().device().clone();
    let mut whole = Session::new(&device, scene.clone(), settings.clone())?;
    whole.run_pass(0)?;
    let picture = whole.film()?.picture();
    let red = |picture: &Picture| -> Vec<f32> {
        picture.layer("").map_or(vec![], |layer| layer.data.iter().step_by(3).copied().collect())
    };
    let (pixels, n) = (red(&picture), side as usize);
    let half = |first: usize| {
        let part = &pixels[first * n * n / 2..][..n * n / 2];
        part.iter().map(|x| f64::from(*x)).sum::<f64>() / part.len() as f64
    };
    let coarse = lab.shot(&scene, &Settings { width: 64, height: 64, ..settings }, 0..64)?.red("");
    for (name, first) in [("upper", 0), ("lower", 1)] {
        let expected = coarse[first * 2048..][..2048].iter().sum::<f64>() / 2048.0;
        lab.found(
            format!("{name} half of 1024 x 1024 pixels and of 64 x 64"),
            half(first),
            expected,
            Within::Part(0.01),
        );
    }
    Ok(())
}
