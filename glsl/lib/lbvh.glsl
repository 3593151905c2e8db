// What the steps of the LBVH builder share.

// Words of the builder's counts.
const uint LBVH_ITEMS = 0u;      // boxes in the tree
const uint LBVH_DEGENERATE = 1u; // boxes left out
const uint LBVH_NODES = 2u;      // nodes of the finished tree

/// Marks the last item of a leaf, where leaves are too large for a count in the reference.
const uint LBVH_END = 0x80000000u;

// Link to a parent: its index and the side.
uint lbvh_link(uint parent, uint side) {
    return parent << 1 | side;
}
