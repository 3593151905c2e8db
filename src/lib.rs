//! nephroid: a progressive photon-mapping renderer on Vulkan compute.
#![deny(unsafe_code)]

pub mod bench;
pub mod cli;
pub mod compare;
pub mod constants;
pub mod draw_state;
pub mod error;
pub mod film;
pub mod fit;
pub mod graph;
pub mod kernels;
pub mod picture;
pub mod plot;
pub mod render;
pub mod scene;
pub mod study;
pub mod vk;
