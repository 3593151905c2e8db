// After an append: the photon count, and how many did not fit.
#version 460
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 1) in;

layout(push_constant, scalar) uniform Params {
    uint capacity;
} params;

layout(set = 0, binding = 16, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 17, scalar) buffer PhotonCount { uint photon_count[]; };
layout(set = 0, binding = 18, scalar) buffer Overflow { uint overflow[]; };

void main() {
    uint room = params.capacity - photon_count[0];
    uint fits = min(count[0], room);
    overflow[0] += count[0] - fits;
    photon_count[0] += fits;
}
