// Equirectangular light from infinity; orientation as in src/scene/mod.rs.

vec3 environment_direction(vec2 uv) {
    float phi = 2.0 * PI * (uv.x - 0.5), theta = PI * uv.y;
    float s = sin(theta);
    return vec3(s * sin(phi), cos(theta), -s * cos(phi));
}

vec2 environment_uv(vec3 d) {
    float across = length(d.xz);
    // atan(0, 0) is undefined. The polar angle by atan keeps its digits near the poles, where acos loses half of them.
    float u = across > 0.0 ? atan(d.x, -d.z) / (2.0 * PI) + 0.5 : 0.5;
    return vec2(u, atan(across, d.y) / PI);
}

vec3 environment_texel(int x, int y) {
    int width = int(globals[0].environment_width), height = int(globals[0].environment_height);
    x = x < 0 ? x + width : (x >= width ? x - width : x);
    return environment[uint(clamp(y, 0, height - 1) * width + clamp(x, 0, width - 1))].rgb;
}

vec3 environment_radiance(vec3 d) { // bilinear; black without environment
    if (globals[0].environment_width == 0u) return vec3(0.0);
    vec2 p = environment_uv(d) * vec2(globals[0].environment_width, globals[0].environment_height) - 0.5;
    vec2 base = floor(p);
    vec2 f = p - base;
    int x = int(base.x), y = int(base.y);
    vec3 result = vec3(0.0);
    [[dont_unroll]] for (int k = 0; k < 2; ++k) {
        vec3 left = environment_texel(x, y + k);
        vec3 row = left + (environment_texel(x + 1, y + k) - left) * f.x; // a constant stays what it is
        result = k == 0 ? row : result + (row - result) * f.y;
    }
    return result;
}

// Density per solid angle with which sample_environment finds a direction; w of a texel has it per unit of the image.
float environment_density(vec3 d) {
    vec2 size = vec2(globals[0].environment_width, globals[0].environment_height);
    vec2 uv = environment_uv(d);
    uvec2 texel = min(uvec2(uv * size), uvec2(size) - 1u);
    float per_image = environment[texel.y * globals[0].environment_width + texel.x].w;
    return per_image / (2.0 * PI * PI * max(sin(PI * uv.y), 1e-6));
}

// The numbers from which sample_environment makes a direction, up to rounding.
vec2 environment_numbers(vec3 d) {
    uint width = globals[0].environment_width, height = globals[0].environment_height;
    vec2 at = environment_uv(d) * vec2(width, height);
    uvec2 texel = min(uvec2(at), uvec2(width, height) - 1u);
    vec2 inside = at - vec2(texel);
    uint row = texel.y * width, column = width * height;
    float x0 = texel.x == 0u ? 0.0 : environment_cdf[row + texel.x - 1u], x1 = environment_cdf[row + texel.x];
    float y0 = texel.y == 0u ? 0.0 : environment_cdf[column + texel.y - 1u], y1 = environment_cdf[column + texel.y];
    return vec2(mix(x0, x1, inside.x), mix(y0, y1, inside.y));
}

// First entry of environment_cdf[first, first + count) above u.
uint environment_search(uint first, uint count, float u) {
    uint low = 0u, high = count - 1u;
    while (low < high) {
        uint middle = (low + high) >> 1;
        if (environment_cdf[first + middle] > u) high = middle;
        else low = middle + 1u;
    }
    return low;
}

// Direction towards the environment, its radiance and its density per solid angle. environment_cdf holds one cumulative
// row of `width` entries per image row, then one of `height` entries over the rows.
vec3 sample_environment(vec2 u, out vec3 direction, out float pdf) {
    uint width = globals[0].environment_width, height = globals[0].environment_height;
    uint y = environment_search(width * height, height, u.y);
    float y0 = y == 0u ? 0.0 : environment_cdf[width * height + y - 1u], y1 = environment_cdf[width * height + y];
    uint x = environment_search(y * width, width, u.x);
    float x0 = x == 0u ? 0.0 : environment_cdf[y * width + x - 1u], x1 = environment_cdf[y * width + x];
    vec2 inside = clamp(vec2((u.x - x0) / max(x1 - x0, 1e-12), (u.y - y0) / max(y1 - y0, 1e-12)), 0.0, 0.99999994);
    vec2 uv = (vec2(x, y) + inside) / vec2(width, height);
    direction = environment_direction(uv);
    float sine = sin(PI * uv.y);
    pdf = (x1 - x0) * (y1 - y0) * float(width) * float(height) / (2.0 * PI * PI * max(sine, 1e-6));
    return environment_radiance(direction);
}
