// The scene's buffers, bound alike by every kernel that uses them; a kernel's own buffers begin at binding 16.
#include "shared/scene.glsl"
#include "shared/bvh.glsl"
layout(set = 0, binding = 0, scalar) readonly buffer Nodes { BvhNode nodes[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Triangles { BvhTriangle triangles[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Shading { vec4 shading_data[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Materials { Material materials[]; };
layout(set = 0, binding = 4, scalar) readonly buffer TextureUses { TextureUse texture_uses[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Texels { uint texels[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Lights { Light lights[]; };
layout(set = 0, binding = 7, scalar) readonly buffer GlobalsBlock { Globals globals[]; };
layout(set = 0, binding = 8, scalar) readonly buffer Environment { vec4 environment[]; };
layout(set = 0, binding = 9, scalar) readonly buffer EnvironmentCdf { float environment_cdf[]; };
layout(set = 0, binding = 10, scalar) readonly buffer Casters { Caster casters[]; };
layout(set = 0, binding = 11, scalar) readonly buffer CameraBlock { Camera camera[]; };
layout(set = 0, binding = 12, scalar) readonly buffer PassBlock { Pass pass[]; };
layout(set = 0, binding = 13, scalar) readonly buffer Lobes { uint lobes[]; };
layout(set = 0, binding = 14, scalar) readonly buffer Guide { float guide[]; };

// What a scene does not need is compiled out: one source, many lean kernels (scene::needs decides).
layout(constant_id = 0) const bool TEXTURES = true;
layout(constant_id = 1) const bool NORMAL_MAPS = true;
layout(constant_id = 2) const bool ALPHA_MASK = true;
layout(constant_id = 3) const bool GLASS = true;          // any transmission
layout(constant_id = 4) const bool ABSORPTION = true;
layout(constant_id = 5) const bool GLOSSY = true;         // anything but pure Lambert
layout(constant_id = 6) const bool ENVIRONMENT = true;
layout(constant_id = 7) const bool AREA_LIGHTS = true;
layout(constant_id = 8) const bool DELTA_LIGHTS = true;   // point, spot, directional
layout(constant_id = 9) const bool SMOOTH_NORMALS = true; // shading normals that differ from geometric ones
// Layout of shading_data: vec4s per triangle and where each optional attribute begins (0: absent). The first three
// hold the vertex normals, with u of set 0 in w.
layout(constant_id = 10) const uint SHADING_STRIDE = 3;
layout(constant_id = 11) const uint UV0_AT = 0;
layout(constant_id = 12) const uint UV1_AT = 0;
layout(constant_id = 13) const uint COLOR_AT = 0;
layout(constant_id = 14) const uint TANGENT_AT = 0;
layout(constant_id = 16) const bool GUIDED = true;         // photons from infinity start where they are useful
layout(constant_id = 17) const bool GUIDED_SAMPLES = true; // samples of the environment, too
