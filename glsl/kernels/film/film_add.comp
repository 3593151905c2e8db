// Adds a pass to the film: per pixel the sum over its path slots, as exact sums (lib/exact_sum.glsl) of the value, of
// its square, and of the value times the squared footprint scale of the pass, from which the bias is estimated. Values
// that are not finite count as zero and those beyond the range are cut; both are tallied.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/film.glsl"
#include "lib/exact_sum.glsl"
#include "shared/scene.glsl"

layout(constant_id = 20) const bool AOV = false;

layout(push_constant, scalar) uniform Params {
    float unit;       // power of two that brings radiance to the range of exact sums
    float depth_unit; // the same for depths
} params;

layout(set = 0, binding = 11, scalar) readonly buffer CameraBlock { Camera camera[]; };
layout(set = 0, binding = 12, scalar) readonly buffer PassBlock { Pass pass[]; };
layout(set = 0, binding = 16, scalar) readonly buffer Radiance { vec4 radiance[]; };  // per slot: emitted and direct
layout(set = 0, binding = 17, scalar) readonly buffer Gathered { vec4 gathered[]; };  // per slot: caustic, then other
layout(set = 0, binding = 18, scalar) readonly buffer AovFirst { float aov_first[]; };
layout(set = 0, binding = 19, scalar) buffer Film { uvec4 film[]; };                  // FILM_SUMS per pixel
layout(set = 0, binding = 20, scalar) buffer FilmLayers { uvec4 film_layers[]; };     // with AOV: LAYER_SUMS per pixel
layout(set = 0, binding = 21, scalar) buffer Rejected { uint rejected[]; };
layout(set = 0, binding = 22, scalar) readonly buffer Overflow { uint overflow[]; };

void add_to_film(uint at, float x) {
    uvec4 sum = film[at];
    exact_add(sum, x);
    film[at] = sum;
}

void add_to_layer(uint at, float x) {
    uvec4 sum = film_layers[at];
    exact_add(sum, clamp(x, -EXACT_LARGEST, EXACT_LARGEST));
    film_layers[at] = sum;
}

void add_layers(uint pixel, vec3 direct, vec3 other, vec3 caustic) {
    uint first = AOV_FLOATS * pixel, layer = LAYER_SUMS * pixel;
    // Albedo and normal stand in the same order in both.
    [[dont_unroll]] for (uint i = 0u; i < AOV_AT_DEPTH; ++i) add_to_layer(layer + i, aov_first[first + i]);
    float depth = aov_first[first + AOV_AT_DEPTH];
    bool seen = !isinf(depth);
    add_to_layer(layer + LAYER_AT_DEPTH, seen ? depth * params.depth_unit : 0.0);
    add_to_layer(layer + LAYER_AT_COVERAGE, seen ? 1.0 : 0.0);
    [[dont_unroll]] for (uint i = 0u; i < 3u; ++i) {
        add_to_layer(layer + LAYER_AT_DIRECT + i, direct[i] * params.unit);
        add_to_layer(layer + LAYER_AT_INDIRECT + i, other[i] * params.unit);
        add_to_layer(layer + LAYER_AT_CAUSTIC + i, caustic[i] * params.unit);
    }
}

void main() {
    uint pixel = linear_id();
    Camera c = camera[0];
    // A pass whose photons did not fit is not counted; the host repeats it with more room.
    if (pixel >= c.pixels || overflow[0] != 0u) return;
    vec3 direct = vec3(0.0), caustic = vec3(0.0), other = vec3(0.0);
    for (uint i = 0u; i < c.slots; ++i) {
        uint slot = i * c.pixels + pixel;
        direct += radiance[slot].xyz;
        caustic += gathered[2u * slot].xyz;
        other += gathered[2u * slot + 1u].xyz;
    }
    vec3 value = direct + caustic + other;
    if (any(isnan(value)) || any(isinf(value))) {
        atomicAdd(rejected[0], 1u);
        value = vec3(0.0);
        direct = vec3(0.0);
        caustic = vec3(0.0);
        other = vec3(0.0);
    }
    value *= params.unit;
    if (any(greaterThan(abs(value), vec3(EXACT_LARGEST)))) {
        atomicAdd(rejected[0], 1u);
        value = clamp(value, vec3(-EXACT_LARGEST), vec3(EXACT_LARGEST));
    }
    float squared_scale = pass[0].radius_scale * pass[0].radius_scale;
    uint at = FILM_SUMS * pixel;
    [[dont_unroll]] for (uint i = 0u; i < 3u; ++i) {
        float x = value[i];
        add_to_film(at + i, x);
        add_to_film(at + FILM_SQUARES + i, min(x * x, EXACT_LARGEST));
        add_to_film(at + FILM_SCALED + i, x * squared_scale);
    }
    if (AOV) add_layers(pixel, direct, other, caustic);
}
