// Points to squares: the geometry kernel amplifies.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shared/splat.glsl"
layout(points) in;
layout(triangle_strip, max_vertices = 4) out;

layout(push_constant, scalar) uniform Params { vec2 extent; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Splats { Splat splats[]; };
layout(location = 0) flat in uint splat_of_point[];
layout(location = 0) flat out uint splat;

void main() {
    Splat s = splats[splat_of_point[0]];
    for (uint corner = 0u; corner < 4u; ++corner) {
        splat = splat_of_point[0];
        gl_Position = splat_corner(s, corner, params.extent);
        EmitVertex();
    }
    EndPrimitive();
}
