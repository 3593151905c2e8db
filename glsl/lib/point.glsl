// A surface point that is looked at, and what a photon is worth there: the one place for density estimation and for
// connections of light paths to the camera. GLOSSY, SMOOTH_NORMALS, lib/bsdf.glsl and lib/eye_hit.glsl come before.
#include "lib/boundary.glsl"

// An eye hit, ready for photons.
struct Point {
    Surface s;
    vec3 to_eye;
    vec3 factor;        // of the sum over photons
    bool glossy;        // decided by the surface, not by the program: a lean program gives the same bits
    bool smooth_normal;
    Boundaries boundaries;
};

Point point_of(EyeHit hit) {
    Point x;
    vec3 through;
    x.s = surface_of(hit, x.to_eye, through);
    x.glossy = GLOSSY && !is_lambert(x.s);
    x.smooth_normal = SMOOTH_NORMALS && hit.a.w != hit.b.w;
    x.factor = x.glossy ? through : uintBitsToFloat(hit.b.xyz);
    x.boundaries = boundaries_decode(hit.e, x.s.geometric);
    return x;
}

// A surface seen from along `to_eye`, with nothing on the way.
Point point_at(Surface s, vec3 to_eye) {
    bool glossy = GLOSSY && !is_lambert(s);
    Boundaries none = Boundaries(false, vec3(0.0), vec3(0.0), vec4(0.0), 0.0);
    bool smooth_normal = SMOOTH_NORMALS && s.shading != s.geometric;
    return Point(s, to_eye, glossy ? vec3(1.0) : s.diffuse / PI, glossy, smooth_normal, none);
}

// What the photon brings to a point where the weight over its footprint is `density` [1/area].
vec3 photon_light(Photon p, Point x, float density) {
    vec3 light = uintBitsToFloat(p.b.xyz) * density;
    if (x.glossy || x.smooth_normal) {
        vec3 wi = -oct_decode(p.b.w);
        // Flux is counted per geometric area; the BSDF is meant for the shading normal (Veach 1997, 5.3.2).
        float n_i = dot(x.s.shading, wi), g_i = dot(x.s.geometric, wi);
        light *= n_i > 0.0 && g_i > 0.0 ? min(n_i / g_i, 4.0) : 0.0;
        if (x.glossy) light *= gathered_bsdf(x.s, x.to_eye, wi);
    }
    return light;
}
