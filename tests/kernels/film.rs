//! The film kernel against the exact sums of the host.

use nephroid::low_level::constants::{AOV_AT_DEPTH, AOV_FLOATS};
use nephroid::low_level::film::exact::{ExactSum, LARGEST};
use nephroid::low_level::graph::DeviceClass;
use nephroid::low_level::kernels::film::{self, Adding, FILM_SUMS, FilmBuffers, LAYER_SUMS, PassResult};
use nephroid::low_level::kernels::generated::{Camera, Pass};

use crate::support::harness::{Harness, Output, POISON_WORD, assert_same};
use crate::support::proof;
use crate::support::random::Random;

const PIXELS: u32 = 777;
const SLOTS: u32 = 3;
/// Radiance is counted in units of 8, depths in quarters.
const EXPONENTS: [i32; 2] = [3, -2];
const SCALE: f32 = 0.3;
const FLOATS: usize = AOV_FLOATS as usize;
const DEPTH: usize = AOV_AT_DEPTH as usize;

/// Values of every order of magnitude, some beyond the range, some not numbers.
fn awkward(count: usize, seed: u64) -> Vec<f32> {
    let mut random = Random(seed);
    let value = |_| match random.bits() % 64 {
        0 => f32::NAN,
        1 => f32::NEG_INFINITY,
        2 => -1e12,
        3 => 2f32.powi(60),
        4 => 0.0,
        _ => (random.unit() - 0.25) * 2f32.powi((random.bits() % 90) as i32 - 62),
    };
    (0..count).map(value).collect()
}

struct Sample {
    radiance: Vec<[f32; 4]>,
    gathered: Vec<[f32; 4]>,
    aov: Vec<f32>,
}

fn sample() -> Sample {
    let slots = (PIXELS * SLOTS) as usize;
    let vectors = |numbers: Vec<f32>| numbers.chunks(4).map(|v| [v[0], v[1], v[2], v[3]]).collect();
    let mut random = Random(5);
    let mut aov: Vec<f32> = (0..AOV_FLOATS * PIXELS).map(|_| random.unit() - 0.5).collect();
    aov.chunks_mut(FLOATS).step_by(5).for_each(|floats| floats[DEPTH] = f32::INFINITY);
    Sample { radiance: vectors(awkward(4 * slots, 1)), gathered: vectors(awkward(8 * slots, 2)), aov }
}

/// What the kernel must leave, and how many pixels are tallied.
fn expected(sample: &Sample, start: ExactSum) -> (Vec<[u32; 4]>, Vec<[u32; 4]>, u32) {
    let (mut film, mut layers, mut rejected) = (vec![], vec![], 0);
    let [unit, depth_unit] = EXPONENTS.map(|exponent| 2f32.powi(-exponent));
    for pixel in 0..PIXELS as usize {
        let slots = || (0..SLOTS as usize).map(|i| i * PIXELS as usize + pixel);
        let sum = |at: &dyn Fn(usize) -> [f32; 4]| {
            slots().fold([0.0f32; 3], |sum, slot| std::array::from_fn(|k| sum[k] + at(slot)[k]))
        };
        let mut parts = [
            sum(&|slot| sample.radiance[slot]),
            sum(&|slot| sample.gathered[2 * slot + 1]),
            sum(&|slot| sample.gathered[2 * slot]),
        ];
        let value = |parts: &[[f32; 3]; 3]| [0, 1, 2].map(|k| parts[0][k] + parts[2][k] + parts[1][k]);
        if value(&parts).iter().any(|x| !x.is_finite()) {
            parts = [[0.0; 3]; 3];
            rejected += 1;
        }
        let scaled = value(&parts).map(|x| x * unit);
        rejected += u32::from(scaled.iter().any(|x| x.abs() > LARGEST));
        let cut = |x: f32| x.clamp(-LARGEST, LARGEST);
        let squares = scaled.map(|x| (cut(x) * cut(x)).min(LARGEST));
        let products = scaled.map(|x| cut(x) * (SCALE * SCALE));
        film.extend([scaled.map(cut), squares, products].as_flattened().iter().map(|&x| start.plus(x).words()));
        let aov = &sample.aov[FLOATS * pixel..][..FLOATS];
        let seen = aov[DEPTH].is_finite();
        let depth = if seen { [aov[DEPTH] * depth_unit, 1.0] } else { [0.0; 2] };
        let light = parts.map(|part| part.map(|x| cut(x * unit)));
        let numbers = aov[..DEPTH].iter().chain(&depth).chain(light.as_flattened());
        layers.extend(numbers.map(|&x| start.plus(x).words()));
    }
    (film, layers, rejected)
}

/// The kernel adds to sums that hold poison already: a negative number, so that borrows are met.
#[test]
fn the_kernel_adds_exactly() {
    let h = Harness::lock();
    let sample = sample();
    let camera = Camera { pixels: PIXELS, slots: SLOTS, ..Camera::default() };
    let (camera, pass) = (h.input(&[camera]), h.input(&[Pass { radius_scale: SCALE, ..Pass::default() }]));
    let (radiance, gathered) = (h.input(&sample.radiance), h.input(&sample.gathered));
    let (aov, overflow, no_overflow) = (h.input(&sample.aov), h.input(&[7u32]), h.input(&[0u32]));
    let film: Output<[u32; 4]> = h.output((PIXELS * FILM_SUMS) as usize);
    let layers: Output<[u32; 4]> = h.output((PIXELS * LAYER_SUMS) as usize);
    let rejected: Output<u32> = h.output(1);
    let run = |overflow| {
        h.run_on(DeviceClass::Cpu, &[&film, &layers, &rejected], |g| {
            let (camera, pass) = (g.import_read(&camera), g.import_read(&pass));
            let (radiance, gathered) = (g.import_read(&radiance), g.import_read(&gathered));
            let (aov_first, overflow) = (g.import_read(&aov), g.import_read(overflow));
            let mut buffers = FilmBuffers {
                film: g.import(film.memory()),
                layers: g.import(layers.memory()),
                rejected: g.import(rejected.memory()),
            };
            let result =
                PassResult { radiance: &radiance, gathered: &gathered, aov_first: &aov_first, overflow: &overflow };
            let adding = Adding { pixels: PIXELS, aov: true, exponents: EXPONENTS };
            film::add(g, (&camera, &pass), adding, result, &mut buffers);
            g.keep(&buffers.film);
            g.keep(&buffers.layers);
            g.keep(&buffers.rejected);
        });
        (h.content(&film), h.content(&layers), h.content(&rejected)[0].wrapping_sub(POISON_WORD))
    };
    let poison = ExactSum::from_words([POISON_WORD; 4]);
    let (wanted, wanted_layers, tally) = expected(&sample, poison);
    let found = run(&no_overflow);
    assert_same(&found.0, &wanted, "film");
    assert_same(&found.1, &wanted_layers, "layers");
    assert_eq!(found.2, tally);
    assert!(tally > 50 && (tally as usize) < PIXELS as usize, "the values are awkward: {tally}");
    let nothing = vec![poison.words(); wanted.len()];
    assert_same(&run(&overflow).0, &nothing, "a pass that did not fit");
    assert_ne!(wanted, nothing, "the check can fail");
    proof::by(ExactSum::plus, &["film_add"]);
}
