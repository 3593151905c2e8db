// One bounce of the photons in flight: transfer of the footprint to the surface, deposit, and the next direction by
// Russian roulette over the lobes. Caustic photons follow only mirrors, glass and sharp glossy lobes; what they leave
// at gathering surfaces is light-specular+-diffuse light. Global photons take every lobe and leave light behind once
// they have met a diffuse or rough glossy surface. Together they carry all indirect light, each path once.
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
    float radius_max; // also the fixed radius; of ellipses, in units of footprints at the first pass
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
#include "lib/medium.glsl"
#include "lib/footprint.glsl"
#include "lib/scatter.glsl"
#include "lib/energy.glsl"
#include "lib/glass.glsl"

// The photon where it met the surface, without a footprint (Photon in shared/photon.glsl).
void leave_vertex(uint j, Hit hit, vec3 d, vec3 light, uint medium) {
    Photon p;
    p.a = pack_hit(hit);
    p.b = uvec4(floatBitsToUint(light), oct_encode(d));
    p.c = uvec4(medium, 0u, 0u, 0u);
    p.d = uvec4(0u, 0u, 0u, floatBitsToUint(CAUSTIC ? -1.0 : 1.0));
    pending[j] = p;
    stored[j] = 1u;
}

// Distance within which places on the surface's triangle are rounded to a few points: in smaller footprints eye hits
// would see a photon where it is rounded to, or not at all.
float place_rounding(Surface s) {
    float size = max(max(max_component(abs(s.e1)), max_component(abs(s.e2))), max_component(abs(s.position)));
    return size * 4.76837158203125e-7; // 2^-21
}

// The footprint that the differentials give, within its limits; false if it is not finite.
bool differential_ellipse(Surface s, Differential f, out Ellipse e) {
    // The paper's further factor |dp|^(-3/4) for diffusely reflected photons is left out: it has a unit of length, and
    // no unit suits both a cup and the table that it stands on.
    float scale = params.smoothing * pass[0].radius_scale;
    e = principal_axes(scale * f.dp_u, scale * f.dp_v, s.geometric);
    float unit = globals[0].footprint_unit * pass[0].radius_scale;
    float largest = params.radius_max * unit;
    float smallest = min(max(MIN_RADIUS * unit, place_rounding(s)), largest);
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

// Leaves a footprint; false if a guard refuses it.
bool deposit(uint j, Surface s, vec3 d, vec4 photon_flux, Differential f, float path_density) {
    if (!(-dot(d, s.geometric) > 1e-5)) {
        atomicAdd(counters[COUNT_GRAZING], 1u);
        return false;
    }
    Ellipse e;
    if (FOOTPRINT == FOOTPRINT_DIFFERENTIAL) {
        if (!differential_ellipse(s, f, e)) return false;
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
    vec3 in_plane = sqrt(e.major * e.major * (e.longer * e.longer) + e.minor * e.minor * (e.shorter * e.shorter));
    vec3 extent = in_plane + slab * abs(s.geometric);
    pending[j] = p;
    pending_boxes[j] = Aabb(s.position - extent, s.position + extent);
    stored[j] = 1u;
    return true;
}

// The chosen continuation of a photon.
struct Event {
    vec3 direction;
    vec3 weight;       // on the flux, probability divided out
    float probability; // 0: absorbed
    uint state;
    float density;     // of the scattering per steradian, infinite for mirrors and glass
};

// Spread of a rough lobe, added to the specular derivative: the spacing that all photons of this light would have if
// they were sent into the lobe from here. It vanishes towards the mirror (our extension; the papers leave glossy out).
float lobe_spread(Surface s, vec3 wo, vec3 facet, float spacing) {
    float pdf = lobe_density(s, wo, facet);
    return isinf(pdf) ? 0.0 : spacing * inversesqrt(4.0 * PI * max(pdf, 1e-6));
}

// Adds the spread of a lobe around a direction.
void spread_differential(inout Differential f, vec3 direction, float spread) {
    vec3 t, b;
    basis(direction, t, b);
    f.dd_u += spread * t;
    f.dd_v += spread * b;
}

// How a followed photon left a surface: by reflection or refraction about a facet.
struct SpecularStep {
    vec3 facet;     // normal of the facet
    Way way;        // after it
    float eta;      // n_incident / n_transmitted
    bool transmitted;
    float spread;   // of the lobe around the direction
};

void follow_differential(inout Differential f, Surface s, InterpolatedNormal n, vec3 d, SpecularStep to) {
    vec3 dn_u = vec3(0.0), dn_v = vec3(0.0);
    if (SMOOTH_NORMALS) {
        dn_u = normal_derivative(f.dp_u, s.e1, s.e2, n.dn1, n.dn2, n.normal);
        dn_v = normal_derivative(f.dp_v, s.e1, s.e2, n.dn1, n.dn2, n.normal);
    }
    if (to.transmitted) {
        vec3 refracted = turn(s, to.way, to.way.direction);
        f.dd_u = refract_derivative(f.dd_u, d, to.facet, dn_u, to.eta, refracted);
        f.dd_v = refract_derivative(f.dd_v, d, to.facet, dn_v, to.eta, refracted);
    } else {
        f.dd_u = reflect_derivative(f.dd_u, d, to.facet, dn_u);
        f.dd_v = reflect_derivative(f.dd_v, d, to.facet, dn_v);
    }
    f.dd_u = turn(s, to.way, f.dd_u);
    f.dd_v = turn(s, to.way, f.dd_v);
    spread_differential(f, to.way.direction, to.spread);
}

// The differential after absorption and emission by a diffuse surface (Fabianowski and Dingliana 2009, eq. 13): as if
// the photon had started v behind the surface, with v keeping the footprint's area.
void diffuse_differential(inout Differential f, vec3 direction, float spacing) {
    vec3 x, y;
    basis(direction, x, y);
    // In units of the longest component: fourth powers of lengths neither under- nor overflow.
    float unit = max(max_component(abs(f.dp_u)), max_component(abs(f.dp_v)));
    float v = unit > 0.0 ? unit * sqrt(length(cross(f.dp_u / unit, f.dp_v / unit))) / spacing : 0.0;
    // Each surface met at an angle makes footprints larger: after hundreds of them they would not be finite. Far beyond
    // the largest that is stored.
    v = min(v, 100.0 * globals[0].footprint_unit / spacing);
    f.dd_u = spacing * x;
    f.dd_v = spacing * y;
    f.dp_u = v * f.dd_u;
    f.dp_v = v * f.dd_v;
}

// Correction for shading normals in light transport (Veach 1997, section 5.3.2), bounded.
float shading_correction(Surface s, vec3 wi, vec3 wo) {
    if (!SMOOTH_NORMALS) return 1.0;
    float above = abs(dot(wi, s.shading)) * abs(dot(wo, s.geometric));
    float below = abs(dot(wi, s.geometric)) * abs(dot(wo, s.shading));
    return below > 0.0 ? min(above / below, 4.0) : 0.0;
}

// What a photon may do at a surface, and with which probabilities.
struct Choices {
    Ways ways;
    bool gathered;   // the reflection is of a gathered lobe
    float reflect;   // probabilities; what is missing to one is that of absorption
    float transmit;
    float diffuse;
};

Choices choices_at(Surface s, vec3 d, vec2 u) {
    Choices c = Choices(Ways(s.shading, 1.0, false, NO_WAY, NO_WAY), false, 0.0, 0.0, 0.0);
    c.gathered = GLOSSY && has_gathered_glossy(s);
    if (c.gathered || (GLOSSY && has_followed_glossy(s))) {
        c.ways = sample_ways(s, d, u);
        c.reflect = !CAUSTIC || !c.gathered ? c.ways.reflected.chance : 0.0;
        c.transmit = c.ways.transmitted.chance;
    }
    if (!CAUSTIC) c.diffuse = diffuse_chance(s);
    float norm = chance_norm(c.diffuse + c.reflect + c.transmit, true);
    c.diffuse *= norm;
    c.reflect *= norm;
    c.transmit *= norm;
    return c;
}

// A photon at a surface.
struct Arrival {
    Surface s;
    InterpolatedNormal n;
    vec3 d;        // direction of travel
    uint state;
    float spacing; // D of an isotropic light with this share of the photons
};

// The photon goes one of the ways, which was drawn with a probability.
Event go(Arrival a, Ways ways, Way way, float probability, inout Differential f) {
    Event e = Event(way.direction, way.weight / probability, probability, a.state, INFINITY);
    if (ways.again) {
        e.density = abs(dot(way.direction, a.s.shading)) / PI;
        diffuse_differential(f, way.direction, a.spacing);
        return e;
    }
    if (FOOTPRINT == FOOTPRINT_DENSITY) e.density = lobe_density(a.s, -a.d, ways.facet);
    bool transmitted = dot(way.direction, a.s.geometric) < 0.0;
    float spread = lobe_spread(a.s, -a.d, ways.facet, a.spacing);
    // A thin sheet bends light back at once: the derivative of the direction is unchanged.
    if (transmitted && (a.s.flags & MATERIAL_VOLUME) == 0u) spread_differential(f, way.direction, spread);
    else follow_differential(f, a.s, a.n, a.d, SpecularStep(ways.facet, way, ways.eta, transmitted, spread));
    return e;
}

Event reflect_photon(Arrival a, Choices c, inout Differential f) {
    Event e = go(a, c.ways, c.ways.reflected, c.reflect, f);
    e.state = a.state | (c.gathered ? PATH_DIFFUSE : PATH_SPECULAR);
    return e;
}

Event transmit_photon(Arrival a, Choices c, inout Differential f) {
    Event e = go(a, c.ways, c.ways.transmitted, c.transmit, f);
    uint medium = medium_behind(a.s, a.state & PATH_MEDIUM_MASK);
    e.state = (a.state & ~PATH_MEDIUM_MASK) | medium | PATH_SPECULAR;
    return e;
}

Event diffuse_photon(Arrival a, Choices c, vec2 u, inout Differential f) {
    Event e;
    vec3 reflectance;
    e.direction = sample_diffuse(a.s, u, reflectance);
    e.probability = dot(e.direction, a.s.geometric) > 0.0 ? c.diffuse : 0.0;
    e.weight = reflectance * (shading_correction(a.s, -a.d, e.direction) / c.diffuse);
    e.state = a.state | PATH_DIFFUSE;
    e.density = max(dot(e.direction, a.s.shading), 0.0) / PI;
    diffuse_differential(f, e.direction, a.spacing);
    return e;
}

Event scatter(Arrival a, uint seed, inout Differential f) {
    float choice = unit_float(hash(seed ^ SALT_LOBE));
    vec2 u = vec2(unit_float(hash(seed ^ SALT_DIRECTION_U)), unit_float(hash(seed ^ SALT_DIRECTION_V)));
    Choices c = choices_at(a.s, a.d, u);
    Event e = Event(vec3(0.0), vec3(0.0), 0.0, a.state, INFINITY);
    if (choice < c.reflect) {
        e = reflect_photon(a, c, f);
    } else if (choice < c.reflect + c.transmit) {
        e = transmit_photon(a, c, f);
    } else if (choice < c.reflect + c.transmit + c.diffuse) {
        e = diffuse_photon(a, c, u, f);
    }
    return e;
}

// The photon goes straight on where the surface is not there; `t` is the length of its ray.
Event pass_hole(Arrival a, float t, inout Differential f) {
    f.dp_u += t * f.dd_u;
    f.dp_v += t * f.dd_v;
    uint medium = medium_past(a.s, a.state & PATH_MEDIUM_MASK);
    uint state = (a.state & ~PATH_MEDIUM_MASK) | medium;
    return Event(a.d, vec3(1.0), 1.0 - a.s.opacity, state, INFINITY);
}

// What a photon takes with it where its way ends.
struct End {
    vec3 flux;
    float absorbed; // so far, of what it stands for
    uint became;    // ENERGY_*
};

// A photon's place among all of them is written by its own invocation alone, so the ledger needs no atomics.
void end_photon(uint slot, uint state, End e) {
    states[slot] = state | e.became << PATH_END_SHIFT;
    if (ABSORPTION) {
        flux[slot].rgb = e.flux;
        rays[2u * slot].w = e.absorbed;
    }
}

// Whether the photon is at a surface; if not, its way has ended.
bool arrives(uint slot, uint triangle, vec3 carried) {
    if (triangle != BVH_MISS && max_component(carried) > 0.0 && !not_finite(carried)) return true;
    bool refused = not_finite(carried);
    if (refused) atomicAdd(counters[COUNT_NOT_FINITE], 1u);
    uint became = refused ? ENERGY_CLAMPED : ENERGY_ESCAPED;
    states[slot] |= became << PATH_END_SHIFT;
    return false;
}

// What the medium takes on the way to the surface, and which it is.
void absorb(Surface s, float way, inout uint state, inout vec3 carried, inout float absorbed) {
    uint medium = medium_inside(s, state & PATH_MEDIUM_MASK);
    state = (state & ~PATH_MEDIUM_MASK) | medium;
    float before = energy_of(carried);
    carried *= transmittance(medium, way);
    absorbed += before - energy_of(carried);
}

// Seed of the decisions of a photon at this bounce.
uint seed_of(uint slot) {
    uint photons = pass[0].seed ^ (CAUSTIC ? SALT_CAUSTIC_PHOTONS : SALT_GLOBAL_PHOTONS);
    uint key = hash2(photons, pass[0].index) + (params.bounce >> 8) * 0x9e3779b9u;
    return hash2(key, slot * 256u + (params.bounce & 255u));
}

// What is kept with the direction. For FOOTPRINT_DENSITY the path density: the product of the probabilities of
// scattering into CONE around the direction that was taken. Else where a ray in a body begins (way_back).
float kept_of(Surface s, uint slot, Event e, vec3 origin) {
    if (FOOTPRINT == FOOTPRINT_DENSITY) return rays[2u * slot + 1u].w * min(1.0, e.density * CONE);
    return GLASS ? way_back(s, origin, e.direction) : 0.0;
}

void main() {
    uint j = linear_id();
    if (j >= count[0]) return;
    alive[j] = 0u;
    stored[j] = 0u;
    uint slot = list[j];
    Hit hit = unpack_hit(hits[slot]);
    vec4 photon_flux = flux[slot];
    if (!arrives(slot, hit.triangle, photon_flux.rgb)) return;
    float absorbed = rays[2u * slot].w;
    uint end = ENERGY_ABSORBED;
    vec3 d = rays[2u * slot + 1u].xyz;
    uint state = states[slot];
    InterpolatedNormal normal;
    Surface s = load_surface(hit, d, normal);
    Differential f = Differential(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
    if (FOOTPRINT != FOOTPRINT_NONE) f = differentials[slot];
    if (ABSORPTION) absorb(s, hit.t, state, photon_flux.rgb, absorbed);
    uint medium = state & PATH_MEDIUM_MASK;
    if (ALPHA_MASK) s.opacity = share_met(s, medium);
    Differential landed = f;
    if (FOOTPRINT != FOOTPRINT_NONE) transfer(landed, d, s.geometric, hit.t);
    bool kind = CAUSTIC ? (state & PATH_SPECULAR) != 0u : (state & PATH_DIFFUSE) != 0u;
    bool gathers = has_diffuse(s) || (GLOSSY && has_gathered_glossy(s));
    if (CAUSTIC && gathers) end = ENERGY_ENDED;
    if (kind && gathers && s.opacity > 0.0) {
        // Of a surface that is there in part, eye paths meet this part, which has the full flux per area. A vertex
        // stands for the light of the part.
        if (FOOTPRINT == FOOTPRINT_NONE) leave_vertex(j, hit, d, photon_flux.rgb * s.opacity, medium);
        else if (!deposit(j, s, d, photon_flux, landed, rays[2u * slot + 1u].w) && CAUSTIC) end = ENERGY_CLAMPED;
    }
    uint seed = seed_of(slot);
    Arrival at = Arrival(s, normal, d, state, photon_flux.w);
    Event e;
    if (ALPHA_MASK && unit_float(hash(seed ^ SALT_COVERAGE)) >= s.opacity) {
        e = pass_hole(at, hit.t, f);
    } else {
        f = landed;
        e = scatter(at, seed, f);
        e.probability *= s.opacity;
    }
    vec3 carried = photon_flux.rgb * e.weight;
    bool refused = e.probability > 0.0 && not_finite(carried);
    if (refused) atomicAdd(counters[COUNT_NOT_FINITE], 1u);
    if (refused || !(e.probability > 0.0) || max_component(e.weight) <= 0.0) {
        end_photon(slot, state, End(photon_flux.rgb, absorbed, refused ? ENERGY_CLAMPED : end));
        return;
    }
    // Survivors stand for those that were absorbed or went another way: each covers 1 / p of the area.
    scale(f, inversesqrt(e.probability));
    absorbed += energy_of(photon_flux.rgb) - energy_of(carried);
    vec3 origin = offset_point(s.position, s.e1, s.e2, e.direction);
    rays[2u * slot] = vec4(origin, absorbed);
    rays[2u * slot + 1u] = vec4(e.direction, kept_of(s, slot, e, origin));
    flux[slot] = vec4(carried, photon_flux.w);
    states[slot] = e.state;
    if (FOOTPRINT != FOOTPRINT_NONE) differentials[slot] = f;
    alive[j] = 1u;
}
