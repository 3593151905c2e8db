// Morton codes of 30 bits: 10 bits of each axis, x lowest.

const uint MORTON_BITS = 30u;
const uint MORTON_NONE = 1u << MORTON_BITS; // sorts behind every code

// Ten bits of `value` with two zeros between each two.
uint morton_spread(uint value) {
    value = (value | value << 16) & 0x030000ffu;
    value = (value | value << 8) & 0x0300f00fu;
    value = (value | value << 4) & 0x030c30c3u;
    return (value | value << 2) & 0x09249249u;
}

// Code of a box's centre within the scene's box. Cells are cubes, because boxes of a long cell are long as well, and
// their edge is a power of two, because then every step but two additions is exact: all devices, and the same scene in
// other units of length, get the same codes.
uint morton_code(Aabb box, Aabb scene) {
    // Halves and quarters keep sums and differences of large coordinates finite.
    precise vec3 half_size = 0.5 * scene.max - 0.5 * scene.min;
    float longest = max(half_size.x, max(half_size.y, half_size.z));
    // longest < 2^exponent; below 2^-100 all boxes share a cell, above the factor 2^(10 - exponent) stays a normal number.
    int exponent = max(int(floatBitsToUint(longest) >> 23) - 126, -100);
    precise vec3 offset = (0.25 * box.min + 0.25 * box.max) - 0.5 * scene.min;
    vec3 cell = clamp(offset * uintBitsToFloat(uint(127 + 10 - exponent) << 23), vec3(0.0), vec3(1023.0));
    return morton_spread(uint(cell.x)) | morton_spread(uint(cell.y)) << 1 | morton_spread(uint(cell.z)) << 2;
}
