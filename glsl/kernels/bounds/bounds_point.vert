// A point per photon, which a geometry kernel amplifies.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(set = 0, binding = 21, scalar) readonly buffer Seen { uint seen[]; }; // photons that may be in the picture
layout(location = 0) flat out uint photon_of_point;

void main() {
    photon_of_point = seen[gl_VertexIndex];
    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}
