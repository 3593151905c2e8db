// From differentials to a stored photon: the ellipse in the surface's plane that the photon's flux is spread over.

// Guards, counted in `counters`.
const uint COUNT_MIN_RADIUS = 0u;  /// Footprints raised to the smallest radius: near a focus, or a beam without spread.
const uint COUNT_MAX_RADIUS = 1u;  /// Footprints cut to the largest radius.
const uint COUNT_ANISOTROPY = 2u;  /// Ellipses beyond MAX_ANISOTROPY.
const uint COUNT_GRAZING = 3u;     /// Deposits refused because the photon grazes to within float precision.
const uint COUNT_OVERFLOW = 4u;    /// Photons that did not fit; the pass is repeated with more room.
const uint COUNT_NOT_FINITE = 5u;  /// Photons whose flux or footprint is not finite.
const uint COUNTERS = 6u;          /// Number of the guards' counters.

const float MAX_ANISOTROPY = 1000.0; // longer over shorter semiaxis
const float MIN_RADIUS = 1e-4; // in scene radii, at the first pass

struct Ellipse {
    vec3 major;   // semiaxes, orthogonal
    vec3 minor;
    float longer; // their lengths
    float shorter;
};

// The ellipse { a cos p + b sin p }: principal axes from the 2 x 2 matrix M M^T, M = (a b).
Ellipse principal_axes(vec3 a, vec3 b, vec3 normal) {
    vec3 t, s;
    basis(normal, t, s);
    // In units of the longest component: fourth powers of lengths neither under- nor overflow.
    float unit = max(max_component(abs(a)), max_component(abs(b)));
    if (unit > 0.0) {
        a /= unit;
        b /= unit;
    }
    vec2 u = vec2(dot(a, t), dot(a, s)), v = vec2(dot(b, t), dot(b, s));
    float xx = u.x * u.x + v.x * v.x, yy = u.y * u.y + v.y * v.y, xy = u.x * u.y + v.x * v.y;
    float determinant = abs(u.x * v.y - u.y * v.x);
    float half_difference = 0.5 * (xx - yy);
    float large = 0.5 * (xx + yy) + sqrt(half_difference * half_difference + xy * xy);
    // The row of M M^T - small I with the larger diagonal entry is along the major axis.
    vec2 axis = half_difference > 0.0 ? vec2(large - yy, xy) : vec2(xy, large - xx);
    float size = length(axis);
    axis = size > 0.0 ? axis / size : vec2(1.0, 0.0);
    Ellipse e;
    float longer = sqrt(large);
    e.longer = unit * longer;
    e.shorter = longer > 0.0 ? unit * (determinant / longer) : 0.0;
    e.major = axis.x * t + axis.y * s;
    e.minor = -axis.y * t + axis.x * s;
    return e;
}
