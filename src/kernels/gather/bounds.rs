//! Density estimation by rasterising bounds around the photons (Mara, Luebke and McGuire 2013, "2.5D bounds" and "3D
//! bounds"): each fragment is one photon at one pixel's eye hit, and blending adds them up.
//!
//! Depths of the eye hits are laid down first; bounds then leave out pixels without a hit and pixels whose hit is in
//! front of the photon, which cuts the photons on surfaces that are hidden.

use super::{Band, Points, Program};
use crate::constants::{ICOSAHEDRON_CORNERS, PIXEL_ROWS};
use crate::draw_state::{Cull, DepthTest, DrawState, Topology};
use crate::graph::{Buf, Draw, DrawArgs, Graph, Grid, Instances, RasterPass};
use crate::kernels::Items;
use crate::kernels::compact::{self, Survivors};
use crate::kernels::generated::{
    BoundsArgs, BoundsArgsBindings, BoundsArgsParams, BoundsBallGeom, BoundsBallGeomBindings, BoundsBallGeomParams,
    BoundsBallVert, BoundsBallVertBindings, BoundsBallVertParams, BoundsDepthFrag, BoundsDepthFragBindings,
    BoundsDepthFragParams, BoundsDepths, BoundsDepthsBindings, BoundsPointVert, BoundsPointVertBindings,
    BoundsPolygonGeom, BoundsPolygonGeomBindings, BoundsPolygonGeomParams, BoundsPolygonVert,
    BoundsPolygonVertBindings, BoundsPolygonVertParams, BoundsResolve, BoundsResolveBindings, BoundsResolveParams,
    BoundsScreenVert, BoundsScreenVertBindings, BoundsSeen, BoundsSeenBindings, BoundsSeenParams, BoundsSplatFrag,
    BoundsSplatFragBindings, BoundsSplatFragParams, Photon,
};

/// Corners that a polygon may have.
pub const POLYGON_CORNERS: std::ops::RangeInclusive<u32> = 6..=18;

/// What is drawn around a photon.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// A polygon with so many corners, of [`POLYGON_CORNERS`], around the outline of its ball in the picture.
    Polygon(u32),
    /// The back of an icosahedron around its ball.
    Icosahedron,
}

/// Which kernel makes bounds out of photons.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Amplification {
    /// The vertex kernel: an instance for each photon.
    #[default]
    Vertex,
    /// The geometry kernel, out of a point for each photon; not every device has one
    /// ([`crate::graph::GeometryShader`]).
    Geometry,
}

/// How bounds are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bounds {
    /// What is drawn.
    pub shape: Shape,
    /// By which kernel.
    pub amplification: Amplification,
}

impl Bounds {
    /// Vertices of an instance; 0: the photons are the vertices.
    fn vertices(self) -> u32 {
        match (self.amplification, self.shape) {
            (Amplification::Geometry, _) => 0,
            (Amplification::Vertex, Shape::Polygon(corners)) => corners,
            (Amplification::Vertex, Shape::Icosahedron) => ICOSAHEDRON_CORNERS,
        }
    }

    fn state(self) -> DrawState {
        let topology = match (self.amplification, self.shape) {
            (Amplification::Geometry, _) => Topology::Points,
            (Amplification::Vertex, Shape::Polygon(_)) => Topology::TriangleStrip,
            (Amplification::Vertex, Shape::Icosahedron) => Topology::Triangles,
        };
        // Every line of sight leaves the icosahedron once, also where the eye is inside.
        let cull = if self.shape == Shape::Icosahedron { Cull::Front } else { Cull::Nothing };
        DrawState { topology, cull, depth_test: DepthTest::Greater, ..DrawState::default() }
    }
}

/// The rows of the image in which a band has pixels.
#[derive(Clone, Copy)]
struct Rows {
    first: u32,
    count: u32,
}

impl Rows {
    fn of(band: Band<'_>) -> Self {
        let [width, height] = band.size;
        let strip = PIXEL_ROWS * width;
        let first = PIXEL_ROWS * (band.first_pixel / strip);
        let end = (PIXEL_ROWS * (band.first_pixel + band.pixels).div_ceil(strip)).min(height);
        Self { first, count: end - first }
    }
}

/// Writes the gathered radiance of the listed slots (caustic, then other light) from the first `photons.1[0]` photons.
///
/// All hits have to lie at their pixel's place in space, in the first slot of their pixel ([`super::split`]). Needs a
/// device that rasterises, for [`Amplification::Geometry`] one with geometry kernels. Photons are taken in their order:
/// the sums are the same in every run on a device.
pub fn bounds(
    g: &mut Graph,
    (program, bounds): (Program, Bounds),
    (points, band): (Points<'_>, Band<'_>),
    photons: (&Buf<Photon>, &Buf<u32>),
    gathered: &mut Buf<[f32; 4]>,
) {
    let rows = Rows::of(band);
    let depths = hit_depths(g, (points, band));
    let seen = photons_in_picture(g, (band, rows), photons);
    let mut args = g.buffer::<DrawArgs>("bounds_args", 1);
    let params = BoundsArgsParams { vertices: bounds.vertices() };
    g.dispatch(BoundsArgs, Grid::Threads(1), params, BoundsArgsBindings { count: &seen.count, args: &mut args });
    let pixels = band.size[0] * rows.count;
    let (mut caustic, mut other) = (g.buffer("bounds_caustic", pixels), g.buffer("bounds_other", pixels));
    // Nothing passes where there is no hit.
    let pass = RasterPass { name: "bounds", extent: [band.size[0], rows.count], depth: Some(1.0) };
    let splats = outline(bounds, Instances::Indirect(&args), (band, rows), (photons.0, &seen.indices))
        .fragment(
            BoundsSplatFrag {
                glossy: program.glossy,
                smooth_normals: program.smooth_normals,
                blinn_phong: program.blinn_phong,
                weight: program.weight.code(),
                count_pairs: program.count_pairs,
            },
            BoundsSplatFragParams { first_row: rows.first, rows: rows.count },
            BoundsSplatFragBindings {
                camera: band.camera,
                eye_hits: points.hits,
                photons: photons.0,
                lobes: points.lobes,
            },
        )
        .state(bounds.state());
    g.raster(pass, vec![depth_draw(&depths, (band, rows)), splats], [&mut caustic, &mut other]);
    let kernel = BoundsResolve { glossy: program.glossy };
    let bind = BoundsResolveBindings {
        camera: band.camera,
        list: points.list,
        count: points.count,
        eye_hits: points.hits,
        caustic: &caustic,
        other: &other,
        gathered,
    };
    let params = BoundsResolveParams { first_row: rows.first, rows: rows.count };
    g.dispatch(kernel, Grid::Indirect(points.args), params, bind);
}

/// The photons whose bounds may be in the picture, in order.
fn photons_in_picture(
    g: &mut Graph,
    (band, rows): (Band<'_>, Rows),
    (photons, count): (&Buf<Photon>, &Buf<u32>),
) -> Survivors {
    let mut flags = g.buffer("photons_in_picture", photons.len());
    let bind = BoundsSeenBindings { camera: band.camera, count, photons, flags: &mut flags };
    let params = BoundsSeenParams { first_row: rows.first, rows: rows.count };
    g.dispatch(BoundsSeen, Grid::Threads(photons.len()), params, bind);
    compact::indices(g, Items::Counted(count), &flags, 64)
}

/// Depths of the eye hits by pixel of the band; 1 without one.
fn hit_depths(g: &mut Graph, (points, band): (Points<'_>, Band<'_>)) -> Buf<f32> {
    let mut depths = g.buffer("bounds_depths", band.pixels);
    g.fill(&mut depths, 1f32.to_bits());
    let bind = BoundsDepthsBindings {
        camera: band.camera,
        list: points.list,
        count: points.count,
        eye_hits: points.hits,
        depths: &mut depths,
    };
    g.dispatch(BoundsDepths, Grid::Indirect(points.args), (), bind);
    depths
}

/// Lays the depths down in the picture.
fn depth_draw<'a>(depths: &'a Buf<f32>, (band, rows): (Band<'a>, Rows)) -> Draw<'a> {
    let triangle = Instances::Direct { vertices: 3, instances: 1 };
    Draw::new(BoundsScreenVert, triangle, (), BoundsScreenVertBindings { none: Default::default() })
        .fragment(
            BoundsDepthFrag,
            BoundsDepthFragParams { first_row: rows.first, rows: rows.count },
            BoundsDepthFragBindings { camera: band.camera, depths },
        )
        .state(DrawState { depth_write: true, ..DrawState::default() })
}

/// The kernels that make bounds out of photons.
fn outline<'a>(
    bounds: Bounds,
    count: Instances<'a>,
    (band, rows): (Band<'a>, Rows),
    (photons, seen): (&'a Buf<Photon>, &'a Buf<u32>),
) -> Draw<'a> {
    let (camera, first_row, rows) = (band.camera, rows.first, rows.count);
    let point = |count| Draw::new(BoundsPointVert, count, (), BoundsPointVertBindings { seen });
    match (bounds.amplification, bounds.shape) {
        (Amplification::Vertex, Shape::Polygon(corners)) => Draw::new(
            BoundsPolygonVert { corners },
            count,
            BoundsPolygonVertParams { first_row, rows },
            BoundsPolygonVertBindings { camera, photons, seen },
        ),
        (Amplification::Vertex, Shape::Icosahedron) => Draw::new(
            BoundsBallVert,
            count,
            BoundsBallVertParams { first_row, rows },
            BoundsBallVertBindings { camera, photons, seen },
        ),
        (Amplification::Geometry, Shape::Polygon(corners)) => point(count).geometry(
            BoundsPolygonGeom { corners },
            BoundsPolygonGeomParams { first_row, rows },
            BoundsPolygonGeomBindings { camera, photons },
        ),
        (Amplification::Geometry, Shape::Icosahedron) => point(count).geometry(
            BoundsBallGeom,
            BoundsBallGeomParams { first_row, rows },
            BoundsBallGeomBindings { camera, photons },
        ),
    }
}
