// Selection of the (k + 1)-th candidate by the digits of its order key, most significant first. A key has two words,
// the bits of the squared distance (ordered as integers, because it is not negative) and the deposit index.

struct KnnKey {
    uint high;      // digits chosen so far
    uint low;
    uint rank;      // of the one sought among the candidates that start with them, from 0
    uint tally[16]; // of the next digit
};

const uint KNN_DIGITS = 16u; /// Digits of an order key.
// Instead of `high`: there are at most k candidates. No distance has these bits.
const uint KNN_ALL = 0xffffffffu;

KnnKey knn_any_key() {
    return KnnKey(0u, 0u, NEIGHBOURS, uint[16](0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u));
}

uint knn_shift(uint digit) {
    return 28u - 4u * (digit & 7u);
}

uint knn_digit(uvec2 key, uint digit) {
    return ((digit < 8u ? key.x : key.y) >> knn_shift(digit)) & 15u;
}

// Whether all digits before this one are as chosen.
bool knn_starts_with(uvec2 key, uvec2 chosen, uint digit) {
    if (chosen.x == KNN_ALL) return false;
    uint above = digit == 0u || digit == 8u ? 0u : ~0u << (32u - 4u * (digit & 7u));
    uvec2 mask = digit < 8u ? uvec2(above, 0u) : uvec2(~0u, above);
    return (key & mask) == (chosen & mask);
}

// The key with the digit whose tally is complete, and an empty tally.
KnnKey knn_choose(KnnKey key, uint digit) {
    KnnKey result = knn_any_key();
    result.high = key.high;
    result.low = key.low;
    if (key.high == KNN_ALL) return result;
    uint value = 0u, rank = key.rank;
    while (value < 16u && rank >= key.tally[value]) {
        rank -= key.tally[value];
        ++value;
    }
    result.rank = rank;
    if (value == 16u) { // only at the first digit: later ones know that there are enough
        result.high = KNN_ALL;
    } else if (digit < 8u) {
        result.high |= value << knn_shift(digit);
    } else {
        result.low |= value << knn_shift(digit);
    }
    return result;
}
