//! The scene on the host: plain data, no GPU.
//!
//! Conventions: right-handed, +Y up, linear Rec.709, world space in scene units. The photometric numbers of
//! glTF are read as radiometric RGB without the factor 683: emission is the radiance of a Lambertian emitter on
//! its front side, or on both sides of a double-sided material [W/(sr m^2)], the intensity of a point or spot light
//! is radiant intensity [W/sr], that of a directional light the irradiance of a plane that faces it [W/m^2].
//!
//! A scene is made of lists, and an id such as [`MeshId`] is a position in one of them. [`World`] is what a renderer
//! traces: the triangles of all visible instances in world space.

mod build;
pub mod environment;
mod flatten;
pub mod frame;
mod ids;
pub mod load;
mod mesh;
pub mod motion;
pub mod needs;
pub mod shapes;
pub mod summary;
mod transform;
mod validate;
mod world;

use std::path::PathBuf;
use std::sync::Arc;

pub use environment::EnvironmentFile;
pub use ids::{CameraId, InstanceId, LightId, MaterialId, MeshId};
pub use load::{Choices, Limits, load, load_with, load_with_environment};
pub use mesh::{Instance, Mesh};
pub use motion::{Motion, Pose, Vertices};
pub use needs::Needs;
pub use summary::Summary;
pub use transform::Transform;
pub use world::{Part, World};

/// A scene, from a file or built by hand ([`Scene::add_mesh`] and its siblings).
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// The file it came from; empty if it was built by hand.
    pub path: PathBuf,
    /// Further files that it was read from or names: buffers, images, the environment map. A program that writes files
    /// must not write over these.
    pub files: Vec<PathBuf>,
    /// Surfaces, each in a space of its own.
    pub meshes: Vec<Mesh>,
    /// Meshes in the world. Their order is that of the triangles in [`World`].
    pub instances: Vec<Instance>,
    /// Materials, indexed by [`Mesh::material`]. Never empty once loaded.
    pub materials: Vec<Material>,
    /// Decoded images, indexed by [`TextureRef::texture`] through [`Scene::textures`].
    pub images: Vec<Image>,
    /// Image and sampler pairs.
    pub textures: Vec<Texture>,
    /// Punctual lights. Emissive triangles follow from materials, the sky from [`Scene::environment`].
    pub lights: Vec<Light>,
    /// Light from outside the scene.
    pub environment: Option<Environment>,
    /// Cameras in file order; never empty once loaded (a framing camera is added where the file has none).
    pub cameras: Vec<Camera>,
    /// What was ignored, clamped, skipped or added: one sentence each, for the user.
    pub warnings: Vec<String>,
    /// Counts of input that had to be left out.
    pub skipped: Skipped,
    /// Names of the variants of materials that the file has (KHR_materials_variants): one can be chosen when it is
    /// loaded.
    pub variants: Vec<String>,
    /// How it moves, where the file has animations: [`Scene::move_to`].
    pub motion: Option<Arc<Motion>>,
}

/// glTF 2.0 metallic-roughness material with the extensions nephroid supports. Factors multiply textures.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name in the file.
    pub name: String,
    /// Linear base colour and alpha.
    pub base_color: [f32; 4],
    /// 0 dielectric ... 1 metal.
    pub metallic: f32,
    /// Perceptual roughness; GGX alpha is its square.
    pub roughness: f32,
    /// Radiance emitted by the front side, and by the back of double-sided materials (strength multiplied in).
    pub emissive: [f32; 3],
    /// KHR_materials_specular: weight of the dielectric reflection, 0 is pure Lambert.
    pub specular: f32,
    /// KHR_materials_specular: tint of F0.
    pub specular_color: [f32; 3],
    /// KHR_materials_transmission factor.
    pub transmission: f32,
    /// Index of refraction; 1.5 by default.
    pub ior: f32,
    /// KHR_materials_volume: true when thickness > 0, that is, the mesh bounds a medium; false is a thin sheet.
    pub volume: bool,
    /// Absorption coefficient per scene unit of the enclosed medium, -ln(colour)/distance. Zero without volume.
    pub absorption: [f32; 3],
    /// What the alpha of the base colour means.
    pub alpha: Alpha,
    /// Emits from both sides, and the camera sees both. Without it the back emits nothing, and the camera looks
    /// through it unless light is transmitted there; other light meets either side all the same.
    pub double_sided: bool,
    /// KHR_materials_unlit: shown as emission of its base colour, receives and reflects nothing.
    pub unlit: bool,
    /// sRGB texture of the base colour.
    pub base_color_texture: Option<TextureRef>,
    /// Linear texture: green roughness, blue metallic.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Linear tangent-space normal map.
    pub normal_texture: Option<TextureRef>,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
    /// sRGB texture of the emission.
    pub emissive_texture: Option<TextureRef>,
    /// Linear texture of the transmission (red).
    pub transmission_texture: Option<TextureRef>,
    /// Linear texture of the specular weight (alpha).
    pub specular_texture: Option<TextureRef>,
}

/// What the alpha of a base colour means (glTF 2.0, section 3.9.4).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Alpha {
    /// Nothing.
    #[default]
    Opaque,
    /// The surface is not there where alpha is below this cut-off.
    Mask(f32),
    /// The share of the surface that is there, 0 to 1: each path meets it with this probability.
    Blend,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: [1.0; 4],
            metallic: 1.0,
            roughness: 1.0,
            emissive: [0.0; 3],
            specular: 1.0,
            specular_color: [1.0; 3],
            transmission: 0.0,
            ior: 1.5,
            volume: false,
            absorption: [0.0; 3],
            alpha: Alpha::Opaque,
            double_sided: false,
            unlit: false,
            base_color_texture: None,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            emissive_texture: None,
            transmission_texture: None,
            specular_texture: None,
        }
    }
}

impl Material {
    /// Whether the camera looks through the back. The back of glass is the way out of it, which is always there.
    pub fn is_one_sided(&self) -> bool {
        !self.double_sided && self.transmission == 0.0
    }

    /// The textures that this material uses, in the order of the fields.
    pub fn texture_refs(&self) -> impl Iterator<Item = &TextureRef> {
        [
            &self.base_color_texture,
            &self.metallic_roughness_texture,
            &self.normal_texture,
            &self.emissive_texture,
            &self.transmission_texture,
            &self.specular_texture,
        ]
        .into_iter()
        .flatten()
    }

    /// The places for uses of textures.
    fn texture_slots(&mut self) -> [&mut Option<TextureRef>; 6] {
        [
            &mut self.base_color_texture,
            &mut self.metallic_roughness_texture,
            &mut self.normal_texture,
            &mut self.emissive_texture,
            &mut self.transmission_texture,
            &mut self.specular_texture,
        ]
    }
}

/// A use of a texture by a material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TextureRef {
    /// Index into [`Scene::textures`].
    pub texture: u32,
    /// Texture coordinate set, 0 or 1.
    pub uv_set: u32,
    /// KHR_texture_transform as rows of a 2 x 3 matrix: `u' = m[0][0] u + m[0][1] v + m[0][2]`.
    pub transform: [[f32; 3]; 2],
}

/// Image and sampler.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Texture {
    /// Index into [`Scene::images`].
    pub image: u32,
    /// Addressing in u and v.
    pub wrap: [Wrap; 2],
    /// Bilinear when true, nearest otherwise.
    pub linear: bool,
}

/// Texture addressing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wrap {
    /// Repeat.
    Repeat,
    /// Clamp to the edge texel.
    Clamp,
    /// Mirrored repeat.
    Mirror,
}

/// Eight bits per channel RGBA, rows from the top. Whether it holds sRGB or linear values follows from its use.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Image {
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// `width * height` texels.
    pub rgba: Vec<[u8; 4]>,
}

/// A punctual light (KHR_lights_punctual) in world space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Light {
    /// Isotropic point light.
    Point {
        /// World position.
        position: [f32; 3],
        /// Radiant intensity [W/sr].
        intensity: [f32; 3],
    },
    /// Spot light with the smooth edge that KHR_lights_punctual recommends.
    Spot {
        /// World position.
        position: [f32; 3],
        /// Unit axis, away from the light.
        direction: [f32; 3],
        /// Radiant intensity on the axis [W/sr].
        intensity: [f32; 3],
        /// Angle where the falloff begins, in radians.
        inner_angle: f32,
        /// Angle where the light ends, in radians.
        outer_angle: f32,
    },
    /// Parallel light.
    Directional {
        /// Unit direction of travel.
        direction: [f32; 3],
        /// Irradiance of a plane that faces it [W/m^2].
        irradiance: [f32; 3],
    },
}

/// Equirectangular radiance from infinity. Row 0 is +Y; column 0 begins at +Z, the middle is -Z, u grows from
/// there towards +X: direction (sin t sin p, cos t, -sin t cos p) with p = 2 pi (u - 1/2), t = pi v.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Environment {
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// Linear radiance.
    pub radiance: Vec<[f32; 3]>,
}

/// A camera in world space.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Name in the file.
    pub name: String,
    /// World position of the pinhole (or of the image plane's centre if orthographic).
    pub position: [f32; 3],
    /// Unit vector to the right of the image.
    pub right: [f32; 3],
    /// Unit vector to the top of the image.
    pub up: [f32; 3],
    /// Unit viewing direction.
    pub forward: [f32; 3],
    /// Projection.
    pub projection: Projection,
}

/// How a camera maps directions to its image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// Pinhole.
    Perspective {
        /// Full vertical field of view, in radians.
        yfov: f32,
        /// Width over height of what is shown at least, if the file gives it: a narrower picture shows more above and
        /// below, a wider one more at its sides. Without it the vertical field of view is that of any picture.
        aspect: Option<f32>,
    },
    /// Parallel projection.
    Orthographic {
        /// Half width in scene units of what is shown at least; see [`Projection::Perspective::aspect`].
        xmag: f32,
        /// Half height in scene units of what is shown at least.
        ymag: f32,
    },
}

impl Projection {
    /// Half width and height of the image plane, at distance 1 of a pinhole, for a picture of this shape (width over
    /// height): the smallest that holds what is shown at least.
    pub fn half_size(&self, shape: f32) -> [f32; 2] {
        let [half_width, half_height] = match *self {
            Self::Perspective { yfov, aspect } => {
                let half = (0.5 * yfov).tan();
                [aspect.map_or(0.0, |aspect| half * aspect), half]
            }
            Self::Orthographic { xmag, ymag } => [xmag, ymag],
        };
        let narrow = half_width > half_height * shape;
        if narrow { [half_width, half_width / shape] } else { [half_height * shape, half_height] }
    }
}

/// Counts of input that was left out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Skipped {
    /// Triangles whose area is zero.
    pub degenerate_triangles: u64,
    /// Triangles with a coordinate that is not finite.
    pub non_finite_triangles: u64,
    /// Points, lines and other primitives that have no area.
    pub non_triangle_primitives: u64,
}

impl Skipped {
    /// Adds the counts of another part of the scene.
    fn add(&mut self, other: Self) {
        self.degenerate_triangles += other.degenerate_triangles;
        self.non_finite_triangles += other.non_finite_triangles;
        self.non_triangle_primitives += other.non_triangle_primitives;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_file_shows_is_never_cropped() {
        let wide = Projection::Orthographic { xmag: 2.0, ymag: 1.0 };
        assert_eq!(wide.half_size(2.0), [2.0, 1.0]);
        assert_eq!(wide.half_size(1.0), [2.0, 2.0], "a narrow picture of a wide view");
        assert_eq!(wide.half_size(4.0), [4.0, 1.0], "a wide picture");
        let yfov = 2.0 * 0.5f32.atan();
        let near = |a: [f32; 2], b: [f32; 2]| assert!((a[0] - b[0]).abs() + (a[1] - b[1]).abs() < 1e-6, "{a:?} {b:?}");
        near(Projection::Perspective { yfov, aspect: None }.half_size(0.5), [0.25, 0.5]);
        near(Projection::Perspective { yfov, aspect: Some(2.0) }.half_size(0.5), [1.0, 2.0]);
    }
}
