const float PI = 3.14159265358979;
const float INFINITY = uintBitsToFloat(0x7f800000u);

float luminance(vec3 c) {
    return dot(c, vec3(0.2126, 0.7152, 0.0722));
}

float max_component(vec3 c) {
    return max(c.x, max(c.y, c.z));
}

float sqr(float x) {
    return x * x;
}

// Orthonormal basis around a unit vector (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
void basis(vec3 n, out vec3 t, out vec3 b) {
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float c = n.x * n.y * a;
    t = vec3(1.0 + s * n.x * n.x * a, s * c, -s * n.x);
    b = vec3(c, s + n.y * n.y * a, -n.y);
}

vec3 from_basis(vec3 n, vec3 local) {
    vec3 t, b;
    basis(n, t, b);
    return t * local.x + b * local.y + n * local.z;
}

// Octahedral unit vector in 2 x 16 bits (Cigolle et al. 2014, "A Survey of Efficient Representations for Independent
// Unit Vectors"); largest error about 4e-5 rad.
uint oct_encode(vec3 v) {
    vec2 p = v.xy / (abs(v.x) + abs(v.y) + abs(v.z));
    vec2 s = vec2(p.x >= 0.0 ? 1.0 : -1.0, p.y >= 0.0 ? 1.0 : -1.0);
    p = v.z < 0.0 ? (1.0 - abs(p.yx)) * s : p;
    uvec2 q = uvec2(clamp(round(p * 32767.0), vec2(-32767.0), vec2(32767.0)) + 32768.0);
    return q.x | (q.y << 16);
}

vec3 oct_decode(uint bits) {
    vec2 p = (vec2(bits & 0xffffu, bits >> 16) - 32768.0) / 32767.0;
    vec3 v = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    float t = max(-v.z, 0.0);
    v.x += v.x >= 0.0 ? -t : t;
    v.y += v.y >= 0.0 ? -t : t;
    return normalize(v);
}
