// What the eye hits of each tile of the lowest level span: a box in space, depths, a window of the image, normals. Also
// how far (in pixels) hits lie outside of their own tile, which they do only where a lens spreads the rays.
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

shared Tile s_tile[64];
shared float s_slack[64];

void main() {
    Camera c = camera[0];
    uvec2 corner = (gl_WorkGroupID.xy + uvec2(0u, params.first_row)) << TILE_SHIFT;
    Tile tile = tile_of_nothing();
    uint side = 1u << TILE_SHIFT;
    for (uint i = gl_LocalInvocationIndex; i < side * side; i += 64u) {
        uvec2 at = corner + uvec2(i & (side - 1u), i >> TILE_SHIFT);
        if (at.x >= c.width || at.y >= c.height) continue;
        uint p = pixel_index(at, c.width, c.height) - c.first_pixel;
        if (p >= c.pixels || seen[p] == 0u) continue;
        vec3 position = uintBitsToFloat(eye_hits[p].a.xyz);
        vec3 v = in_camera(c, position - c.position);
        // Before the camera a perspective image is undefined: such hits, which only a lens can have, are everywhere in
        // it.
        bool everywhere = c.orthographic == 0u && !(v.z > 0.0);
        vec2 image = in_pixels(c, c.orthographic != 0u ? v.xy : v.xy / v.z);
        vec4 normal = vec4(oct_decode(eye_hits[p].a.w), 0.0);
        vec4 window = everywhere ? vec4(vec2(-INFINITY), vec2(INFINITY)) : image.xyxy;
        tile = tile_union(tile, Tile(vec4(position, v.z), vec4(position, v.z), window, normal, normal));
    }
    vec2 outside = max(vec2(corner) - tile.window.xy, tile.window.zw - vec2(corner + side));
    float most = subgroupMax(max(0.0, max(outside.x, outside.y)));
    tile.low = subgroupMin(tile.low);
    tile.high = subgroupMax(tile.high);
    tile.window = vec4(subgroupMin(tile.window.xy), subgroupMax(tile.window.zw));
    tile.normal_low = subgroupMin(tile.normal_low);
    tile.normal_high = subgroupMax(tile.normal_high);
    if (subgroupElect()) {
        s_tile[gl_SubgroupID] = tile;
        s_slack[gl_SubgroupID] = most;
    }
    barrier();
    if (gl_LocalInvocationIndex != 0u) return;
    for (uint i = 1u; i < gl_NumSubgroups; ++i) {
        tile = tile_union(tile, s_tile[i]);
        most = max(most, s_slack[i]);
    }
    uint t = gl_WorkGroupID.y * params.lowest.x + gl_WorkGroupID.x;
    TILE_STORE(tiles, t, tile);
    if (most > 0.0) atomicMax(slack[0], floatBitsToUint(most)); // floats of one sign order as their bits do
}
