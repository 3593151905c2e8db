// Scans over a workgroup of one value per invocation, through subgroups of any size, full or not.
//
// The order of the scan is (subgroup, invocation in the subgroup), which need not be the order of the local index:
// a kernel takes its place in the tile from workgroup_rank(). Every function has to be reached by the whole workgroup.
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_arithmetic : require

// One entry per subgroup; subgroups are never smaller than one invocation.
shared uint s_subgroup[gl_WorkGroupSize.x];
shared uint s_total;

// Defines `uint NAME(uint value, out uint total)`: the exclusive scan, and the reduction of the whole workgroup.
#define WORKGROUP_SCAN(NAME, EXCLUSIVE, REDUCE, COMBINE)                                  \
    uint NAME(uint value, out uint total) {                                               \
        uint before = EXCLUSIVE(value);                                                   \
        uint sum = REDUCE(value);                                                         \
        if (subgroupElect()) s_subgroup[gl_SubgroupID] = sum;                             \
        barrier();                                                                        \
        /* The first subgroup scans the sums of all, as many at a time as it is wide. */  \
        if (gl_SubgroupID == 0u) {                                                        \
            uint lane = subgroupExclusiveAdd(1u);                                         \
            uint width = subgroupAdd(1u);                                                 \
            uint carry = 0u;                                                              \
            for (uint base = 0u; base < gl_NumSubgroups; base += width) {                 \
                uint index = base + lane;                                                 \
                uint part = index < gl_NumSubgroups ? s_subgroup[index] : 0u;             \
                uint place = COMBINE(carry, EXCLUSIVE(part));                             \
                carry = COMBINE(carry, REDUCE(part));                                     \
                if (index < gl_NumSubgroups) s_subgroup[index] = place;                   \
            }                                                                             \
            if (subgroupElect()) s_total = carry;                                         \
        }                                                                                 \
        barrier();                                                                        \
        uint result = COMBINE(s_subgroup[gl_SubgroupID], before);                         \
        total = s_total;                                                                  \
        barrier(); /* the shared words may be used again */                               \
        return result;                                                                    \
    }

uint combine_add(uint a, uint b) { return a + b; }
uint combine_max(uint a, uint b) { return max(a, b); }

WORKGROUP_SCAN(workgroup_exclusive_add, subgroupExclusiveAdd, subgroupAdd, combine_add)
WORKGROUP_SCAN(workgroup_exclusive_max, subgroupExclusiveMax, subgroupMax, combine_max)

// Place of this invocation in the order of the scans, 0 to the workgroup's size - 1.
uint workgroup_rank() {
    uint total;
    return workgroup_exclusive_add(1u, total);
}
