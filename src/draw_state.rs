//! How a draw rasterises: values that the command graph declares and the device layer obeys.

/// What the vertices of an instance form.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Topology {
    /// Every three vertices are a triangle.
    #[default]
    Triangles,
    /// Every vertex after the second makes a triangle with the two before it.
    TriangleStrip,
    /// Every vertex is a point. Without a geometry kernel the vertex kernel has to write `gl_PointSize`; every device
    /// supports the size 1.0, and not all support larger ones.
    Points,
}

/// What becomes of a fragment's colours.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Blend {
    /// They are added, all four components, to those of the picture, in the order of draws, instances and primitives:
    /// the sums are the same in every run on a device.
    #[default]
    Add,
    /// They replace those of the picture.
    Replace,
}

/// Which fragments pass, by their depth (0 near, 1 far, as the vertex kernel or `gl_FragDepth` gives it) and the
/// picture's.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum DepthTest {
    /// All.
    #[default]
    Always,
    /// Those with a lesser depth than the picture's.
    Less,
    /// Those with a greater depth than the picture's.
    Greater,
}

/// Which triangles are left out. The front shows its vertices counter-clockwise in the picture with y downward.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Cull {
    /// None.
    #[default]
    Nothing,
    /// Those that show their back.
    Back,
    /// Those that show their front. Of a closed bound the far side is left, which is visible from inside as well.
    Front,
}

/// Everything between the kernels of a draw.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct DrawState {
    /// What the vertices form.
    pub topology: Topology,
    /// What becomes of the colours.
    pub blend: Blend,
    /// Which fragments pass.
    pub depth_test: DepthTest,
    /// Whether fragments that pass leave their depth.
    pub depth_write: bool,
    /// Which triangles are left out.
    pub cull: Cull,
    /// Clamps depths to [0, 1] instead of clipping primitives there, so that a bound across the near plane stays whole.
    /// Not every device supports this.
    pub depth_clamp: bool,
}

impl DrawState {
    /// Whether the draw looks at depths or leaves them.
    pub fn needs_depth(&self) -> bool {
        self.depth_write || self.depth_test != DepthTest::Always
    }
}
