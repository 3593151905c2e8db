// Origins of rays that leave a surface: moved by a bound of the position's rounding error, never by a constant (Pharr,
// Jakob and Humphreys, "Physically Based Rendering", section 6.8).

const float GAMMA_7 = 7.0 * 5.9604644775390625e-8 / (1.0 - 7.0 * 5.9604644775390625e-8);

// Bound, per coordinate, of the error of b0 v0 + b1 v1 + b2 v2 with weights that sum to one.
vec3 position_error(vec3 v0, vec3 v1, vec3 v2) {
    return GAMMA_7 * max(abs(v0), max(abs(v1), abs(v2)));
}

// Moves a coordinate one float away from zero displacement in the direction of `offset`.
float step_away(float x, float offset) {
    uint bits = floatBitsToUint(x);
    bool grow = (x >= 0.0) == (offset > 0.0);
    uint next = grow ? bits + 1u : bits - 1u;
    return offset == 0.0 || x == 0.0 ? x : uintBitsToFloat(next);
}

vec3 spawn_origin(vec3 position, vec3 error, vec3 normal, vec3 direction) {
    float distance = dot(abs(normal), error);
    vec3 offset = (dot(normal, direction) < 0.0 ? -distance : distance) * normal;
    vec3 p = position + offset;
    return vec3(step_away(p.x, offset.x), step_away(p.y, offset.y), step_away(p.z, offset.z));
}
