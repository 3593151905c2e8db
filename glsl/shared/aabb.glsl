// A box: a point p is inside if min <= p <= max in every axis.
struct Aabb {
    vec3 min;
    vec3 max;
};

// Largest finite number.
const float FLT_MAX = 3.402823466e38;

// The box of nothing: the identity of the union.
Aabb aabb_empty() {
    float inf = uintBitsToFloat(0x7f800000u);
    return Aabb(vec3(inf), vec3(-inf));
}

// A box that holds at least one point and is finite. NaN fails every comparison.
bool aabb_valid(Aabb box) {
    bool ordered = box.min.x <= box.max.x && box.min.y <= box.max.y && box.min.z <= box.max.z;
    bool low = box.min.x >= -FLT_MAX && box.min.y >= -FLT_MAX && box.min.z >= -FLT_MAX;
    bool high = box.max.x <= FLT_MAX && box.max.y <= FLT_MAX && box.max.z <= FLT_MAX;
    return ordered && low && high;
}

Aabb aabb_union(Aabb a, Aabb b) {
    return Aabb(min(a.min, b.min), max(a.max, b.max));
}
