// Files each photon in a cell: its key, by which photons are sorted, and the levels that have any.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_arithmetic : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"
#include "lib/hash.glsl"

// Levels that are filled, 1 to HASH_LEVELS; 1 is the single cell size of Mara, Luebke and McGuire.
layout(constant_id = 24) const uint LEVELS = 16;

layout(set = 0, binding = 16, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Photons { Photon photons[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Boxes { Aabb boxes[]; };
layout(set = 0, binding = 19, scalar) readonly buffer Extents { uint extents[]; };
layout(set = 0, binding = 20, scalar) readonly buffer Largest { uint largest[]; };
layout(set = 0, binding = 21, scalar) readonly buffer Levels { HashLevel levels[]; };
layout(set = 0, binding = 22, scalar) writeonly buffer Keys { uint keys[]; };
layout(set = 0, binding = 23, scalar) writeonly buffer Index { uint index[]; };
layout(set = 0, binding = 24, scalar) buffer InUse { uint in_use[]; };

// The largest level whose radius, largest * 2^-level, is not below the extent: from the bits, so exact.
uint level_of(uint extent, uint largest) {
    uint steps = (largest >> 23) - (extent >> 23) - ((extent & 0x7fffffu) > (largest & 0x7fffffu) ? 1u : 0u);
    return min(steps, LEVELS - 1u);
}

void main() {
    uint i = linear_id();
    if (i >= min(count[0], keys.length())) return;
    vec3 centre = uintBitsToFloat(photons[i].a.xyz);
    bool finite = all(lessThanEqual(abs(centre), vec3(FLT_MAX)));
    uint level = level_of(extents[i], largest[0]);
    precise vec3 place = centre * levels[level].scale;
    bool filed = finite && aabb_valid(boxes[i]);
    keys[i] = filed ? hash_key(level, hash_coordinates(floor(place))) : HASH_NONE;
    index[i] = i;
    uint used = subgroupOr(filed ? 1u << level : 0u);
    if (subgroupElect()) atomicOr(in_use[0], used);
}
