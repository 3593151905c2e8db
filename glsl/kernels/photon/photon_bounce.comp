// One bounce of the photons in flight: transfer of the footprint to the surface, deposit, and the next direction by
// Russian roulette over the lobes. Caustic photons follow only mirrors, glass and sharp glossy lobes; what they leave at
// gathering surfaces is light-specular+-diffuse light. Global photons take every lobe and leave light behind once they
// have met a diffuse or rough glossy surface. Together they carry all indirect light, each path once.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "lib/sampling.glsl"
#include "lib/scene_bindings.glsl"
#include "shared/photon.glsl"

layout(constant_id = 20) const bool CAUSTIC = false;

// How large footprints are: FOOTPRINT_*.
layout(constant_id = 21) const uint FOOTPRINT = 0;
const uint FOOTPRINT_DIFFERENTIAL = 0u; /// Photon differentials (Fabianowski and Dingliana 2009).
const uint FOOTPRINT_DENSITY = 1u; /// Discs by path density (Mara, Luebke and McGuire 2013, equations 4 and 5).
const uint FOOTPRINT_FIXED = 2u;   /// Discs of one radius in every pass.
const uint FOOTPRINT_NONE = 3u;    /// A light vertex takes the deposit's place, to be connected to the camera.
const float CONE = 1e-3; // steradians

layout(push_constant, scalar) uniform Params {
    float smoothing; // the paper's s for this class of photons
    uint bounce;
    float radius_min; // of discs, in scene units at the first pass
    float radius_max; // also the fixed radius; of ellipses, in scene radii at the first pass
} params;

layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) buffer Rays { vec4 rays[]; };
layout(set = 0, binding = 19, scalar) readonly buffer Hits { uvec4 hits[]; };
layout(set = 0, binding = 20, scalar) buffer Flux { vec4 flux[]; };
layout(set = 0, binding = 21, scalar) buffer States { uint states[]; };
layout(set = 0, binding = 22, scalar) buffer Differentials { Differential differentials[]; };
layout(set = 0, binding = 23, scalar) writeonly buffer Alive { uint alive[]; };
layout(set = 0, binding = 24, scalar) writeonly buffer Stored { uint stored[]; };
layout(set = 0, binding = 25, scalar) writeonly buffer Pending { Photon pending[]; };
layout(set = 0, binding = 26, scalar) writeonly buffer PendingBoxes { Aabb pending_boxes[]; };
layout(set = 0, binding = 27, scalar) buffer Counters { uint counters[]; };
#include "lib/textures.glsl"
#include "lib/bsdf.glsl"
#include "lib/intersect.glsl"
#include "lib/surface.glsl"
#include "lib/footprint.glsl"
#include "lib/scatter.glsl"

// The photon where it met the surface, without a footprint (Photon in shared/photon.glsl).
void leave_vertex(uint j, Hit hit, vec3 d, vec3 light) {
    Photon p;
    p.a = pack_hit(hit);
    p.b = uvec4(floatBitsToUint(light), oct_encode(d));
    p.c = uvec4(0u);
    p.d = uvec4(0u, 0u, 0u, floatBitsToUint(CAUSTIC ? -1.0 : 1.0));
    pending[j] = p;
    stored[j] = 1u;
}

// The footprint that the differentials give, within its limits; false if it is not finite.
bool differential_ellipse(Surface s, Differential f, out Ellipse e) {
    // The paper's further factor |dp|^(-3/4) for diffusely reflected photons is left out: it has a unit of length, and no
    // unit suits both a cup and the table that it stands on.
    float scale = params.smoothing * pass[0].radius_scale;
    e = principal_axes(scale * f.dp_u, scale * f.dp_v, s.geometric);
    float unit = globals[0].radius * pass[0].radius_scale;
    float smallest = MIN_RADIUS * unit, largest = params.radius_max * unit;
    if (!(e.longer < 3.0e38)) {
        atomicAdd(counters[COUNT_NOT_FINITE], 1u);
        return false;
    }
    if (e.shorter < smallest) atomicAdd(counters[COUNT_MIN_RADIUS], 1u);
    if (e.longer > largest) atomicAdd(counters[COUNT_MAX_RADIUS], 1u);
    e.longer = clamp(e.longer, smallest, largest);
    e.shorter = clamp(e.shorter, smallest, largest);
    if (e.longer > MAX_ANISOTROPY * e.shorter) {
        atomicAdd(counters[COUNT_ANISOTROPY], 1u);
        e.shorter = e.longer / MAX_ANISOTROPY;
    }
    return true;
}

void deposit(uint j, Surface s, vec3 d, vec4 photon_flux, Differential f, float path_density) {
    if (!(-dot(d, s.geometric) > 1e-5)) {
        atomicAdd(counters[COUNT_GRAZING], 1u);
        return;
    }
    if (!(max_component(photon_flux.rgb) < 3.0e38)) {
        atomicAdd(counters[COUNT_NOT_FINITE], 1u);
        return;
    }
    Ellipse e;
    if (FOOTPRINT == FOOTPRINT_DIFFERENTIAL) {
        if (!differential_ellipse(s, f, e)) return;
    } else {
        basis(s.geometric, e.major, e.minor);
        float r = mix(params.radius_min, params.radius_max, sqrt(max(0.0, 1.0 - path_density)));
        e.longer = FOOTPRINT == FOOTPRINT_FIXED ? params.radius_max : r * pass[0].radius_scale;
        e.shorter = e.longer;
    }
    float slab = SLAB * e.longer;
    float area = PI * e.longer * e.shorter;
    Photon p;
    p.a = uvec4(floatBitsToUint(s.position), oct_encode(s.geometric));
    p.b = uvec4(floatBitsToUint(photon_flux.rgb), oct_encode(d));
    p.c = uvec4(floatBitsToUint(e.major / e.longer), 0u);
    p.d = uvec4(floatBitsToUint(e.minor / e.shorter), floatBitsToUint(CAUSTIC ? -1.0 / area : 1.0 / area));
    vec3 extent = sqrt(e.major * e.major * (e.longer * e.longer) + e.minor * e.minor * (e.shorter * e.shorter)) + slab * abs(s.geometric);
    pending[j] = p;
    pending_boxes[j] = Aabb(s.position - extent, s.position + extent);
    stored[j] = 1u;
}

// The chosen continuation of a photon.
struct Event {
    vec3 direction;
    vec3 weight;       // on the flux, probability divided out
    float probability; // 0: absorbed
    uint state;
    float density;     // of the scattering per steradian, infinite for mirrors and glass
};

// Spread of a rough lobe, added to the specular derivative: the spacing that all photons of this light would have if they
// were sent into the lobe from here. It vanishes towards the mirror (our extension; the papers leave glossy out).
float lobe_spread(Surface s, vec3 wo, vec3 facet, float spacing) {
    float pdf = lobe_density(s, wo, facet);
    return isinf(pdf) ? 0.0 : spacing * inversesqrt(4.0 * PI * max(pdf, 1e-6));
}

void specular_step(inout Differential f, Surface s, Facet facet, vec3 d, vec3 n, vec3 out_direction, float eta, bool transmitted, float spread) {
    vec3 dn_u = vec3(0.0), dn_v = vec3(0.0);
    if (SMOOTH_NORMALS) {
        dn_u = normal_derivative(f.dp_u, s.e1, s.e2, facet.dn1, facet.dn2, facet.normal);
        dn_v = normal_derivative(f.dp_v, s.e1, s.e2, facet.dn1, facet.dn2, facet.normal);
    }
    if (transmitted) {
        f.dd_u = refract_derivative(f.dd_u, d, n, dn_u, eta, out_direction);
        f.dd_v = refract_derivative(f.dd_v, d, n, dn_v, eta, out_direction);
    } else {
        f.dd_u = reflect_derivative(f.dd_u, d, n, dn_u);
        f.dd_v = reflect_derivative(f.dd_v, d, n, dn_v);
    }
    vec3 t, b;
    basis(out_direction, t, b);
    f.dd_u += spread * t;
    f.dd_v += spread * b;
}

// Correction for shading normals in light transport (Veach 1997, section 5.3.2), bounded.
float shading_correction(Surface s, vec3 wi, vec3 wo) {
    if (!SMOOTH_NORMALS) return 1.0;
    float above = abs(dot(wi, s.shading)) * abs(dot(wo, s.geometric));
    float below = abs(dot(wi, s.geometric)) * abs(dot(wo, s.shading));
    return below > 0.0 ? min(above / below, 4.0) : 0.0;
}

Event scatter(Surface s, Facet facet, vec3 d, uint state, float spacing, uint seed, inout Differential f) {
    Event e = Event(vec3(0.0), vec3(0.0), 0.0, state, INFINITY);
    float choice = unit_float(hash(seed ^ 0x68bc21ebu));
    vec2 u = vec2(unit_float(hash(seed ^ 0x02e5be93u)), unit_float(hash(seed ^ 0x967a889bu)));
    uint medium = state & PATH_MEDIUM_MASK;
    float p_diffuse = 0.0, p_reflect = 0.0, p_transmit = 0.0;
    vec3 h = s.shading, fresnel = vec3(0.0), r = d, t = d;
    bool glass = GLASS && max_component(s.transmission) > 0.0;
    bool gathered_glossy = GLOSSY && has_gathered_glossy(s) && !glass;
    bool volume = (s.flags & MATERIAL_VOLUME) != 0u;
    float eta = volume ? (s.front ? 1.0 / s.ior : s.ior) : 1.0;
    if (GLOSSY && (glass || s.f90 > 0.0 || max_component(s.f0) > 0.0)) {
        Reflection reflection = sample_reflection(s, d, u, glass, volume ? eta : 1.0 / s.ior);
        h = reflection.facet;
        float cosine = reflection.cosine;
        fresnel = reflection.fresnel;
        r = reflection.direction;
        bool wanted = !CAUSTIC || !gathered_glossy;
        p_reflect = wanted ? reflection.chance : 0.0;
        float k = 1.0 - eta * eta * (1.0 - cosine * cosine);
        if (glass && k > 0.0) {
            t = eta * d + (eta * cosine - sqrt(k)) * h;
            t = normalize(t);
            p_transmit = dot(t, s.geometric) < 0.0 ? max_component((1.0 - fresnel) * s.transmission) * facet_weight(s, -d, t) : 0.0;
        }
    }
    if (!CAUSTIC) p_diffuse = diffuse_chance(s, d);
    float norm = chance_norm(p_diffuse + p_reflect + p_transmit, true);
    p_diffuse *= norm;
    p_reflect *= norm;
    p_transmit *= norm;
    if (choice < p_reflect) {
        e.direction = r;
        e.probability = p_reflect;
        e.weight = fresnel * (facet_weight(s, -d, r) / p_reflect);
        e.state |= gathered_glossy ? PATH_DIFFUSE : PATH_SPECULAR;
        if (FOOTPRINT == FOOTPRINT_DENSITY) e.density = lobe_density(s, -d, h);
        specular_step(f, s, facet, d, h, r, eta, false, lobe_spread(s, -d, h, spacing));
    } else if (choice < p_reflect + p_transmit) {
        e.direction = t;
        e.probability = p_transmit;
        e.weight = (1.0 - fresnel) * s.transmission * (facet_weight(s, -d, t) / p_transmit);
        medium = volume ? (s.front ? path_medium(s.material) : 0u) : medium;
        e.state = (e.state & ~PATH_MEDIUM_MASK) | medium | PATH_SPECULAR;
        if (FOOTPRINT == FOOTPRINT_DENSITY) e.density = lobe_density(s, -d, h);
        // A thin sheet bends light back at once: the derivative of the direction is unchanged.
        if (volume) specular_step(f, s, facet, d, h, t, eta, true, lobe_spread(s, -d, h, spacing));
    } else if (choice < p_reflect + p_transmit + p_diffuse) {
        vec3 reflectance;
        e.direction = sample_diffuse(s, d, u, reflectance);
        bool above = dot(e.direction, s.geometric) > 0.0;
        e.probability = above ? p_diffuse : 0.0;
        e.weight = reflectance * (shading_correction(s, -d, e.direction) / p_diffuse);
        e.state |= PATH_DIFFUSE;
        e.density = max(dot(e.direction, s.shading), 0.0) / PI;
        // Absorption and re-emission (eq. 13): as if it had started v behind the surface, with v keeping the footprint's area.
        vec3 x, y;
        basis(e.direction, x, y);
        // In units of the longest component: fourth powers of lengths neither under- nor overflow.
        float unit = max(max_component(abs(f.dp_u)), max_component(abs(f.dp_v)));
        float v = unit > 0.0 ? unit * sqrt(length(cross(f.dp_u / unit, f.dp_v / unit))) / spacing : 0.0;
        f.dd_u = spacing * x;
        f.dd_v = spacing * y;
        f.dp_u = v * f.dd_u;
        f.dp_v = v * f.dd_v;
    }
    return e;
}

void main() {
    uint j = linear_id();
    if (j >= count[0]) return;
    alive[j] = 0u;
    stored[j] = 0u;
    uint slot = list[j];
    Hit hit = unpack_hit(hits[slot]);
    vec4 photon_flux = flux[slot];
    if (hit.triangle == BVH_MISS || max_component(photon_flux.rgb) <= 0.0) return;
    vec3 d = rays[2u * slot + 1u].xyz;
    uint state = states[slot];
    Facet facet;
    Surface s = load_surface(hit, d, facet);
    Differential f = Differential(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
    if (FOOTPRINT != FOOTPRINT_NONE) f = differentials[slot];
    if (ABSORPTION) {
        uint medium = state & PATH_MEDIUM_MASK;
        bool leaving = !s.front && (s.flags & MATERIAL_VOLUME) != 0u && max_component(s.transmission) > 0.0;
        uint inside = leaving ? s.material + 1u : medium;
        if (inside != 0u) photon_flux.rgb *= exp(-materials[inside - 1u].absorption * hit.t);
    }
    Event e;
    if (ALPHA_MASK && s.opacity == 0.0) {
        f.dp_u += hit.t * f.dd_u;
        f.dp_v += hit.t * f.dd_v;
        e = Event(d, vec3(1.0), 1.0, state, INFINITY);
    } else {
        if (FOOTPRINT != FOOTPRINT_NONE) transfer(f, d, s.geometric, hit.t);
        bool kind = CAUSTIC ? (state & PATH_SPECULAR) != 0u : (state & PATH_DIFFUSE) != 0u;
        bool gathers = has_diffuse(s) || (GLOSSY && has_gathered_glossy(s));
        if (kind && gathers) {
            if (FOOTPRINT == FOOTPRINT_NONE) leave_vertex(j, hit, d, photon_flux.rgb);
            else deposit(j, s, d, photon_flux, f, rays[2u * slot + 1u].w);
        }
        uint seed = hash2(hash2(pass[0].seed ^ (CAUSTIC ? 0x9d2c5681u : 0x2545f491u), pass[0].index), slot * 256u + params.bounce);
        e = scatter(s, facet, d, state, photon_flux.w, seed, f);
    }
    if (!(e.probability > 0.0)) return;
    // Survivors stand for those that were absorbed: each covers 1 / p of the area.
    scale(f, inversesqrt(e.probability));
    rays[2u * slot] = vec4(offset_point(s.position, s.e1, s.e2, e.direction), 0.0);
    // Path density: the product of the probabilities of scattering into CONE around the direction that was taken.
    float path_density = rays[2u * slot + 1u].w * min(1.0, e.density * CONE);
    rays[2u * slot + 1u] = vec4(e.direction, path_density);
    flux[slot] = vec4(photon_flux.rgb * e.weight, photon_flux.w);
    states[slot] = e.state;
    if (FOOTPRINT != FOOTPRINT_NONE) differentials[slot] = f;
    alive[j] = max_component(e.weight) > 0.0 ? 1u : 0u;
}
