// Whether a triangle has an area that a ray can meet, in about twice single precision and without double precision,
// which not every device has. The host mirror is has_area() of src/kernels/triangles.rs.

// x - y and its rounding error (Knuth 1969, "The Art of Computer Programming", volume 2, 4.2.2).
vec3 exact_difference(vec3 x, vec3 y, out vec3 error) {
    precise vec3 difference = x - y;
    precise vec3 virtual = difference - x;
    precise vec3 rest = (x - (difference - virtual)) - (y + virtual);
    error = rest;
    return difference;
}

// x * y and its rounding error (Dekker 1971; written out because a fused multiply-add is not fused everywhere).
vec3 exact_product(vec3 x, vec3 y, out vec3 error) {
    precise vec3 product = x * y;
    precise vec3 x_wide = 4097.0 * x;
    precise vec3 y_wide = 4097.0 * y;
    precise vec3 x_high = x_wide - (x_wide - x);
    precise vec3 y_high = y_wide - (y_wide - y);
    precise vec3 x_low = x - x_high;
    precise vec3 y_low = y - y_high;
    precise vec3 rest = ((x_high * y_high - product) + x_high * y_low + x_low * y_high) + x_low * y_low;
    error = rest;
    return product;
}

float largest_part(vec3 v) {
    return max(abs(v.x), max(abs(v.y), abs(v.z)));
}

// Exponent of a normal number below 2^127.
int exponent_of(float size) {
    return clamp(int(floatBitsToUint(size) >> 23) - 127, -126, 126);
}

float power_of_two(int exponent) {
    return uintBitsToFloat(uint(127 + exponent) << 23);
}

// The edges are halved, so that none overflows, and brought to sizes of one to four. A triangle has no area whose
// edges are below the normal numbers, whose doubled area is, or which is thinner than 2^-44 of its length: that is what
// rounding leaves of corners on a line. Coordinates have to be finite.
bool has_area(vec3 a, vec3 b, vec3 c) {
    vec3 e_low, f_low, p_low, q_low;
    vec3 e = exact_difference(0.5 * b, 0.5 * a, e_low);
    vec3 f = exact_difference(0.5 * c, 0.5 * a, f_low);
    float e_size = largest_part(e);
    float f_size = largest_part(f);
    if (!(e_size >= power_of_two(-126) && f_size >= power_of_two(-126))) return false;
    int e_exponent = exponent_of(e_size);
    int f_exponent = exponent_of(f_size);
    float e_unit = power_of_two(-e_exponent);
    float f_unit = power_of_two(-f_exponent);
    e *= e_unit;
    e_low *= e_unit;
    f *= f_unit;
    f_low *= f_unit;
    vec3 p = exact_product(e.yzx, f.zxy, p_low);
    vec3 q = exact_product(e.zxy, f.yzx, q_low);
    precise vec3 p_rest = p_low + (e.yzx * f_low.zxy + e_low.yzx * f.zxy);
    precise vec3 q_rest = q_low + (e.zxy * f_low.yzx + e_low.zxy * f.yzx);
    precise vec3 area = (p - q) + (p_rest - q_rest);
    return largest_part(area) >= power_of_two(clamp(-128 - e_exponent - f_exponent, -44, 5));
}
