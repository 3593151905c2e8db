// Path tracing: where a path gathers, it goes on in a direction drawn from the gathered lobes. Runs after the light
// samples over the same list; continuations take the second place of their path (the first is for mirrors and glass).
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "lib/sampling.glsl"
#include "lib/scene_bindings.glsl"
#include "shared/photon.glsl"
#include "lib/pixels.glsl"

layout(constant_id = 20) const uint MAX_DEPTH = 24;

layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) writeonly buffer Rays { vec4 rays[]; };
layout(set = 0, binding = 19, scalar) readonly buffer EyeHits { EyeHit eye_hits[]; };
layout(set = 0, binding = 20, scalar) writeonly buffer Throughput { vec4 throughput[]; };
layout(set = 0, binding = 21, scalar) buffer States { uint states[]; };
layout(set = 0, binding = 22, scalar) buffer Radiance { vec4 radiance[]; };
layout(set = 0, binding = 23, scalar) writeonly buffer ChildFlags { uint child_flags[]; };
layout(set = 0, binding = 24, scalar) writeonly buffer ChildSlots { uint child_slots[]; };
layout(set = 0, binding = 25, scalar) buffer Truncated { uint truncated[]; };
#include "lib/bsdf.glsl"
#include "lib/intersect.glsl"
#include "lib/eye_hit.glsl"
#include "lib/scatter.glsl"
#include "lib/path.glsl"

void main() {
    uint j = linear_id();
    if (j >= count[0]) return;
    uint slot = list[j];
    if (radiance[slot].w == 0.0) return;
    radiance[slot].w = 0.0;
    EyeHit hit = eye_hits[slot];
    vec3 to_eye, through;
    Surface s = surface_of(hit, to_eye, through);
    uint state = states[slot];
    uint depth = (state >> PATH_DEPTH_SHIFT) & PATH_DEPTH_MASK;
    bool absorb = depth >= ROULETTE_DEPTH;
    uint seed = hash2(hash2(pass[0].seed ^ SALT_PATH_TRACING, pass[0].index), slot_key(slot, camera[0]) + depth);
    float choice = unit_float(hash(seed ^ SALT_LOBE));
    vec2 u = vec2(unit_float(hash(seed ^ SALT_DIRECTION_U)), unit_float(hash(seed ^ SALT_DIRECTION_V)));
    Gathered e = sample_gathered(s, -to_eye, choice, u, absorb);
    through *= e.weight;
    float density = gathered_density(s, to_eye, e.direction, absorb);
    if (!(e.probability > 0.0 && max_component(through) > 0.0 && density > 0.0)) return;
    if (depth >= MAX_DEPTH) {
        atomicAdd(truncated[0], 1u);
        return;
    }
    BvhTriangle corners = triangles[hit.d.w & ~EYE_HIT_BENT];
    vec3 e1 = corners.v1.xyz - corners.v0.xyz, e2 = corners.v2.xyz - corners.v0.xyz;
    rays[2u * slot] = vec4(offset_point(s.position, e1, e2, e.direction), 0.0);
    rays[2u * slot + 1u] = vec4(e.direction, density);
    throughput[slot] = vec4(through, 1.0);
    uint again = (state & PATH_DIFFUSE) != 0u ? PATH_DIFFUSE_AGAIN : 0u;
    uint kept = state & (PATH_MEDIUM_MASK | PATH_SPECULAR | PATH_DIFFUSE_AGAIN);
    states[slot] = kept | ((depth + 1u) << PATH_DEPTH_SHIFT) | PATH_DIFFUSE | again;
    child_flags[2u * j + 1u] = 1u;
    child_slots[2u * j + 1u] = slot;
}
