// What the steps of the H-PLOC builder share.

/// Clusters that a node of the radix tree hands up, at most: half of a group.
const uint HPLOC_KEPT = 16u;
/// Clusters that a group merges at a time, one for each invocation.
const uint HPLOC_GROUP = 32u;
/// How many places away in the list a cluster looks for its nearest neighbour.
const uint HPLOC_RADIUS = 8u;
/// Most edges below a cluster of the root of the radix tree while there are more than HPLOC_KEPT of them. Clusters of
/// its nodes at depth d stay d lower, and every halving of what the root has adds one.
const uint HPLOC_ROOT_HEIGHT = 57u;

// Cluster.reference where there is none.
const uint HPLOC_NONE = 0xffffffffu;

// A subtree that has no parent yet.
struct Cluster {
    uint reference; // its root: a node, or an item with BVH_LEAF
    uint label;     // an item in it that no other cluster has; the node that ends a cluster has its label
    uint height;    // edges to its deepest leaf
};

// Whether a node of the radix tree merges clusters: one with few items hands them up as they are. The root always does.
bool hploc_merges(uint first, uint last) {
    return last - first >= HPLOC_KEPT;
}
