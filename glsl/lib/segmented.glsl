// One tile of a segmented exclusive sum. In modular arithmetic a segment's sum is the difference of two plain prefix
// sums, so the scan of (flag, value) pairs is a sum scan and a maximum scan (which finds the last head).
#include "lib/chunk.glsl"
#include "lib/subgroup.glsl"

const uint ITEMS = 8u;
const uint TILE = 256u * ITEMS;

shared uint s_at_head[gl_WorkGroupSize.x]; // plain prefix at the last head of an invocation's items

struct Running {
    uint sum;  // sum since the last head
    bool head; // whether there was a head at all
};

// Replaces `value` by its exclusive segmented sum; `carry` is updated to the end of the tile.
void segmented_tile(uint rank, inout uint value[ITEMS], bool head[ITEMS], inout Running carry) {
    uint own = 0u;
    uint at_head = 0u;
    bool any = false;
    for (uint k = 0u; k < ITEMS; k++) {
        if (head[k]) {
            any = true;
            at_head = own;
        }
        own += value[k];
    }
    uint total, last;
    uint prefix = workgroup_exclusive_add(own, total);
    s_at_head[rank] = prefix + at_head;
    uint earlier = workgroup_exclusive_max(any ? rank + 1u : 0u, last); // its barriers publish s_at_head
    uint origin = earlier > 0u ? s_at_head[earlier - 1u] : 0u - carry.sum;
    for (uint k = 0u; k < ITEMS; k++) {
        if (head[k]) origin = prefix;
        uint next = prefix + value[k];
        value[k] = prefix - origin;
        prefix = next;
    }
    carry.sum = last > 0u ? total - s_at_head[last - 1u] : carry.sum + total;
    carry.head = carry.head || last > 0u;
    barrier(); // s_at_head may be used again
}
