// The stochastic walk through lists of photons (Mara, Luebke and McGuire 2013, section 2.3.2): of all photons that an
// estimator would test, only one in STRIDE on average, by steps that are geometrically distributed. Each photon is thus
// visited with probability 1 / STRIDE, independently of the others, wherever the lists begin and end.
//
//   Walk walk = walk_start(pass[0], j, 0u);              // j: place in the list of slots
//   for (uint i = walk_enter(walk, first, end); walk_holds(walk, i, end); i = walk_next(walk, i)) add_photon(...);
//   ... sums * walk_scale(walk)
//
// A hit may go through any number of lists. With STRIDE 1 the loop is `for (i = first; i < end; ++i)` and the scale 1.
// Lanes that look at the same photons together must come with the same first and end, and then go on alike.
// Include lib/sampling.glsl and shared/scene.glsl before.

layout(constant_id = 30) const uint WALK_STRIDE = 1;    // k^2
layout(constant_id = 31) const bool WALK_RATIO = false; // scale by listed / visited instead of by STRIDE

/// Number of neighbouring hits that draw the same numbers. They visit the same photons of the lists that they share, so
/// that loads are uniform where the lanes of a subgroup work together. For each hit alone the numbers are as random as
/// numbers of its own.
const uint WALK_TOGETHER = 8u;

struct Walk {
    uint random;
    uint skip;    // photons to go before the next one that is visited
    uint listed;  // photons in the lists so far
    uint visited; // of them
};

// Photons between one that is visited and the next: floor(ln(1 - u) / ln(1 - 1 / STRIDE)) for u uniform in [0, 1), at
// most 4300 for STRIDE = 256, because u has 24 bits.
uint walk_gap(inout Walk walk) {
    walk.random = hash(walk.random + 0x9e3779b9u);
    return uint(log2(1.0 - unit_float(walk.random)) / log2(1.0 - 1.0 / float(WALK_STRIDE)));
}

// `part` tells apart the walks of one hit, where there are several.
Walk walk_start(Pass pass, uint place, uint part) {
    Walk walk = Walk(0u, 0u, 0u, 0u);
    if (WALK_STRIDE == 1u) return walk;
    walk.random = hash2(hash2(pass.seed, pass.index ^ SALT_WALK), hash2(place / WALK_TOGETHER, part));
    walk.skip = walk_gap(walk);
    return walk;
}

// Begins the list first ... end - 1; returns the first photon to visit, which may lie beyond.
uint walk_enter(inout Walk walk, uint first, uint end) {
    if (WALK_STRIDE == 1u) return first;
    walk.listed += end - first;
    return first + walk.skip;
}

// Whether photon i is to be visited; at the end of the list, what is left of the step is kept for the next one.
bool walk_holds(inout Walk walk, uint i, uint end) {
    if (WALK_STRIDE == 1u || i < end) return i < end;
    walk.skip = i - end;
    return false;
}

// After photon i was visited.
uint walk_next(inout Walk walk, uint i) {
    if (WALK_STRIDE == 1u) return i + 1u;
    walk.visited += 1u;
    return i + 1u + walk_gap(walk);
}

// For estimators whose lanes share the work on a list: whether entry i is visited, the same for every lane that asks.
bool walk_tries(Walk walk, uint i) {
    return WALK_STRIDE == 1u || unit_float(hash2(walk.random, i)) * float(WALK_STRIDE) < 1.0;
}

// Factor on the sums. STRIDE is unbiased. The paper's ratio has the same mean where at least one photon was visited,
// and less variance; but a list of n photons loses the share (1 - 1 / STRIDE)^n of its light, the probability that no
// photon is visited.
float walk_scale(Walk walk) {
    if (WALK_STRIDE == 1u) return 1.0;
    if (!WALK_RATIO) return float(WALK_STRIDE);
    return walk.visited > 0u ? float(walk.listed) / float(walk.visited) : 0.0;
}
