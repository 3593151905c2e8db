// Camera rays: one jittered sample per pixel and pass, box filter, and with LENS a point of the thin lens for each.
// Clears the pixel's path slots.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "lib/sampling.glsl"
#include "shared/scene.glsl"
#include "shared/photon.glsl"
#include "lib/pixels.glsl"

layout(constant_id = 20) const bool LENS = false;
layout(constant_id = 21) const uint START_MEDIUM = 0; // in which paths begin, as their states have it

layout(set = 0, binding = 11, scalar) readonly buffer CameraBlock { Camera camera[]; };
layout(set = 0, binding = 12, scalar) readonly buffer PassBlock { Pass pass[]; };
layout(set = 0, binding = 16, scalar) writeonly buffer Rays { vec4 rays[]; };
layout(set = 0, binding = 17, scalar) writeonly buffer Throughput { vec4 throughput[]; };
layout(set = 0, binding = 18, scalar) writeonly buffer States { uint states[]; };
layout(set = 0, binding = 19, scalar) writeonly buffer List { uint list[]; };
layout(set = 0, binding = 20, scalar) writeonly buffer Radiance { vec4 radiance[]; };
layout(set = 0, binding = 21, scalar) writeonly buffer Valid { uint valid[]; };

// A point of the unit disc, uniform for a uniform `u`; concentric squares become concentric circles, so that what is
// stratified stays so (Shirley and Chiu 1997).
vec2 concentric_disc(vec2 u) {
    vec2 p = 2.0 * u - 1.0;
    bool wide = abs(p.x) > abs(p.y);
    float radius = wide ? p.x : p.y;
    if (radius == 0.0) return vec2(0.0);
    float turn = 0.25 * PI * (wide ? p.y / p.x : p.x / p.y);
    float angle = wide ? turn : 0.5 * PI - turn;
    return radius * vec2(cos(angle), sin(angle));
}

void main() {
    uint pixel = linear_id();
    Camera c = camera[0];
    if (pixel >= c.pixels) return;
    uvec2 at = pixel_position(c.first_pixel + pixel, c.width, c.height);
    // The pass index runs through one low-discrepancy sequence per pixel, so that passes together stratify the pixel.
    uint key = hash2(pass[0].seed, at.y * c.width + at.x);
    vec2 jitter = sequence2(pass[0].index, key, 0u);
    vec2 p = (vec2(at) + jitter) / vec2(c.width, c.height) * 2.0 - 1.0;
    vec3 across = c.right * p.x - c.up * p.y;
    bool parallel = c.orthographic != 0u;
    vec3 origin = parallel ? c.position + across : c.position;
    vec3 direction = parallel ? c.forward : normalize(c.forward + across);
    if (LENS && c.lens_radius > 0.0) {
        // Every ray of the jittered point meets the same point of the sharp plane, position + focus * (forward +
        // across); `right` and `up` are stretched to the image, so the lens is laid out along their directions.
        vec2 on_lens = c.lens_radius * concentric_disc(sequence2(pass[0].index, key, 1u));
        vec3 offset = normalize(c.right) * on_lens.x + normalize(c.up) * on_lens.y;
        origin = c.position + offset;
        direction = normalize(c.forward + across - offset * c.inverse_focus);
    }
    rays[2u * pixel] = vec4(origin, 0.0);
    rays[2u * pixel + 1u] = vec4(direction, 0.0);
    throughput[pixel] = vec4(1.0, 1.0, 1.0, float(c.slots));
    states[pixel] = START_MEDIUM;
    list[pixel] = pixel;
    for (uint i = 0u; i < c.slots; ++i) {
        radiance[pixel + i * c.pixels] = vec4(0.0);
        valid[pixel + i * c.pixels] = 0u;
    }
}
