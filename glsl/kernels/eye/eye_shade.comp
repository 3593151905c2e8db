// One step of the eye paths: adds emission, stores an eye hit where the surface gathers, and follows mirrors and glass
// with up to two children. A path owns a range of its pixel's slots (slot k of pixel p is k * pixels + p); splitting divides the range, and with a single slot
// left one continuation is drawn by its weight, so that no sum depends on the order of execution.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "lib/sampling.glsl"
#include "lib/scene_bindings.glsl"
#include "shared/film.glsl"
#include "shared/photon.glsl"
#include "lib/pixels.glsl"

layout(constant_id = 20) const bool AOV = false;
layout(constant_id = 21) const uint MAX_DEPTH = 24;
layout(constant_id = 22) const bool PATH = false; // path tracing: the path came by gathered lobes, too

layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) buffer Rays { vec4 rays[]; };
layout(set = 0, binding = 19, scalar) readonly buffer Hits { uvec4 hits[]; };
layout(set = 0, binding = 20, scalar) buffer Throughput { vec4 throughput[]; };
layout(set = 0, binding = 21, scalar) buffer States { uint states[]; };
layout(set = 0, binding = 22, scalar) buffer Radiance { vec4 radiance[]; };
layout(set = 0, binding = 23, scalar) writeonly buffer EyeHits { EyeHit eye_hits[]; };
layout(set = 0, binding = 24, scalar) writeonly buffer Valid { uint valid[]; };
layout(set = 0, binding = 25, scalar) writeonly buffer ChildFlags { uint child_flags[]; };
layout(set = 0, binding = 26, scalar) writeonly buffer ChildSlots { uint child_slots[]; };
layout(set = 0, binding = 27, scalar) writeonly buffer AovFirst { float aov_first[]; };
layout(set = 0, binding = 29, scalar) writeonly buffer ChildPlaces { uint child_places[]; };
layout(set = 0, binding = 28, scalar) buffer Truncated { uint truncated[]; };
#include "lib/textures.glsl"
#include "lib/bsdf.glsl"
#include "lib/intersect.glsl"
#include "lib/surface.glsl"
#include "lib/environment.glsl"
#include "lib/path.glsl"

// Below this luminance of the throughput a minor continuation is drawn by chance instead of taking a slot of its own.
const float SPLIT_THRESHOLD = 0.004;

// The path that owns a pixel's first slot overwrites the layers until it ends: what remains is the first surface that is
// not a mirror or glass.
void write_aov(uint slot, vec3 albedo, vec3 normal, float depth) {
    if (slot >= camera[0].pixels) return;
    uint at = AOV_FLOATS * slot;
    for (uint i = 0u; i < 3u; ++i) {
        aov_first[at + i] = albedo[i];
        aov_first[at + AOV_AT_NORMAL + i] = normal[i];
    }
    aov_first[at + AOV_AT_DEPTH] = depth;
}

// `triangle` with EYE_HIT_BENT where it applies.
void store_hit(uint slot, uint triangle, Surface s, vec3 to_eye, vec3 weight) {
    EyeHit h;
    h.a = uvec4(floatBitsToUint(s.position), oct_encode(s.geometric));
    h.b = uvec4(floatBitsToUint(weight * s.diffuse / PI), oct_encode(s.shading));
    h.c = uvec4(floatBitsToUint(weight), floatBitsToUint(is_glass(s) ? -s.alpha : s.alpha));
    h.d = uvec4(oct_encode(to_eye), packHalf2x16(s.f0.rg), packHalf2x16(vec2(s.f0.b, s.f90)), triangle);
    eye_hits[slot] = h;
    if (PATH) {
        uint state = states[slot];
        bool caustic = (state & (PATH_DIFFUSE | PATH_DIFFUSE_AGAIN)) == PATH_DIFFUSE && !has_diffuse(s) && !has_gathered_glossy(s);
        uint layer = (state & PATH_DIFFUSE) == 0u ? LAYER_DIRECT : caustic ? LAYER_CAUSTIC : LAYER_INDIRECT;
        radiance[slot].w = path_tag((state >> PATH_DEPTH_SHIFT) & PATH_DEPTH_MASK, layer);
    } else {
        valid[slot] = 1u;
    }
}

// Emitted light that the path meets; `light_density` is that of a light sample [1/sr] for this direction. Sampled lights
// are not seen through mirrors and glass, so what is found there counts in full.
void add_emission(uint slot, uint state, vec3 light, float light_density) {
    uint place = slot;
    if (PATH) {
        float density = rays[2u * slot + 1u].w;
        if (density > 0.0) light *= balance(density, light_density);
        place = path_place(slot, path_layer(state, density > 0.0), camera[0].pixels);
    }
    radiance[place].xyz += light;
}

// Density of a light sample at a hit [1/sr].
float emitter_density(Surface s, vec3 d, float distance) {
    return materials[s.material].light_density * sqr(distance) / max(-dot(s.geometric, d), 1e-30);
}

struct Child {
    vec3 direction;
    vec3 weight;      // factor on the throughput
    float importance; // luminance of throughput times weight; 0: absent
    uint medium;
    bool bent;        // goes on in another direction
};

// Reflection from, and transmission through, the followed lobes.
void follow(Surface s, vec3 d, vec3 through, uint medium, vec2 u, out Child reflected, out Child transmitted) {
    reflected = Child(vec3(0.0), vec3(0.0), 0.0, medium, true);
    transmitted = Child(vec3(0.0), vec3(0.0), 0.0, medium, true);
    bool glass = GLASS && max_component(s.transmission) > 0.0;
    bool glossy = s.alpha < ALPHA_GATHER && (glass || has_followed_glossy(s));
    if (!glass && !glossy) return;
    vec3 facet = sample_facet(s, -d, u);
    float cosine = clamp(-dot(facet, d), 0.0, 1.0);
    bool volume = (s.flags & MATERIAL_VOLUME) != 0u;
    float eta = volume ? (s.front ? 1.0 / s.ior : s.ior) : 1.0;
    vec3 fresnel = fresnel_schlick(s.f0, s.f90, cosine);
    if (glass) fresnel = vec3(fresnel_dielectric(cosine, volume ? eta : 1.0 / s.ior));
    vec3 r = reflect(d, facet);
    if (dot(r, s.geometric) > 0.0) {
        reflected.direction = r;
        reflected.weight = fresnel * facet_weight(s, -d, r);
        reflected.importance = luminance(through * reflected.weight);
    }
    if (!glass) return;
    float k = 1.0 - eta * eta * (1.0 - cosine * cosine);
    if (k <= 0.0) return;
    vec3 t = eta * d + (eta * cosine - sqrt(k)) * facet;
    if (dot(t, s.geometric) >= 0.0) return;
    transmitted.direction = normalize(t);
    // Radiance is divided by the square of the index on its way; a thin sheet ends where it began.
    transmitted.weight = (1.0 - fresnel) * s.transmission * (eta * eta) * facet_weight(s, -d, t);
    transmitted.importance = luminance(through * transmitted.weight);
    transmitted.medium = volume ? (s.front ? path_medium(s.material) : 0u) : medium;
}

void emit_child(uint j, uint which, uint slot, uint slots, Child c, vec3 through, Surface s, uint state) {
    vec3 origin = offset_point(s.position, s.e1, s.e2, c.direction);
    rays[2u * slot] = vec4(origin, 0.0);
    rays[2u * slot + 1u] = vec4(c.direction, 0.0);
    throughput[slot] = vec4(through * c.weight, float(slots));
    uint depth = ((state >> PATH_DEPTH_SHIFT) & PATH_DEPTH_MASK) + 1u;
    states[slot] = c.medium | (depth << PATH_DEPTH_SHIFT) | (c.bent ? PATH_SPECULAR : state & PATH_SPECULAR);
    if (PATH) states[slot] |= state & (PATH_DIFFUSE | PATH_DIFFUSE_AGAIN);
    child_flags[2u * j + which] = 1u;
    child_slots[2u * j + which] = slot;
}

void main() {
    uint j = linear_id();
    if (j >= count[0]) return;
    if (j == 0u) child_places[0] = 2u * count[0];
    child_flags[2u * j] = 0u;
    child_flags[2u * j + 1u] = 0u;
    uint slot = list[j];
    vec3 d = rays[2u * slot + 1u].xyz;
    vec3 through = throughput[slot].xyz;
    uint slots = uint(throughput[slot].w);
    uint state = states[slot];
    uint depth = (state >> PATH_DEPTH_SHIFT) & PATH_DEPTH_MASK;
    Hit hit = unpack_hit(hits[slot]);
    bool first = !PATH || (state & PATH_DIFFUSE) == 0u; // what the layers show
    if (hit.triangle == BVH_MISS) {
        vec3 sky = vec3(0.0);
        if (ENVIRONMENT && globals[0].environment_width > 0u) sky = environment_radiance(d);
        float density = PATH && ENVIRONMENT && globals[0].environment_width > 0u ? globals[0].environment_probability * environment_density(d) : 0.0;
        add_emission(slot, state, through * sky, density);
        if (AOV && first) write_aov(slot, vec3(0.0), vec3(0.0), INFINITY);
        return;
    }
    Facet facet;
    Surface s = load_surface(hit, d, facet);
    uint seen = hit.triangle | ((state & PATH_SPECULAR) != 0u ? EYE_HIT_BENT : 0u);
    uint medium = state & PATH_MEDIUM_MASK;
    if (ABSORPTION) {
        // The back of a volume's boundary was reached from inside of it, whatever the path knows of its past.
        bool leaving = !s.front && (s.flags & MATERIAL_VOLUME) != 0u && max_component(s.transmission) > 0.0;
        uint inside = leaving ? s.material + 1u : medium;
        if (inside != 0u) through *= exp(-materials[inside - 1u].absorption * hit.t);
    }
    Child pass_through = Child(d, vec3(1.0), 1.0, medium, false);
    if (ALPHA_MASK && s.opacity == 0.0) {
        if (depth >= MAX_DEPTH) atomicAdd(truncated[0], 1u);
        else {
            float density = rays[2u * slot + 1u].w, distance = rays[2u * slot].w + hit.t;
            emit_child(j, 0u, slot, slots, pass_through, through, s, state);
            if (PATH) {
                rays[2u * slot].w = distance;
                rays[2u * slot + 1u].w = density;
            }
        }
        return;
    }
    // Unlit surfaces are seen, but light nothing.
    bool shines = first || (s.flags & MATERIAL_UNLIT) == 0u;
    if (shines) add_emission(slot, state, through * s.emission, PATH ? emitter_density(s, d, rays[2u * slot].w + hit.t) : 0.0);
    if (AOV && first) {
        vec3 albedo = s.diffuse + (GLOSSY ? s.f0 : vec3(0.0)) + s.transmission;
        write_aov(slot, albedo, s.shading, dot(s.position - camera[0].position, camera[0].forward));
    }
    bool gathers = has_diffuse(s);
    if (!GLOSSY) {
        if (gathers) store_hit(slot, seen, s, -d, through);
        return;
    }
    gathers = gathers || has_gathered_glossy(s) || (DELTA_LIGHTS && has_followed_glossy(s) && s.alpha >= ALPHA_SMOOTH);
    uint seed = hash2(hash2(pass[0].seed, pass[0].index), slot_key(slot, camera[0]) + depth);
    vec2 u = vec2(unit_float(hash(seed ^ 0x1b56c4e9u)), unit_float(hash(seed ^ 0x7feb352du)));
    float choice = unit_float(hash(seed ^ 0x3c6ef372u));
    Child a, b;
    follow(s, d, through, medium, u, a, b);
    bool last = depth >= MAX_DEPTH;
    if (last && a.importance + b.importance > 0.0) {
        atomicAdd(truncated[0], 1u);
        a.importance = 0.0;
        b.importance = 0.0;
    }
    // The hit itself competes for slots only when a single one is left.
    float hit_importance = gathers ? luminance(through * (s.diffuse + s.f0)) : 0.0;
    if (gathers && slots == 1u && a.importance + b.importance > 0.0) {
        float p = clamp(hit_importance / (hit_importance + a.importance + b.importance), 0.1, 0.9);
        bool stay = choice < p;
        choice = stay ? choice / p : (choice - p) / (1.0 - p);
        if (stay) {
            store_hit(slot, seen, s, -d, through / p);
            return;
        }
        through /= 1.0 - p;
        gathers = false;
    }
    if (gathers) {
        store_hit(slot, seen, s, -d, through);
        slot += camera[0].pixels;
        slots -= 1u;
        if (slots == 0u) return;
    }
    if (a.importance + b.importance <= 0.0) return;
    bool both = slots >= 2u && min(a.importance, b.importance) > SPLIT_THRESHOLD;
    if (both) {
        uint minor = max(1u, slots / 4u);
        uint slots_a = a.importance < b.importance ? minor : slots - minor;
        emit_child(j, 0u, slot, slots_a, a, through, s, state);
        emit_child(j, 1u, slot + slots_a * camera[0].pixels, slots - slots_a, b, through, s, state);
        return;
    }
    float p = a.importance / (a.importance + b.importance);
    bool take_a = choice < p;
    Child c = take_a ? a : b;
    c.weight /= take_a ? p : 1.0 - p;
    // Paths that carry next to nothing end by Russian roulette; the survivors stand for them.
    float survive = clamp((a.importance + b.importance) * 20.0, 0.05, 1.0);
    if (unit_float(hash(seed ^ 0x9e3779b9u)) >= survive) return;
    c.weight /= survive;
    emit_child(j, 0u, slot, slots, c, through, s, state);
}
