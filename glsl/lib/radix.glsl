// Digits of a radix sort, and the range of one worker: every invocation of the grid is a worker that owns a contiguous
// range of the items and has a counter of its own for each digit, so ranks are exact and stable without any
// communication. Made for devices where an invocation is a lane of a CPU's vector unit.
#include "lib/chunk.glsl"

const uint RADIX_DIGITS = 256u; /// Values of a digit of the radix sort.
const uint RADIX_WORKERS = 16u; /// Workers of a workgroup of the radix sort.

shared uint s_digit[RADIX_DIGITS * RADIX_WORKERS];

// `mask` is narrower than a digit in the last pass of a key whose width is no multiple of 8.
uint digit_of(uint key, uint shift, uint mask) {
    return key >> shift & mask;
}

// Where this invocation's counter of a digit stands.
uint counter(uint digit) {
    return digit * RADIX_WORKERS + gl_LocalInvocationIndex;
}
