// Radius and scale of the levels: the largest footprint of the pass decides, and each next level is for half that size.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 16) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"
#include "lib/hash.glsl"
#include "lib/packed_photon.glsl"

layout(set = 0, binding = 16, scalar) readonly buffer Largest { uint largest[]; }; // bits of the largest extent
layout(set = 0, binding = 17, scalar) readonly buffer Bounds { Aabb bounds[]; };   // of all footprints
layout(set = 0, binding = 18, scalar) writeonly buffer Levels { HashLevel levels[]; };
layout(set = 0, binding = 19, scalar) writeonly buffer InUse { uint in_use[]; };

const float HASH_SMALL = 7.888609052210118e-31; /// 2^-100: least radius of a level, also relative to coordinates.
const float HASH_LARGE = 1.329227995784916e36; /// 2^120: with larger coordinates each level is one cell.

/// A cell is wider than a hit looks by this factor, so that rounding does not make it meet three cells of an axis.
const float HASH_WIDER = 1.015625;

void main() {
    uint level = gl_LocalInvocationID.x;
    if (level == 0u) in_use[0] = 0u;
    float reach = max(max_component(abs(bounds[0].min)), max_component(abs(bounds[0].max)));
    // No smaller than 2^-100 of the coordinates, so that a coordinate in cells is always finite and no radius is
    // denormal.
    float radius = uintBitsToFloat(largest[0]) * uintBitsToFloat((127u - level) << 23);
    radius = max(radius, max(HASH_SMALL, HASH_SMALL * reach));
    // Places relative to cells: not more cells than that their corners are exact, and rounding a small part of them.
    if (RECORD == 12u) radius = max(radius, reach * 6.103515625e-5); // 2^-14
    // Near the end of the floats, and without photons, each level is one cell.
    levels[level] = reach <= HASH_LARGE ? HashLevel(radius, 1.0 / (2.0 * HASH_WIDER * radius)) : HashLevel(0.0, 0.0);
}
