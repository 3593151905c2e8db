// Adds a pass to the film: per pixel the sum over its path slots, as two-float sums of the value and of its square.
// Values that are not finite count as zero and are tallied.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "lib/two_float.glsl"
#include "shared/scene.glsl"

layout(constant_id = 20) const bool AOV = false;

layout(set = 0, binding = 11, scalar) readonly buffer CameraBlock { Camera camera[]; };
layout(set = 0, binding = 16, scalar) readonly buffer Radiance { vec4 radiance[]; };  // per slot: emitted and direct
layout(set = 0, binding = 17, scalar) readonly buffer Gathered { vec4 gathered[]; };  // per slot: caustic, then other
layout(set = 0, binding = 18, scalar) readonly buffer AovFirst { float aov_first[]; };
layout(set = 0, binding = 19, scalar) buffer Film { float film[]; };                  // 12 floats per pixel
layout(set = 0, binding = 20, scalar) buffer FilmLayers { vec4 film_layers[]; };      // with AOV: layer sums
layout(set = 0, binding = 21, scalar) buffer Rejected { uint rejected[]; };
layout(set = 0, binding = 22, scalar) readonly buffer Overflow { uint overflow[]; };

void add_layer(uint at, vec3 value) {
    // Layers carry their own two-float sums: high parts, then low parts.
    vec4 high = film_layers[at], low = film_layers[at + 1u];
    two_float_add(high.x, low.x, value.x);
    two_float_add(high.y, low.y, value.y);
    two_float_add(high.z, low.z, value.z);
    film_layers[at] = high;
    film_layers[at + 1u] = low;
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
    uint at = 12u * pixel;
    for (uint i = 0u; i < 3u; ++i) {
        float high = film[at + i], low = film[at + 3u + i];
        two_float_add(high, low, value[i]);
        film[at + i] = high;
        film[at + 3u + i] = low;
        high = film[at + 6u + i];
        low = film[at + 9u + i];
        two_float_add(high, low, value[i] * value[i]);
        film[at + 6u + i] = high;
        film[at + 9u + i] = low;
    }
    if (!AOV) return;
    uint first = 7u * pixel, layer = 12u * pixel;
    add_layer(layer, vec3(aov_first[first], aov_first[first + 1u], aov_first[first + 2u]));
    add_layer(layer + 2u, vec3(aov_first[first + 3u], aov_first[first + 4u], aov_first[first + 5u]));
    float depth = aov_first[first + 6u];
    bool seen = !isinf(depth);
    add_layer(layer + 4u, vec3(seen ? depth : 0.0, seen ? 1.0 : 0.0, 0.0));
    add_layer(layer + 6u, direct);
    add_layer(layer + 8u, other);
    add_layer(layer + 10u, caustic);
}
