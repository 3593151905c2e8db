//! Claims of tests to prove kernels. A claim fails if the test has not run the kernel on the device;
//! `kernels/proofs.rs` reads all claims and fails if a kernel has none.

use std::cell::RefCell;
use std::collections::BTreeSet;

thread_local! {
    /// Kernels that this thread, hence this test, has run since its last claim.
    static RAN: RefCell<BTreeSet<String>> = const { RefCell::new(BTreeSet::new()) };
}

/// Notes what a plan runs, by its text ([`nephroid::low_level::graph::Plan::dump`],
/// [`nephroid::low_level::render::Session::plan_text`]). Every test helper that runs a plan calls it afterwards.
pub fn ran(plan: &str) {
    let planned = plan.split("\nculled\n").next().unwrap_or_default().split("\nmemory\n").next().unwrap_or_default();
    RAN.with_borrow_mut(|ran| {
        for line in planned.lines() {
            // What follows an arrow are names of buffers.
            let pass = line.split(" <- ").next().unwrap_or_default().split(" -> ").next().unwrap_or_default();
            let words = pass.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| !word.is_empty());
            ran.extend(words.map(String::from));
        }
    });
}

/// Claims that this test has compared what `kernels` give on the device with `reference`, a function of the host.
pub fn by<F>(_reference: F, kernels: &[&str]) {
    check(kernels);
}

/// Claims that this test has compared what `kernels` give on the device with an answer that is known otherwise.
pub fn by_answer(kernels: &[&str]) {
    check(kernels);
}

fn check(kernels: &[&str]) {
    let ran = RAN.take();
    let missing: Vec<_> = kernels.iter().filter(|kernel| !ran.contains(**kernel)).collect();
    assert!(missing.is_empty(), "the test claims to prove {missing:?} and runs only {ran:?}");
}
