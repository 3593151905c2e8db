// What the steps that collapse subtrees to leaves share.

/// Most items of a leaf.
const uint COLLAPSE_LEAF = 4u;

// What is known of the subtree under a node.
struct Subtree {
    uint items;
    float cost;  // surface-area cost, in the units of tree_area()
    uint fused;  // 1: it is cheaper as a leaf
};
