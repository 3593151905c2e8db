// A ray's hit, in registers and packed into words.

struct Hit {
    float t;           // ray parameter; t_max where nothing was hit
    vec2 barycentrics; // weights of v1 and v2
    uint triangle;     // index in leaf order, or BVH_MISS
};

Hit unpack_hit(uvec4 w) {
    return Hit(uintBitsToFloat(w.x), uintBitsToFloat(w.yz), w.w);
}

uvec4 pack_hit(Hit h) {
    return uvec4(floatBitsToUint(h.t), floatBitsToUint(h.barycentrics), h.triangle);
}
