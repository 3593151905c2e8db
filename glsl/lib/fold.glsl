// Footprints at boundaries. Where another surface stands on the one that a photon lies on (a wall on a floor, the
// surface of water at the side of a basin), the part of the footprint beyond it is lost, and what lies beyond gets
// light that never came there. The footprint is therefore cut along that line, and the part beyond is reflected back:
// the reflection method of density estimation (Schuster 1985; Silverman 1986, section 2.10). In units of the semiaxes
// the reflection keeps areas, so the weight still integrates to one.
//
// A fold is a line { at : dot(at, n) = reach } in units of the semiaxes, 0 <= reach < 1, n a unit vector: a flag, 11
// bits of reach, 10 bits for each component of n. No fold is 0.

const uint FOLD = 0x80000000u; /// Flag of a footprint that is folded.

uint fold_encode(vec2 n, float reach) {
    uvec2 q = uvec2(round(n * 511.0) + 512.0);
    return FOLD | (min(uint(reach * 2048.0), 2047u) << 20) | (q.x << 10) | q.y;
}

// n and reach.
vec3 fold_decode(uint fold) {
    vec2 n = vec2((fold >> 10) & 1023u, fold & 1023u) - 512.0;
    return vec3(normalize(n), (float((fold >> 20) & 2047u) + 0.5) / 2048.0);
}

// Whether a place within the footprint is behind the boundary, and else the image of the place behind it.
bool fold_hides(uint fold, vec2 at, out vec2 image) {
    vec3 f = fold_decode(fold);
    float beyond = dot(at, f.xy) - f.z;
    image = at - 2.0 * beyond * f.xy;
    return beyond > 0.0;
}
