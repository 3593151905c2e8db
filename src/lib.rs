//! nephroid: a progressive photon-mapping renderer on Vulkan compute.
#![deny(unsafe_code)]

#[cfg(feature = "cli")]
pub mod bench;
#[cfg(feature = "cli")]
pub mod cli;
pub mod compare;
pub mod constants;
pub mod draw_state;
pub mod error;
pub mod film;
#[cfg(feature = "cli")]
pub mod fit;
pub mod graph;
pub mod input;
pub mod kernels;
pub mod picture;
#[cfg(feature = "cli")]
pub mod plot;
pub mod render;
pub mod scene;
#[cfg(feature = "cli")]
pub mod study;
pub mod vk;
