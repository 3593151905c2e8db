// Entries of tiles as records of 12 bytes, each relative to a box around its tile's hits. Three arrays: no binding is
// then longer than that of the entries.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/scene.glsl"
#include "shared/photon.glsl"
#include "lib/packed_photon.glsl"
#include "lib/tiles.glsl"

layout(set = 0, binding = 16, scalar) readonly buffer Total { uint total[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Keys { uint keys[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Entries { uint entries[]; };
layout(set = 0, binding = 19, scalar) readonly buffer Discs { Photon discs[]; };
layout(set = 0, binding = 20, scalar) readonly buffer Tiles { vec4 tiles[]; };
layout(set = 0, binding = 21, scalar) readonly buffer Ranges { RadiusRange ranges[]; };
layout(set = 0, binding = 22, scalar) writeonly buffer Places { uint places[]; };
layout(set = 0, binding = 23, scalar) writeonly buffer Powers { uint powers[]; };
layout(set = 0, binding = 24, scalar) writeonly buffer Looks { uint looks[]; };

void main() {
    uint e = linear_id();
    if (e >= min(total[0], entries.length())) return;
    Photon p = discs[entries[e]];
    // With the radius that will be read from the record.
    float radius = radius_decode(radius_encode(disc_radius(p), ranges[0], 256u), ranges[0], 256u);
    vec3 low = tiles[TILE_VECTORS * keys[e]].xyz, size = tiles[TILE_VECTORS * keys[e] + 1u].xyz - low;
    tile_box(low, size, radius);
    uvec3 record = pack12(p, ranges[0], low, size);
    places[e] = record.x;
    powers[e] = record.y;
    looks[e] = record.z;
}
