// Group counts for an indirect dispatch over `count` items, spread over x and y like the host does.

/// Workgroups along one axis that every device allows: the least value of `maxComputeWorkGroupCount`.
const uint MOST_GROUPS = 65535u;

const uint GROUPS_OF_ROW = 32768u; /// Workgroups of a row where one row does not hold them all.

struct DispatchArgs {
    uint x;
    uint y;
    uint z;
};

DispatchArgs dispatch_for(uint count, uint local_size) {
    uint groups = count / local_size + (count % local_size != 0u ? 1u : 0u);
    if (groups <= MOST_GROUPS) return DispatchArgs(groups, 1u, 1u);
    return DispatchArgs(GROUPS_OF_ROW, (groups + GROUPS_OF_ROW - 1u) / GROUPS_OF_ROW, 1u);
}
