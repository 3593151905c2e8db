// Texture lookups from the storage buffer `texels` (RGBA8 words) through `texture_uses`.

int wrap_texel(int i, int size, uint mode) {
    int clamped = clamp(i, 0, size - 1);
    int period = mode == WRAP_MIRROR ? 2 * size : size;
    int m = i % period;
    m = m < 0 ? m + period : m;
    int repeated = m >= size ? 2 * size - 1 - m : m;
    return mode == WRAP_CLAMP ? clamped : repeated;
}

vec3 srgb_to_linear(vec3 c) {
    return mix(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, lessThanEqual(c, vec3(0.04045)));
}

vec4 fetch_texel(TextureUse t, int x, int y) {
    int column = wrap_texel(x, int(t.width), t.flags & WRAP_MASK);
    int row = wrap_texel(y, int(t.height), (t.flags >> WRAP_V_SHIFT) & WRAP_MASK);
    vec4 c = unpackUnorm4x8(texels[t.first_texel + uint(row) * t.width + uint(column)]);
    return (t.flags & TEXTURE_SRGB) != 0u ? vec4(srgb_to_linear(c.rgb), c.a) : c;
}

vec4 sample_texture(uint use, vec2 uv0, vec2 uv1) {
    TextureUse t = texture_uses[use];
    vec3 uv = vec3((t.flags & TEXTURE_UV1) != 0u ? uv1 : uv0, 1.0);
    vec2 p = vec2(dot(t.row_u, uv), dot(t.row_v, uv));
    // Whole turns carry no information; dropping them keeps the conversion to integers in range.
    bool clamp_u = (t.flags & WRAP_MASK) == WRAP_CLAMP, clamp_v = ((t.flags >> WRAP_V_SHIFT) & WRAP_MASK) == WRAP_CLAMP;
    p -= vec2(clamp_u ? 0.0 : 2.0 * floor(0.5 * p.x), clamp_v ? 0.0 : 2.0 * floor(0.5 * p.y));
    p = clamp(p, vec2(-4.0), vec2(4.0)) * vec2(t.width, t.height);
    bool linear = (t.flags & TEXTURE_LINEAR) != 0u;
    p -= linear ? 0.5 : 0.0;
    vec2 base = floor(p);
    vec2 f = linear ? p - base : vec2(0.0);
    int x = int(base.x), y = int(base.y);
    vec4 result = vec4(0.0);
    // A loop, not copies: software drivers compile for seconds what is inlined often.
    [[dont_unroll]] for (int k = 0; k < 2; ++k) {
        vec4 left = fetch_texel(t, x, y + k);
        vec4 row = left + (fetch_texel(t, x + 1, y + k) - left) * f.x; // a constant stays what it is
        result = k == 0 ? row : result + (row - result) * f.y;
    }
    return result;
}
