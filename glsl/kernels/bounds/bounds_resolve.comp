// From sums by place in the picture to gathered light by slot, for the listed eye hits; what all photons of a hit have
// in common is multiplied here.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "lib/sampling.glsl"
#include "shared/photon.glsl"
#include "lib/estimate.glsl"
#include "lib/pixels.glsl"

layout(push_constant, scalar) uniform Params {
    uint first_row; // of the image that the picture shows
    uint rows;
} params;
layout(set = 0, binding = 11, scalar) readonly buffer CameraBlock { Camera camera[]; };
layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer EyeHits { EyeHit eye_hits[]; };
layout(set = 0, binding = 19, scalar) readonly buffer Caustic { vec4 caustic[]; };
layout(set = 0, binding = 20, scalar) readonly buffer Other { vec4 other[]; };
layout(set = 0, binding = 21, scalar) writeonly buffer Gathered { vec4 gathered[]; };

void main() {
    uint j = linear_id();
    if (j >= count[0]) return;
    uint slot = list[j];
    uvec2 place = pixel_position(camera[0].first_pixel + slot, camera[0].width, camera[0].height);
    uint at = (place.y - params.first_row) * camera[0].width + place.x;
    vec4 factor = vec4(point_of(eye_hits[slot]).factor, 1.0);
    gathered[2u * slot] = caustic[at] * factor;
    gathered[2u * slot + 1u] = other[at] * factor;
}
