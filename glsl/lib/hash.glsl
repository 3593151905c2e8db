// The hash grid: in which cell a photon is filed, and the key of a cell.
//
// A photon is filed by its centre, at the level of its size: the half-extent of its footprint's box lies within a
// factor of two below the level's radius (the last level takes the rest). A hit X has to see the photons of the level
// whose centres lie in X +- radius. That none is missed follows from monotonicity alone: with p >= X - radius, rounding
// gives p >= fl(X - radius), and multiplication by a common factor and floor keep the order, whatever they lose. So the
// cells from floor((X - radius) scale) to floor((X + radius) scale) hold all of them, at any distance from the origin.

// Bits of a cell's hash. Tests take fewer, so that cells share a hash.
layout(constant_id = 23) const uint HASH_BITS = 28;

const uint HASH_LEVELS = 16u; /// Levels of cells of the hash grid.
const uint HASH_NONE = 0xffffffffu; /// No key of the hash grid.
const uint HASH_LEVEL_SHIFT = 28u; /// Bits of a key below its level: the hash of a cell.
const uint HASH_GREATEST = (1u << HASH_LEVEL_SHIFT) - 2u; /// Greatest hash of a cell, so that no key is HASH_NONE.

// A slot of the table: an empty one has HASH_NONE for a key.
struct HashSlot {
    uint key;
    uint first; // photon of the run
};

// Cells of one level, the same numbers for filing and gathering.
struct HashLevel {
    float radius; // no photon of the level reaches further from its centre, along any axis
    float scale;  // cells per unit of length; 0 if the whole level is one cell
};

// A coordinate along an axis as 20 bits: wrapped, and mixed with the bits that wrapping drops, so that far places do
// not share cells systematically. `cell` is whole; every step is exact.
uint hash_coordinate(float cell) {
    precise float high = floor(cell * 9.5367431640625e-7); // 2^-20
    precise float wrapped = cell - high * 1048576.0;
    uint mixed = high == 0.0 ? 0u : floatBitsToUint(high) * 0x9e3779b1u >> 12;
    return (uint(wrapped) ^ mixed) & 0xfffffu;
}

uvec3 hash_coordinates(vec3 cell) {
    return uvec3(hash_coordinate(cell.x), hash_coordinate(cell.y), hash_coordinate(cell.z));
}

// 64-bit words as low and high half: not every device has them.
uvec2 wide_left(uvec2 a, uint n) {
    return uvec2(a.x << n, a.y << n | a.x >> (32u - n));
}

uvec2 wide_right(uvec2 a, uint n) {
    return uvec2(a.x >> n | a.y << (32u - n), a.y >> n);
}

uvec2 wide_add(uvec2 a, uvec2 b) {
    uint low = a.x + b.x;
    return uvec2(low, a.y + b.y + (low < a.x ? 1u : 0u));
}

// 64 to 32 bits by shifts (Wang 2007, "Integer Hash Function").
uint hash_wide(uvec2 k) {
    k = wide_add(~k, wide_left(k, 18u));
    k ^= wide_right(k, 31u);
    k = wide_add(wide_add(k, wide_left(k, 2u)), wide_left(k, 4u));
    k ^= wide_right(k, 11u);
    k = wide_add(k, wide_left(k, 6u));
    k ^= wide_right(k, 22u);
    return k.x;
}

// What photons are sorted by and the table is searched for: the level, and the hash of the cell, a 64-bit word of level
// and coordinates. Cells of one level may share a key, which costs tests and nothing else; no two levels do.
uint hash_key(uint level, uvec3 c) {
    uvec2 cell = uvec2(c.x | c.y << 20, c.y >> 12 | c.z << 8 | level << 28);
    uint hash = hash_wide(cell) & ((1u << HASH_BITS) - 1u);
    return level << HASH_LEVEL_SHIFT | min(hash, HASH_GREATEST);
}

// Corner and size of a cell, for places relative to it.
struct HashCell {
    vec3 low;
    vec3 size;
};

// `low` and `high` bound all footprints: this box is the cell of a level that has a single one.
HashCell hash_cell(HashLevel of, vec3 cell, vec3 low, vec3 high) {
    if (!(of.scale > 0.0)) return HashCell(low, min(high - low, vec3(3e38)));
    precise vec3 corner = cell / of.scale;
    return HashCell(corner, vec3(1.0 / of.scale));
}

// Another hash of a cell, independent of its key. Places are relative to a cell, so a photon of another cell with the
// same key must be told apart.
uint hash_check(uvec3 c) {
    uint h = (c.x * 0x8da6b343u ^ (c.y + 0x7f4a7c15u) * 0xd8163841u) * 0x9e3779b1u;
    h = (h ^ h >> 15) + c.z * 0xcb1ab31fu;
    return h ^ h >> 13;
}

// The next place where quadratic probing looks; the steps 1, 2, 3, ... visit every slot of a power of two.
uint hash_probe(uint slot, inout uint step, uint mask) {
    ++step;
    return (slot + step) & mask;
}
