// Tells the paths of a list, which are at their hits, in which medium they began, if they do not know.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "lib/scene_bindings.glsl"
#include "shared/photon.glsl"

layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Rays { vec4 rays[]; };
layout(set = 0, binding = 19, scalar) readonly buffer Hits { uvec4 hits[]; };
layout(set = 0, binding = 20, scalar) buffer States { uint states[]; };
#include "lib/traverse.glsl"
#include "lib/enclosing.glsl"

void main() {
    uint i = linear_id();
    if (i >= count[0]) return;
    uint slot = list[i];
    uint state = states[slot];
    if ((state & PATH_MEDIUM_MASK) != MEDIUM_UNKNOWN) return;
    // What comes from infinity, or goes there, is not absorbed.
    bool lost = unpack_hit(hits[slot]).triangle == BVH_MISS;
    states[slot] = (state & ~PATH_MEDIUM_MASK) | (lost ? 0u : enclosing_medium(rays[2u * slot].xyz));
}
