// target[k] = source[indices[k]]: turns the indices of survivors into the slots that they stand for.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"

layout(set = 0, binding = 16, scalar) readonly buffer Indices { uint indices[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Source { uint source[]; };
layout(set = 0, binding = 19, scalar) writeonly buffer Target { uint target[]; };

void main() {
    uint k = linear_id();
    if (k < count[0]) target[k] = source[indices[k]];
}
