// Sums as unevaluated pairs of floats (Knuth's two-sum): a million passes lose nothing. Mirrors src/film/accumulate.rs.
void two_float_add(inout float high, inout float low, float x) {
    precise float s = high + x;
    precise float virtual_x = s - high;
    precise float error = (high - (s - virtual_x)) + (x - virtual_x);
    precise float l = low + error;
    precise float h = s + l;
    precise float rest = l - (h - s);
    high = h;
    low = rest;
}
