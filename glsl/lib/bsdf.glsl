// The material model of glTF 2.0 (metallic-roughness, specular, transmission, ior, volume) as four lobes:
//   diffuse   Lambert under the coat, which takes what it reflects   gathered
//   glossy    GGX reflection                                         gathered if rough, else followed like a mirror
//   mirror    the limit of the glossy lobe for alpha < ALPHA_SMOOTH  followed
//   glass     smooth or rough dielectric boundary, or a thin sheet   followed
// "Gathered" lobes take photons and shadow rays; "followed" ones continue eye and photon paths.
//
// No lobe loses light by itself: lib/lobes.glsl gives back what single scattering loses. The reference in double
// precision is src/kernels/lobes.

#include "lib/lobes.glsl"

const float ALPHA_SMOOTH = 1e-3; /// Below it GGX and the mirror agree to float precision of the half vector
const float ALPHA_GATHER = 0.1; /// Above it a glossy lobe is wide enough for density estimation

// Gathered glossy lobes after Blinn and Phong instead of GGX, for comparison with Mara, Luebke and McGuire 2013.
layout(constant_id = 15) const bool BLINN_PHONG = false;

struct Surface {
    vec3 position;
    vec3 geometric;   // geometric normal towards the incoming ray's origin
    vec3 shading;     // shading normal on the same side
    bool front;       // the ray came to the front side
    uint material;
    uint flags;       // MATERIAL_*
    vec3 diffuse;     // diffuse reflectance of the base
    vec3 f0;          // reflectance at normal incidence of the glossy or mirror lobe, without the share of glass
    float f90;
    vec3 f0_again;    // the same for light that meets a second facet
    float metallic;
    float coat_f0;    // reflectance of the coat over the base, the strongest of its colours
    float coat_f90;
    float alpha;      // GGX
    float glass;      // share of the surface that is a boundary of glass or a thin sheet
    vec3 transmission; // colour of the transmitted light times that share, zero for opaque surfaces
    float ior;
    uint boundary;    // where the table of a rough boundary begins in `lobes`; 0: it loses nothing
    // For the direction from which the surface is looked at, see look_from:
    float own_scale;  // of the glossy lobe
    float own_below;  // what the coat lets through
    float mean_below; // the same for light from everywhere
    vec3 emission;
    vec3 absorption;
    float opacity;    // share of the surface that is there: 0 where an alpha mask cuts it away, alpha with blending
    vec3 e1;          // edges of the triangle
    vec3 e2;
};

// What the facets of the glossy lobe reflect (Schlick 1994), where `scales` is the product of the scales of both
// directions. Light that meets a second facet is reflected once more, head-on.
vec3 facet_reflectance(Surface s, float cosine, float scales) {
    float m = clamp(1.0 - cosine, 0.0, 1.0);
    float edge = m * m * m * m * m;
    return s.f0 + (vec3(s.f90) - s.f0) * edge + (scales - 1.0) * (s.f0_again + (s.f0 - s.f0_again) * edge);
}

// Reflectance of a smooth dielectric boundary; eta is n_incident / n_transmitted. Total reflection gives 1.
float fresnel_dielectric(float cos_i, float eta) {
    float sin2_t = eta * eta * max(0.0, 1.0 - cos_i * cos_i);
    if (sin2_t >= 1.0) return 1.0;
    float cos_t = sqrt(1.0 - sin2_t);
    float parallel = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    float perpendicular = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    return 0.5 * (parallel * parallel + perpendicular * perpendicular);
}

float ggx_d(float n_h, float alpha) {
    float a2 = alpha * alpha;
    float t = 1.0 + (a2 - 1.0) * n_h * n_h;
    return a2 / (PI * t * t);
}

float ggx_lambda(float n_w, float alpha) { // Smith's Lambda
    float c2 = max(n_w * n_w, 1e-12);
    return 0.5 * (sqrt(1.0 + alpha * alpha * (1.0 - c2) / c2) - 1.0);
}

// Half vector from the distribution of normals visible from w, in the frame of the normal (Heitz 2018).
vec3 sample_visible_normal(vec3 w, float alpha, vec2 u) {
    vec3 v = normalize(vec3(alpha * w.xy, w.z));
    vec3 t1 = dot(v.xy, v.xy) > 0.0 ? vec3(-v.y, v.x, 0.0) * inversesqrt(dot(v.xy, v.xy)) : vec3(1.0, 0.0, 0.0);
    vec3 t2 = cross(v, t1);
    float r = sqrt(u.x);
    float phi = 2.0 * PI * u.y;
    float p1 = r * cos(phi);
    float s = 0.5 * (1.0 + v.z);
    float p2 = mix(sqrt(max(0.0, 1.0 - p1 * p1)), r * sin(phi), s);
    vec3 n = p1 * t1 + p2 * t2 + sqrt(max(0.0, 1.0 - p1 * p1 - p2 * p2)) * v;
    return normalize(vec3(alpha * n.xy, max(1e-9, n.z)));
}

// GGX reflection without its Fresnel factor and without a cosine: D G2 / (4 |n.wo| |n.wi|).
float ggx_reflection(vec3 n, vec3 wo, vec3 wi, float alpha) {
    float n_o = dot(n, wo), n_i = dot(n, wi);
    if (n_o <= 0.0 || n_i <= 0.0) return 0.0;
    vec3 h = normalize(wo + wi);
    float g = 1.0 / (1.0 + ggx_lambda(n_o, alpha) + ggx_lambda(n_i, alpha));
    return ggx_d(clamp(dot(n, h), 0.0, 1.0), alpha) * g / (4.0 * n_o * n_i);
}

// Normalised Blinn-Phong lobe without its Fresnel factor: (8 + s) / (8 pi) (n.h)^s (Mara, Luebke and McGuire 2013,
// equation 6), with the exponent s = 2 / alpha^2 - 2 whose lobe has the width of GGX's (Walter et al. 2007, section
// 5.2).
float blinn_phong_reflection(vec3 n, vec3 wo, vec3 wi, float alpha) {
    float exponent = max(2.0 / (alpha * alpha) - 2.0, 0.0);
    float n_h = clamp(dot(n, normalize(wo + wi)), 0.0, 1.0);
    return (8.0 + exponent) / (8.0 * PI) * (n_h > 0.0 ? pow(n_h, exponent) : (exponent > 0.0 ? 0.0 : 1.0));
}

bool is_lambert(Surface s) {
    return s.f90 == 0.0 && s.f0 == vec3(0.0);
}

bool has_diffuse(Surface s) {
    return max_component(s.diffuse) > 0.0;
}

bool is_glass(Surface s) {
    return max_component(s.transmission) > 0.0;
}

// The reflection of rough glass is followed together with its refraction, however rough: gathering it too would count
// it twice.
bool has_gathered_glossy(Surface s) {
    return s.alpha >= ALPHA_GATHER && !is_glass(s) && (max_component(s.f0) > 0.0 || s.f90 > 0.0);
}

bool has_followed_glossy(Surface s) {
    return is_glass(s) || s.alpha < ALPHA_GATHER && (max_component(s.f0) > 0.0 || s.f90 > 0.0);
}

// Scale of the glossy lobe for a direction with this cosine.
float lobe_scale(Surface s, float cosine) {
    return s.alpha < ALPHA_SMOOTH ? 1.0 : lobe_entry(s.alpha, cosine).scale;
}

// Share of light that the coat lets through, from a direction to the base or back.
float coat_below(Surface s, LobeEntry lobe) {
    float head_on = lobe.single - lobe.edge;
    float again = s.coat_f0 * (1.0 - lobe.edge_scaled - head_on) + lobe.edge_scaled - lobe.edge;
    return max(1.0 - s.coat_f0 * (head_on + again) - s.coat_f90 * lobe.edge, 0.0);
}

// Completes a surface that is looked at from the unit direction `w`.
void look_from(inout Surface s, vec3 w) {
    LobeEntry own = lobe_entry(s.alpha, dot(s.shading, w));
    s.own_scale = s.alpha < ALPHA_SMOOTH ? 1.0 : own.scale;
    s.own_below = coat_below(s, own);
    s.mean_below = max(coat_below(s, lobe_mean(s.alpha)), 1e-6);
}

// Diffuse reflectance of the base under its coat, for light to or from a direction with this lobe: the coat takes from
// the base what it reflects, at either direction (Kelemen and Szirmay-Kalos 2001, equation 5).
vec3 base_reflectance(Surface s, LobeEntry lobe) {
    return s.diffuse * (s.own_below * coat_below(s, lobe) / s.mean_below);
}

// The glossy lobe [1/sr] for a direction whose scale is given.
vec3 glossy_lobe(Surface s, vec3 wo, vec3 wi, float scale) {
    float cosine = abs(dot(normalize(wo + wi), wi));
    return facet_reflectance(s, cosine, s.own_scale * scale) * ggx_reflection(s.shading, wo, wi, s.alpha);
}

// The direction below the triangle that a reflection by its plane brings to `wi`, and its cosine to the shading normal;
// not above 0 if no lobe reaches there.
vec3 turned_from(Surface s, vec3 wi, out float cosine) {
    vec3 below = wi - 2.0 * dot(wi, s.geometric) * s.geometric;
    cosine = SMOOTH_NORMALS ? dot(s.shading, below) : 0.0;
    return below;
}

// The same lobe, with what a shading normal sends below the triangle: its plane reflects that light. `wi` is above.
vec3 whole_glossy_lobe(Surface s, vec3 wo, vec3 wi, float scale) {
    float cosine;
    vec3 lobe = glossy_lobe(s, wo, wi, scale), below = turned_from(s, wi, cosine);
    if (cosine <= 0.0) return lobe;
    // Lobes are multiplied by the cosine of `wi`, which is the larger one.
    return lobe + glossy_lobe(s, wo, below, lobe_scale(s, cosine)) * (cosine / dot(s.shading, wi));
}

// Gathered part of the BSDF [1/sr] between the direction that the surface is looked at from and another one.
vec3 gathered_bsdf(Surface s, vec3 wo, vec3 wi) {
    float n_o = dot(s.shading, wo), n_i = dot(s.shading, wi);
    if (n_o <= 0.0 || n_i <= 0.0) return vec3(0.0);
    bool glossy = has_gathered_glossy(s);
    // The paper's model adds the lobes without taking from the diffuse one what the coat reflects.
    if (BLINN_PHONG) {
        float cosine = abs(dot(normalize(wo + wi), wi));
        float lobe = glossy ? blinn_phong_reflection(s.shading, wo, wi, s.alpha) : 0.0;
        return s.diffuse / PI + facet_reflectance(s, cosine, 1.0) * lobe;
    }
    LobeEntry lobe = lobe_entry(s.alpha, n_i);
    vec3 f = base_reflectance(s, lobe) / PI;
    return glossy ? f + whole_glossy_lobe(s, wo, wi, lobe.scale) : f;
}

// Followed part of the glossy lobe [1/sr], for lights that no followed path can hit; zero for mirrors.
vec3 followed_bsdf(Surface s, vec3 wo, vec3 wi) {
    if (!has_followed_glossy(s) || s.alpha < ALPHA_SMOOTH) return vec3(0.0);
    return whole_glossy_lobe(s, wo, wi, lobe_scale(s, dot(s.shading, wi)));
}

// A microfacet normal on the side of wo: the shading normal itself for smooth surfaces. The sample's weight is
// facet_weight times the reflectance of the facet.
vec3 sample_facet(Surface s, vec3 wo, vec2 u) {
    if (s.alpha < ALPHA_SMOOTH) return s.shading;
    vec3 t, b;
    basis(s.shading, t, b);
    vec3 local = vec3(dot(wo, t), dot(wo, b), max(dot(wo, s.shading), 1e-6));
    vec3 h = sample_visible_normal(local, s.alpha, u);
    return t * h.x + b * h.y + s.shading * h.z;
}

// Masking-shadowing ratio G2 / G1(wo) after sampling a visible normal.
float facet_weight(Surface s, vec3 wo, vec3 wi) {
    if (s.alpha < ALPHA_SMOOTH) return 1.0;
    float lo = ggx_lambda(abs(dot(s.shading, wo)), s.alpha), li = ggx_lambda(abs(dot(s.shading, wi)), s.alpha);
    return (1.0 + lo) / (1.0 + lo + li);
}
