// Environment maps of the scene's surfaces: what is seen from a centre in all directions, as six faces of a cube (Yao,
// Wang, Chan, Yong and Paul 2010, section 3).
//
// A texel names the triangle that is seen through its middle, and the place on it. Position, normal and material follow
// from these as for a ray's hit, so photons go on from a map as they do from the tree.

struct MapTexel {
    float distance; // from the centre; infinite where nothing is seen
    uint triangle;  // index in leaf order, or BVH_MISS
    float b1;       // barycentric weight of v1
    float b2;       // barycentric weight of v2
};

const uint MAP_FACES = 6u; // Faces of a map: +x, -x, +y, -y, +z, -z.
const uint MAP_CANDIDATES = 64u; // Most centres to choose from: a bit for each fits two words.

// What one map says of a ray (Yao et al. 2010, figure 7), beside the true hit.
const uint MAP_NONE = 0u;   // Nothing: the point is at infinity.
const uint MAP_BESIDE = 1u; // A point that is not on the ray.
const uint MAP_LATER = 2u;  // A point on the ray, but not the first one.
const uint MAP_RIGHT = 3u;  // The hit.
const uint MAP_EARLY = 4u;  // A point near the ray, before its hit.
// What all maps together say of a ray.
const uint MAPS_RIGHT = 5u;   // The hit.
const uint MAPS_WRONG = 6u;   // Another point.
const uint MAPS_LOST = 7u;    // Nothing, though there is a hit.
const uint MAPS_ESCAPED = 8u; // Nothing, and there is no hit.
const uint MAPS_PHANTOM = 9u; // A point, though there is no hit.
const uint MAP_COUNTS = 10u;  // Number of these.
