//! Leaving out what a scene does not need changes no bit: kernels specialised for the scene against kernels with every
//! feature.

use nephroid::low_level::check::scenes::kinds;
use nephroid::low_level::render::Settings;

use crate::support::lab::{Shot, assert_same, difference, settings};

#[test]
fn the_lean_program_equals_the_full_one() {
    let mut failures = Vec::new();
    for (name, scene) in kinds() {
        println!("{name}");
        let lean = settings(20, 16, 4_000);
        let full = Settings { full_program: true, ..lean.clone() };
        let (a, b) = (Shot::take(&scene, &lean, 0..2).bits(), Shot::take(&scene, &full, 0..2).bits());
        if let Some(at) = difference(&a, &b) {
            let count = a.iter().zip(&b).filter(|(a, b)| a != b).count();
            let (x, y) = (f32::from_bits(a[at]), f32::from_bits(b[at]));
            failures.push(format!("{name}: {count} of {} differ, first number {at}: {x:e} {y:e}", a.len()));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
    // The comparison is not blind: another seed changes the picture.
    let (_, scene) = kinds().swap_remove(0);
    let other = Settings { seed: 1, ..settings(20, 16, 4_000) };
    let (a, b) = (Shot::take(&scene, &settings(20, 16, 4_000), 0..2), Shot::take(&scene, &other, 0..2));
    assert!(difference(&a.bits(), &b.bits()).is_some());
    assert_same(&a.bits(), &a.bits(), "a picture and itself");
}
