// Drawing a continuation among the lobes of a surface: the same for photons and for paths from the eye. `d` is the
// direction of travel towards the surface.

// A reflection about a sampled facet: of the glossy or mirror lobe, or of a boundary of glass.
struct Reflection {
    vec3 facet;
    float cosine;      // between facet and incoming ray
    vec3 fresnel;      // reflectance of the facet
    vec3 direction;
    float chance;      // probability to draw it with: what it reflects; 0 if it points into the surface
};

// `eta` is the ratio of indices of a boundary of glass.
Reflection sample_reflection(Surface s, vec3 d, vec2 u, bool glass, float eta) {
    Reflection r;
    r.facet = sample_facet(s, -d, u);
    r.cosine = clamp(-dot(r.facet, d), 0.0, 1.0);
    r.fresnel = fresnel_schlick(s.f0, s.f90, r.cosine);
    if (glass) r.fresnel = vec3(fresnel_dielectric(r.cosine, eta));
    r.direction = reflect(d, r.facet);
    r.chance = dot(r.direction, s.geometric) > 0.0 ? max_component(r.fresnel) * facet_weight(s, -d, r.direction) : 0.0;
    return r;
}

// Refraction about a sampled facet: its direction, of unit length up to rounding; false where all is reflected.
bool refract_at(vec3 facet, float cosine, vec3 d, float eta, out vec3 direction) {
    float k = 1.0 - eta * eta * (1.0 - cosine * cosine);
    direction = k > 0.0 ? eta * d + (eta * cosine - sqrt(k)) * facet : d;
    return k > 0.0;
}

// Density [1/sr] of the reflection about a sampled facet; infinite for smooth surfaces.
float lobe_density(Surface s, vec3 wo, vec3 facet) {
    if (s.alpha < ALPHA_SMOOTH) return INFINITY;
    float n_h = clamp(dot(s.shading, facet), 0.0, 1.0);
    float g1 = 1.0 / (1.0 + ggx_lambda(max(dot(s.shading, wo), 1e-4), s.alpha));
    return ggx_d(n_h, s.alpha) * g1 / (4.0 * max(dot(s.shading, wo), 1e-4));
}

// Probability with which the diffuse lobe is drawn: its albedo under the coat for a direction along the normal. With
// the coat's reflectance for the ray itself, few photons would survive at grazing angles, where the coat is nearly
// opaque for the ray but not for the directions that follow, and each survivor would carry many times the flux.
float diffuse_chance(Surface s, vec3 d) {
    float half_cosine = sqrt(0.5 + 0.5 * clamp(-dot(s.shading, d), 0.0, 1.0));
    return max_component(s.diffuse * (1.0 - fresnel_schlick(s.f0, s.f90, half_cosine)));
}

// A direction of the diffuse lobe, and what it reflects: the lobe over the density of the direction.
vec3 sample_diffuse(Surface s, vec3 d, vec2 u, out vec3 weight) {
    vec3 direction = from_basis(s.shading, cosine_hemisphere(u));
    vec3 half_vector = normalize(direction - d);
    vec3 coat = fresnel_schlick(s.f0, s.f90, abs(dot(half_vector, direction)));
    weight = s.diffuse * (1.0 - coat);
    return direction;
}

// Factor on chances that sum to `total`. With `absorb` what is missing to one ends the path, else one lobe is always
// drawn.
float chance_norm(float total, bool absorb) {
    return total > 1.0 || (!absorb && total > 0.0) ? 1.0 / total : 1.0;
}

// A continuation from the gathered lobes.
struct Gathered {
    vec3 direction;
    vec3 weight;       // on the throughput, probability divided out
    float probability; // 0: absorbed
};

Gathered sample_gathered(Surface s, vec3 d, float choice, vec2 u, bool absorb) {
    Gathered e = Gathered(vec3(0.0), vec3(0.0), 0.0);
    float p_reflect = 0.0, p_diffuse = diffuse_chance(s, d);
    Reflection r;
    if (GLOSSY && has_gathered_glossy(s)) {
        r = sample_reflection(s, d, u, false, 1.0);
        p_reflect = r.chance;
    }
    float norm = chance_norm(p_diffuse + p_reflect, absorb);
    p_reflect *= norm;
    p_diffuse *= norm;
    if (choice < p_reflect) {
        e.direction = r.direction;
        e.probability = p_reflect;
        e.weight = r.fresnel * (facet_weight(s, -d, r.direction) / p_reflect);
    } else if (choice < p_reflect + p_diffuse) {
        e.direction = sample_diffuse(s, d, u, e.weight);
        e.probability = p_diffuse;
        e.weight /= p_diffuse;
    }
    // Where a light's sample counts: above both horizons.
    if (!(dot(e.direction, s.shading) > 0.0 && dot(e.direction, s.geometric) > 0.0)) e.probability = 0.0;
    return e;
}

// Density [1/sr] with which sample_gathered draws a direction, lobe by lobe with the chances that this direction would
// have met. It only balances samples of lobes against samples of lights: as both ask this function, any one is
// unbiased.
float gathered_density(Surface s, vec3 wo, vec3 wi, bool absorb) {
    float p_diffuse = diffuse_chance(s, -wo), p_reflect = 0.0, density = 0.0;
    if (GLOSSY && has_gathered_glossy(s)) {
        vec3 facet = normalize(wo + wi);
        vec3 fresnel = fresnel_schlick(s.f0, s.f90, clamp(dot(facet, wo), 0.0, 1.0));
        p_reflect = max_component(fresnel) * facet_weight(s, wo, wi);
        density = p_reflect * lobe_density(s, wo, facet);
    }
    density += p_diffuse * max(dot(s.shading, wi), 0.0) / PI;
    return density * chance_norm(p_diffuse + p_reflect, absorb);
}
