// Density estimation from lists of photons per tile of the image (Mara, Luebke and McGuire 2013, "Tiled"). A workgroup
// serves a block of 8 x 8 pixels and goes through the lists of the tiles around it, one of each level.
//
// Each lane of a subgroup tests one photon of the list against the box around the subgroup's points; those that meet it
// are then added by all lanes together. Most photons of a tile miss the few pixels of a subgroup and cost a single
// lane's test.
//
// A dispatch takes a range of the joined lists, because some drivers cut long loops; the first one always writes.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"
#define ESTIMATE_TOGETHER
#include "lib/estimate.glsl"
#include "lib/sampling.glsl"
#include "lib/walk.glsl"
#include "lib/packed_photon.glsl"
#include "lib/pixels.glsl"
#include "lib/tiles.glsl"
#include "lib/dispatch.glsl"

// Photons are read by way of shared memory, 64 at a time, once for all subgroups of the workgroup.
layout(constant_id = 23) const bool CHUNKS = true;

layout(push_constant, scalar) uniform Params {
    uvec2 lowest;
    uint first_row;
    uint levels;
    uint first;  // entry of this dispatch; with 0 the sums start from nothing
    uint most;   // entries of this dispatch
    // Between rows of blocks that follow each other: rows of unequal weight are spread over a CPU's threads.
    uint stride;
} params;

layout(set = 0, binding = 11, scalar) readonly buffer CameraBlock { Camera camera[]; };
layout(set = 0, binding = 12, scalar) readonly buffer PassBlock { Pass pass[]; };
layout(set = 0, binding = 16, scalar) readonly buffer Seen { uint seen[]; };
layout(set = 0, binding = 17, scalar) readonly buffer EyeHits { EyeHit eye_hits[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Begins { uint begins[]; };
layout(set = 0, binding = 19, scalar) readonly buffer Entries { uint entries[]; };
layout(set = 0, binding = 20, scalar) readonly buffer Photons { Photon photons[]; };
layout(set = 0, binding = 21, scalar) readonly buffer Boxes { Aabb boxes[]; };
layout(set = 0, binding = 24, scalar) readonly buffer Tiles { vec4 tiles[]; };
layout(set = 0, binding = 25, scalar) readonly buffer Records { uint records[]; }; // of 20 bytes, or the places
layout(set = 0, binding = 26, scalar) readonly buffer Powers { uint powers[]; };   // of the entries, if RECORD is 12
layout(set = 0, binding = 27, scalar) readonly buffer Looks { uint looks[]; };
layout(set = 0, binding = 28, scalar) readonly buffer Ranges { RadiusRange ranges[]; };
layout(set = 0, binding = 22, scalar) buffer Gathered { vec4 gathered[]; };
// Groups of the other dispatches, if any list needs them.
layout(set = 0, binding = 23, scalar) writeonly buffer More { DispatchArgs more[]; };

const uint CHUNK = 64u;

shared Photon s_photon[CHUNK];
shared Aabb s_box[CHUNK];

// The box around the hits of the tile whose list is read.
struct TileBox {
    vec3 low;
    vec3 size;
};

// What an entry is known by: its photon's index, or with records of 12 bytes its own.
uint entry_index(uint entry) {
    return RECORD == 12u ? entry : entries[entry];
}

vec3 entry_place(uint entry, float radius, TileBox tile) {
    tile_box(tile.low, tile.size, radius);
    return place12(records[entry], tile.low, tile.size);
}

Photon load_photon(uint index, TileBox tile) {
    if (RECORD == 0u) return photons[index];
    if (RECORD == 12u) {
        uvec3 record = uvec3(records[index], powers[index], looks[index]);
        return unpack12_at(entry_place(index, radius12(record.z, ranges[0]), tile), record, ranges[0]);
    }
    uint at = PACKED_WORDS * index;
    uvec3 place = uvec3(records[at], records[at + 1u], records[at + 2u]);
    return unpack20(place, records[at + 3u], records[at + 4u], ranges[0]);
}

Aabb load_box(uint index, TileBox tile) {
    if (RECORD != 12u) return boxes[index];
    float radius = radius12(looks[index], ranges[0]);
    vec3 place = entry_place(index, radius, tile);
    return Aabb(place - DISC_REACH * radius, place + DISC_REACH * radius);
}

// Adds those of `count` photons from entry `from` that meet the box from `low` to `high` around the subgroup's points.
// A walk is the same here as one trial for each entry, since the steps between trials that succeed are geometric.
void add_range(inout Estimate sum, inout Walk walk, Point x, uint from, uint count, vec3 low, vec3 high, TileBox tile) {
    uvec4 here = subgroupBallot(true);
    uint lanes = subgroupBallotBitCount(here), lane = subgroupBallotExclusiveBitCount(here);
    for (uint k = 0u; k < count; k += lanes) {
        uint mine = k + lane;
        bool wanted = false;
        uint index = 0u;
        if (mine < count && walk_tries(walk, from + mine)) {
            index = CHUNKS ? mine : entry_index(from + mine);
            Aabb box;
            if (CHUNKS) box = s_box[mine];
            else box = load_box(index, tile);
            wanted = all(lessThanEqual(box.min, high)) && all(greaterThanEqual(box.max, low));
        }
        if (WALK_RATIO) {
            walk.listed += min(lanes, count - k);
            walk.visited += subgroupBallotBitCount(subgroupBallot(mine < count && walk_tries(walk, from + mine)));
        }
        uvec4 votes = subgroupBallot(wanted);
        for (uint part = 0u; part < gl_SubgroupSize; part += 32u) {
            uint word = part == 0u ? votes.x : part == 32u ? votes.y : part == 64u ? votes.z : votes.w;
            while (word != 0u) {
                uint chosen = subgroupBroadcast(index, part + findLSB(word));
                word &= word - 1u;
                if (CHUNKS) add_photon(sum, s_photon[chosen], x);
                else add_photon(sum, load_photon(chosen, tile), x);
            }
        }
    }
}

void add_entries(
    inout Estimate sum, inout Walk walk, Point x, uint begin, uint end, vec3 low, vec3 high, TileBox tile
) {
    if (!CHUNKS) {
        add_range(sum, walk, x, begin, end - begin, low, high, tile);
        return;
    }
    for (uint from = begin; from < end; from += CHUNK) {
        uint mine = from + gl_LocalInvocationIndex;
        barrier(); // the chunk before this one is done with
        if (mine < end) {
            uint index = entry_index(mine);
            s_photon[gl_LocalInvocationIndex] = load_photon(index, tile);
            s_box[gl_LocalInvocationIndex] = load_box(index, tile);
        }
        barrier();
        add_range(sum, walk, x, from, min(CHUNK, end - from), low, high, tile);
    }
}

// The pixel of the band that this invocation serves; beyond the band if there is none.
uint pixel_here(Camera c, uvec2 block) {
    uint i = gl_LocalInvocationIndex;
    uvec2 inside = uvec2((i >> 2u) & 7u, (i >> 5u) * 4u + (i & 3u));
    uvec2 at = 8u * block + inside + uvec2(0u, params.first_row << TILE_SHIFT);
    return at.x < c.width && at.y < c.height ? pixel_index(at, c.width, c.height) - c.first_pixel : 0xffffffffu;
}

void main() {
    Camera c = camera[0];
    uvec2 block = uvec2(gl_WorkGroupID.x, (gl_WorkGroupID.y * params.stride) % gl_NumWorkGroups.y);
    uint slot = pixel_here(c, block);
    bool here = slot < c.pixels && seen[min(slot, c.pixels - 1u)] != 0u;
    Point x = point_of(eye_hits[here ? slot : 0u]);
    if (!here) x.s.position = vec3(1e30); // out of every photon's reach
    vec3 low = subgroupMin(here ? x.s.position : vec3(INFINITY));
    vec3 high = subgroupMax(here ? x.s.position : vec3(-INFINITY));
    Estimate sum = estimate_nothing();
    // One walk for the pixels of a block: which look at photons together.
    uint place = WALK_TOGETHER * (block.y * gl_NumWorkGroups.x + block.x);
    Walk walk = walk_start(pass[0], place, params.first / params.most);
    uvec2 tile = block >> (TILE_SHIFT - 3u);
    uint base = 0u, at = 0u;
    for (uint level = 0u; level < params.levels; ++level) {
        uvec2 size = tiles_of_level(params.lowest, level);
        uint t = base + (tile.y >> level) * size.x + (tile.x >> level);
        uint begin = begins[t], count = begins[t + 1u] - begin;
        uint first = clamp(params.first, at, at + count) - at;
        uint end = clamp(params.first + params.most, at, at + count) - at;
        TileBox box = TileBox(vec3(0.0), vec3(0.0));
        if (RECORD == 12u) {
            box.low = tiles[TILE_VECTORS * t].xyz;
            box.size = tiles[TILE_VECTORS * t + 1u].xyz - box.low;
        }
        if (first < end) add_entries(sum, walk, x, begin + first, begin + end, low, high, box);
        at += count;
        base += size.x * size.y;
    }
    if (params.first == 0u && at > params.most && gl_LocalInvocationIndex == 0u) {
        more[0] = DispatchArgs(gl_NumWorkGroups.x, gl_NumWorkGroups.y, 1u); // all that write, write the same
    }
    if (!here || (params.first > 0u && params.first >= at)) return;
    vec3 factor = x.factor * walk_scale(walk);
    vec4 caustic = vec4(sum.caustic * factor, sum.tested), other = vec4(sum.other * factor, sum.accepted);
    if (params.first > 0u) {
        caustic += gathered[2u * slot];
        other += gathered[2u * slot + 1u];
    }
    gathered[2u * slot] = caustic;
    gathered[2u * slot + 1u] = other;
}
