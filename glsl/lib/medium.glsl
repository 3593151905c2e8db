// Media that surfaces enclose. Include lib/bsdf.glsl and shared/photon.glsl before.
//
// A body fills what its surface encloses, holes or not. A path knows the medium around it: what it went into last.
// Where it comes out of a body, and where it begins, it does not know: there trace_medium.comp looks.

// Whether the surface is the back of a volume's boundary: it was reached from inside of the volume, whatever a path
// knows of its past.
bool is_leaving(Surface s) {
    return !s.front && (s.flags & MATERIAL_VOLUME) != 0u;
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

// Share of the light that is left of it after a way through a medium.
vec3 transmittance(uint medium, float way) {
    return medium == 0u ? vec3(1.0) : exp(-materials[medium - 1u].absorption * max(way, 0.0));
}
