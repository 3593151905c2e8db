// Media that surfaces enclose. Include lib/bsdf.glsl and shared/photon.glsl before.
//
// A body fills what its surface encloses, holes or not. Of a body with alpha blending a share is there: a path that
// goes in past its surface does not meet it on the way out, and is never in its medium. A path knows the medium around
// it: what it went into last. Where it comes out of a body, and where it begins, it does not know: there
// trace_medium.comp looks.

// Whether the surface is the back of a volume's boundary: it was reached from inside of the volume, whatever a path
// knows of its past.
bool is_leaving(Surface s) {
    return !s.front && (s.flags & (MATERIAL_VOLUME | MATERIAL_BLEND)) == MATERIAL_VOLUME;
}

// The share of the surface that a path in `medium` meets.
float share_met(Surface s, uint medium) {
    const uint BOTH = MATERIAL_VOLUME | MATERIAL_BLEND;
    bool way_out = GLASS && !s.front && (s.flags & BOTH) == BOTH;
    return way_out ? (medium == s.material + 1u ? 1.0 : 0.0) : s.opacity;
}

// What a path that thinks itself in `medium` went through on its way to the surface; both are a material index + 1, or
// 0 outside of all media.
uint medium_inside(Surface s, uint medium) {
    if (is_leaving(s)) return s.material + 1u;
    return medium == MEDIUM_UNKNOWN ? 0u : medium;
}

// The medium behind the surface, for a path that goes through it; a thin sheet has none of its own.
uint medium_behind(Surface s, uint medium) {
    if ((s.flags & MATERIAL_VOLUME) == 0u) return medium;
    if (s.front) return path_medium(s.material);
    return ABSORPTION ? MEDIUM_UNKNOWN : 0u;
}

// Where the ray from a surface into a body began before its origin was moved off the surface [lengths of `d`, not above
// 0]: a body thinner than that has its other side behind the origin. 0 for rays that stay outside.
float way_back(Surface s, vec3 origin, vec3 d) {
    if ((s.flags & MATERIAL_VOLUME) == 0u) return 0.0;
    float cosine = dot(d, s.geometric);
    bool inwards = s.front ? cosine < 0.0 : cosine > 0.0;
    return inwards ? -1.001 * abs(dot(origin - s.position, s.geometric)) / max(abs(cosine), 1e-4) : 0.0;
}

// The medium behind the surface, for a path that goes past it.
uint medium_past(Surface s, uint medium) {
    return (s.flags & MATERIAL_BLEND) != 0u ? medium : medium_behind(s, medium);
}

// Share of the light that is left of it after a way through a medium.
vec3 transmittance(uint medium, float way) {
    return medium == 0u ? vec3(1.0) : exp(-materials[medium - 1u].absorption * max(way, 0.0));
}
