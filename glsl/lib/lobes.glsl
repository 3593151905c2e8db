// Tables of what rough lobes reflect, worked out by src/kernels/lobes/table.rs. The buffer `lobes` holds the table of
// reflection, then those of rough boundaries of glass: one row for each roughness, evenly spread, and in it one entry
// for each cosine, its square root evenly spread, and the mean over all directions.
//
// Single scattering loses the light that meets a second facet. A scale for each direction gives it back; it is
// symmetric, so that photons and eye paths agree.

const uint LOBE_ROUGHNESSES = 32u; /// Rows of the tables of lobes.
const uint LOBE_COSINES = 48u; /// Entries of a row without the mean.
const float LOBE_MAX_SCALE = 4.0; /// Scales are stored as a part of it.
const uint LOBE_ROW = LOBE_COSINES + 1u;

// What a lobe of reflection does with light at an angle.
struct LobeEntry {
    float scale;       // factor on single scattering, for each of the two directions
    float single;      // albedo of single scattering with reflectance 1
    float edge;        // the same with reflectance (1 - cos)^5
    float edge_scaled; // the same, scaled
};

// Rows around a roughness, entries around a cosine: the first, and the share of the second.
uint lobe_place(float squared, uint count, out float share) {
    float place = sqrt(clamp(squared, 0.0, 1.0)) * float(count - 1u);
    uint first = min(uint(place), count - 2u);
    share = place - float(first);
    return first;
}

vec4 lobe_words(uint entry) {
    return vec4(unpackUnorm2x16(lobes[2u * entry]), unpackUnorm2x16(lobes[2u * entry + 1u]));
}

LobeEntry lobe_of(vec4 words) {
    return LobeEntry(LOBE_MAX_SCALE * words.x, words.y, words.z, words.w);
}

LobeEntry lobe_entry(float alpha, float cosine) {
    float down, along;
    uint row = lobe_place(alpha, LOBE_ROUGHNESSES, down);
    uint at = LOBE_ROW * row + lobe_place(cosine, LOBE_COSINES, along);
    vec4 upper = mix(lobe_words(at), lobe_words(at + 1u), along);
    vec4 lower = mix(lobe_words(at + LOBE_ROW), lobe_words(at + LOBE_ROW + 1u), along);
    return lobe_of(mix(upper, lower, down));
}

// The mean over all directions, weighted by their cosines.
LobeEntry lobe_mean(float alpha) {
    float down;
    uint at = LOBE_ROW * lobe_place(alpha, LOBE_ROUGHNESSES, down) + LOBE_COSINES;
    return lobe_of(mix(lobe_words(at), lobe_words(at + LOBE_ROW), down));
}

// Albedo of single scattering by a rough boundary of glass whose table begins at `table`, outside and inside.
vec2 boundary_albedo(uint table, float alpha, float cosine) {
    float down, along;
    uint row = lobe_place(alpha, LOBE_ROUGHNESSES, down);
    uint at = table + LOBE_ROW * row + lobe_place(cosine, LOBE_COSINES, along);
    vec2 upper = mix(unpackUnorm2x16(lobes[at]), unpackUnorm2x16(lobes[at + 1u]), along);
    at += LOBE_ROW;
    return mix(upper, mix(unpackUnorm2x16(lobes[at]), unpackUnorm2x16(lobes[at + 1u]), along), down);
}

vec2 boundary_mean(uint table, float alpha) {
    float down;
    uint at = table + LOBE_ROW * lobe_place(alpha, LOBE_ROUGHNESSES, down) + LOBE_COSINES;
    return mix(unpackUnorm2x16(lobes[at]), unpackUnorm2x16(lobes[at + LOBE_ROW]), down);
}
