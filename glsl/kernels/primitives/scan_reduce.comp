#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "lib/linear_id.glsl"
#include "lib/dispatch.glsl"
layout(local_size_x = 256) in;
layout(constant_id = 0) const uint ITEMS = 8;
layout(constant_id = 1) const bool FLAG = true;
struct Thing { vec3 a; uint b; uvec2 c[2]; };
layout(push_constant, scalar) uniform Params { uint count; float scale; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Source { Thing source[]; };
layout(set = 0, binding = 1, scalar) buffer Sums { uint sums[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Args { DispatchArgs args[]; };
void main() { uint i = linear_id(); if (i >= params.count) return; Thing t = source[i]; sums[i] += t.b + t.c[1].y * ITEMS + (FLAG ? uint(t.a.x * params.scale) : 0u); if (i == 0) args[0] = dispatch_for(params.count, 64); }
