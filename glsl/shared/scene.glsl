// Scene data that host and kernels share. Conventions (radiometric units, sides, textures) as in src/scene/mod.rs.

const uint MATERIAL_VOLUME = 1u; // The surface encloses a medium.
const uint MATERIAL_UNLIT = 2u;  // Shows its colour and takes no light.
const uint MATERIAL_BLEND = 4u;  // Alpha is the share of the surface that is there.
const uint MATERIAL_TWO_SIDED = 8u; // Emits from its back, too.
const uint NO_TEXTURE = 0xffffffffu; // In place of an index of TextureUse.

struct Material {
    vec3 base_color;
    float base_alpha;
    vec3 emissive;        // radiance of the front side, and of the back where MATERIAL_TWO_SIDED
    float metallic;
    vec3 specular_color;
    float specular;
    vec3 absorption;      // per scene unit, of the enclosed medium
    float roughness;
    float transmission;
    float ior;
    float normal_scale;
    float alpha_cutoff;   // negative: no mask
    uint flags;
    uint base_color_texture; // these index TextureUse
    uint metallic_roughness_texture;
    uint normal_texture;
    uint emissive_texture;
    uint transmission_texture;
    uint specular_texture;
    uint boundary;        // where the table of a rough boundary of glass begins in `lobes`; 0: none
    float light_density;  // probability per area with which a point is chosen as a light's; 0: no light
};

const uint WRAP_REPEAT = 0u; // The texture repeats.
const uint WRAP_CLAMP = 1u;  // Its edge goes on.
const uint WRAP_MIRROR = 2u; // It repeats, every second time mirrored.
const uint WRAP_MASK = 3u;    // Bits 0 and 1 of the flags: WRAP_* in u.
const uint WRAP_V_SHIFT = 2u; // Bits 2 and 3: WRAP_* in v.
const uint TEXTURE_LINEAR = 16u; // Bilinear interpolation; nearest texel otherwise.
const uint TEXTURE_SRGB = 32u; // Texels are encoded in sRGB.
const uint TEXTURE_UV1 = 64u; // Coordinates of the second set.

struct TextureUse {
    uint first_texel; // RGBA8 words in `texels`
    uint width;
    uint height;
    uint flags;
    vec3 row_u; // uv transform
    vec3 row_v;
};

const uint LIGHT_POINT = 0u; // From a point in all directions.
const uint LIGHT_SPOT = 1u; // From a point into a cone.
const uint LIGHT_DIRECTIONAL = 2u; // Parallel light.
const uint LIGHT_TRIANGLE = 3u; // An emissive triangle.
const uint LIGHT_ENVIRONMENT = 4u; // Light from infinity, by direction.

struct Light {
    vec3 position;       // point, spot
    uint kind;
    vec3 direction;      // spot, directional: unit direction of travel
    float probability;   // of being chosen, proportional to power
    vec3 emission;       // intensity [W/sr], irradiance [W/m^2] or radiance [W/(sr m^2)] by kind
    float cumulative;    // sum of probabilities up to and including this light
    float cos_inner;     // spot
    float cos_outer;     // spot
    float area;          // triangle
    uint triangle;       // place in the tree of a LIGHT_TRIANGLE
    uint guide;          // of light from infinity: one more than its first column in the guide; 0: it has none
};

// The guide of light from infinity (src/render/scene/guide.rs): spheres around places that light should reach, and how
// likely each is chosen for a column. A directional light is a column, a cell of the environment is one. A cell is a
// square in the random numbers that choose a direction, so all cells are alike in power.
const uint GUIDE_SIDE = 8u; // Cells of the environment along each of the two numbers.
const uint GUIDE_CELLS = 64u; // Cells of the environment, in rows along the first number.
const uint GUIDE_PARALLEL = 8u; // Most directional lights that are guided; their columns come first.
const uint GUIDE_SPHERE = 4u; // Words of a sphere: centre, radius.

// A sphere around a group of specular surfaces; caustic photons are aimed at these.
struct Caster {
    vec3 center;
    float radius;
    float probability;
    float cumulative;
};

struct Globals {
    vec3 center;      // of the scene's bounding sphere
    float radius;     // > 0
    uint light_count;
    uint caster_count;
    uint environment_width; // 0: no environment
    uint environment_height;
    float environment_probability; // of choosing the environment as a light
    float footprint_unit; // > 0: limits footprints; the radius, or less where the view shows less of the scene
    uint guide_spheres;  // 0: no guide
    uint guide_leaves;   // those that are not divided, the first of them
    uint guide_halos;    // spheres around all of them, the last is that of the scene
    uint guide_photons;  // 1: photons from infinity are guided
    uint guide_samples;  // 1: samples of the environment are guided
};

struct Camera {
    vec3 position;
    uint width;
    vec3 right;      // scaled so that one unit spans half of the image
    uint height;
    vec3 up;
    uint orthographic;
    vec3 forward;
    uint slots;      // path slots per pixel, for splitting
    uint first_pixel; // of the band of pixels that these passes work on
    uint pixels;      // in the band
    float lens_radius;   // of the thin lens, in scene units; 0 is a pinhole
    float inverse_focus; // one over the distance of the sharp plane along the view axis
};

// What changes from pass to pass; written by the host before each run.
struct Pass {
    uint index;          // global pass index
    uint seed;
    float radius_scale;  // of footprints, relative to the first pass
    uint reserved;
};
