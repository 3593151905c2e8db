// Density estimation at the eye hits from the hash grid (the "HashGrid" of Mara, Luebke and McGuire 2013, with levels):
// of each level in use every photon is tested that is filed where one may reach the point.
//
// The lanes of a subgroup are neighbouring pixels: they visit every run of photons that any of them needs, together and
// in ascending order of its key, so that control flow and loads are uniform, no lane meets a run twice even if several
// of its cells share it, and each lane adds its photons in an order that depends on nothing else.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_arithmetic : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"
#include "lib/hash.glsl"
#include "lib/packed_photon.glsl"
#define ESTIMATE_TOGETHER
#include "lib/estimate.glsl"
#include "lib/sampling.glsl"
#include "lib/walk.glsl"

// Steps after which a hit is given up and marked UNFINISHED; 0: none.
layout(constant_id = 22) const uint STEP_LIMIT = 0;
// Steps of the loops over corners, if they are not unrolled, with those around them.
const uint LOOPS = 10u;

layout(push_constant, scalar) uniform Params { uint mask; } params; // slots of the table - 1
layout(set = 0, binding = 12, scalar) readonly buffer PassBlock { Pass pass[]; };
layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer EyeHits { EyeHit eye_hits[]; };
layout(set = 0, binding = 19, scalar) readonly buffer Bounds { Aabb bounds[]; }; // of all footprints
layout(set = 0, binding = 20, scalar) readonly buffer Levels { HashLevel levels[]; };
layout(set = 0, binding = 21, scalar) readonly buffer InUse { uint in_use[]; };
layout(set = 0, binding = 22, scalar) readonly buffer Table { HashSlot table[]; };
layout(set = 0, binding = 23, scalar) readonly buffer Ends { uint ends[]; };
layout(set = 0, binding = 24, scalar) readonly buffer Photons { Photon photons[]; };
layout(set = 0, binding = 26, scalar) readonly buffer Records { uint records[]; }; // instead of photons, if RECORD
layout(set = 0, binding = 27, scalar) readonly buffer Checks { uint checks[]; }; // of cells, if RECORD is 12
layout(set = 0, binding = 28, scalar) readonly buffer Ranges { RadiusRange ranges[]; };
layout(set = 0, binding = 25, scalar) writeonly buffer Gathered { vec4 gathered[]; };

// Cells at the corners of the box around a hit: all that it meets, unless `more`.
uint corner_keys[8];
uint corner_checks[8]; // if RECORD is 12

struct Reach {
    uint level;
    vec3 low;  // first and last cell along each axis
    vec3 high;
    float radius; // further away along any axis no photon counts
    bool more; // there are cells between the corners'
};

// The next cell along an axis that a photon can be in: beyond 2^23 not all whole numbers are floats.
float next_cell(float cell) {
    uint bits = floatBitsToUint(cell);
    float above = uintBitsToFloat(cell < 0.0 ? bits - 1u : bits + 1u);
    return max(cell + 1.0, above);
}

Reach reach_of(uint level, vec3 position, bool anything) {
    HashLevel of = levels[level];
    precise vec3 low = (position - of.radius) * of.scale, high = (position + of.radius) * of.scale;
    Reach r = Reach(level, floor(low), floor(high), of.scale > 0.0 ? of.radius : INFINITY, false);
    // Neighbours or the same: in exact arithmetic always, and in floats up to 2^15 cells from the origin, where all are
    // if RECORD is 12.
    r.more = anything && any(greaterThan(r.high - r.low, vec3(1.0)));
    uvec3 a = hash_coordinates(r.low), b = hash_coordinates(r.high);
    for (uint k = 0u; k < 8u; ++k) {
        uvec3 c = uvec3((k & 1u) != 0u ? b.x : a.x, (k & 2u) != 0u ? b.y : a.y, (k & 4u) != 0u ? b.z : a.z);
        corner_keys[k] = anything ? hash_key(level, c) : HASH_NONE;
        if (RECORD == 12u) {
            corner_checks[k] = hash_check(c);
            // Each cell once: here photons are asked for by cell, not by key.
            bvec3 one = equal(r.low, r.high), upper = bvec3((k & 1u) != 0u, (k & 2u) != 0u, (k & 4u) != 0u);
            bvec3 twice = bvec3(one.x && upper.x, one.y && upper.y, one.z && upper.z);
            if (any(twice)) corner_keys[k] = HASH_NONE;
        }
    }
    return r;
}

// The smallest key from `from` on among this lane's cells, HASH_NONE after the last one.
uint next_key(Reach r, uint from, inout uint steps) {
    uint best = HASH_NONE;
    for (uint k = 0u; k < 8u; ++k) best = min(best, corner_keys[k] >= from ? corner_keys[k] : HASH_NONE);
    // Few cells even here: where whole numbers are no longer all floats, neither are all places.
    float z = r.low.z;
    while (r.more && z <= r.high.z) {
        float y = r.low.y;
        while (y <= r.high.y) {
            float x = r.low.x;
            while (x <= r.high.x) {
                uint key = hash_key(r.level, hash_coordinates(vec3(x, y, z)));
                best = min(best, key >= from ? key : HASH_NONE);
                x = next_cell(x);
                steps += 2u;
            }
            y = next_cell(y);
        }
        z = next_cell(z);
    }
    return best;
}

// The slot of a run, or an empty one.
HashSlot find(uint key, inout uint steps) {
    uint slot = key & params.mask, probes = 0u;
    HashSlot found = table[slot];
    while (found.key != key && found.key != HASH_NONE) {
        slot = hash_probe(slot, probes, params.mask);
        found = table[slot];
    }
    steps += probes;
    return found;
}

vec3 position_of(uint i) {
    if (RECORD == 0u) return uintBitsToFloat(photons[i].a.xyz);
    uint at = PACKED_WORDS * i;
    return uintBitsToFloat(uvec3(records[at], records[at + 1u], records[at + 2u]));
}

Photon load_photon(uint i) {
    if (RECORD == 0u) return photons[i];
    uint at = PACKED_WORDS * i;
    uvec3 place = uvec3(records[at], records[at + 1u], records[at + 2u]);
    return unpack20(place, records[at + 3u], records[at + 4u], ranges[0]);
}

// Adds the photons of a run.
void add_run(inout Estimate sum, inout Walk walk, Point x, Reach reach, uint first, uint end) {
    for (uint i = walk_enter(walk, first, end); walk_holds(walk, i, end); i = walk_next(walk, i)) {
        // Most photons of a cell are too far away for all lanes: their centre tells, at a quarter of the loads.
        vec3 offset = abs(x.s.position - position_of(i));
        if (subgroupAny(max_component(offset) <= reach.radius)) add_photon(sum, load_photon(i), x);
        else if (COUNT_PAIRS) sum.tested += 1.0;
    }
}

// Adds the photons of a run that lie in this lane's cells with its key. Almost always a lane has one such cell at most;
// where two share the key, all lanes go through the run twice.
void add_cells(inout Estimate sum, inout Walk walk, Point x, Reach reach, uint key, uint first, uint end) {
    uint mine = 0u;
    for (uint k = 0u; k < 8u; ++k) mine |= corner_keys[k] == key ? 1u << k : 0u;
    HashLevel of = levels[reach.level];
    bool once = false;
    while (!once || subgroupAny(mine != 0u)) {
        once = true;
        bool one = mine != 0u;
        uint k = one ? uint(findLSB(mine)) : 0u;
        mine &= mine - 1u;
        uint check = corner_checks[k];
        vec3 at = mix(reach.low, reach.high, bvec3((k & 1u) != 0u, (k & 2u) != 0u, (k & 4u) != 0u));
        HashCell cell = hash_cell(of, at, bounds[0].min, bounds[0].max);
        for (uint i = walk_enter(walk, first, end); walk_holds(walk, i, end); i = walk_next(walk, i)) {
            bool here = one && checks[i] == check;
            vec3 place = place12(records[3u * i], cell.low, cell.size);
            vec3 offset = abs(x.s.position - place);
            if (subgroupAny(here && max_component(offset) <= reach.radius)) {
                uvec3 record = uvec3(records[3u * i], records[3u * i + 1u], records[3u * i + 2u]);
                Photon p = unpack12_at(place, record, ranges[0]);
                // For who does not mean this cell, a photon that looks away counts nothing.
                if (!here) p.a.w = oct_encode(-x.s.geometric);
                add_photon(sum, p, x);
            } else if (COUNT_PAIRS) {
                sum.tested += 1.0;
            }
        }
    }
}

void main() {
    uint j = linear_id();
    if (j >= count[0]) return;
    uint slot = list[j];
    Point x = point_of(eye_hits[slot]);
    Estimate sum = estimate_nothing();
    Aabb all_boxes = bounds[0];
    if (RECORD == 12u) { // packed places move
        all_boxes.min -= 0.004 * levels[0].radius;
        all_boxes.max += 0.004 * levels[0].radius;
    }
    bool above = all(greaterThanEqual(x.s.position, all_boxes.min));
    bool anything = above && all(lessThanEqual(x.s.position, all_boxes.max));
    uint steps = 0u, rest = in_use[0];
    Walk walk = walk_start(pass[0], j, 0u);
    while (rest != 0u) {
        Reach reach = reach_of(uint(findLSB(rest)), x.s.position, anything);
        rest &= rest - 1u;
        steps += 2u * LOOPS;
        uint key = subgroupMin(next_key(reach, 0u, steps));
        while (key != HASH_NONE) {
            HashSlot run = find(key, steps);
            uint first = run.key == key ? run.first : 0u;
            uint end = run.key == key ? ends[first] : 0u;
            if (STEP_LIMIT != 0u) {
                steps += LOOPS + end - first;
                if (subgroupAny(steps > STEP_LIMIT)) break;
            }
            if (RECORD == 12u) add_cells(sum, walk, x, reach, key, first, end);
            else add_run(sum, walk, x, reach, first, end);
            key = subgroupMin(next_key(reach, key + 1u, steps));
        }
        if (STEP_LIMIT != 0u) {
            if (subgroupAny(steps > STEP_LIMIT)) break;
        }
    }
    bool unfinished = STEP_LIMIT != 0u && subgroupAny(steps > STEP_LIMIT);
    vec3 factor = x.factor * walk_scale(walk);
    gathered[2u * slot] = unfinished ? vec4(UNFINISHED) : vec4(sum.caustic * factor, sum.tested);
    gathered[2u * slot + 1u] = unfinished ? vec4(UNFINISHED) : vec4(sum.other * factor, sum.accepted);
}
