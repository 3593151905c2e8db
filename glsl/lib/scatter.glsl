// Drawing a continuation among the lobes of a surface: the same for photons and for paths from the eye. `d` is the
// direction of travel towards the surface.

// A way on from a surface.
struct Way {
    vec3 direction;
    vec3 weight;  // on radiance or flux
    float chance; // probability to draw it with, before others are known: what it carries; 0: there is no such way
    bool turned;  // brought to the right side of the geometric surface
};

const Way NO_WAY = Way(vec3(0.0), vec3(0.0), 0.0, false);

// What the turn of a way makes of a vector, a direction or the derivative of one; twice gives the vector.
vec3 turn(Surface s, Way way, vec3 v) {
    return way.turned ? v - 2.0 * dot(v, s.geometric) * s.geometric : v;
}

// The way along a unit direction, on the side of the surface to which it was meant. Shading normals bend rays to the
// wrong side of the geometric surface; these are reflected by it, so that no light is lost.
Way way_along(Surface s, vec3 direction, vec3 weight, float side) {
    bool turned = side * dot(direction, s.geometric) < 0.0;
    Way way = Way(direction, weight, max_component(weight), turned);
    way.direction = turn(s, way, direction);
    return way;
}

// Reflection about a sampled facet.
struct Reflection {
    vec3 facet;
    float cosine;     // between facet and incoming ray
    vec3 direction;
    float above;      // cosine of the direction to the shading normal; not above 0: lost to a second facet
    float masking;    // G2 / G1
    float scales;     // of both directions
};

Reflection sample_facet_reflection(Surface s, vec3 d, vec2 u) {
    Reflection r;
    r.facet = sample_facet(s, -d, u);
    r.cosine = clamp(-dot(r.facet, d), 0.0, 1.0);
    r.direction = reflect(d, r.facet);
    r.above = dot(s.shading, r.direction);
    r.masking = r.above > 0.0 ? facet_weight(s, -d, r.direction) : 0.0;
    r.scales = s.own_scale * lobe_scale(s, r.above);
    return r;
}

// The glossy lobe or mirror along a sampled reflection.
Way glossy_way(Surface s, Reflection r) {
    if (r.above <= 0.0) return NO_WAY;
    return way_along(s, r.direction, facet_reflectance(s, r.cosine, r.scales) * r.masking, 1.0);
}

// Density [1/sr] of the reflection about a sampled facet; infinite for smooth surfaces.
float lobe_density(Surface s, vec3 wo, vec3 facet) {
    if (s.alpha < ALPHA_SMOOTH) return INFINITY;
    float n_h = clamp(dot(s.shading, facet), 0.0, 1.0);
    float g1 = 1.0 / (1.0 + ggx_lambda(max(dot(s.shading, wo), 1e-4), s.alpha));
    return ggx_d(n_h, s.alpha) * g1 / (4.0 * max(dot(s.shading, wo), 1e-4));
}

// Probability with which the diffuse lobe is drawn: its albedo under the coat.
float diffuse_chance(Surface s) {
    return max_component(s.diffuse) * s.own_below;
}

// A direction of the diffuse lobe, and what it reflects: the lobe over the density of the direction.
vec3 sample_diffuse(Surface s, vec2 u, out vec3 weight) {
    vec3 direction = from_basis(s.shading, cosine_hemisphere(u));
    weight = GLOSSY ? base_reflectance(s, lobe_entry(s.alpha, dot(s.shading, direction))) : s.diffuse;
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
    float p_diffuse = diffuse_chance(s);
    Way r = NO_WAY;
    if (GLOSSY && has_gathered_glossy(s)) r = glossy_way(s, sample_facet_reflection(s, d, u));
    float p_reflect = r.chance;
    float norm = chance_norm(p_diffuse + p_reflect, absorb);
    p_reflect *= norm;
    p_diffuse *= norm;
    if (choice < p_reflect) {
        e.direction = r.direction;
        e.probability = p_reflect;
        e.weight = r.weight / p_reflect;
    } else if (choice < p_reflect + p_diffuse) {
        e.direction = sample_diffuse(s, u, e.weight);
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
    float p_diffuse = diffuse_chance(s), p_reflect = 0.0, density = 0.0;
    if (GLOSSY && has_gathered_glossy(s)) {
        vec3 facet = normalize(wo + wi);
        float scales = s.own_scale * lobe_scale(s, dot(s.shading, wi));
        vec3 reflected = facet_reflectance(s, clamp(dot(facet, wo), 0.0, 1.0), scales);
        p_reflect = max_component(reflected) * facet_weight(s, wo, wi);
        density = p_reflect * lobe_density(s, wo, facet);
    }
    density += p_diffuse * max(dot(s.shading, wi), 0.0) / PI;
    return density * chance_norm(p_diffuse + p_reflect, absorb);
}
