// Ways on from surfaces that are followed: mirrors, sharp glossy lobes, boundaries of glass. Include lib/scatter.glsl
// before.

// Ratio n_incident / n_transmitted of a boundary of glass for the direction of a ray that goes through; 1 for a thin
// sheet.
float transmission_eta(Surface s) {
    if ((s.flags & MATERIAL_VOLUME) == 0u) return 1.0;
    return s.front ? 1.0 / s.ior : s.ior;
}

// The same ratio for how much is reflected: a thin sheet is entered from either side.
float reflection_eta(Surface s) {
    return (s.flags & MATERIAL_VOLUME) != 0u ? transmission_eta(s) : 1.0 / s.ior;
}

// Refraction about a sampled facet: its direction, of unit length up to rounding; false where all is reflected.
bool refract_at(vec3 facet, float cosine, vec3 d, float eta, out vec3 direction) {
    float k = 1.0 - eta * eta * (1.0 - cosine * cosine);
    direction = k > 0.0 ? eta * d + (eta * cosine - sqrt(k)) * facet : d;
    return k > 0.0;
}

// What is sampled at a followed surface.
struct Ways {
    vec3 facet;     // normal of the facet
    float eta;      // n_incident / n_transmitted for the direction
    bool again;     // the light has met more than one facet of a rough boundary: it goes anywhere
    Way reflected;
    Way transmitted;
};

// Light that meets more than one facet of a rough boundary leaves it to both sides, in directions that are as likely
// as light from there is to meet more than one facet (Kulla and Conty 2017, extended to two sides). Radiance inside
// counts with the square of the index, which makes the lobe reciprocal.
Ways ways_again(Surface s, vec2 u) {
    vec2 mean = (1.0 - boundary_mean(s.boundary, s.alpha)) * vec2(1.0, s.ior * s.ior);
    vec3 local = cosine_hemisphere(u);
    vec2 share = (1.0 - boundary_albedo(s.boundary, s.alpha, local.z)) * vec2(1.0, s.ior * s.ior) / (mean.x + mean.y);
    vec3 up = from_basis(s.shading, local);
    vec3 down = up - 2.0 * local.z * s.shading;
    float own = s.front ? share.x : share.y, other = s.front ? share.y : share.x;
    Ways w = Ways(s.shading, transmission_eta(s), true, NO_WAY, NO_WAY);
    w.reflected = way_along(s, up, vec3(s.glass * own), 1.0);
    w.transmitted = way_along(s, down, s.transmission * other, -1.0);
    return w;
}

// The way through a boundary, or through a thin sheet: that scatters light as its reflection does, to the other side
// (KHR_materials_transmission).
Way transmitted_way(Surface s, vec3 d, Reflection r, float reflectance, float eta) {
    vec3 weight = s.transmission * (1.0 - reflectance);
    if ((s.flags & MATERIAL_VOLUME) == 0u) {
        vec3 through = r.direction - 2.0 * r.above * s.shading;
        return r.above > 0.0 ? way_along(s, through, weight * (r.masking * r.scales), -1.0) : NO_WAY;
    }
    vec3 t;
    if (!refract_at(r.facet, r.cosine, d, eta, t) || dot(t, s.shading) >= 0.0) return NO_WAY;
    t = normalize(t);
    return way_along(s, t, weight * facet_weight(s, -d, t), -1.0);
}

// Ways on from a surface of glass.
Ways glass_ways(Surface s, vec3 d, vec2 u) {
    bool volume = (s.flags & MATERIAL_VOLUME) != 0u;
    float missing = 0.0;
    if (volume && s.boundary != 0u && s.alpha >= ALPHA_SMOOTH) {
        vec2 albedo = boundary_albedo(s.boundary, s.alpha, -dot(s.shading, d));
        missing = 1.0 - (s.front ? albedo.x : albedo.y);
    }
    if (u.x < missing) return ways_again(s, vec2(u.x / missing, u.y));
    float kept = 1.0 - missing;
    Reflection r = sample_facet_reflection(s, d, vec2((u.x - missing) / kept, u.y));
    float reflectance = fresnel_dielectric(r.cosine, reflection_eta(s));
    Ways w = Ways(r.facet, transmission_eta(s), false, NO_WAY, NO_WAY);
    if (r.above > 0.0) {
        vec3 weight = facet_reflectance(s, r.cosine, r.scales);
        weight += s.glass * reflectance * (volume ? 1.0 : r.scales);
        w.reflected = way_along(s, r.direction, weight * (r.masking / kept), 1.0);
    }
    w.transmitted = transmitted_way(s, d, r, reflectance, w.eta);
    w.transmitted.weight /= kept;
    w.transmitted.chance /= kept;
    return w;
}

// Ways on from any surface; `u` is a pair of random numbers.
Ways sample_ways(Surface s, vec3 d, vec2 u) {
    if (GLASS && is_glass(s)) return glass_ways(s, d, u);
    Reflection r = sample_facet_reflection(s, d, u);
    return Ways(r.facet, 1.0, false, glossy_way(s, r), NO_WAY);
}
