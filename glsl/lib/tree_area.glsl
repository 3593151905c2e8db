// Areas of boxes relative to a tree, by steps that round alike everywhere: lengths are brought to the size of the root
// by a power of two, so nothing overflows, and a scene in other units of length gives the same bits.

// What lengths are multiplied by: a box's half extents become at most two.
float tree_unit(Aabb root) {
    precise vec3 size = 0.5 * root.max - 0.5 * root.min;
    float longest = max(size.x, max(size.y, size.z));
    int exponent = clamp(int(floatBitsToUint(longest) >> 23) - 127, -126, 126);
    return uintBitsToFloat(uint(127 - exponent) << 23);
}

// An eighth of the surface of a box in these units; 0 for an inverted box.
float tree_area(Aabb box, float unit) {
    precise vec3 size = max(0.5 * box.max - 0.5 * box.min, vec3(0.0)) * unit;
    precise float area = size.x * size.y + (size.x + size.y) * size.z;
    return box.min.x <= box.max.x ? area : 0.0;
}
