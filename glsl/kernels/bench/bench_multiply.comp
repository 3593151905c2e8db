// How many single-precision multiplications a device does in a second: eight independent chains in each invocation, so
// that no latency shows. The factor comes from the host, so that nothing is computed in advance.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "lib/linear_id.glsl"
layout(local_size_x = 64) in;

const uint ROUNDS = 128u;
const uint MULTIPLICATIONS = ROUNDS * 32u; /// Multiplications of an invocation.

layout(push_constant, scalar) uniform Params { uint count; float factor; } params;
layout(set = 0, binding = 0, scalar) writeonly buffer Products { float products[]; };

void main() {
    uint index = linear_id();
    if (index >= params.count) return;
    vec4 a = vec4(index, index + 1u, index + 2u, index + 3u), b = a + 4.0;
    // Eight times four multiplications a round.
    for (uint i = 0u; i < ROUNDS; ++i) {
        a *= params.factor;
        b *= params.factor;
        a *= params.factor;
        b *= params.factor;
        a *= params.factor;
        b *= params.factor;
        a *= params.factor;
        b *= params.factor;
    }
    a += b;
    products[index] = a.x + a.y + a.z + a.w;
}
