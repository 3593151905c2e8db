// Tells the listed eye hits that lie at their pixel's place in space from those seen by way of a mirror or glass:
// estimators that work in the image can serve only the former.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"

layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer EyeHits { EyeHit eye_hits[]; };
layout(set = 0, binding = 19, scalar) writeonly buffer Straight { uint straight[]; };
layout(set = 0, binding = 20, scalar) writeonly buffer Bent { uint bent[]; };

void main() {
    uint j = linear_id();
    if (j >= count[0]) return;
    bool is_bent = (eye_hits[list[j]].d.w & EYE_HIT_BENT) != 0u;
    straight[j] = is_bent ? 0u : 1u;
    bent[j] = is_bent ? 1u : 0u;
}
