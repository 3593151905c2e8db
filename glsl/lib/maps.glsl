// Directions and texels of an environment map (shared/maps.glsl). A direction belongs to the face of its largest
// component; the two components that follow it, in the order x, y, z, x, y, over its size are the place on the face.

// The picture of a map has numbers of triangles as floats, as bits of small integers would be lost as subnormal ones:
// so many low bits in one, which is one more, the others in the next.
const uint MAP_LOW_BITS = 22u;

layout(constant_id = 40) const uint MAP_RESOLUTION = 128; // texels along a side of a face

uint map_texels() {
    return MAP_FACES * MAP_RESOLUTION * MAP_RESOLUTION;
}

// The direction's components in the order of its face: the largest one first.
vec3 map_turned(uint axis, vec3 d) {
    return axis == 0u ? d : (axis == 1u ? d.yzx : d.zxy);
}

uint map_axis(vec3 d) {
    vec3 size = abs(d);
    return size.x >= size.y && size.x >= size.z ? 0u : (size.y >= size.z ? 1u : 2u);
}

// The texel in which a direction lies, counted from the first one of its map.
uint map_texel(vec3 d) {
    uint axis = map_axis(d);
    vec3 turned = map_turned(axis, d);
    uint face = 2u * axis + (turned.x < 0.0 ? 1u : 0u);
    vec2 at = clamp(turned.yz / abs(turned.x) * 0.5 + 0.5, 0.0, 1.0) * float(MAP_RESOLUTION);
    uvec2 texel = min(uvec2(at), uvec2(MAP_RESOLUTION - 1u));
    return (face * MAP_RESOLUTION + texel.y) * MAP_RESOLUTION + texel.x;
}

// The place that a texel names, on its triangle.
vec3 map_place(BvhTriangle t, float b1, float b2) {
    return t.v0.xyz + b1 * (t.v1.xyz - t.v0.xyz) + b2 * (t.v2.xyz - t.v0.xyz);
}

// The direction through the middle of a texel, of length one along the axis of its face.
vec3 map_direction(uint texel) {
    uint x = texel % MAP_RESOLUTION, row = texel / MAP_RESOLUTION;
    uint face = row / MAP_RESOLUTION, y = row % MAP_RESOLUTION;
    vec2 at = (vec2(x, y) + 0.5) * (2.0 / float(MAP_RESOLUTION)) - 1.0;
    vec3 turned = vec3((face & 1u) != 0u ? -1.0 : 1.0, at);
    uint axis = face >> 1u;
    return axis == 0u ? turned : (axis == 1u ? turned.zxy : turned.yzx);
}
