// A point per instance, which bench_splat.geom makes a square.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(location = 0) flat out uint splat_of_point;

void main() {
    splat_of_point = uint(gl_InstanceIndex);
    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}
