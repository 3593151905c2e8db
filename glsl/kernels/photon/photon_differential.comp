// One step of a photon's differential, with the functions that photon_bounce uses: for tests against
// src/kernels/differentials.rs.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"

struct DifferentialStep {
    vec3 dp;
    float t;            // flight to the surface
    vec3 dd;
    float eta;          // 0: reflection
    vec3 d;
    uint reserved;
    vec3 normal;        // geometric
    uint reserved1;
    vec3 e1;
    uint reserved2;
    vec3 e2;
    uint reserved3;
    vec3 dn1;
    uint reserved4;
    vec3 dn2;
    uint reserved5;
    vec3 interpolated;  // normal before normalisation
    uint reserved6;
};

layout(push_constant, scalar) uniform Params { uint count; } params;
layout(set = 0, binding = 16, scalar) readonly buffer Steps { DifferentialStep steps[]; };
layout(set = 0, binding = 17, scalar) writeonly buffer Results { vec4 results[]; };

void main() {
    uint i = linear_id();
    if (i >= params.count) return;
    DifferentialStep s = steps[i];
    vec3 dp = transfer(s.dp, s.dd, s.d, s.normal, s.t);
    vec3 dn = normal_derivative(dp, s.e1, s.e2, s.dn1, s.dn2, s.interpolated);
    vec3 n = normalize(s.interpolated);
    vec3 dd;
    if (s.eta == 0.0) {
        dd = reflect_derivative(s.dd, s.d, n, dn);
    } else {
        float cosine = dot(s.d, n);
        float k = 1.0 - s.eta * s.eta * (1.0 - cosine * cosine);
        vec3 r = s.eta * s.d - (s.eta * cosine + sqrt(max(k, 0.0))) * n;
        dd = refract_derivative(s.dd, s.d, n, dn, s.eta, r);
    }
    results[2u * i] = vec4(dp, 0.0);
    results[2u * i + 1u] = vec4(dd, 0.0);
}
