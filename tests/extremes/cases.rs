//! The cases that `nephroid check` runs, with as little work as makes each mean something. Each is a test of its own.

use nephroid::low_level::check::{self, Size, Verdict, report};

use crate::support::device::runtime;
use crate::support::proof;

/// Runs a case and fails unless all its numbers are as they should be, or known not to be.
fn passes(number: u32) {
    let case = check::cases().into_iter().find(|case| case.number == number).expect("a case of this number");
    let runtime = runtime();
    let outcome = check::run(&runtime, case, Size::Quick).expect("a device that is not lost");
    drop(runtime);
    println!("{}", report::text(&outcome));
    outcome.plans.iter().for_each(|plan| proof::ran(plan));
    assert!(outcome.verdict() != Verdict::Failed, "\n{}", report::text(&outcome));
}

#[test]
fn case_01_furnace() {
    passes(1);
    proof::by_answer(&["list_select", "photon_advance", "photon_append", "trace_list"]);
}

#[test]
fn case_02_high_albedo() {
    passes(2);
}

#[test]
fn case_03_with_hole() {
    passes(3);
}

#[test]
fn case_04_integrating_sphere() {
    passes(4);
    proof::by_answer(&["photon_sort"]);
}

#[test]
fn case_05_point_light() {
    passes(5);
    proof::by_answer(&["direct_light", "eye_generate", "photon_emit"]);
}

#[test]
fn case_06_disc_light() {
    passes(6);
}

#[test]
fn case_07_form_factors() {
    passes(7);
}

#[test]
fn case_08_slab() {
    passes(8);
    proof::by_answer(&["eye_shade", "photon_bounce"]);
}

#[test]
fn case_09_nephroid() {
    passes(9);
}

#[test]
fn case_10_cardioid() {
    passes(10);
}

#[test]
fn case_11_centre() {
    passes(11);
}

#[test]
fn case_12_paraboloid() {
    passes(12);
}

#[test]
fn case_13_ball_lens() {
    passes(13);
}

#[test]
fn case_14_differentials() {
    passes(14);
    proof::by_answer(&["photon_differential"]);
}

#[test]
fn case_15_grazing() {
    passes(15);
}

#[test]
fn case_16_beam() {
    passes(16);
}

#[test]
fn case_17_roughness() {
    passes(17);
}

#[test]
fn case_18_indices() {
    passes(18);
}

#[test]
fn case_19_absorption() {
    passes(19);
}

#[test]
fn case_20_furnaces() {
    passes(20);
}

#[test]
fn case_21_chi_squares() {
    passes(21);
}

#[test]
fn case_22_poles() {
    passes(22);
}

#[test]
fn case_23_unequal_lights() {
    passes(23);
}

#[test]
fn case_24_convergence() {
    passes(24);
}

#[test]
fn case_25_schedule() {
    passes(25);
}

#[test]
fn case_26_film_sums() {
    passes(26);
}

#[test]
fn case_27_counters() {
    passes(27);
}

#[test]
fn case_28_bright_files() {
    passes(28);
}

#[test]
fn case_29_scaled_geometry() {
    passes(29);
}

#[test]
fn case_30_scaled_light() {
    passes(30);
}

#[test]
fn case_31_moved() {
    passes(31);
}

#[test]
fn case_32_wide_grid() {
    passes(32);
}

#[test]
fn case_33_triangles() {
    passes(33);
}

#[test]
fn case_34_watertight() {
    passes(34);
}

#[test]
fn case_35_self_hits() {
    passes(35);
}

#[test]
fn case_36_ties() {
    passes(36);
}

#[test]
fn case_37_wall() {
    passes(37);
    proof::by_answer(&["eye_boundaries"]);
}

#[test]
fn case_38_edges() {
    passes(38);
}

#[test]
fn case_39_error_bars() {
    passes(39);
}

#[test]
fn case_40_empty() {
    passes(40);
}

#[test]
fn case_41_out_of_range() {
    passes(41);
}

#[test]
fn case_42_repeated() {
    passes(42);
}

#[test]
fn case_43_split() {
    passes(43);
}

#[test]
fn case_44_crowd() {
    passes(44);
}

#[test]
fn case_45_units() {
    passes(45);
}

#[test]
fn case_46_stray() {
    passes(46);
}

#[test]
fn case_47_white_room() {
    passes(47);
}

#[test]
fn case_48_shells() {
    passes(48);
}

#[test]
fn case_49_grating() {
    passes(49);
}

#[test]
fn case_50_unequal_sizes() {
    passes(50);
}

#[test]
fn case_51_many_lights() {
    passes(51);
}

#[test]
fn case_52_grazing_sun() {
    passes(52);
}

#[test]
fn case_53_bright_caustic() {
    passes(53);
}

#[test]
fn case_54_jumping_textures() {
    passes(54);
}

#[test]
fn every_case_is_a_test() {
    let source = include_str!("cases.rs");
    for case in check::cases() {
        let number = case.number;
        let test = format!("#[test]\nfn case_{number:02}_");
        assert!(source.contains(&test) && source.contains(&format!("    passes({number});")), "case {number}");
    }
}
