#ifndef INTERSECT_GLSL
#define INTERSECT_GLSL
// Ray against triangle and against box, and the origins of spawned rays. No epsilon is a length: every bound is a
// multiple of the coordinates that it bounds, so geometry scaled by a power of two gives the same bits.
// The host mirror is src/kernels/trace.rs; u below is half an ulp of 1, 2^-24.
const float TWO_POW_M18 = 3.814697265625e-6;
const float TWO_POW_M19 = 1.9073486328125e-6;
const float TWO_POW_M20 = 9.5367431640625e-7;
const float TWO_POW_M22 = 2.384185791015625e-7;
const float TWO_POW_M23 = 1.1920928955078125e-7;

// A ray prepared for many tests: the permuted, sheared frame of Woop, Benthin and Wald, "Watertight Ray/Triangle
// Intersection" (JCGT 2013), and slab origins moved apart so that no box of an accepted triangle is missed.
struct RayFrame {
    vec3 origin;
    vec3 inverse;     // 1 / direction; infinite where the direction is zero
    vec3 near_origin; // origin for the planes where the ray enters a box
    vec3 far_origin;  // origin for the planes where it leaves
    bvec3 negative;   // direction < 0
    bvec2 major;      // the largest component of the direction is x, is y
    vec3 shear;       // direction.x / z, direction.y / z, 1 / z after the permutation
};

// Cyclic permutation that moves the major axis to z. By selects: dynamic indexing goes through memory.
vec3 to_major_axis(vec3 v, bvec2 major) {
    return major.x ? v.yzx : (major.y ? v.zxy : v);
}

// `low` and `high` bound the whole scene.
//
// The padding of the slab origins: let r be the largest distance, along an axis, from the origin to a corner of the
// scene. A sheared vertex is wrong by at most 2u |A.xy| + (3 + d)u |A.z| where d u is the error of a division (Vulkan
// allows 2.5 ulp, d = 5): 10 u r. The slab distances are wrong by (2 + d)u relative, a shift of the plane by 7 u r.
// Their sum stays below 2^-19 r = 32 u r; the second term covers the rounding of the moved origin itself. The padding
// also keeps a zero direction component finite: a plane through the origin is never 0 * inf.
RayFrame ray_frame(vec3 origin, vec3 direction, vec3 low, vec3 high) {
    RayFrame ray;
    ray.origin = origin;
    vec3 size = abs(direction);
    ray.major.x = size.x > size.y && size.x > size.z;
    ray.major.y = !ray.major.x && size.y > size.z;
    precise vec3 d = to_major_axis(direction, ray.major);
    precise vec3 shear = vec3(d.x / d.z, d.y / d.z, 1.0 / d.z);
    ray.shear = shear;
    precise vec3 inverse = 1.0 / direction;
    ray.inverse = mix(inverse, vec3(uintBitsToFloat(0x7f800000u)), equal(direction, vec3(0.0)));
    ray.negative = lessThan(direction, vec3(0.0));
    precise vec3 reach = max(abs(low - origin), abs(high - origin));
    precise float r = max(reach.x, max(reach.y, reach.z));
    precise vec3 pad = r * TWO_POW_M19 + abs(origin) * TWO_POW_M23;
    precise vec3 less = origin - pad;
    precise vec3 more = origin + pad;
    ray.near_origin = mix(more, less, ray.negative);
    ray.far_origin = mix(less, more, ray.negative);
    return ray;
}

// Ray parameter where the ray enters the box; `leaves` is where it leaves. Missed unless enter <= leave.
float box_enter(RayFrame ray, vec3 low, vec3 high, out float leave) {
    precise vec3 near = (mix(low, high, ray.negative) - ray.near_origin) * ray.inverse;
    precise vec3 far = (mix(high, low, ray.negative) - ray.far_origin) * ray.inverse;
    leave = min(min(far.x, far.y), far.z);
    return max(max(near.x, near.y), near.z);
}

// The upper half of the digits (Veltkamp's splitting), so that products of halves are exact.
vec2 upper_half(vec2 v) {
    precise vec2 c = 4097.0 * v;
    precise vec2 high = c - (c - v);
    return high;
}

// a.x b.y - a.y b.x to about an ulp, hence with the exact sign: rounded products and their rounding errors (Dekker
// 1971; written out because a fused multiply-add is not fused everywhere). The upper halves of a and b come with them,
// each serves twice.
float edge_function(vec2 a, vec2 a_high, vec2 b, vec2 b_high) {
    precise vec2 product = a * b.yx;
    precise vec2 a_low = a - a_high;
    precise vec2 b_low = b - b_high;
    precise vec2 error =
        ((a_high * b_high.yx - product) + a_high * b_low.yx + a_low * b_high.yx) + a_low * b_low.yx;
    precise float edge = (product.x - product.y) + (error.x - error.y);
    return edge;
}

// Distance and barycentrics (of v1, v2) of a hit from either side with t_min < t; false where there is none.
//
// Two triangles that share an edge compute opposite values of its edge function, so no ray passes between them. t is
// raised to where the ray enters the triangle's own box: an edge-on triangle has an ill-conditioned t, and with this
// bound no box around the triangle is entered behind its t. Hence every tree finds the same hit as a loop over all
// triangles, ties included.
bool intersect_triangle(RayFrame ray, mat3 corners, float t_min, out float t, out vec2 barycentrics) {
    vec3 v0 = corners[0], v1 = corners[1], v2 = corners[2];
    precise vec3 a = to_major_axis(v0 - ray.origin, ray.major);
    precise vec3 b = to_major_axis(v1 - ray.origin, ray.major);
    precise vec3 c = to_major_axis(v2 - ray.origin, ray.major);
    precise vec2 pa = a.xy - ray.shear.xy * a.z;
    precise vec2 pb = b.xy - ray.shear.xy * b.z;
    precise vec2 pc = c.xy - ray.shear.xy * c.z;
    vec2 ha = upper_half(pa);
    vec2 hb = upper_half(pb);
    vec2 hc = upper_half(pc);
    float u = edge_function(pc, hc, pb, hb);
    float v = edge_function(pa, ha, pc, hc);
    float w = edge_function(pb, hb, pa, ha);
    bool inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
    precise float det = u + v + w;
    precise float inverse = 1.0 / det;
    precise float b0 = u * inverse;
    precise float b1 = v * inverse;
    precise float b2 = w * inverse;
    barycentrics = vec2(b1, b2);
    precise float distance = (b0 * a.z + b1 * b.z + b2 * c.z) * ray.shear.z;
    float leave;
    t = max(distance, box_enter(ray, min(min(v0, v1), v2), max(max(v0, v1), v2), leave));
    return inside && det != 0.0 && t > t_min;
}

float largest(vec3 v) {
    return max(v.x, max(v.y, v.z));
}

// Unit normal of a triangle of any size: edges are first brought to unit size.
vec3 triangle_normal(vec3 e1, vec3 e2) {
    float unit = 1.0 / largest(max(abs(e1), abs(e2)));
    vec3 n = cross(e1 * unit, e2 * unit);
    float size = largest(abs(n));
    if (size == 0.0) { // a needle whose normal is lost in rounding: any that is perpendicular
        vec3 along = e1 * unit;
        n = abs(along.x) > abs(along.z) ? vec3(-along.y, along.x, 0.0) : vec3(0.0, -along.z, along.y);
        size = largest(abs(n));
        if (size == 0.0) return vec3(0.0, 0.0, 1.0);
    }
    return normalize(n / size);
}

// The interpolated point with barycentrics `b` (of v1, v2), in the form whose error offset_point bounds.
vec3 triangle_point(vec3 v0, vec3 e1, vec3 e2, vec2 b) {
    precise vec3 p = v0 + (b.x * e1 + b.y * e2);
    return p;
}

// Origin for a ray that leaves the point `p` of a triangle with edges e1, e2 along `direction`: the point, moved off
// the triangle to the side that the direction points to, by the error bound of the point and of the next intersection.
//
// Let m be the largest extent of the edges. The computed point is off the plane by at most u |p| + 4u m along each
// axis, the sum below rounds once more, u |p|, and the distance that intersect_triangle finds is wrong by a few u m.
// The bound 4u |p| + 16u m covers all of it; its projection on the normal is the step (Pharr, Jakob and Humphreys, PBR
// 4th edition,
// 6.8.6). The normal of a needle is wrong by up to 11u over its aspect; a direction so close to the plane that its side
// is unsure may cross the plane within the triangle, which the step must then exceed too. Exact under scaling by powers
// of two.
vec3 offset_point(vec3 p, vec3 e1, vec3 e2, vec3 direction) {
    precise float m = max(largest(abs(e1)), largest(abs(e2)));
    precise vec3 f1 = e1 / m; // so that the product of edges does not underflow
    precise vec3 f2 = e2 / m;
    precise vec3 n = vec3(f1.y * f2.z - f1.z * f2.y, f1.z * f2.x - f1.x * f2.z, f1.x * f2.y - f1.y * f2.x);
    if (largest(abs(n)) == 0.0) n = direction; // a needle whose normal is lost in rounding
    precise float aspect = largest(abs(n));
    precise vec3 unit = n / aspect;
    precise float side = unit.x * direction.x + unit.y * direction.y + unit.z * direction.z;
    precise float unsure = (abs(direction.x) + abs(direction.y) + abs(direction.z)) * TWO_POW_M20 / aspect;
    precise float spread = abs(side) <= unsure ? TWO_POW_M18 / min(aspect, 1.0) : TWO_POW_M20;
    precise vec3 bound = abs(p) * TWO_POW_M22 + m * spread;
    precise float reach = abs(unit.x) * bound.x + abs(unit.y) * bound.y + abs(unit.z) * bound.z;
    precise float step_length = reach / (unit.x * unit.x + unit.y * unit.y + unit.z * unit.z);
    precise vec3 origin = p + unit * (side < 0.0 ? -step_length : step_length);
    return origin;
}

// The same from the corners and the barycentrics.
vec3 offset_ray_origin(vec3 v0, vec3 v1, vec3 v2, vec2 b, vec3 direction) {
    precise vec3 e1 = v1 - v0;
    precise vec3 e2 = v2 - v0;
    return offset_point(triangle_point(v0, e1, e2, b), e1, e2, direction);
}
#endif
