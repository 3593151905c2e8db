// Squares of the picture, for measuring and testing graphics passes.
struct Splat {
    // In pixels from the upper left corner of the picture.
    vec2 centre;
    float half_side;
    // 0 near, 1 far.
    float depth;
};

// Corner 0 to 3 of a strip whose triangles are counter-clockwise in the picture.
vec4 splat_corner(Splat s, uint corner, vec2 extent) {
    vec2 side = vec2((corner & 2u) != 0u ? 1.0 : -1.0, (corner & 1u) != 0u ? 1.0 : -1.0);
    return vec4((s.centre + side * s.half_side) / extent * 2.0 - 1.0, s.depth, 1.0);
}
