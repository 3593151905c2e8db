// Camera rays: one jittered sample per pixel and pass, box filter. Clears the pixel's path slots.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "lib/sampling.glsl"
#include "shared/scene.glsl"
#include "shared/photon.glsl"
#include "lib/pixels.glsl"

layout(set = 0, binding = 11, scalar) readonly buffer CameraBlock { Camera camera[]; };
layout(set = 0, binding = 12, scalar) readonly buffer PassBlock { Pass pass[]; };
layout(set = 0, binding = 16, scalar) writeonly buffer Rays { vec4 rays[]; };
layout(set = 0, binding = 17, scalar) writeonly buffer Throughput { vec4 throughput[]; };
layout(set = 0, binding = 18, scalar) writeonly buffer States { uint states[]; };
layout(set = 0, binding = 19, scalar) writeonly buffer List { uint list[]; };
layout(set = 0, binding = 20, scalar) writeonly buffer Radiance { vec4 radiance[]; };
layout(set = 0, binding = 21, scalar) writeonly buffer Valid { uint valid[]; };

void main() {
    uint pixel = linear_id();
    Camera c = camera[0];
    if (pixel >= c.pixels) return;
    uvec2 at = pixel_position(c.first_pixel + pixel, c.width, c.height);
    // The pass index runs through one low-discrepancy sequence per pixel, so that passes together stratify the pixel.
    vec2 jitter = sequence2(pass[0].index, hash2(pass[0].seed, at.y * c.width + at.x), 0u);
    vec2 p = (vec2(at) + jitter) / vec2(c.width, c.height) * 2.0 - 1.0;
    vec3 across = c.right * p.x - c.up * p.y;
    bool parallel = c.orthographic != 0u;
    vec3 origin = parallel ? c.position + across : c.position;
    vec3 direction = parallel ? c.forward : normalize(c.forward + across);
    rays[2u * pixel] = vec4(origin, 0.0);
    rays[2u * pixel + 1u] = vec4(direction, 0.0);
    throughput[pixel] = vec4(1.0, 1.0, 1.0, float(c.slots));
    states[pixel] = 0u;
    list[pixel] = pixel;
    for (uint i = 0u; i < c.slots; ++i) {
        radiance[pixel + i * c.pixels] = vec4(0.0);
        valid[pixel + i * c.pixels] = 0u;
    }
}
