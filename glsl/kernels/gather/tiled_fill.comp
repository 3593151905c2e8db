// Writes (tile, photon) for each tile of each photon, photon by photon: the stable sort by tile keeps that order.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/scene.glsl"
#include "lib/tiles.glsl"

layout(push_constant, scalar) uniform Params {
    uvec2 lowest;
    uint photons; // that there is room for
} params;

layout(set = 0, binding = 16, scalar) readonly buffer Covers { uvec2 covers[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Places { uint places[]; };
layout(set = 0, binding = 18, scalar) writeonly buffer Keys { uint keys[]; };
layout(set = 0, binding = 19, scalar) writeonly buffer Entries { uint entries[]; };

void main() {
    uint i = linear_id();
    if (i >= params.photons) return;
    uvec2 cover = covers[i];
    uint columns = bitfieldExtract(cover.y, 16, 8), row = tiles_of_level(params.lowest, cover.y >> 24).x;
    uint place = places[i];
    for (uint mask = cover.y & 0xffffu; mask != 0u; mask &= mask - 1u) {
        uint k = findLSB(mask);
        keys[place] = cover.x + (k / columns) * row + k % columns;
        entries[place] = i;
        ++place;
    }
}
