// Photon and ray differentials (Igehy 1999; Fabianowski and Dingliana 2009, section 4): two pairs of derivatives of
// position and direction. Emission scales them by the sample spacing, so a footprint's semiaxes are dp_u and dp_v.
struct Differential {
    vec3 dp_u;
    vec3 dp_v;
    vec3 dd_u;
    vec3 dd_v;
};

vec3 transfer(vec3 dp, vec3 dd, vec3 d, vec3 normal, float t) {
    vec3 q = dp + t * dd;
    float cosine = dot(d, normal);
    // A ray that grazes to within float precision keeps its footprint perpendicular to itself.
    return abs(cosine) < 1e-6 ? q : q - d * (dot(q, normal) / cosine);
}

void transfer(inout Differential f, vec3 d, vec3 normal, float t) {
    f.dp_u = transfer(f.dp_u, f.dd_u, d, normal, t);
    f.dp_v = transfer(f.dp_v, f.dd_v, d, normal, t);
}

// Derivative of the interpolated unit normal along a displacement dp in the triangle's plane. `unnormalized` is the
// interpolated normal before normalisation, dn1 and dn2 the differences of the vertex normals along the edges e1, e2.
vec3 normal_derivative(vec3 dp, vec3 e1, vec3 e2, vec3 dn1, vec3 dn2, vec3 unnormalized) {
    // In units of the longest edge component: products of four lengths neither under- nor overflow.
    vec3 extent = max(abs(e1), abs(e2));
    float unit = 1.0 / max_component(extent);
    e1 *= unit;
    e2 *= unit;
    dp *= unit;
    vec3 n = cross(e1, e2);
    float n2 = dot(n, n);
    if (n2 == 0.0) return vec3(0.0); // a needle whose normal is lost in rounding
    float inverse = 1.0 / n2;
    vec3 dn = (dot(cross(dp, e2), n) * inverse) * dn1 + (dot(cross(e1, dp), n) * inverse) * dn2;
    float inverse_length = inversesqrt(max(dot(unnormalized, unnormalized), 1e-12));
    vec3 direction = unnormalized * inverse_length;
    return (dn - direction * dot(direction, dn)) * inverse_length;
}

vec3 reflect_derivative(vec3 dd, vec3 d, vec3 n, vec3 dn) {
    float cosine = dot(d, n);
    return dd - 2.0 * (cosine * dn + (dot(dd, n) + dot(d, dn)) * n);
}

// n on the side of the incoming ray, eta = n_incident / n_transmitted, r the refracted direction.
vec3 refract_derivative(vec3 dd, vec3 d, vec3 n, vec3 dn, float eta, vec3 r) {
    float d_n = dot(d, n), r_n = dot(r, n);
    float mu = eta * d_n - r_n;
    float dmu = (eta - eta * eta * d_n / min(r_n, -1e-6)) * (dot(dd, n) + dot(d, dn));
    return eta * dd - (mu * dn + dmu * n);
}

void scale(inout Differential f, float factor) {
    f.dp_u *= factor;
    f.dp_v *= factor;
    f.dd_u *= factor;
    f.dd_v *= factor;
}
