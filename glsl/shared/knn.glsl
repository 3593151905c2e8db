// Tree over the photons' centres, in the order of the photon map's leaves: an implicit binary tree in which node i has
// the children 2i and 2i + 1, node 1 is the root, and leaf j (node KNN_LEAVES + j) covers the photons KNN_LEAF * j and
// on.

const uint KNN_LEAF = 8u; // Photons of a leaf.

struct KnnNode {
    // Corners of the box of the centres. w: longest reach of a caustic photon's footprint, and of any other photon's;
    // negative where there is none.
    vec4 low;
    vec4 high;
    uint first; // smallest deposit index
};
