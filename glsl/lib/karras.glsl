// Which items a node of a radix tree covers (Karras 2012, "Maximizing parallelism in the construction of BVHs, octrees,
// and k-d trees", section 4). Node i starts or ends at item i; node 0 is the root. The including kernel declares
// `codes`, the codes of the items in order.

// Length of the common prefix of (code, index) of two items; -1 outside of the items.
int common_prefix(int a, int b, int n) {
    if (b < 0 || b >= n) return -1;
    uint x = codes[a] ^ codes[b];
    return x != 0u ? 31 - findMSB(x) : 63 - findMSB(uint(a ^ b));
}

// The other end of node i's items: in the direction of the longer prefix, as far as it is longer than on the other
// side.
int other_end(int i, int n, out int direction) {
    direction = common_prefix(i, i + 1, n) > common_prefix(i, i - 1, n) ? 1 : -1;
    int outside = common_prefix(i, i - direction, n);
    int bound = 2;
    while (common_prefix(i, i + bound * direction, n) > outside) bound *= 2;
    int reach = 0;
    for (int step = bound / 2; step > 0; step /= 2) {
        if (common_prefix(i, i + (reach + step) * direction, n) > outside) reach += step;
    }
    return i + reach * direction;
}

// The last item of the first child: where the prefix that all items share ends.
int split_of(int first, int last, int n) {
    int shared_prefix = common_prefix(first, last, n);
    int reach = 0;
    int step = last - first;
    do {
        step = (step + 1) / 2;
        if (first + reach + step < last && common_prefix(first, first + reach + step, n) > shared_prefix) reach += step;
    } while (step > 1);
    return first + reach;
}
