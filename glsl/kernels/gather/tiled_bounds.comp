// What the eye hits of each tile of the lowest level span: a box in space, depths, and a window of the image. Also how far
// (in pixels) hits lie outside of their own tile, which they do only where a lens spreads the rays.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_arithmetic : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "lib/sampling.glsl"
#include "shared/scene.glsl"
#include "shared/photon.glsl"
#include "lib/pixels.glsl"
#include "lib/tiles.glsl"

layout(push_constant, scalar) uniform Params {
    uvec2 lowest;   // tiles of the lowest level
    uint first_row; // of tiles, in the image
} params;

layout(set = 0, binding = 11, scalar) readonly buffer CameraBlock { Camera camera[]; };
layout(set = 0, binding = 16, scalar) readonly buffer Seen { uint seen[]; };
layout(set = 0, binding = 17, scalar) readonly buffer EyeHits { EyeHit eye_hits[]; };
layout(set = 0, binding = 18, scalar) writeonly buffer Tiles { vec4 tiles[]; };
layout(set = 0, binding = 19, scalar) buffer Slack { uint slack[]; };

shared vec4 s_part[TILE_WORDS * 64u];
shared float s_slack[64];

void main() {
    Camera c = camera[0];
    uvec2 corner = (gl_WorkGroupID.xy + uvec2(0u, params.first_row)) << TILE_SHIFT;
    vec4 low = vec4(INFINITY), high = vec4(-INFINITY), window = vec4(vec2(INFINITY), vec2(-INFINITY));
    uint side = 1u << TILE_SHIFT;
    for (uint i = gl_LocalInvocationIndex; i < side * side; i += 64u) {
        uvec2 at = corner + uvec2(i & (side - 1u), i >> TILE_SHIFT);
        if (at.x >= c.width || at.y >= c.height) continue;
        uint p = pixel_index(at, c.width, c.height) - c.first_pixel;
        if (p >= c.pixels || seen[p] == 0u) continue;
        vec3 position = uintBitsToFloat(eye_hits[p].a.xyz);
        vec3 v = in_camera(c, position - c.position);
        // Before the camera a perspective image is undefined: such hits, which only a lens can have, are everywhere in it.
        bool everywhere = c.orthographic == 0u && !(v.z > 0.0);
        vec2 image = in_pixels(c, c.orthographic != 0u ? v.xy : v.xy / v.z);
        low = min(low, vec4(position, v.z));
        high = max(high, vec4(position, v.z));
        window.xy = min(window.xy, everywhere ? vec2(-INFINITY) : image);
        window.zw = max(window.zw, everywhere ? vec2(INFINITY) : image);
    }
    vec2 outside = max(vec2(corner) - window.xy, window.zw - vec2(corner + side));
    float most = subgroupMax(max(0.0, max(outside.x, outside.y)));
    low = subgroupMin(low);
    high = subgroupMax(high);
    window.xy = subgroupMin(window.xy);
    window.zw = subgroupMax(window.zw);
    if (subgroupElect()) {
        s_part[TILE_WORDS * gl_SubgroupID] = low;
        s_part[TILE_WORDS * gl_SubgroupID + 1u] = high;
        s_part[TILE_WORDS * gl_SubgroupID + 2u] = window;
        s_slack[gl_SubgroupID] = most;
    }
    barrier();
    if (gl_LocalInvocationIndex != 0u) return;
    for (uint i = 1u; i < gl_NumSubgroups; ++i) {
        low = min(low, s_part[TILE_WORDS * i]);
        high = max(high, s_part[TILE_WORDS * i + 1u]);
        vec4 other = s_part[TILE_WORDS * i + 2u];
        window = vec4(min(window.xy, other.xy), max(window.zw, other.zw));
        most = max(most, s_slack[i]);
    }
    uint tile = gl_WorkGroupID.y * params.lowest.x + gl_WorkGroupID.x;
    tiles[TILE_WORDS * tile] = low;
    tiles[TILE_WORDS * tile + 1u] = high;
    tiles[TILE_WORDS * tile + 2u] = window;
    if (most > 0.0) atomicMax(slack[0], floatBitsToUint(most)); // floats of one sign order as their bits do
}
