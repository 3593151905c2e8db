// A square per instance, as a strip of four vertices: the vertex kernel amplifies.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shared/splat.glsl"

layout(push_constant, scalar) uniform Params { vec2 extent; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Splats { Splat splats[]; };
layout(location = 0) flat out uint splat;

void main() {
    Splat s = splats[gl_InstanceIndex];
    splat = uint(gl_InstanceIndex);
    gl_Position = splat_corner(s, uint(gl_VertexIndex), params.extent);
}
