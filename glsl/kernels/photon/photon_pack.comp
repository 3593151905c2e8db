// Photons as records of 20 bytes, and the discs that these stand for, with their boxes. With RECORD 12 the discs of
// those records alone, at their exact places: the places are packed where cells or tiles are known.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"
#include "lib/packed_photon.glsl"

layout(set = 0, binding = 16, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Photons { Photon photons[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Smallest { uint smallest[]; };
layout(set = 0, binding = 19, scalar) readonly buffer Largest { uint largest[]; };
layout(set = 0, binding = 20, scalar) writeonly buffer Ranges { RadiusRange ranges[]; };
layout(set = 0, binding = 21, scalar) writeonly buffer Records { uint records[]; };
layout(set = 0, binding = 22, scalar) writeonly buffer Boxes { Aabb boxes[]; };
layout(set = 0, binding = 23, scalar) writeonly buffer Discs { Photon discs[]; };

void main() {
    uint i = linear_id();
    float top = log2(uintBitsToFloat(largest[0]));
    RadiusRange range = RadiusRange(top, max(0.0, top - log2(uintBitsToFloat(smallest[0]))));
    if (i == 0u) ranges[0] = range;
    if (i >= min(count[0], photons.length())) return;
    Photon p = photons[i];
    if (RECORD == 12u) {
        p = unpack12_at(uintBitsToFloat(p.a.xyz), pack12(p, range, vec3(0.0), vec3(1.0)), range);
    } else {
        Packed20 r = pack20(p, range);
        uint at = PACKED_WORDS * i;
        records[at] = r.words[0];
        records[at + 1u] = r.words[1];
        records[at + 2u] = r.words[2];
        records[at + 3u] = r.words[3];
        records[at + 4u] = r.words[4];
        p = unpack20(uvec3(r.words[0], r.words[1], r.words[2]), r.words[3], r.words[4], range);
    }
    discs[i] = p;
    float radius = disc_radius(p);
    vec3 n = oct_decode(p.a.w), position = uintBitsToFloat(p.a.xyz);
    vec3 extent = radius * (sqrt(max(vec3(0.0), 1.0 - n * n)) + SLAB * abs(n));
    // Padded by the rounding of these few operations.
    extent *= 1.0 + 1e-6;
    boxes[i] = Aabb(position - extent, position + extent);
}
