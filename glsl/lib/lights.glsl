// Choosing a light by power, and sampling it from a point. Include lib/environment.glsl and lib/guide.glsl before.

// First light whose cumulative probability is above u; u becomes uniform again inside of the chosen interval.
uint choose_light(inout float u) {
    uint low = 0u, high = globals[0].light_count - 1u;
    while (low < high) {
        uint middle = (low + high) >> 1;
        if (lights[middle].cumulative > u) high = middle;
        else low = middle + 1u;
    }
    float before = low == 0u ? 0.0 : lights[low - 1u].cumulative;
    u = clamp((u - before) / max(lights[low].cumulative - before, 1e-12), 0.0, 0.99999994);
    return low;
}

// KHR_lights_punctual's recommended falloff between the cones.
float spot_falloff(Light l, float cosine) {
    float t = clamp((cosine - l.cos_outer) / max(l.cos_inner - l.cos_outer, 1e-6), 0.0, 1.0);
    return t * t;
}

// Barycentrics of the second and third corner of a point of a lamp, uniform for a uniform `u`. The order of these
// corners does not matter: a lamp that is turned over is sampled alike.
vec2 lamp_point(BvhTriangle corners, vec2 u) {
    vec2 b = uniform_triangle(u);
    vec3 edge = corners.v2.xyz - corners.v1.xyz;
    float first = edge.x != 0.0 ? edge.x : (edge.y != 0.0 ? edge.y : edge.z);
    return first < 0.0 ? b.yx : b;
}

// Bound of the error of the distance of a hit, as a part of it: eight roundings.
const float HIT_ERROR = 9.5367431640625e-7; // 2^-20

struct LightSample {
    vec3 to_light;  // unit
    vec3 target;    // point on the light; for parallel light a point outside of the scene
    vec3 weight;    // radiance over density per solid angle, or the limit of that for delta lights
    bool delta;     // cannot be hit by a followed path
    bool far;       // comes from infinity
    float density;  // of to_light per solid angle, the choice of the light included; 0 for delta lights
};

// The region of a point in which samples of the environment have a guide.
uint sample_region(vec3 position) {
    return GUIDED_SAMPLES && ENVIRONMENT && globals[0].guide_samples > 0u ? guide_region(position) : 0u;
}

// A sample of a light from a point; `region` is the point's.
LightSample sample_light(uint index, vec3 position, uint region, vec2 u) {
    Light l = lights[index];
    LightSample s = LightSample(vec3(0.0, 1.0, 0.0), position, vec3(0.0), true, false, 0.0);
    if (AREA_LIGHTS && l.kind == LIGHT_TRIANGLE) {
        BvhTriangle corners = triangles[l.triangle];
        vec2 b = lamp_point(corners, u);
        vec3 e1 = corners.v1.xyz - corners.v0.xyz, e2 = corners.v2.xyz - corners.v0.xyz;
        vec3 p = triangle_point(corners.v0.xyz, e1, e2, b);
        vec3 normal = triangle_normal(e1, e2);
        vec3 offset = p - position;
        float distance = length(offset);
        s.to_light = offset / distance;
        float cosine = -dot(normal, s.to_light);
        // On the light's own error bound towards the receiver, and on that of a hit at this distance, so that the
        // shadow ray ends before the light. Without the second, one ray in thirty met a small lamp that it was sent to.
        s.target = offset_point(p, e1, e2, -s.to_light) + (cosine < 0.0 ? -normal : normal) * (distance * HIT_ERROR);
        cosine = emits_from_back(l.triangle) ? abs(cosine) : cosine;
        float share = cosine * (l.area / distance) / (distance * l.probability);
        s.weight = cosine > 0.0 ? emission_at(l.triangle, b) * share : vec3(0.0);
        s.density = cosine > 0.0 ? l.probability * (distance / l.area) * (distance / cosine) : 0.0;
        s.delta = false;
    } else if (ENVIRONMENT && l.kind == LIGHT_ENVIRONMENT) {
        float pdf, preference = 1.0;
        if (GUIDED_SAMPLES && globals[0].guide_samples > 0u) u = guide_sample(region, u, preference);
        vec3 radiance = sample_environment(u, s.to_light, pdf);
        pdf *= preference;
        s.target = position + s.to_light * (4.0 * globals[0].radius);
        s.weight = pdf > 0.0 ? radiance / (pdf * l.probability) : vec3(0.0);
        s.density = pdf * l.probability;
        s.delta = false;
        s.far = true;
    } else if (DELTA_LIGHTS && l.kind == LIGHT_DIRECTIONAL) {
        s.to_light = -l.direction;
        s.target = position + s.to_light * (4.0 * globals[0].radius);
        s.weight = l.emission / l.probability;
        s.far = true;
    } else if (DELTA_LIGHTS) {
        vec3 offset = l.position - position;
        float distance = length(offset);
        s.to_light = offset / distance;
        s.target = l.position;
        float falloff = l.kind == LIGHT_SPOT ? spot_falloff(l, -dot(s.to_light, l.direction)) : 1.0;
        s.weight = l.emission / distance / distance * (falloff / l.probability);
    }
    return s;
}
