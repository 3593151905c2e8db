// Codes of 30 bits: three of size, then Morton codes with nine bits of each axis, x lowest.
//
// Size comes first (a coarse form of the extended codes of Vinkler, Bittner and Havran 2017), because a single large
// box among small ones would make every node around them large: the footprints of one photon map differ a thousandfold.

const uint MORTON_BITS = 30u; /// Bits of a code.
const uint MORTON_NONE = 1u << MORTON_BITS; /// Sorts behind every code.

// Bits of `value`, at most ten, with two zeros between each two.
uint morton_spread(uint value) {
    value = (value | value << 16) & 0x030000ffu;
    value = (value | value << 8) & 0x0300f00fu;
    value = (value | value << 4) & 0x030c30c3u;
    return (value | value << 2) & 0x09249249u;
}

// Size class of a box, 0 for a quarter of the scene's or more, each next one for half of that: from the exponents
// alone.
uint size_class(Aabb box, int scene_exponent) {
    precise vec3 half_size = 0.5 * box.max - 0.5 * box.min;
    int exponent = int(floatBitsToUint(max(half_size.x, max(half_size.y, half_size.z))) >> 23) - 126;
    return uint(clamp(scene_exponent - exponent - 2, 0, 7));
}

// Place of a box's centre within the scene's box, in cells of which 2^`bits` lie along the longest axis. Cells are
// cubes, because boxes of a long cell are long as well, and their edge is a power of two, because then every step but
// two additions is exact: all devices, and the same scene in other units of length, get the same codes.
uint morton_place(Aabb box, Aabb scene, int bits, out int exponent) {
    // Halves and quarters keep sums and differences of large coordinates finite.
    precise vec3 half_size = 0.5 * scene.max - 0.5 * scene.min;
    float longest = max(half_size.x, max(half_size.y, half_size.z));
    // longest < 2^exponent; below 2^-100 all boxes share a cell, above the factor 2^(bits - exponent) stays a normal
    // number.
    exponent = max(int(floatBitsToUint(longest) >> 23) - 126, -100);
    precise vec3 offset = (0.25 * box.min + 0.25 * box.max) - 0.5 * scene.min;
    float last = float((1 << bits) - 1);
    vec3 cell = clamp(offset * uintBitsToFloat(uint(127 + bits - exponent) << 23), vec3(0.0), vec3(last));
    return morton_spread(uint(cell.x)) | morton_spread(uint(cell.y)) << 1 | morton_spread(uint(cell.z)) << 2;
}

// Code of a box's size and place.
uint morton_code(Aabb box, Aabb scene) {
    int exponent;
    uint place = morton_place(box, scene, 9, exponent);
    return size_class(box, exponent) << 27 | place;
}

// Code of a box's place alone, in cells half as long: for triangles, whose sizes change from neighbour to neighbour and
// not by much.
uint morton_place_code(Aabb box, Aabb scene) {
    int exponent;
    return morton_place(box, scene, 10, exponent);
}
