//! Constants that the host shares with the kernels. They are written in GLSL only: all of `glsl/shared`, and elsewhere
//! those whose comment begins with three slashes. The build script reads them (`src/shader/constants.rs`).
#![allow(clippy::approx_constant, clippy::unreadable_literal)]

include!(concat!(env!("OUT_DIR"), "/constants.rs"));
