//! The ledger of the photons' light against its specification.

use nephroid::low_level::constants::{ENERGIES, ENERGY_CUT, ENERGY_IN_FLIGHT, PATH_END_SHIFT};
use nephroid::low_level::graph::Grid;
use nephroid::low_level::kernels::energy::{self, Ledger, Photons, cut, reference};

use crate::support::harness::{Harness, assert_same};
use crate::support::proof;
use crate::support::random::Random;

/// Photons of every order of magnitude, with every end; some are not finite.
fn photons(count: usize, seed: u64) -> (Vec<[f32; 4]>, Vec<[f32; 4]>, Vec<u32>) {
    let mut random = Random(seed);
    let mut number = || random.unit() * 2f32.powi((random.bits() % 40) as i32 - 20);
    let flux = (0..count).map(|i| [if i % 97 == 5 { f32::NAN } else { number() }, number(), number(), 7.0]).collect();
    let rays = (0..2 * count).map(|_| [1.0, 2.0, 3.0, number()]).collect();
    let states = (0..count as u32).map(|i| (i * 7 % ENERGIES) << PATH_END_SHIFT | i & 0xff_ffff).collect();
    (rays, flux, states)
}

fn on_device(harness: &Harness, (rays, flux, states): (&[[f32; 4]], &[[f32; 4]], &[u32])) -> Vec<[f32; 2]> {
    let (rays, flux, states) = (harness.input(rays), harness.input(flux), harness.input(states));
    let output = harness.output::<[f32; 2]>(64 * ENERGIES as usize);
    harness.run(&[&output], |g| {
        let (rays, flux, states) = (g.import(&rays), g.import(&flux), g.import(&states));
        let sums = energy::sum(g, Photons { rays: &rays, flux: &flux, states: &states });
        let mut out = g.import(output.memory());
        g.copy(&sums, &mut out);
        g.keep(&out);
    });
    harness.content(&output)
}

#[test]
fn sums_equal_the_specification() {
    let harness = Harness::lock();
    for count in [1, 63, 64, 65, 16_384, 100_003] {
        let (rays, mut flux, states) = photons(count, count as u64);
        flux[0] = [1e3; 4];
        let partial = on_device(&harness, (&rays, &flux, &states));
        let found = Ledger::of(&partial, &partial);
        let wanted = reference(&rays, &flux, &states);
        let entries = found.entries().map(|(_, watts)| watts);
        for (k, (found, wanted)) in entries.iter().zip(wanted).enumerate() {
            assert!(
                (found - wanted).abs() <= 1e-12 * wanted.abs(),
                "{count} photons, entry {k}: {found}, not {wanted}"
            );
        }
        // A photon that changes its end, or carries a thousandth more, is noticed.
        let mut other = states.clone();
        other[0] ^= 1 << PATH_END_SHIFT;
        assert!(on_device(&harness, (&rays, &flux, &other)) != partial, "{count} photons: another end");
        let mut more = flux.clone();
        more[0][1] *= 1.001;
        assert!(on_device(&harness, (&rays, &more, &states)) != partial, "{count} photons: more light");
    }
    proof::by(reference, &["photon_energy"]);
}

#[test]
fn photons_of_the_last_list_are_cut() {
    let harness = Harness::lock();
    let states = harness.input(&[5u32, 6, 7, 8]);
    let output = harness.output::<u32>(4);
    harness.run(&[&output], |g| {
        let (list, count) = (g.upload("list", &[2u32, 0, 3]), g.upload("count", &[2u32]));
        let (source, mut out) = (g.import(&states), g.import(output.memory()));
        g.copy(&source, &mut out);
        cut(g, (&list, &count), Grid::Threads(3), &mut out);
        g.keep(&out);
    });
    let end = ENERGY_CUT << PATH_END_SHIFT;
    assert_eq!(ENERGY_IN_FLIGHT, 0, "no mark");
    assert_same(&harness.content(&output), &[5 | end, 6, 7 | end, 8], "states");
    proof::by_answer(&["photon_cut"]);
}
