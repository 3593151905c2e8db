// Sums without rounding: 128-bit two's complement integers in units of 2^-64, least significant word first. Integer
// addition is associative, so passes may be added in any order and in any grouping and give the same bits: what
// resuming and merging rest on. The specification is src/film/exact.rs.

// Adds x, |x| <= EXACT_LARGEST and finite, rounded to a multiple of 2^-64, to `sum`.
void exact_add(inout uvec4 sum, float x) {
    uint bits = floatBitsToUint(x);
    int biased = int((bits >> 23) & 0xffu);
    uint mantissa = biased == 0 ? 0u : (bits & 0x7fffffu) | 0x800000u; // what a driver may flush counts as zero
    int shift = biased - 150 + 64;
    if (shift < 0) {
        mantissa = shift < -24 ? 0u : (mantissa + (1u << uint(-shift - 1))) >> uint(-shift);
        shift = 0;
    }
    uint word = uint(shift) >> 5, bit = uint(shift) & 31u;
    uint low = mantissa << bit, high = bit == 0u ? 0u : mantissa >> (32u - bit);
    bool negative = (bits & 0x80000000u) != 0u;
    uvec4 y = uvec4(word == 0u ? low : 0u, word == 1u ? low : (word == 0u ? high : 0u),
        word == 2u ? low : (word == 1u ? high : 0u), word == 2u ? high : 0u);
    // a - y = ~(~a + y)
    uvec4 a = negative ? ~sum : sum;
    uvec4 r;
    uint c0, c1, c2, c3;
    r.x = uaddCarry(a.x, y.x, c0);
    r.y = uaddCarry(a.y, y.y, c1);
    r.y += c0; // at most one of the two additions carries
    c1 += (r.y == 0u && c0 == 1u) ? 1u : 0u;
    r.z = uaddCarry(a.z, y.z, c2);
    r.z += c1;
    c2 += (r.z == 0u && c1 == 1u) ? 1u : 0u;
    r.w = a.w + y.w + c2;
    sum = negative ? ~r : r;
}
