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
            Tile tile = tile_of_nothing();
            for (uint k = 0u; k < 4u; ++k) {
                uvec2 child = min(at + uvec2(k & 1u, k >> 1u), children - 1u);
                tile = tile_union(tile, TILE_LOAD(tiles, below + child.y * children.x + child.x));
            }
            TILE_STORE(tiles, base + t, tile);
        }
        below = base;
        children = size;
        memoryBarrierBuffer();
        barrier();
    }
}
