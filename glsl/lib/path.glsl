// What path tracing keeps of a path, in places that the photon method leaves empty:
//   rays[2 slot].w      distance from the last surface where gathered lobes scattered it, past holes on the way; or,
//                       at most 0, where a ray in a body begins (way_back in lib/medium.glsl)
//   rays[2 slot + 1].w  density [1/sr] of its direction if gathered lobes drew it, else 0
//   radiance[slot].w    tag of a hit to gather at, else 0
// A pixel has one path slot. Light is kept in three layers of the film: radiance[slot] is the direct one, the others
// follow those of all pixels in pairs.

const uint LAYER_DIRECT = 0u;
const uint LAYER_CAUSTIC = 1u;
const uint LAYER_INDIRECT = 2u;

// From this depth on paths end by Russian roulette.
const uint ROULETTE_DEPTH = 3u;

uint path_place(uint slot, uint layer, uint pixels) {
    return layer == LAYER_DIRECT ? slot : pixels + 2u * slot + layer - LAYER_CAUSTIC;
}

// Layer of an emitter that the path meets. What gathered lobes find is the other half of a light sample at their
// surface.
uint path_layer(uint state, bool drawn_by_gathered) {
    if ((state & PATH_DIFFUSE) == 0u) return LAYER_DIRECT;
    if ((state & PATH_DIFFUSE_AGAIN) != 0u) return LAYER_INDIRECT;
    return drawn_by_gathered ? LAYER_DIRECT : LAYER_CAUSTIC;
}

// Whether photons bring what the path meets: it was scattered widely, and has since met mirrors and glass alone.
bool is_told(uint state, bool drawn_by_gathered) {
    return (state & PATH_DIFFUSE) != 0u && !drawn_by_gathered;
}

// A hit to gather at: depth of the path, and the layer of what lights bring there.
float path_tag(uint depth, uint layer) {
    return float(1u + 4u * depth + layer);
}

uint tag_depth(uint tag) {
    return (tag - 1u) >> 2;
}

uint tag_layer(uint tag) {
    return (tag - 1u) & 3u;
}

// Balance heuristic (Veach 1997, section 9.2.2): the share of the strategy with density `own`, of two.
float balance(float own, float other) {
    return own > 0.0 ? 1.0 / (1.0 + other / own) : 0.0;
}
