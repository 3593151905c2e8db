//! Every kernel against its reference, on the device of `NEPHROID_TEST_DEVICE` under validation.

#[path = "../support/mod.rs"]
mod support;

mod boundaries;
mod bounds;
mod device_trees;
mod energy;
mod film;
mod gather;
mod gather_knn;
mod hash_grid;
mod lbvh;
mod lobes;
mod maps;
mod packing;
mod primitives;
mod proofs;
mod refit;
mod trace;
mod vvh;
mod walk;
