// Which tiles each photon is put into: on the lowest level where its footprint meets few enough, those whose eye hits
// span something that it reaches. Everything is decided here, so that counting and copying cannot disagree.
//
// The footprint is a slab of an ellipse. Its extent along any direction is exact, so no box around a box is needed; its
// place in the image follows from the extents across, down and in depth, cut at the nearest eye hit, which is in front
// of the camera.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/scene.glsl"
#include "shared/photon.glsl"
#include "lib/packed_photon.glsl"
#include "lib/tiles.glsl"

layout(push_constant, scalar) uniform Params {
    uvec2 lowest;
    uint first_row;
    uint levels;
} params;

layout(set = 0, binding = 11, scalar) readonly buffer CameraBlock { Camera camera[]; };
layout(set = 0, binding = 16, scalar) readonly buffer PhotonCount { uint photon_count[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Photons { Photon photons[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Boxes { Aabb boxes[]; };
layout(set = 0, binding = 19, scalar) readonly buffer Tiles { vec4 tiles[]; };
layout(set = 0, binding = 20, scalar) readonly buffer Slack { uint slack[]; };
layout(set = 0, binding = 21, scalar) writeonly buffer Covers { uvec2 covers[]; }; // first tile; level, columns, mask
layout(set = 0, binding = 22, scalar) writeonly buffer Counts { uint counts[]; };
layout(set = 0, binding = 23, scalar) buffer Touched { uint touched[]; };

// A photon's footprint as the culling sees it: the only place here that knows how photons are stored.
struct Footprint {
    vec3 centre, major, minor, normal; // semiaxes as vectors
    float thickness;
    vec3 moved; // along the axes at most, when its place is packed
};

Footprint footprint_of(Photon p) {
    vec3 u = uintBitsToFloat(p.c.xyz), v = uintBitsToFloat(p.d.xyz);
    vec3 moved = vec3(0.0);
    if (RECORD == 12u) {
        // As far as in the widest tile. What a photon gains by a move, it loses elsewhere: a tile that left it out
        // would only lose.
        uint top = tiles.length() - TILE_VECTORS;
        vec3 low = tiles[top].xyz, size = max(vec3(0.0), tiles[top + 1u].xyz - low);
        tile_box(low, size, disc_radius(p));
        moved = size * (0.501 / PLACE_STEPS);
    }
    float slab = SLAB * inversesqrt(inverse_longer2(p));
    return Footprint(uintBitsToFloat(p.a.xyz), u / dot(u, u), v / dot(v, v), oct_decode(p.a.w), slab, moved);
}

// Bounds of the camera coordinates of vectors with components of these sizes.
vec3 in_camera_size(Camera c, vec3 size) {
    vec3 right = abs(c.right) / dot(c.right, c.right), up = abs(c.up) / dot(c.up, c.up);
    return vec3(dot(size, right), dot(size, up), dot(size, abs(c.forward)));
}

// Half extents in camera coordinates, a little too large for rounding never to matter.
vec3 extent_of(Footprint f, Camera c, vec3 centre) {
    vec3 u = in_camera(c, f.major), v = in_camera(c, f.minor);
    vec3 exact = sqrt(u * u + v * v) + f.thickness * abs(in_camera(c, f.normal));
    if (RECORD == 12u) exact += in_camera_size(c, f.moved);
    vec3 rounding = in_camera_size(c, abs(f.centre) + abs(c.position));
    return exact * 1.0001 + 1e-6 * (rounding + abs(centre));
}

// The range of x / z over boxes, z > 0.
vec2 quotient(vec2 x, vec2 z) {
    return vec2(x.x / (x.x < 0.0 ? z.x : z.y), x.y / (x.y > 0.0 ? z.x : z.y));
}

struct Reach {
    vec4 window; // in pixels
    vec2 depth;
};

// Where the footprint may be in the image, and at which depths. `near` is the depth of the nearest eye hit.
Reach reach_of(Footprint f, Camera c, float near) {
    vec3 centre = in_camera(c, f.centre - c.position);
    vec3 extent = extent_of(f, c, centre);
    vec3 low = centre - extent, high = centre + extent;
    vec2 across = vec2(low.x, high.x), down = vec2(low.y, high.y), depth = vec2(max(low.z, near), high.z);
    if (c.orthographic == 0u && near > 0.0) {
        across = quotient(across, depth);
        down = quotient(down, depth);
    }
    vec4 window = vec4(in_pixels(c, vec2(across.x, down.x)), in_pixels(c, vec2(across.y, down.y)));
    // Rounding of the division and of the hits' coordinates.
    float margin = 1e-5 * float(max(c.width, c.height));
    vec4 image = vec4(c.width, c.height, c.width, c.height);
    window += vec4(vec2(-margin), vec2(margin)) * max(vec4(1.0), abs(window) / image);
    bool unknown = c.orthographic == 0u && !(near > 0.0);
    return Reach(unknown ? vec4(vec2(-INFINITY), vec2(INFINITY)) : window, vec2(low.z, high.z));
}

// Range of the products of `v` with the vectors from `low` to `high`.
vec2 products(vec3 v, vec3 low, vec3 high) {
    vec3 a = v * low, b = v * high;
    return vec2(dot(min(a, b), vec3(1.0)), dot(max(a, b), vec3(1.0)));
}

// Whether the footprint may count at a hit of the tile. What most tiles fail comes first, and the rest is not loaded
// then.
bool meets(uint tile, Footprint f, Reach r, Aabb box) {
    uint at = TILE_VECTORS * tile;
    vec4 low = tiles[at], high = tiles[at + 1u];
    bool begins_before = all(lessThanEqual(vec4(box.min, r.depth.x), high));
    if (!(begins_before && all(greaterThanEqual(vec4(box.max, r.depth.y), low)))) return false;
    vec4 window = tiles[at + 2u];
    bool image = all(lessThanEqual(r.window.xy, window.zw)) && all(greaterThanEqual(r.window.zw, window.xy));
    if (!image) return false; // an empty tile's infinities go no further
    // Hits that the slab holds, on surfaces that turn the same way.
    vec2 height = products(f.normal, low.xyz - f.centre, high.xyz - f.centre);
    vec3 size = max(abs(low.xyz), abs(high.xyz)) + abs(f.centre);
    float reach = f.thickness * 1.0001 + 1e-6 * (size.x + size.y + size.z) + dot(f.moved, abs(f.normal));
    bool facing = products(f.normal, tiles[at + 3u].xyz, tiles[at + 4u].xyz).y > SAME_SURFACE - 1e-4;
    return facing && height.x <= reach && height.y >= -reach;
}

// The tiles of the lowest level that the photon can concern, first and last; none if first > last.
ivec4 candidates(Reach r) {
    float spread = uintBitsToFloat(slack[0]);
    float side = float(1u << TILE_SHIFT);
    vec4 range = (r.window + vec4(vec2(-spread), vec2(spread))) / side;
    range.yw -= float(params.first_row);
    vec4 most = vec4(params.lowest, params.lowest);
    // Beyond the image on either side becomes an empty range; what is not a number, everything.
    vec2 first = mix(vec2(0.0), clamp(floor(range.xy), vec2(0.0), most.xy), greaterThan(range.xy, vec2(0.0)));
    vec2 last = mix(most.zw - 1.0, clamp(floor(range.zw), vec2(-1.0), most.zw - 1.0), lessThan(range.zw, most.zw));
    return ivec4(first, last);
}

void main() {
    uint i = linear_id();
    if (i >= photons.length()) return;
    covers[i] = uvec2(0u);
    counts[i] = 0u;
    if (i >= photon_count[0]) return;
    Camera c = camera[0];
    Aabb box = boxes[i];
    float near = tiles[tiles.length() - TILE_VECTORS].w;
    Footprint f = footprint_of(photons[i]);
    box.min -= f.moved;
    box.max += f.moved;
    Reach r = reach_of(f, c, near);
    if (r.depth.y < near) return;
    ivec4 range = candidates(r);
    if (any(greaterThan(range.xy, range.zw))) return;
    uvec4 at = uvec4(range);
    uint level = 0u, base = 0u;
    while (level + 1u < params.levels && (at.z - at.x + 1u) * (at.w - at.y + 1u) > MOST_TILES) {
        uvec2 size = tiles_of_level(params.lowest, level);
        base += size.x * size.y;
        ++level;
        at >>= 1u;
    }
    uint columns = at.z - at.x + 1u, all_tiles = columns * (at.w - at.y + 1u);
    uint row = tiles_of_level(params.lowest, level).x;
    uint mask = 0u, first = base + at.y * row + at.x;
    for (uint k = 0u; k < all_tiles; ++k) {
        uint tile = first + (k / columns) * row + k % columns;
        if (meets(tile, f, r, box)) mask |= 1u << k;
    }
    if (mask == 0u) return;
    covers[i] = uvec2(first, mask | columns << 16 | level << 24);
    counts[i] = bitCount(mask);
    touched[i] = 1u;
}
