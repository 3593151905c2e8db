// Random and low-discrepancy numbers: everything is a hash of (seed, pass, index, dimension), never of time or order.

#include "lib/salts.glsl"

uint hash(uint x) { // "lowbias32" constants by C. Wellons' search of 2018
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    x ^= x >> 16;
    return x;
}

uint hash2(uint a, uint b) {
    return hash(a ^ (hash(b) + 0x9e3779b9u + (a << 6) + (a >> 2)));
}

float unit_float(uint bits) { // [0, 1)
    return float(bits >> 8) * 5.9604644775390625e-8;
}

// Owen scrambling by a hash that only carries upwards (Laine and Karras 2011; Burley 2020, "Practical Hash-based Owen
// Scrambling", section 3).
uint owen(uint x, uint seed) {
    x = bitfieldReverse(x);
    x += seed;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return bitfieldReverse(x);
}

uint sobol1(uint index) { // second dimension of the Sobol sequence
    uint x = 0u;
    uint direction = 0x80000000u;
    while (index != 0u) {
        x ^= (index & 1u) != 0u ? direction : 0u;
        index >>= 1;
        direction ^= direction >> 1;
    }
    return x;
}

// Point `index` of a shuffled, Owen-scrambled (0,2)-sequence; pairs of different `pair` are independent.
vec2 sequence2(uint index, uint seed, uint pair) {
    uint key = hash2(seed, pair);
    uint i = owen(index, key);
    uint x = owen(bitfieldReverse(i), hash(key ^ 0xa511e9b3u));
    uint y = owen(sobol1(i), hash(key ^ 0x63d83595u));
    return vec2(unit_float(x), unit_float(y));
}

float sequence1(uint index, uint seed, uint pair) {
    uint key = hash2(seed, pair);
    return unit_float(owen(bitfieldReverse(owen(index, key)), hash(key ^ 0xa511e9b3u)));
}

vec3 cosine_hemisphere(vec2 u) { // pdf z / pi
    float r = sqrt(u.x);
    float phi = 2.0 * PI * u.y;
    return vec3(r * cos(phi), r * sin(phi), sqrt(max(0.0, 1.0 - u.x)));
}

vec3 uniform_sphere(vec2 u) { // pdf 1 / (4 pi)
    float z = 1.0 - 2.0 * u.x;
    float r = sqrt(max(0.0, 1.0 - z * z));
    float phi = 2.0 * PI * u.y;
    return vec3(r * cos(phi), r * sin(phi), z);
}

// Uniform in the cone of half angle acos(1 - one_minus_cos) around +z; stable for narrow cones. pdf 1 / (2 pi
// one_minus_cos)
vec3 uniform_cone(vec2 u, float one_minus_cos) {
    float h = u.x * one_minus_cos;
    float r = sqrt(max(0.0, h * (2.0 - h)));
    float phi = 2.0 * PI * u.y;
    return vec3(r * cos(phi), r * sin(phi), 1.0 - h);
}

vec2 uniform_triangle(vec2 u) { // barycentrics of the second and third vertex
    float s = sqrt(u.x);
    return vec2(s * (1.0 - u.y), s * u.y);
}
