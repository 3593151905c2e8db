// Photon records of 20 bytes, and of 12 bytes relative to a box (after Mara, Luebke and McGuire 2013, section 4).
//
// What is lost: the ellipse becomes the disc of the same area; its radius is one of 128 (in 12 bytes 256) steps between
// the smallest and the largest of the pass. Flux has 8 bits for each channel below a shared exponent, the direction 7
// bits for each octahedral axis, the normal 5, and in 12 bytes the position 10 bits for each axis of the box. The
// largest error of each is half a step.
//   20 bytes: position; flux; direction, normal, radius, class
//   12 bytes: position and class; flux; direction, normal, radius

layout(constant_id = 32) const uint RECORD = 0; // bytes of a record; 0: Photon in full

// Radii of a pass in logarithms to base 2: code c stands for largest - c * span / (codes - 1).
struct RadiusRange {
    float largest;
    float span;
};

// Ward's shared exponent with rounding; the whole range of floats.
uint rgbe_encode(vec3 c) {
    float m = max_component(c);
    if (!(m > 1e-37)) return 0u;
    int exponent;
    frexp(m, exponent);
    // 255.5 / 256 of a power of two would round up to 256.
    if (round(ldexp(m, 8 - exponent)) > 255.0) ++exponent;
    uvec3 q = uvec3(round(ldexp(c, ivec3(8 - exponent))));
    return q.x | (q.y << 8) | (q.z << 16) | (uint(clamp(exponent + 128, 1, 255)) << 24);
}

vec3 rgbe_decode(uint bits) {
    if (bits == 0u) return vec3(0.0);
    vec3 q = vec3(bits & 255u, (bits >> 8) & 255u, (bits >> 16) & 255u);
    return ldexp(q, ivec3(int(bits >> 24) - 136));
}

// Octahedral code with an odd number of steps, so that the axes are exact; 2 * bits long.
uint oct_small_encode(vec3 v, uint bits) {
    float half_steps = float((1u << (bits - 1u)) - 1u);
    vec2 p = v.xy / (abs(v.x) + abs(v.y) + abs(v.z));
    vec2 s = vec2(p.x >= 0.0 ? 1.0 : -1.0, p.y >= 0.0 ? 1.0 : -1.0);
    p = v.z < 0.0 ? (1.0 - abs(p.yx)) * s : p;
    uvec2 q = uvec2(round(p * half_steps) + half_steps);
    return q.x | (q.y << bits);
}

vec3 oct_small_decode(uint code, uint bits) {
    float half_steps = float((1u << (bits - 1u)) - 1u);
    uint mask = (1u << bits) - 1u;
    vec2 p = (vec2(code & mask, (code >> bits) & mask) - half_steps) / half_steps;
    vec3 v = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    float t = max(-v.z, 0.0);
    v.x += v.x >= 0.0 ? -t : t;
    v.y += v.y >= 0.0 ? -t : t;
    return normalize(v);
}

uint radius_encode(float radius, RadiusRange range, uint codes) {
    float steps = float(codes - 1u);
    float c = range.span > 0.0 ? (range.largest - log2(radius)) / range.span * steps : 0.0;
    return uint(clamp(round(c), 0.0, steps));
}

float radius_decode(uint code, RadiusRange range, uint codes) {
    // The largest radius itself stays exact as far as exp2 and log2 are: with one radius for all, every photon has it.
    return exp2(range.largest - float(code) * (range.span / float(codes - 1u)));
}

// Radius of the disc that has the area of a photon's ellipse.
float disc_radius(Photon p) {
    return inversesqrt(PI * abs(uintBitsToFloat(p.d.w)));
}

// The photon that a record stands for.
Photon disc_photon(vec3 position, vec3 normal, float radius, vec3 flux, vec3 direction, bool caustic) {
    uint code = oct_encode(normal);
    vec3 t, b;
    basis(oct_decode(code), t, b);
    float density = 1.0 / (PI * radius * radius);
    Photon p;
    p.a = uvec4(floatBitsToUint(position), code);
    p.b = uvec4(floatBitsToUint(flux), oct_encode(direction));
    p.c = uvec4(floatBitsToUint(t / radius), 0u);
    p.d = uvec4(floatBitsToUint(b / radius), floatBitsToUint(caustic ? -density : density));
    return p;
}

struct Packed20 {
    uint words[PACKED_WORDS];
};

Packed20 pack20(Photon p, RadiusRange range) {
    bool caustic = uintBitsToFloat(p.d.w) < 0.0;
    uint look = oct_small_encode(oct_decode(p.b.w), 7u) | (oct_small_encode(oct_decode(p.a.w), 5u) << 14);
    look |= (radius_encode(disc_radius(p), range, 128u) << 24) | (caustic ? 0x80000000u : 0u);
    return Packed20(uint[](p.a.x, p.a.y, p.a.z, rgbe_encode(uintBitsToFloat(p.b.xyz)), look));
}

Photon unpack20(uvec3 position, uint power, uint look, RadiusRange range) {
    float radius = radius_decode((look >> 24) & 127u, range, 128u);
    vec3 direction = oct_small_decode(look, 7u), normal = oct_small_decode(look >> 14, 5u);
    bool caustic = (look & 0x80000000u) != 0u;
    return disc_photon(uintBitsToFloat(position), normal, radius, rgbe_decode(power), direction, caustic);
}

// Steps of a position along each axis of its box, in 12 bytes.
const float PLACE_STEPS = 1023.0;

// Photons of a tile lie around its hits, no further away along any axis than their footprint reaches: a cylinder of
// height 2 SLAB.
const float DISC_REACH = 1.12; // sqrt(1 + SLAB^2) = 1.118

// The box that places of a tile's photons of this radius are relative to, from the box around its hits.
void tile_box(inout vec3 low, inout vec3 size, float radius) {
    low -= DISC_REACH * radius;
    size += 2.0 * DISC_REACH * radius;
}

// Relative to the box that begins at `low` and is `size` long.
uvec3 pack12(Photon p, RadiusRange range, vec3 low, vec3 size) {
    vec3 place = (uintBitsToFloat(p.a.xyz) - low) / max(size, vec3(1e-37));
    uvec3 q = uvec3(clamp(round(place * PLACE_STEPS), vec3(0.0), vec3(PLACE_STEPS)));
    bool caustic = uintBitsToFloat(p.d.w) < 0.0;
    uint look = oct_small_encode(oct_decode(p.b.w), 7u) | (oct_small_encode(oct_decode(p.a.w), 5u) << 14);
    look |= radius_encode(disc_radius(p), range, 256u) << 24;
    uint where = q.x | (q.y << 10) | (q.z << 20) | (caustic ? 0x80000000u : 0u);
    return uvec3(where, rgbe_encode(uintBitsToFloat(p.b.xyz)), look);
}

vec3 place12(uint where, vec3 low, vec3 size) {
    uvec3 q = uvec3(where & 1023u, (where >> 10) & 1023u, (where >> 20) & 1023u);
    return low + size * (vec3(q) / PLACE_STEPS);
}

float radius12(uint look, RadiusRange range) {
    return radius_decode(look >> 24, range, 256u);
}

// The photon at a place that is known already.
Photon unpack12_at(vec3 position, uvec3 record, RadiusRange range) {
    vec3 direction = oct_small_decode(record.z, 7u), normal = oct_small_decode(record.z >> 14, 5u);
    bool caustic = (record.x & 0x80000000u) != 0u;
    return disc_photon(position, normal, radius12(record.z, range), rgbe_decode(record.y), direction, caustic);
}
