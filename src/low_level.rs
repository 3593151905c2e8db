//! The layers under the crate's face: for programs that run kernels of their own, for measurements, and for tests.
//!
//! Anything in here may change with any version. ARCHITECTURE.md has the map of the layers and says which layer may
//! use which.

/// Shows what each layer makes public.
macro_rules! layers {
    ($($(#[$attribute:meta])* $layer:ident;)*) => {
        $($(#[$attribute])* pub mod $layer { pub use crate::$layer::*; })*
    };
}

layers! {
    /// The command graph: passes over buffers are declared, planned without a device, and run.
    graph;
    /// The algorithms as passes of a graph, each with its CPU reference.
    kernels;
    /// The device: all Vulkan.
    vk;
    /// How a draw blends, culls and tests depth.
    draw_state;
    /// Constants that kernels and host share.
    constants;
    /// The scene on the host: loading, shapes, what a scene needs.
    scene;
    /// The scene on the device, passes and sessions.
    render;
    /// Sums of passes, their files, and their error.
    film;
    /// Finished pictures, their files, and changes after the render.
    picture;
    /// Files from outside, read within limits.
    input;
    /// Faults on request, for tests.
    injection;
    /// Measures that compare pictures.
    compare;
    /// Rates of kernels and scenes beside their floors.
    #[cfg(feature = "cli")]
    bench;
    /// Stiff and extreme cases with known answers.
    #[cfg(feature = "cli")]
    check;
    /// Power laws through points.
    #[cfg(feature = "cli")]
    fit;
    /// Plots as SVG.
    #[cfg(feature = "cli")]
    plot;
    /// Error against run time.
    #[cfg(feature = "cli")]
    study;
}
