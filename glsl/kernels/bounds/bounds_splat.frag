// What one photon brings to the eye hit of one pixel, to be added up by blending. The depth test
// has dropped pixels without a hit in this place.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
#include "lib/math.glsl"
#include "lib/sampling.glsl"
#include "shared/photon.glsl"
#include "lib/estimate.glsl"
#include "lib/pixels.glsl"
layout(early_fragment_tests) in;

layout(push_constant, scalar) uniform Params {
    uint first_row; // of the image that the picture shows
    uint rows;
} params;
layout(set = 0, binding = 11, scalar) readonly buffer CameraBlock { Camera camera[]; };
layout(set = 0, binding = 18, scalar) readonly buffer EyeHits { EyeHit eye_hits[]; };
layout(set = 0, binding = 20, scalar) readonly buffer Photons { Photon photons[]; };
layout(location = 0) flat in uint photon;
layout(location = 0) out vec4 caustic;
layout(location = 1) out vec4 other;

void main() {
    uvec2 at = uvec2(gl_FragCoord.xy) + uvec2(0u, params.first_row);
    uint slot = pixel_index(at, camera[0].width, camera[0].height) - camera[0].first_pixel;
    Point x = point_of(eye_hits[slot]);
    Estimate sum = estimate_nothing();
    add_photon(sum, photons[photon], x);
    caustic = vec4(sum.caustic, sum.tested);
    other = vec4(sum.other, sum.accepted);
}
