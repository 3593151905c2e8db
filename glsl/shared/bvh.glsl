// Binary bounding-volume hierarchy, the same for every builder (host SAH, device LBVH).
//
// Loads of four aligned words are the fast ones, so the integers ride in the fourth components as bits
// (floatBitsToUint); they are only moved, never computed with as floats.

// An inner node with the boxes of both children. Node 0 is the root. An absent child has the inverted box
// (min = +inf, max = -inf), which no ray enters.
struct BvhNode {
    vec4 min0; // child 0: smallest corner; w: reference of child 0
    vec4 max0; // child 0: largest corner;  w: reference of child 1
    vec4 min1; // child 1: smallest corner; w: 0
    vec4 max1; // child 1: largest corner;  w: 0
};

// A triangle, stored in leaf order.
struct BvhTriangle {
    vec4 v0; // w: id of the triangle in the scene, whatever its place in the tree
    vec4 v1; // w: flags, BVH_ALPHA_MASKED and those after it
    vec4 v2; // w: material index
};

// A child reference with this bit is a leaf: bits 0..26 first triangle, bits 27..30 number of triangles - 1.
// Otherwise it is the index of an inner node.
const uint BVH_LEAF = 0x80000000u;       // A child reference with this bit is a leaf.
const uint BVH_FIRST_MASK = 0x07ffffffu; // First item of a leaf, in leaf order.
const uint BVH_COUNT_SHIFT = 27u;        // Where the count of a leaf reference begins.
const uint BVH_COUNT_ONE = 1u << BVH_COUNT_SHIFT; // One more item in a leaf reference.
const uint BVH_COUNT_MASK = 0x78000000u; // Number of items of a leaf, less one.

// Cost of visiting a node in units of one triangle test. From 0.5 to 4 the rays per second of trees do not differ
// measurably on a software device; 2 has 40 % fewer nodes than 1.
const float BVH_NODE_COST = 2.0;

// Deepest path from the root to a leaf, in edges, that a builder may make: the traversal stack has room for it.
const uint BVH_MAX_DEPTH = 62u;

// BvhTriangle.v1.w: the material has an alpha mask or blends, so a hit counts only where something is there.
const uint BVH_ALPHA_MASKED = 1u;
// BvhTriangle.v1.w: the camera looks through the back.
const uint BVH_ONE_SIDED = 2u;
// BvhTriangle.v1.w: the boundary of a body of glass.
const uint BVH_BOUNDARY = 4u;

// Hit.triangle where nothing was hit.
const uint BVH_MISS = 0xffffffffu;

// A ray and a hit as kernels exchange them through buffers.
struct Ray {
    vec4 origin;    // w: largest ray parameter
    vec4 direction; // not necessarily of unit length; w: unused
};

struct RayHit {
    float t;       // ray parameter, in lengths of the direction; the ray's largest where nothing was hit
    float b1;      // barycentric weight of v1
    float b2;      // barycentric weight of v2
    uint triangle; // index in leaf order, or BVH_MISS
};
