// Lobes of a surface by themselves, with the functions that light transport uses: for tests against src/kernels/lobes.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "lib/sampling.glsl"
#include "shared/scene.glsl"
#include "shared/photon.glsl"

const bool GLOSSY = true;
const bool GLASS = true;
const bool SMOOTH_NORMALS = true;

struct ProbedLobe {
    vec3 wo;       // in the frame of the shading normal, away from the surface
    float alpha;
    vec3 wi;
    float metallic;
    vec2 u;        // random numbers
    float base;    // reflectance of metal and base
    float coat_f0;
    float coat_f90;
    float ior;     // of a boundary of glass; 0: an opaque surface
    uint boundary; // where its table begins
    uint inside;
};

layout(push_constant, scalar) uniform Params { uint count; } params;
layout(set = 0, binding = 13, scalar) readonly buffer Lobes { uint lobes[]; };
layout(set = 0, binding = 16, scalar) readonly buffer Probes { ProbedLobe probes[]; };
layout(set = 0, binding = 17, scalar) writeonly buffer Results { vec4 results[]; };
#include "lib/bsdf.glsl"
#include "lib/scatter.glsl"
#include "lib/glass.glsl"

Surface surface_of_probe(ProbedLobe p) {
    Surface s;
    s.geometric = vec3(0.0, 0.0, 1.0);
    s.shading = s.geometric;
    s.front = p.inside == 0u;
    s.material = 0u;
    s.flags = MATERIAL_VOLUME;
    float glass = p.ior > 0.0 ? 1.0 : 0.0, coat = 1.0 - glass;
    s.diffuse = vec3(p.base * (1.0 - p.metallic) * coat);
    s.f0 = vec3(mix(p.coat_f0, p.base, p.metallic) * coat);
    s.f90 = mix(p.coat_f90, 1.0, p.metallic) * coat;
    s.f0_again = vec3(mix(sqr(p.coat_f0), sqr(p.base), p.metallic) * coat);
    s.metallic = p.metallic;
    s.coat_f0 = p.coat_f0;
    s.coat_f90 = p.coat_f90;
    s.alpha = p.alpha;
    s.glass = glass;
    s.transmission = vec3(glass);
    s.ior = p.ior;
    s.boundary = p.boundary;
    look_from(s, p.wo);
    return s;
}

// Three vectors for each probe: lobe, density, and the weight and chance of a sample; then two ways on with their
// weights: of an opaque surface the sample, of glass reflection and refraction.
void main() {
    uint i = linear_id();
    if (i >= params.count) return;
    ProbedLobe p = probes[i];
    Surface s = surface_of_probe(p);
    if (p.ior > 0.0) {
        Ways ways = sample_ways(s, -p.wo, p.u);
        results[3u * i] = vec4(0.0);
        results[3u * i + 1u] = vec4(ways.reflected.direction, ways.reflected.weight.x);
        results[3u * i + 2u] = vec4(ways.transmitted.direction, ways.transmitted.weight.x);
        return;
    }
    Gathered e = sample_gathered(s, -p.wo, 0.0, p.u, true);
    float lobe = gathered_bsdf(s, p.wo, p.wi).x, density = gathered_density(s, p.wo, p.wi, true);
    results[3u * i] = vec4(lobe, density, e.weight.x, e.probability);
    results[3u * i + 1u] = vec4(e.direction, gathered_bsdf(s, p.wo, e.direction).x);
    results[3u * i + 2u] = vec4(0.0);
}
