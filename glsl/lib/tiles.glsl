// Tiles of the image: squares of 2^TILE_SHIFT pixels, and above them levels of tiles of twice the side, up to one that
// is the whole band. A tile is known by what its eye hits span, not by the rays that found them: this holds with
// jitter and lenses, too.

layout(constant_id = 22) const uint TILE_SHIFT = 3;

/// Vectors of a tile's bounds: smallest corner and depth, largest corner and depth, window in pixels, normals from and
/// to.
const uint TILE_VECTORS = 5u;

struct Tile {
    vec4 low, high;
    vec4 window;
    vec4 normal_low, normal_high; // w: unused
};

Tile tile_of_nothing() {
    vec4 inf = vec4(uintBitsToFloat(0x7f800000u));
    return Tile(inf, -inf, vec4(inf.xy, -inf.xy), inf, -inf);
}

Tile tile_union(Tile a, Tile b) {
    vec4 window = vec4(min(a.window.xy, b.window.xy), max(a.window.zw, b.window.zw));
    vec4 normal_low = min(a.normal_low, b.normal_low), normal_high = max(a.normal_high, b.normal_high);
    return Tile(min(a.low, b.low), max(a.high, b.high), window, normal_low, normal_high);
}

// Reading and writing tile T of an array of vec4.
#define TILE_LOAD(A, T)                                                                    \
    Tile(A[TILE_VECTORS * (T)], A[TILE_VECTORS * (T) + 1u], A[TILE_VECTORS * (T) + 2u], \
        A[TILE_VECTORS * (T) + 3u], A[TILE_VECTORS * (T) + 4u])
#define TILE_STORE(A, T, V)                     \
    A[TILE_VECTORS * (T)] = (V).low;              \
    A[TILE_VECTORS * (T) + 1u] = (V).high;        \
    A[TILE_VECTORS * (T) + 2u] = (V).window;      \
    A[TILE_VECTORS * (T) + 3u] = (V).normal_low;  \
    A[TILE_VECTORS * (T) + 4u] = (V).normal_high

/// Most tiles that a photon is put into; one that needs more goes to a higher level.
const uint MOST_TILES = 16u;

// Tiles in a row and in a column of a level.
uvec2 tiles_of_level(uvec2 lowest, uint level) {
    return (lowest + ((1u << level) - 1u)) >> level;
}

// The camera's linear forms of a vector: across and down in halves of the image at distance one, and depth.
vec3 in_camera(Camera c, vec3 v) {
    return vec3(dot(v, c.right) / dot(c.right, c.right), -dot(v, c.up) / dot(c.up, c.up), dot(v, c.forward));
}

// Image coordinates in pixels of halves of the image.
vec2 in_pixels(Camera c, vec2 p) {
    return (p + 1.0) * 0.5 * vec2(c.width, c.height);
}
