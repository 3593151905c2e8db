// The colour of a square times two factors; beside it where the fragment is, how large its square, and a 1 to be
// counted.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shared/splat.glsl"

layout(constant_id = 20) const float SCALE = 1.0;

layout(push_constant, scalar) uniform Params { vec2 extent; float factor; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Splats { Splat splats[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Colours { vec4 colours[]; };
layout(location = 0) flat in uint splat;
layout(location = 0) out vec4 sum;
layout(location = 1) out vec4 where;

void main() {
    sum = colours[splat] * (SCALE * params.factor);
    where = vec4(gl_FragCoord.xy, splats[splat].half_side, 1.0);
}
