// Records of 12 bytes in the order of the cells, each relative to its photon's own cell, and which cell that is: a run
// may hold the photons of several cells that share its key.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"
#include "lib/hash.glsl"
#include "lib/packed_photon.glsl"

layout(set = 0, binding = 16, scalar) readonly buffer Order { uint order[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Keys { uint keys[]; };
layout(set = 0, binding = 19, scalar) readonly buffer Discs { Photon discs[]; };
layout(set = 0, binding = 20, scalar) readonly buffer Levels { HashLevel levels[]; };
layout(set = 0, binding = 21, scalar) readonly buffer Bounds { Aabb bounds[]; };
layout(set = 0, binding = 22, scalar) readonly buffer Ranges { RadiusRange ranges[]; };
layout(set = 0, binding = 23, scalar) writeonly buffer Records { uint records[]; };
layout(set = 0, binding = 24, scalar) writeonly buffer Checks { uint checks[]; };

void main() {
    uint k = linear_id();
    if (k >= min(count[0], keys.length())) return;
    Photon p = discs[order[k]];
    HashLevel of = levels[keys[k] >> HASH_LEVEL_SHIFT];
    precise vec3 place = uintBitsToFloat(p.a.xyz) * of.scale; // as in hash_file
    vec3 cell = floor(place);
    HashCell box = hash_cell(of, cell, bounds[0].min, bounds[0].max);
    uvec3 record = pack12(p, ranges[0], box.low, box.size);
    records[3u * k] = record.x;
    records[3u * k + 1u] = record.y;
    records[3u * k + 2u] = record.z;
    checks[k] = hash_check(hash_coordinates(cell));
}
