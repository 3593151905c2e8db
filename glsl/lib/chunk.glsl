// The share of one workgroup in a problem of `count` items: a contiguous run of whole tiles. The grid is fixed by the
// capacity, the shares follow from the count, so counts known only on the GPU need no indirect dispatch. Exact for
// every count up to 2^32 - 1: no expression exceeds tiles * tile - 1 <= 2^32 - 1.
struct Share {
    uint first; // first tile
    uint end;   // one past the last tile
};

Share share_of(uint group, uint groups, uint count, uint tile) {
    uint tiles = count / tile + (count % tile != 0u ? 1u : 0u);
    uint each = tiles / groups + (tiles % groups != 0u ? 1u : 0u);
    // group * each <= tiles + groups, far below 2^32 because tiles <= 2^32 / tile.
    return Share(min(group * each, tiles), min(group * each + each, tiles));
}
