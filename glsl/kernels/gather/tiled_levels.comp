// The bounds of all higher levels of tiles, by one workgroup: a third as many tiles as at the lowest level.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 256) in;
#include "lib/header.glsl"
#include "shared/scene.glsl"
#include "lib/tiles.glsl"

layout(push_constant, scalar) uniform Params {
    uvec2 lowest;
    uint levels;
} params;

layout(set = 0, binding = 16, scalar) coherent buffer Tiles { vec4 tiles[]; };

void main() {
    uint below = 0u;
    uvec2 children = params.lowest;
    for (uint level = 1u; level < params.levels; ++level) {
        uvec2 size = tiles_of_level(params.lowest, level);
        uint base = below + children.x * children.y;
        for (uint t = gl_LocalInvocationIndex; t < size.x * size.y; t += 256u) {
            uvec2 at = 2u * uvec2(t % size.x, t / size.x);
            vec4 low = vec4(INFINITY), high = vec4(-INFINITY), window = vec4(vec2(INFINITY), vec2(-INFINITY));
            for (uint k = 0u; k < 4u; ++k) {
                uvec2 child = min(at + uvec2(k & 1u, k >> 1u), children - 1u);
                uint i = TILE_WORDS * (below + child.y * children.x + child.x);
                low = min(low, tiles[i]);
                high = max(high, tiles[i + 1u]);
                vec4 other = tiles[i + 2u];
                window = vec4(min(window.xy, other.xy), max(window.zw, other.zw));
            }
            uint i = TILE_WORDS * (base + t);
            tiles[i] = low;
            tiles[i + 1u] = high;
            tiles[i + 2u] = window;
        }
        below = base;
        children = size;
        memoryBarrierBuffer();
        barrier();
    }
}
