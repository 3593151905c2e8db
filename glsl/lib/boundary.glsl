// Boundaries of the surface that an eye hit lies on: where another surface stands on it (a wall on a floor), and where
// it ends (the edge of a board). Beyond them lies light of other surfaces, or none. What footprints would bring from
// there is left out, and each photon counts once more for its mirror image behind each boundary: the reflection method
// of density estimation (Schuster 1985; Silverman 1986, section 2.10). Even light stays even up to the boundary.
//
// Boundaries are lines along two axes at right angles in the surface, at most one on either side along each axis.
// Between two of them that are closer together than a footprint is wide, the footprint is made narrower, within limits:
// on what is very thin few photons would stand for much light. A hit has its own boundaries, so what it sees is even in
// even light whatever the shape of the surface is elsewhere.
//
// EyeHit.e holds them: octahedral direction of the first axis, the four distances as halves in units of the last word.

const float MOST_NARROWER = 3.0; /// By how much footprints are made narrower along an axis at most.
const float LEAST_DISTANCE = 6.103515625e-5; // in units: the least half that is not subnormal
const float BOUNDARY_FAR = 32768.0; /// In place of a distance in units: no boundary on this side.

struct Boundaries {
    bool any;
    vec3 across; // unit vectors in the surface
    vec3 along;
    vec4 reach;  // distances: towards across, against it, towards along, against it
    float unit;  // a length to measure them by
};

uvec4 boundaries_encode(vec3 across, vec4 relative, float unit) {
    relative = clamp(relative, LEAST_DISTANCE, BOUNDARY_FAR);
    return uvec4(oct_encode(across), packHalf2x16(relative.xy), packHalf2x16(relative.zw), floatBitsToUint(unit));
}

Boundaries boundaries_decode(uvec4 e, vec3 normal) {
    Boundaries b;
    float unit = uintBitsToFloat(e.w);
    b.any = unit > 0.0;
    b.unit = unit;
    b.across = oct_decode(e.x);
    b.along = cross(normal, b.across);
    b.reach = vec4(unpackHalf2x16(e.y), unpackHalf2x16(e.z)) * unit;
    return b;
}

// Whether a photon lies beyond a boundary; `place` is its place along both axes, seen from the hit.
bool boundary_hides(Boundaries b, vec2 place) {
    return any(greaterThan(place.xx * vec2(1.0, -1.0), b.reach.xy))
        || any(greaterThan(place.yy * vec2(1.0, -1.0), b.reach.zw));
}

// One axis of the boundaries, seen from a photon: how much narrower its footprint is made along it, and what brings a
// place to its mirror images, in units of the semiaxes.
struct Mirrors {
    float narrower;
    vec2 wider; // times the distance along the axis over the unit: what takes a place as far out as that makes it
    vec2 image[3];
};

// `axis` is the axis in the photon's plane, as the components of the semiaxes along it, `reach` the distances of both
// boundaries; in units, as squares of small lengths would vanish.
Mirrors mirrors_of(vec2 axis, vec2 reach, float unit) {
    Mirrors m;
    axis /= unit;
    reach /= unit;
    float half_width2 = max(dot(axis, axis), 1e-36);
    m.narrower = clamp(sqrt(half_width2) / (reach.x + reach.y), 1.0, MOST_NARROWER);
    vec2 to = axis * (2.0 * m.narrower / half_width2);
    m.wider = axis * ((m.narrower - 1.0) / half_width2);
    m.image = vec2[3](vec2(0.0), to * reach.x, to * -reach.y);
    return m;
}
