// Group counts for an indirect dispatch over `count` items, spread over x and y like the host does.
struct DispatchArgs {
    uint x;
    uint y;
    uint z;
};

DispatchArgs dispatch_for(uint count, uint local_size) {
    const uint ROW = 32768u;
    uint groups = count / local_size + (count % local_size != 0u ? 1u : 0u);
    return groups <= 65535u ? DispatchArgs(groups, 1u, 1u) : DispatchArgs(ROW, (groups + ROW - 1u) / ROW, 1u);
}
