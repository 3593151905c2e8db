// Bilateral upsampling: gives each eye hit that was not estimated the light of the four estimated hits around it, as
// far as they are similar, and flags those around which none is.
//
// A hit behind a mirror or glass looks at the same path slot of the other pixels. What is interpolated is the light
// that arrives: the estimate divided by the lender's factor, times the factor of the hit, so that textures stay sharp.
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
    uint k;
    uint jump; // of chosen_place
} params;

layout(set = 0, binding = 11, scalar) readonly buffer CameraBlock { Camera camera[]; };
layout(set = 0, binding = 12, scalar) readonly buffer PassBlock { Pass pass[]; };
layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer EyeHits { EyeHit eye_hits[]; };
layout(set = 0, binding = 19, scalar) readonly buffer Chosen { uint chosen[]; };
layout(set = 0, binding = 20, scalar) readonly buffer Lenders { uint lenders[]; };
layout(set = 0, binding = 21, scalar) buffer Gathered { vec4 gathered[]; };
layout(set = 0, binding = 22, scalar) writeonly buffer Orphans { uint orphans[]; }; // by place in the list

// Share of the weight of all four that similar ones must have.
const float ENOUGH = 0.1;

void main() {
    uint j = linear_id();
    if (j >= count[0]) return;
    orphans[j] = 0u;
    if (chosen[j] != 0u) return;
    uint slot = list[j];
    EyeHit hit = eye_hits[slot];
    Camera c = camera[0];
    uvec2 at = pixel_position(c.first_pixel + slot % c.pixels, c.width, c.height);
    uvec2 place = chosen_place(pass[0], params.k, params.jump);
    int k = int(params.k);
    ivec2 blocks = (ivec2(c.width, c.height) + k - 1) / k;
    // Rounds down also below 0.
    ivec2 corner = (ivec2(at) + k - ivec2(place)) / k - 1;
    vec3 caustic = vec3(0.0), other = vec3(0.0), weight = vec3(0.0);
    float all = 0.0;
    uint n = 0u;
    while (n < 4u) {
        ivec2 block = corner + ivec2(n & 1u, n >> 1);
        ++n;
        if (any(lessThan(block, ivec2(0))) || any(greaterThanEqual(block, blocks))) continue;
        uvec2 from = chosen_pixel(uvec2(block), place, params.k, c);
        vec2 apart = abs(vec2(from) - vec2(at));
        vec2 tent = max(vec2(0.0), 1.0 - apart / float(k));
        // Other bands are other passes over the device's memory: their hits are not there.
        uint pixel = pixel_index(from, c.width, c.height) - c.first_pixel;
        if (pixel >= c.pixels) continue;
        all += tent.x * tent.y;
        uint lender = slot - slot % c.pixels + pixel;
        if (lenders[lender] == 0u) continue;
        EyeHit lent = eye_hits[lender];
        vec3 factor = uintBitsToFloat(lent.b.xyz);
        vec3 w = tent.x * tent.y * similarity(hit, lent, length(apart), c) * vec3(greaterThan(factor, vec3(LENDS)));
        vec3 share = w / max(factor, vec3(LENDS));
        caustic += share * gathered[2u * lender].xyz;
        other += share * gathered[2u * lender + 1u].xyz;
        weight += w;
    }
    vec3 factor = uintBitsToFloat(hit.b.xyz);
    bvec3 needed = greaterThan(factor, vec3(LENDS));
    bvec3 poor = lessThanEqual(weight, vec3(ENOUGH * all));
    if (any(bvec3(uvec3(needed) & uvec3(poor)))) {
        orphans[j] = 1u;
        return;
    }
    vec3 scale = mix(vec3(0.0), factor / max(weight, vec3(LENDS)), needed);
    gathered[2u * slot] = vec4(caustic * scale, 0.0);
    gathered[2u * slot + 1u] = vec4(other * scale, 0.0);
}
