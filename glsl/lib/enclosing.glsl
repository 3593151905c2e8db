// The medium around a point, by the boundaries above it. Include shared/photon.glsl, lib/scene_bindings.glsl and
// lib/traverse.glsl before, which must stop at all of them.

// Up, as glTF has it, but along no edge of what is built square. Water that is only a surface is below it.
const vec3 UPWARDS = vec3(0.0130985, 0.9997042, 0.0204337);
// Boundaries that are looked at.
const uint MOST_BOUNDARIES = 64u;

// Material index + 1 of the innermost body around `p`, 0 outside of all: the first one that the way up leaves without
// having entered it.
uint enclosing_medium(vec3 p) {
    uint entered = 0u;
    [[dont_unroll]] for (uint i = 0u; i < MOST_BOUNDARIES; ++i) {
        Hit hit = trace_closest(p, UPWARDS, INFINITY);
        if (hit.triangle == BVH_MISS) return 0u;
        BvhTriangle t = triangles[hit.triangle];
        vec3 e1 = t.v1.xyz - t.v0.xyz, e2 = t.v2.xyz - t.v0.xyz;
        uint material = floatBitsToUint(t.v2.w);
        if ((materials[material].flags & (MATERIAL_VOLUME | MATERIAL_BLEND)) == MATERIAL_VOLUME) {
            bool enters = dot(triangle_normal(e1, e2), UPWARDS) < 0.0;
            if (!enters && entered == 0u) return path_medium(material);
            entered += enters ? 1u : 0xffffffffu;
        }
        p = offset_point(triangle_point(t.v0.xyz, e1, e2, hit.barycentrics), e1, e2, UPWARDS);
    }
    return 0u;
}
