// Group counts for an indirect dispatch over `count` items in groups of LOCAL.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 1) in;
#include "lib/dispatch.glsl"

layout(constant_id = 0) const uint LOCAL = 64;
layout(push_constant, scalar) uniform Params { uint capacity; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Args { DispatchArgs args[]; };

void main() {
    args[0] = dispatch_for(min(count[0], params.capacity), LOCAL);
}
