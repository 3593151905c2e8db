// The guide of light from infinity, see src/render/scene/guide.rs. Its words: the spheres and the halos around all of
// them; cumulative probabilities of the halos; those of the rows of cells, then of the cells in each row; the same for
// each sphere that is not divided; for each column those of the spheres.

// Part of the photons that no guide leads: they start in the halos, so that no light is missed, and that what lies
// beyond the spheres is the less likely the farther it is.
const float GUIDE_PLAIN = 0.25; /// Part of the photons from infinity that no guide leads.
// The same of the samples of the environment, which have its own distribution.
const float GUIDE_PLAIN_SAMPLES = 0.4;

// Words of the probabilities of cells.
const uint GUIDE_CELL_WORDS = GUIDE_SIDE + GUIDE_CELLS;

vec4 guide_sphere(uint i) {
    uint at = GUIDE_SPHERE * i;
    return vec4(guide[at], guide[at + 1u], guide[at + 2u], guide[at + 3u]);
}

// The step of cumulative probabilities that begin at a word.
float guide_step(uint first, uint k) {
    return guide[first + k] - (k == 0u ? 0.0 : guide[first + k - 1u]);
}

// First of `count` cumulative probabilities above u, which becomes uniform again inside of its step.
uint guide_search(uint first, uint count, inout float u) {
    uint low = 0u, high = count - 1u;
    while (low < high) {
        uint middle = (low + high) >> 1;
        if (guide[first + middle] > u) high = middle;
        else low = middle + 1u;
    }
    float before = low == 0u ? 0.0 : guide[first + low - 1u];
    u = clamp((u - before) / max(guide[first + low] - before, 1e-12), 0.0, 0.99999994);
    return low;
}

// Where the probabilities of halos begin.
uint guide_first_halo() {
    return GUIDE_SPHERE * (globals[0].guide_spheres + globals[0].guide_halos);
}

// Where the probabilities of cells begin: for all spheres together, and for one.
uint guide_all_cells() {
    return guide_first_halo() + globals[0].guide_halos;
}

uint guide_cells_of(uint sphere) {
    return guide_all_cells() + GUIDE_CELL_WORDS * (1u + sphere);
}

// Where the probabilities of spheres begin, for a column.
uint guide_column(uint column) {
    return guide_cells_of(globals[0].guide_leaves) + column * globals[0].guide_spheres;
}

// Whether any place is known that photons of a light should reach.
bool guide_has(Light l) {
    if (globals[0].guide_photons == 0u || l.guide == 0u) return false;
    if (l.kind == LIGHT_ENVIRONMENT) return guide[guide_all_cells() + GUIDE_SIDE - 1u] > 0.0;
    return guide[guide_column(l.guide - 1u) + globals[0].guide_spheres - 1u] > 0.0;
}

// Numbers for a direction of the environment from uniform ones, by the probabilities of cells that begin at `first`.
vec2 guide_place(uint first, vec2 u) {
    uint row = guide_search(first, GUIDE_SIDE, u.y);
    uint cell = guide_search(first + GUIDE_SIDE * (row + 1u), GUIDE_SIDE, u.x);
    return min((vec2(cell, row) + u) / float(GUIDE_SIDE), vec2(0.99999994));
}

uvec2 guide_cell(vec2 place) {
    return min(uvec2(place * float(GUIDE_SIDE)), uvec2(GUIDE_SIDE - 1u));
}

// Probability of a cell times the number of cells.
float guide_preference(uint first, uvec2 cell) {
    float row = guide_step(first, cell.y);
    return row * guide_step(first + GUIDE_SIDE * (cell.y + 1u), cell.x) * float(GUIDE_CELLS);
}

uint guide_choose_halo(float u) {
    return globals[0].guide_spheres + guide_search(guide_first_halo(), globals[0].guide_halos, u);
}

uint guide_choose(uint column, float u) {
    return guide_search(guide_column(column), globals[0].guide_spheres, u);
}

// Whether a ray along d through a point with this offset from a sphere's centre passes beside the sphere.
bool is_beside(vec3 offset, vec3 d, float radius) {
    vec3 away = cross(offset, d); // a difference of squares would cancel
    return dot(away, away) > radius * radius;
}

// Density per area, across d, of starts through p that aim at the spheres of a column. `chosen` counts in any case: a
// start on its rim may be rounded to outside of it.
float guide_density(uint column, vec3 p, vec3 d, uint chosen) {
    float density = 0.0;
    uint first = guide_column(column);
    [[dont_unroll]] for (uint i = 0u; i < globals[0].guide_spheres; ++i) {
        vec4 sphere = guide_sphere(i);
        bool aims = i == chosen || !is_beside(p - sphere.xyz, d, sphere.w);
        if (aims) density += guide_step(first, i) / (PI * sphere.w * sphere.w);
    }
    return density;
}

// The same of starts that no guide leads.
float guide_density_plain(vec3 p, vec3 d, uint chosen) {
    float density = 0.0;
    uint first = guide_first_halo();
    [[dont_unroll]] for (uint i = 0u; i < globals[0].guide_halos; ++i) {
        vec4 halo = guide_sphere(globals[0].guide_spheres + i);
        bool aims = globals[0].guide_spheres + i == chosen || !is_beside(p - halo.xyz, d, halo.w);
        if (aims) density += guide_step(first, i) / (PI * halo.w * halo.w);
    }
    return density;
}

// The sphere that tells from where the environment lights a point: that with the least power of the point, of those
// that are not divided.
uint guide_region(vec3 p) {
    float least = INFINITY;
    uint region = 0u;
    [[dont_unroll]] for (uint i = 0u; i < globals[0].guide_leaves; ++i) {
        vec4 sphere = guide_sphere(i);
        vec3 offset = p - sphere.xyz;
        float power = dot(offset, offset) - sphere.w * sphere.w;
        if (power < least) {
            least = power;
            region = i;
        }
    }
    return region;
}

// Numbers for a sample of the environment in a region, and how many times more likely it is than without a guide.
vec2 guide_sample(uint region, vec2 u, out float preference) {
    uint first = guide_cells_of(region);
    bool plain = u.x < GUIDE_PLAIN_SAMPLES;
    u.x = plain ? u.x / GUIDE_PLAIN_SAMPLES : (u.x - GUIDE_PLAIN_SAMPLES) / (1.0 - GUIDE_PLAIN_SAMPLES);
    u.x = min(u.x, 0.99999994);
    vec2 place = plain ? u : guide_place(first, u);
    preference = mix(guide_preference(first, guide_cell(place)), 1.0, GUIDE_PLAIN_SAMPLES);
    return place;
}

// The same of a direction whose numbers are known.
float guide_sample_preference(uint region, vec2 place) {
    return mix(guide_preference(guide_cells_of(region), guide_cell(place)), 1.0, GUIDE_PLAIN_SAMPLES);
}
