// Connects light vertices to the camera (light tracing; Veach 1997, section 10.3.4.2, with one eye vertex): each adds
// to the pixel in which its place is seen, if nothing stands between. Photons say which paths there are, and
// photon_light what one is worth: this is the density estimate with a footprint that is a point.
//
// Leaves a key per vertex, 2 * pixel + class (0 caustic, 1 other), behind all pixels where nothing is seen, and the
// light.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "lib/sampling.glsl"
#include "lib/scene_bindings.glsl"
#include "shared/photon.glsl"
#include "lib/pixels.glsl"

layout(set = 0, binding = 16, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Vertices { Photon vertices[]; };
layout(set = 0, binding = 18, scalar) writeonly buffer Keys { uint keys[]; };
layout(set = 0, binding = 19, scalar) writeonly buffer Indices { uint indices[]; };
layout(set = 0, binding = 20, scalar) writeonly buffer Splats { vec4 splats[]; };
#include "lib/textures.glsl"
#include "lib/bsdf.glsl"
#include "lib/intersect.glsl"
#include "lib/surface.glsl"
#include "lib/medium.glsl"
#include "lib/eye_hit.glsl"
#include "lib/point.glsl"

vec3 seen_along; // direction of the camera's ray to the vertex

// Whether the camera's ray meets the triangle, as eye paths have it.
bool is_met(uint index, vec2 barycentrics) {
    BvhTriangle t = triangles[index];
    bool one_sided = (floatBitsToUint(t.v1.w) & BVH_ONE_SIDED) != 0u;
    vec3 e1 = t.v1.xyz - t.v0.xyz, e2 = t.v2.xyz - t.v0.xyz;
    return !(one_sided && dot(triangle_normal(e1, e2), seen_along) > 0.0) && is_covered(index, barycentrics);
}

bool shadow_stops = false; // rays stop at holes
#define TRACE_FLAGS (BVH_ALPHA_MASKED | BVH_ONE_SIDED)
#define SHADOW_MEETS(triangle, barycentrics) is_met(triangle, barycentrics)
#define TRACE_ACCEPT(triangle, barycentrics) (shadow_stops || SHADOW_MEETS(triangle, barycentrics))
#include "lib/traverse.glsl"
#include "lib/shadow.glsl"

// How the camera sees a place.
struct View {
    uint pixel;
    vec3 to_camera;     // unit
    vec3 target;        // where the ray to the camera ends
    float distance;
    float pixels_by_area; // pixels that a unit of area there covers if it faces the camera
};

// False behind the camera and outside of the picture.
//
// A pixel shows the mean over its square on the plane at unit distance, of area a. An area dA there is cos dA / (d^2
// cos'^3 a) pixels, with d the distance and cos' the cosine at the camera; parallel rays: cos dA / a.
bool view_of(vec3 position, out View v) {
    Camera c = camera[0];
    vec3 offset = position - c.position;
    float depth = dot(offset, c.forward);
    if (!(depth > 0.0)) return false;
    bool parallel = c.orthographic != 0u;
    float size = parallel ? 1.0 : depth;
    vec2 p = vec2(dot(offset, c.right) / dot(c.right, c.right), -dot(offset, c.up) / dot(c.up, c.up)) / size;
    vec2 at = (0.5 * p + 0.5) * vec2(c.width, c.height);
    if (!(at.x >= 0.0 && at.y >= 0.0 && at.x < float(c.width) && at.y < float(c.height))) return false;
    v.pixel = pixel_index(min(uvec2(at), uvec2(c.width, c.height) - 1u), c.width, c.height);
    v.target = parallel ? position - depth * c.forward : c.position;
    v.distance = parallel ? depth : length(offset);
    v.to_camera = parallel ? -c.forward : -offset / v.distance;
    float side = 4.0 * length(c.right) * length(c.up) / (float(c.width) * float(c.height)); // area of a pixel
    // d^2 cos'^3 = depth^2 cos'
    v.pixels_by_area = parallel ? 1.0 / side : v.distance / depth / side / depth / depth;
    return true;
}

// The light that the vertex sends to the camera, as radiance of its pixel.
vec3 connect(Photon p, View v) {
    Hit hit = unpack_hit(p.a);
    InterpolatedNormal unused;
    Surface s = load_surface(hit, -v.to_camera, unused);
    seen_along = -v.to_camera;
    if (!s.front && (floatBitsToUint(triangles[hit.triangle].v1.w) & BVH_ONE_SIDED) != 0u) return vec3(0.0);
    float cosine = dot(s.geometric, v.to_camera);
    // Gathered lobes only reflect: light from behind is not seen.
    if (!(cosine > 0.0 && dot(s.geometric, oct_decode(p.b.w)) < 0.0)) return vec3(0.0);
    Point x = point_at(s, v.to_camera);
    vec3 light = x.factor * photon_light(p, x, cosine * v.pixels_by_area);
    if (light == vec3(0.0)) return light;
    vec3 origin = offset_point(s.position, s.e1, s.e2, v.to_camera);
    return light * light_between(origin, v.target, p.c.x, false);
}

void main() {
    uint j = linear_id();
    if (j >= count[0]) return;
    Photon p = vertices[j];
    Hit hit = unpack_hit(p.a);
    BvhTriangle corners = triangles[hit.triangle];
    vec3 e1 = corners.v1.xyz - corners.v0.xyz, e2 = corners.v2.xyz - corners.v0.xyz;
    View v;
    vec3 light = vec3(0.0);
    if (ALPHA_MASK) coverage_key = hash2(hash2(pass[0].seed ^ SALT_COVERAGE, pass[0].index), j);
    if (view_of(triangle_point(corners.v0.xyz, e1, e2, hit.barycentrics), v)) light = connect(p, v);
    uint unseen = 2u * camera[0].width * camera[0].height;
    uint class_bit = uintBitsToFloat(p.d.w) < 0.0 ? 0u : 1u;
    keys[j] = light == vec3(0.0) ? unseen : 2u * v.pixel + class_bit;
    indices[j] = j;
    splats[j] = vec4(light, 0.0);
}
