// One step of the eye paths: adds emission, stores an eye hit where the surface gathers, and follows mirrors and glass
// with up to two children. A path owns a range of its pixel's slots (slot k of pixel p is k * pixels + p); splitting
// divides the range, and with a single slot left one continuation is drawn by its weight, so that no sum depends on the
// order of execution.
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
layout(constant_id = 22) const bool PATH = false; // path tracing: gathered lobes continue paths, too
layout(constant_id = 23) const bool TOLD = false; // photons bring what reaches a surface by mirrors and glass alone

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
#include "lib/medium.glsl"
#include "lib/eye_hit.glsl"
#include "lib/scatter.glsl"
#include "lib/glass.glsl"
#include "lib/environment.glsl"
#include "lib/guide.glsl"
#include "lib/path.glsl"

// Below this luminance of the throughput a minor continuation is drawn by chance instead of taking a slot of its own.
const float SPLIT_THRESHOLD = 0.004;

// The path that owns a pixel's first slot overwrites the layers until it ends: what remains is the first surface that
// is not a mirror or glass.
void write_aov(uint slot, vec3 albedo, vec3 normal, float depth) {
    if (slot >= camera[0].pixels) return;
    uint at = AOV_FLOATS * slot;
    for (uint i = 0u; i < 3u; ++i) {
        aov_first[at + i] = albedo[i];
        aov_first[at + AOV_AT_NORMAL + i] = normal[i];
    }
    aov_first[at + AOV_AT_DEPTH] = depth;
}

// A path where it arrives.
struct EyePath {
    uint place;     // in the list
    uint slot;      // first of its slots
    uint slots;     // number of its slots
    uint state;     // PATH_*
    vec3 direction; // of travel towards the surface
    vec3 through;   // throughput
};

uint depth_of(EyePath path) {
    return (path.state >> PATH_DEPTH_SHIFT) & PATH_DEPTH_MASK;
}

// Whether the layers show what the path meets.
bool is_shown(EyePath path) {
    return !PATH || (path.state & PATH_DIFFUSE) == 0u;
}

// Layer of the light that light samples bring to a hit of path tracing.
uint layer_of_hit(EyePath path, Surface s) {
    if ((path.state & PATH_DIFFUSE) == 0u) return LAYER_DIRECT;
    bool again = (path.state & PATH_DIFFUSE_AGAIN) != 0u;
    return again || has_diffuse(s) || has_gathered_glossy(s) ? LAYER_INDIRECT : LAYER_CAUSTIC;
}

// Stores an eye hit in the path's first slot; `weight` is the throughput.
void store_hit(EyePath path, uint triangle, Surface s, vec3 weight) {
    uint seen = triangle | ((path.state & PATH_SPECULAR) != 0u ? EYE_HIT_BENT : 0u);
    eye_hits[path.slot] = eye_hit_of(s, -path.direction, weight, seen);
    if (PATH) radiance[path.slot].w = path_tag(depth_of(path), layer_of_hit(path, s));
    else valid[path.slot] = 1u;
}

// Emitted light that the path meets; `light_density` is that of a light sample [1/sr] for this direction. Sampled
// lights are not seen through mirrors and glass, so what is found there counts in full.
void add_emission(uint slot, uint state, vec3 light, float light_density) {
    uint place = slot;
    if (PATH) {
        float density = rays[2u * slot + 1u].w;
        if (TOLD && is_told(state, density > 0.0)) return;
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

// A way on as a child.
Child child_of(EyePath path, Way way, vec3 weight, uint medium) {
    return Child(way.direction, weight, luminance(path.through * weight), medium, true);
}

// Reflection from, and transmission through, the followed lobes.
void follow(Surface s, EyePath path, vec2 u, out Child reflected, out Child transmitted) {
    uint medium = path.state & PATH_MEDIUM_MASK;
    reflected = Child(vec3(0.0), vec3(0.0), 0.0, medium, true);
    transmitted = Child(vec3(0.0), vec3(0.0), 0.0, medium, true);
    if (!has_followed_glossy(s)) return;
    Ways ways = sample_ways(s, path.direction, u);
    reflected = child_of(path, ways.reflected, ways.reflected.weight, medium);
    // Radiance is divided by the square of the index on its way; a thin sheet ends where it began.
    transmitted = child_of(path, ways.transmitted, ways.transmitted.weight * sqr(ways.eta), medium_behind(s, medium));
}

// Child `which` (0 or 1) of the path, in the slots from `slot` on.
void emit_child(EyePath path, uint which, uint slot, uint slots, Child c, Surface s) {
    vec3 origin = offset_point(s.position, s.e1, s.e2, c.direction);
    rays[2u * slot] = vec4(origin, GLASS ? way_back(s, origin, c.direction) : 0.0);
    rays[2u * slot + 1u] = vec4(c.direction, 0.0);
    throughput[slot] = vec4(path.through * c.weight, float(slots));
    uint depth = depth_of(path) + 1u;
    states[slot] = c.medium | (depth << PATH_DEPTH_SHIFT) | (c.bent ? PATH_SPECULAR : path.state & PATH_SPECULAR);
    if (PATH) states[slot] |= path.state & (PATH_DIFFUSE | PATH_DIFFUSE_AGAIN);
    child_flags[2u * path.place + which] = 1u;
    child_slots[2u * path.place + which] = slot;
}

// Density with which samples of the lights have the direction of a path that has left the scene, at the surface where
// gathered lobes drew it.
float density_of_samples(EyePath path) {
    float density = globals[0].environment_probability * environment_density(path.direction);
    if (GUIDED_SAMPLES && globals[0].guide_samples > 0u) {
        vec3 surface = rays[2u * path.slot].xyz - max(rays[2u * path.slot].w, 0.0) * path.direction;
        density *= guide_sample_preference(guide_region(surface), environment_numbers(path.direction));
    }
    return density;
}

// The path leaves the scene.
void escape(EyePath path) {
    vec3 sky = vec3(0.0);
    float density = 0.0;
    if (ENVIRONMENT && globals[0].environment_width > 0u) {
        sky = environment_radiance(path.direction);
        if (PATH) density = density_of_samples(path);
    }
    add_emission(path.slot, path.state, path.through * sky, density);
    if (AOV && is_shown(path)) write_aov(path.slot, vec3(0.0), vec3(0.0), INFINITY);
}

// Whether the path meets the surface, of which a share is there. The choices of a pixel at one depth are stratified
// over the passes.
bool is_met(EyePath path, float share) {
    if (share <= 0.0 || share >= 1.0) return share > 0.0;
    uint key = hash2(pass[0].seed ^ SALT_COVERAGE, slot_key(path.slot, camera[0]));
    return sequence1(pass[0].index, key, depth_of(path)) < share;
}

// The path goes straight on where the surface is not there; `t` is the length of its ray.
void pass_hole(EyePath path, Surface s, float t) {
    if (depth_of(path) >= MAX_DEPTH) {
        atomicAdd(truncated[0], 1u);
        return;
    }
    float density = rays[2u * path.slot + 1u].w, distance = rays[2u * path.slot].w + t;
    uint medium = medium_past(s, path.state & PATH_MEDIUM_MASK);
    Child same = Child(path.direction, vec3(1.0), 1.0, medium, false);
    emit_child(path, 0u, path.slot, path.slots, same, s);
    if (PATH) {
        rays[2u * path.slot].w = distance;
        rays[2u * path.slot + 1u].w = density;
    }
}

// Light that the surface emits, and what the layers show of it.
void emit(EyePath path, Surface s, float t) {
    bool shown = is_shown(path);
    // Unlit surfaces are seen, but light nothing.
    if (shown || (s.flags & MATERIAL_UNLIT) == 0u) {
        float density = PATH ? emitter_density(s, path.direction, rays[2u * path.slot].w + t) : 0.0;
        add_emission(path.slot, path.state, path.through * s.emission, density);
    }
    if (AOV && shown) {
        vec3 albedo = s.diffuse + (GLOSSY ? s.f0 : vec3(0.0)) + s.transmission;
        write_aov(path.slot, albedo, s.shading, dot(s.position - camera[0].position, camera[0].forward));
    }
}

// Whether photons and light samples are looked for at the surface.
bool gathers_at(Surface s) {
    bool delta_seen = DELTA_LIGHTS && has_followed_glossy(s) && s.alpha >= ALPHA_SMOOTH;
    return has_diffuse(s) || has_gathered_glossy(s) || delta_seen;
}

// With a single slot, hit and children compete for it: returns whether the hit has won and is stored. The throughput of
// what goes on makes up for what does not, and `choice` is uniform again.
bool hit_wins(inout EyePath path, uint triangle, Surface s, float children, inout float choice) {
    float own = luminance(path.through * (s.diffuse + s.f0));
    float p = clamp(own / (own + children), 0.1, 0.9);
    bool stay = choice < p;
    choice = stay ? choice / p : (choice - p) / (1.0 - p);
    if (stay) store_hit(path, triangle, s, path.through / p);
    else path.through /= 1.0 - p;
    return stay;
}

// Gives the path's slots to its children: to both if there is room and neither is faint, else to one by chance.
void split(EyePath path, Surface s, Child a, Child b, float choice, uint seed) {
    uint slot = path.slot, slots = path.slots;
    if (slots >= 2u && min(a.importance, b.importance) > SPLIT_THRESHOLD) {
        uint minor = max(1u, slots / 4u);
        uint slots_a = a.importance < b.importance ? minor : slots - minor;
        emit_child(path, 0u, slot, slots_a, a, s);
        emit_child(path, 1u, slot + slots_a * camera[0].pixels, slots - slots_a, b, s);
        return;
    }
    float p = a.importance / (a.importance + b.importance);
    bool take_a = choice < p;
    Child c = take_a ? a : b;
    c.weight /= take_a ? p : 1.0 - p;
    // Paths that carry next to nothing end by Russian roulette; the survivors stand for them.
    float survive = clamp((a.importance + b.importance) * 20.0, 0.05, 1.0);
    if (unit_float(hash(seed ^ SALT_EYE_ROULETTE)) >= survive) return;
    c.weight /= survive;
    emit_child(path, 0u, slot, slots, c, s);
}

// Stores a hit where the surface gathers, and follows mirrors and glass.
void go_on(EyePath path, uint triangle, Surface s) {
    uint seed = hash2(hash2(pass[0].seed, pass[0].index), slot_key(path.slot, camera[0]) + depth_of(path));
    vec2 u = vec2(unit_float(hash(seed ^ SALT_EYE_FACET_U)), unit_float(hash(seed ^ SALT_EYE_FACET_V)));
    float choice = unit_float(hash(seed ^ SALT_EYE_CHOICE));
    Child a, b;
    follow(s, path, u, a, b);
    if (depth_of(path) >= MAX_DEPTH && a.importance + b.importance > 0.0) {
        atomicAdd(truncated[0], 1u);
        a.importance = 0.0;
        b.importance = 0.0;
    }
    float children = a.importance + b.importance;
    if (gathers_at(s)) {
        if (path.slots == 1u && children > 0.0) {
            if (hit_wins(path, triangle, s, children, choice)) return;
        } else {
            store_hit(path, triangle, s, path.through);
            path.slot += camera[0].pixels;
            path.slots -= 1u;
            if (path.slots == 0u) return;
        }
    }
    if (children > 0.0) split(path, s, a, b, choice, seed);
}

void main() {
    uint j = linear_id();
    if (j >= count[0]) return;
    if (j == 0u) child_places[0] = 2u * count[0];
    child_flags[2u * j] = 0u;
    child_flags[2u * j + 1u] = 0u;
    uint slot = list[j];
    vec4 carried = throughput[slot];
    EyePath path = EyePath(j, slot, uint(carried.w), states[slot], rays[2u * slot + 1u].xyz, carried.xyz);
    Hit hit = unpack_hit(hits[slot]);
    if (hit.triangle == BVH_MISS) {
        escape(path);
        return;
    }
    InterpolatedNormal unused;
    Surface s = load_surface(hit, path.direction, unused);
    if (ABSORPTION) {
        uint medium = medium_inside(s, path.state & PATH_MEDIUM_MASK);
        path.state = (path.state & ~PATH_MEDIUM_MASK) | medium;
        states[slot] = path.state; // light samples at the hit are in this medium, too
        path.through *= transmittance(medium, hit.t);
    }
    if (ALPHA_MASK && !is_met(path, share_met(s, path.state & PATH_MEDIUM_MASK))) {
        pass_hole(path, s, hit.t);
        return;
    }
    emit(path, s, hit.t);
    if (GLOSSY) go_on(path, hit.triangle, s);
    else if (has_diffuse(s)) store_hit(path, hit.triangle, s, path.through);
}
