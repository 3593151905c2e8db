// A ray against environment maps: by false position between a point before the surface and one behind it, as in Yao et
// al. 2010, section 5 (after Szirmay-Kalos, Aszodi, Lazanyi and Premecz 2005), or by steps along the ray first.
//
// The including kernel declares, with shared/maps.glsl and lib/maps.glsl:
//   readonly buffers `texels` of MapTexel, `centres`, `triangles`
// The texels of layer l of centre c begin at (l * centres + c) * map_texels().

layout(constant_id = 42) const uint MAP_COUNT = 12; // centres
layout(constant_id = 43) const uint MAP_LAYERS = 1; // of each
layout(constant_id = 44) const uint MAP_STEPS = 0;  // for half a turn, before the search; 0: the paper's first guess
layout(constant_id = 45) const uint MAP_ITERATIONS = 5;
// Points whose direction differs from the ray's by more are rejected: one less the cosine (equation 2).
layout(constant_id = 46) const float MAP_TOLERANCE = 0.001;

// Distances that agree to this part are one.
const float MAP_AGREES = 0.001;

// In place of the ratio where a ray begins. Photons begin on surfaces, where the ratio is one: false position would
// take this for the place that it looks for, and stay there.
const float MAP_BEGIN = 0.0;

// What a map has found along a ray.
struct MapPoint {
    MapTexel texel; // no triangle: nothing
    float t;        // distance from the ray's origin
    float error;    // one less the cosine between its direction and the ray's
};

const MapPoint MAP_NO_POINT = MapPoint(MapTexel(0.0, BVH_MISS, 0.0, 0.0), 0.0, 2.0);

// The distance of what the map shows in the direction of a place, which is relative to the centre. With the paper's
// search it is that of the texel's middle. With steps it is that of the triangle's plane: beside a wall that a ray
// leaves at a small angle, the steps of distance from texel to texel would hide the ray.
float map_shown(uint first, uint centre, vec3 place) {
    MapTexel texel = texels[first + map_texel(place)];
    if (MAP_STEPS == 0u || texel.triangle == BVH_MISS) return texel.distance;
    BvhTriangle t = triangles[texel.triangle];
    vec3 normal = cross(t.v1.xyz - t.v0.xyz, t.v2.xyz - t.v0.xyz);
    float plane = dot(t.v0.xyz - centres[centre].xyz, normal) / dot(place, normal) * length(place);
    // Seen along its plane a triangle has no distance of use.
    return plane > 0.5 * texel.distance && plane < 2.0 * texel.distance ? plane : texel.distance;
}

// How far a point is from the centre, in distances of what the map shows there: below one before it, above one behind.
float map_ratio(uint first, uint centre, vec3 place) {
    return length(place) / map_shown(first, centre, place);
}

// Puts the point where the ray meets the triangle that the texel shows, if it does.
void map_meet(inout MapPoint p, BvhTriangle t, vec3 v0, vec3 origin, vec3 d) {
    vec3 e1 = t.v1.xyz - t.v0.xyz, e2 = t.v2.xyz - t.v0.xyz, to = origin - v0;
    vec3 across = cross(d, e2), beside = cross(to, e1);
    vec3 met = vec3(dot(e2, beside), dot(to, across), dot(d, beside)) / dot(e1, across);
    if (met.x > 0.0 && met.y >= 0.0 && met.z >= 0.0 && met.y + met.z <= 1.0) {
        p.t = met.x;
        p.texel.b1 = met.y;
        p.texel.b2 = met.z;
        p.error = 0.0;
    }
}

// The point that the map shows in the direction of a place; all are relative to the centre. With the paper's search it
// is the middle of the texel, which is beside a ray that has come a short way only. With steps it is where the ray
// meets the triangle, if it does.
MapPoint map_point(uint first, uint centre, vec3 origin, vec3 d, vec3 place) {
    MapPoint p = MAP_NO_POINT;
    p.texel = texels[first + map_texel(place)];
    if (p.texel.triangle == BVH_MISS) return p;
    BvhTriangle t = triangles[p.texel.triangle];
    vec3 v0 = t.v0.xyz - centres[centre].xyz;
    vec3 to = map_place(t, p.texel.b1, p.texel.b2) - centres[centre].xyz - origin;
    p.t = length(to);
    // A point where the ray begins has no direction.
    p.error = p.t > 0.0 ? 1.0 - dot(to, d) / p.t : 2.0;
    if (MAP_STEPS > 0u) map_meet(p, t, v0, origin, d);
    return p;
}

// False position from `before`, a length along the ray where it is before the surface, and `behind`; a negative one is
// not known yet.
float map_refine(uint first, uint centre, vec3 origin, vec3 d, float before, float before_ratio, float behind,
                 float behind_ratio, float at) {
    for (uint k = 0u; k < MAP_ITERATIONS; ++k) {
        vec3 place = origin + at * d;
        float shown = map_shown(first, centre, place);
        float ratio = length(place) / shown;
        if (abs(ratio - 1.0) < MAP_AGREES) break;
        if (ratio < 1.0) {
            before = at;
            before_ratio = ratio;
        } else {
            behind = at;
            behind_ratio = ratio;
        }
        if (behind < 0.0) {
            if (isinf(shown)) break;
            at += shown * (1.0 - ratio);
        } else {
            at = mix(before, behind, (1.0 - before_ratio) / (behind_ratio - before_ratio));
        }
    }
    return at;
}

// The paper's search: it begins where the ray meets the plane, at right angles to it, through what is seen from the
// centre in the direction of the ray.
MapPoint map_guess(uint first, uint centre, vec3 origin, vec3 d) {
    float shown = texels[first + map_texel(d)].distance;
    if (isinf(shown)) return MAP_NO_POINT;
    float at = max(shown - dot(origin, d), 0.0);
    at = map_refine(first, centre, origin, d, 0.0, MAP_BEGIN, -1.0, 0.0, at);
    return map_point(first, centre, origin, d, origin + at * d);
}

// Steps of equal angle, seen from the centre, from the origin to the far end of the ray. Wherever the ray goes behind
// what is shown, false position finds the place; the first one on the ray is the result.
MapPoint map_march(uint first, uint centre, vec3 origin, vec3 d) {
    float from = length(origin);
    vec3 start = origin / max(from, 1e-30);
    float angle = acos(clamp(dot(start, d), -1.0, 1.0));
    MapPoint best = MAP_NO_POINT;
    float before = 0.0, before_ratio = MAP_BEGIN;
    bool in_front = true;
    uint steps = max(uint(ceil(angle / PI * float(MAP_STEPS))), 2u);
    for (uint k = 1u; k <= steps; ++k) {
        // By the law of sines in the triangle of centre, origin and place. The last step looks where the ray ends.
        float part = min(float(k) / float(steps), 0.999);
        float at = from * sin(part * angle) / max(sin((1.0 - part) * angle), 1e-6);
        float ratio = map_ratio(first, centre, origin + at * d);
        if (ratio > 1.0 + MAP_AGREES && in_front) {
            float middle = mix(before, at, clamp((1.0 - before_ratio) / (ratio - before_ratio), 0.0, 1.0));
            float found = map_refine(first, centre, origin, d, before, before_ratio, at, ratio, middle);
            MapPoint p = map_point(first, centre, origin, d, origin + found * d);
            if (p.error <= MAP_TOLERANCE) return p;
            if (p.error < best.error) best = p;
        }
        in_front = ratio <= 1.0 + MAP_AGREES;
        if (in_front) {
            before = at;
            before_ratio = ratio;
        }
    }
    return best;
}

// What a layer of a map says of the ray from `origin` along the unit vector `d`.
MapPoint map_find(uint centre, uint layer, vec3 origin, vec3 d) {
    uint first = (layer * MAP_COUNT + centre) * map_texels();
    vec3 from = origin - centres[centre].xyz;
    if (MAP_STEPS == 0u) return map_guess(first, centre, from, d);
    return map_march(first, centre, from, d);
}

// Whether a result counts: it is near the ray.
bool map_accepts(MapPoint p) {
    return p.texel.triangle != BVH_MISS && p.error <= MAP_TOLERANCE;
}

// The hit that a result stands for.
Hit map_hit(MapPoint p) {
    return Hit(p.t, vec2(p.texel.b1, p.texel.b2), p.texel.triangle);
}
