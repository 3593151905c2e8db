// Enters each run of photons with one key in the table: the first invocation of the run does. Which slot a run gets
// when several want it depends on the order of the invocations; where its photons lie, and what is found, does not.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "lib/hash.glsl"

layout(push_constant, scalar) uniform Params { uint mask; } params; // slots of the table - 1
layout(set = 0, binding = 16, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Keys { uint keys[]; };
layout(set = 0, binding = 18, scalar) buffer Table { HashSlot table[]; };
layout(set = 0, binding = 19, scalar) writeonly buffer Ends { uint ends[]; }; // by first photon of a run

void main() {
    uint first = linear_id();
    uint n = min(count[0], keys.length());
    if (first >= n) return;
    uint key = keys[first];
    if (key == HASH_NONE || (first > 0u && keys[first - 1u] == key)) return;
    // The end of the run: doubling steps, then bisection. `inside` has the key, `outside` has not.
    uint reach = 1u;
    while (first + reach < n && keys[first + reach] == key) reach *= 2u;
    uint inside = first + reach / 2u, outside = min(first + reach, n);
    while (outside - inside > 1u) {
        uint middle = inside + (outside - inside) / 2u;
        if (keys[middle] == key) inside = middle;
        else outside = middle;
    }
    ends[first] = outside;
    // At most half of the slots are taken, and probing visits all of them: it ends.
    uint slot = key & params.mask, probes = 0u;
    while (atomicCompSwap(table[slot].key, HASH_NONE, key) != HASH_NONE) slot = hash_probe(slot, probes, params.mask);
    table[slot].first = first;
}
