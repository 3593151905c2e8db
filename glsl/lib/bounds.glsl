// Bounds of photons in the picture: what the rasteriser draws so that each pixel whose eye hit may lie in a photon's
// footprint gets a fragment (Mara, Luebke and McGuire 2013: "2.5D bounds" and "3D bounds").
//
// An eye hit lies anywhere within its pixel, while a bound is sampled at the pixel's middle: bounds are wider by half
// of a pixel's diagonal.

// The camera's axes (x to the right, y down, z into the picture) and its picture on the plane at distance 1, or on any
// plane if the camera is orthographic.
struct View {
    vec3 position;
    vec3 x;
    vec3 y;
    vec3 z;
    vec2 half_size;
    float reach;   // half of a pixel's diagonal, and a tenth of a pixel for rounding to the rasteriser's grid
    bool parallel;
};

// The ball around a photon's footprint, in the axes of the view.
struct Ball {
    vec3 centre;
    float radius;
};

// The rows of the picture that are drawn.
struct Rows {
    float first;
    float count;
    float all; // of the image
};

View view_of(Camera c) {
    vec2 half_size = vec2(length(c.right), length(c.up));
    vec2 pixel = 2.0 * half_size / vec2(c.width, c.height);
    float reach = 0.5 * length(pixel) + 0.1 * max(pixel.x, pixel.y);
    vec3 z = normalize(c.forward);
    return View(c.position, c.right / half_size.x, -c.up / half_size.y, z, half_size, reach, c.orthographic != 0u);
}

Ball ball_of(Photon p, View v) {
    vec3 position = uintBitsToFloat(p.a.xyz), offset = position - v.position;
    float longer = inversesqrt(inverse_longer2(p));
    // The normal of the slab is rounded to 4e-5 rad; hits and photons far from the origin are rounded in space.
    float rounding = 1e-4 * longer + 1e-6 * max_component(max(abs(position), abs(v.position)));
    vec3 centre = vec3(dot(offset, v.x), dot(offset, v.y), dot(offset, v.z));
    return Ball(centre, longer * sqrt(1.0 + SLAB * SLAB) + rounding);
}

// Distance from the middle of the picture, along a unit vector n in it, of the line across n that touches the ball's
// outline: the plane through that line and the eye touches the ball. z > radius.
float outline_distance(Ball b, View v, vec2 n) {
    float u = dot(n, b.centre.xy), z = b.centre.z, r = b.radius;
    if (v.parallel) return u + r;
    return (u * z + r * sqrt(max(u * u + z * z - r * r, 0.0))) / (z * z - r * r);
}

// Whether the ball lies on the far side of the line n . p = distance in the picture.
bool is_beyond(Ball b, View v, vec2 n, float distance) {
    float u = dot(n, b.centre.xy);
    if (v.parallel) return u - b.radius > distance;
    return u - distance * b.centre.z > b.radius * sqrt(1.0 + distance * distance);
}

bool may_be_seen(Ball b, View v, Rows rows) {
    if (!(b.centre.z + b.radius > 0.0)) return false;
    vec2 side = v.half_size + v.reach;
    float row = 2.0 * v.half_size.y / rows.all;
    float top = rows.first * row - side.y, bottom = (rows.first + rows.count) * row - v.half_size.y + v.reach;
    return !(is_beyond(b, v, vec2(1.0, 0.0), side.x) || is_beyond(b, v, vec2(-1.0, 0.0), side.x) ||
             is_beyond(b, v, vec2(0.0, 1.0), bottom) || is_beyond(b, v, vec2(0.0, -1.0), -top));
}

// A point x, y of the plane at distance z, in clip space without depth.
vec3 to_clip(View v, Rows rows, vec2 p, float z) {
    float y = p.y * rows.all / (v.half_size.y * rows.count) + z * ((rows.all - 2.0 * rows.first) / rows.count - 1.0);
    return vec3(p.x / v.half_size.x, y, z);
}

// Depths only cull: they fall with the distance and are the same over a whole bound, that of its nearest point, so that
// hits in front of the ball are left out. Every distance of an eye hit is far above DEPTH_UNIT.
const float DEPTH_UNIT = 1e-12;
const float DEPTH_OF_NO_HIT = 1.0;
const float DEPTH_AT_EYE = 0.5;

float depth_of_hit(float z) {
    return DEPTH_UNIT / max(z, 4.0 * DEPTH_UNIT);
}

float depth_of_ball(Ball b) {
    // Nearer than any hit in the ball by more than rounding.
    float nearest = b.centre.z - b.radius;
    return nearest > 4.0 * DEPTH_UNIT ? DEPTH_UNIT / nearest * (1.0 + 1e-5) : DEPTH_AT_EYE;
}

// Polygons in the picture ------------------------------------------------------------------------------------------

// Whether the ball's outline is not an ellipse of moderate size.
bool fills_picture(Ball b, View v) {
    if (v.parallel) return false;
    float z = b.centre.z, r = b.radius, z2r2 = z * z - r * r;
    float most = 8.0 * max(v.half_size.x, v.half_size.y);
    return !(z > 1.001 * r) || r * sqrt(dot(b.centre.xy, b.centre.xy) + z2r2) > most * z2r2;
}

// Normal of side k of `corners` of the polygon. Crowded across the ellipse's longer axis, which points away from the
// middle of the picture, as those of a regular polygon stretched to the ellipse would be.
vec2 side_normal(Ball b, View v, uint k, uint corners) {
    float far2 = dot(b.centre.xy, b.centre.xy), angle = 2.0 * PI * (float(k) + 0.5) / float(corners);
    vec2 away = far2 > 0.0 ? b.centre.xy * inversesqrt(far2) : vec2(1.0, 0.0);
    float z2r2 = b.centre.z * b.centre.z - b.radius * b.radius;
    float stretch = v.parallel ? 1.0 : min(sqrt((far2 + z2r2) / z2r2), 8.0);
    vec2 n = normalize(vec2(cos(angle), sin(angle) * stretch));
    return n.x * away + n.y * vec2(-away.y, away.x);
}

// Corner `index` of a strip of `corners` vertices that covers the ball's outline: the outline's tangents, moved
// outward.
vec4 polygon_corner(Ball b, View v, Rows rows, uint index, uint corners) {
    float depth = depth_of_ball(b);
    if (fills_picture(b, v)) {
        uint corner = min(index, 3u);
        return vec4((corner & 1u) != 0u ? 1.1 : -1.1, (corner & 2u) != 0u ? 1.1 : -1.1, depth, 1.0);
    }
    // From side to side of the convex polygon: 0, last, 1, last but one, ...
    uint k = (index & 1u) == 0u ? index / 2u : corners - (index + 1u) / 2u;
    vec2 n = side_normal(b, v, k, corners), m = side_normal(b, v, k + 1u == corners ? 0u : k + 1u, corners);
    float s = outline_distance(b, v, n) + v.reach, t = outline_distance(b, v, m) + v.reach;
    vec2 p = vec2(s * m.y - t * n.y, t * n.x - s * m.x) / (n.x * m.y - n.y * m.x);
    return vec4(to_clip(v, rows, p, 1.0).xy, depth, 1.0);
}

// Icosahedra in space ----------------------------------------------------------------------------------------------

const uint ICOSAHEDRON_CORNERS = 60u; /// Corners of the twenty triangles of an icosahedron.

// Around the unit ball.
const float A = 0.66158454;
const float B = 1.07046627;
const float ICOSAHEDRON_RADIUS = 1.25840857;
const vec3 ICOSAHEDRON[12] = vec3[](
    vec3(0.0, A, B), vec3(A, B, 0.0), vec3(B, 0.0, A), vec3(0.0, A, -B),
    vec3(A, -B, 0.0), vec3(-B, 0.0, A), vec3(0.0, -A, B), vec3(-A, B, 0.0),
    vec3(B, 0.0, -A), vec3(0.0, -A, -B), vec3(-A, -B, 0.0), vec3(-B, 0.0, -A)
);
// Counter-clockwise as seen from outside.
const uint ICOSAHEDRON_FACES[ICOSAHEDRON_CORNERS] = uint[](
    0u, 2u, 1u, 0u, 1u, 7u, 0u, 6u, 2u, 0u, 5u, 6u, 0u, 7u, 5u,
    1u, 2u, 8u, 1u, 3u, 7u, 1u, 8u, 3u, 2u, 6u, 4u, 2u, 4u, 8u,
    3u, 11u, 7u, 3u, 8u, 9u, 3u, 9u, 11u, 4u, 6u, 10u, 4u, 9u, 8u,
    4u, 10u, 9u, 5u, 10u, 6u, 5u, 7u, 11u, 5u, 11u, 10u, 9u, 10u, 11u
);

vec4 icosahedron_corner(Ball b, View v, Rows rows, uint index) {
    float depth = depth_of_ball(b);
    // A hit of the ball, moved sideways to the middle of its pixel.
    float radius = 1.00001 * (b.radius + v.reach * (v.parallel ? 1.0 : b.centre.z + b.radius));
    vec3 p = b.centre + radius * ICOSAHEDRON[ICOSAHEDRON_FACES[index]];
    if (v.parallel) return vec4(to_clip(v, rows, p.xy, 1.0).xy, depth, 1.0);
    // Divided here where that can be done: the depth is then exact.
    if (b.centre.z > 1.01 * ICOSAHEDRON_RADIUS * radius) {
        return vec4(to_clip(v, rows, p.xy / p.z, 1.0).xy, depth, 1.0);
    }
    return vec4(to_clip(v, rows, p.xy, p.z).xy, DEPTH_AT_EYE * p.z, p.z);
}
