// Leaves the depths of the eye hits in the picture.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "lib/math.glsl"
#include "lib/sampling.glsl"
#include "shared/scene.glsl"
#include "lib/pixels.glsl"

layout(push_constant, scalar) uniform Params {
    uint first_row; // of the image that the picture shows
    uint rows;
} params;
layout(set = 0, binding = 11, scalar) readonly buffer CameraBlock { Camera camera[]; };
layout(set = 0, binding = 19, scalar) readonly buffer Depths { float depths[]; };

void main() {
    uvec2 at = uvec2(gl_FragCoord.xy) + uvec2(0u, params.first_row);
    uint index = pixel_index(at, camera[0].width, camera[0].height), first = camera[0].first_pixel;
    // A pixel outside of the band counts as one without a hit.
    gl_FragDepth = index >= first && index - first < camera[0].pixels ? depths[index - first] : 1.0;
}
