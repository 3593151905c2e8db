// Flags the listed eye hits that are estimated in this pass: one pixel of each block of k x k, and whatever is not
// Lambert. Marks those of the former that can lend their light to others. With k = 1 these are all Lambert hits.
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
layout(set = 0, binding = 19, scalar) writeonly buffer Chosen { uint chosen[]; };   // by place in the list
layout(set = 0, binding = 20, scalar) writeonly buffer Lenders { uint lenders[]; }; // by slot; filled with 0 before

void main() {
    uint j = linear_id();
    if (j >= count[0]) return;
    uint slot = list[j];
    Camera c = camera[0];
    uvec2 at = pixel_position(c.first_pixel + slot % c.pixels, c.width, c.height);
    uvec2 place = chosen_place(pass[0], params.k, params.jump);
    bool in_turn = chosen_pixel(at / params.k, place, params.k, c) == at;
    bool lambert = lambert_hit(eye_hits[slot]);
    chosen[j] = in_turn || !lambert ? 1u : 0u;
    if (in_turn && lambert) lenders[slot] = 1u;
}
