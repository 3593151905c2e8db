// Bilateral filter of the light at Lambert hits over a window that shrinks with the footprints: for estimates from few
// photons. As in sampling_fill.comp it is arriving light that is averaged, among hits of the same path slot.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "lib/sampling.glsl"
#include "shared/scene.glsl"
#include "shared/photon.glsl"
#include "lib/pixels.glsl"
#include "lib/similar.glsl"

layout(push_constant, scalar) uniform Params {
    uint radius; // of the window at the first pass, in pixels
} params;

layout(set = 0, binding = 11, scalar) readonly buffer CameraBlock { Camera camera[]; };
layout(set = 0, binding = 12, scalar) readonly buffer PassBlock { Pass pass[]; };
layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer EyeHits { EyeHit eye_hits[]; };
layout(set = 0, binding = 19, scalar) readonly buffer Lenders { uint lenders[]; };
layout(set = 0, binding = 20, scalar) readonly buffer Gathered { vec4 gathered[]; };
layout(set = 0, binding = 21, scalar) writeonly buffer Filtered { vec4 filtered[]; };

void main() {
    uint j = linear_id();
    if (j >= count[0]) return;
    uint slot = list[j];
    vec4 caustic = gathered[2u * slot], other = gathered[2u * slot + 1u];
    Camera c = camera[0];
    int radius = int(float(params.radius) * pass[0].radius_scale + 0.5);
    EyeHit hit = eye_hits[slot];
    if (radius > 0 && lambert_hit(hit)) {
        uvec2 at = pixel_position(c.first_pixel + slot % c.pixels, c.width, c.height);
        ivec2 low = max(ivec2(at) - radius, ivec2(0));
        ivec2 high = min(ivec2(at) + radius, ivec2(c.width, c.height) - 1);
        vec3 sums[2] = vec3[2](vec3(0.0), vec3(0.0));
        vec3 weight = vec3(0.0);
        ivec2 from = low;
        while (from.y <= high.y) {
            vec2 apart = abs(vec2(from) - vec2(at));
            vec2 tent = 1.0 - apart / float(radius + 1);
            uint pixel = pixel_index(uvec2(from), c.width, c.height) - c.first_pixel;
            uint lender = slot - slot % c.pixels + pixel;
            from = from.x < high.x ? ivec2(from.x + 1, from.y) : ivec2(low.x, from.y + 1);
            if (pixel >= c.pixels || lenders[lender] == 0u) continue;
            EyeHit lent = eye_hits[lender];
            vec3 factor = uintBitsToFloat(lent.b.xyz);
            vec3 w = tent.x * tent.y * similarity(hit, lent, length(apart), c) * vec3(greaterThan(factor, vec3(LENDS)));
            vec3 share = w / max(factor, vec3(LENDS));
            sums[0] += share * gathered[2u * lender].xyz;
            sums[1] += share * gathered[2u * lender + 1u].xyz;
            weight += w;
        }
        // The hit itself is among its lenders: where its factor is not 0, neither is the weight.
        vec3 scale = uintBitsToFloat(hit.b.xyz) / max(weight, vec3(LENDS));
        caustic.xyz = sums[0] * scale;
        other.xyz = sums[1] * scale;
    }
    filtered[2u * slot] = caustic;
    filtered[2u * slot + 1u] = other;
}
