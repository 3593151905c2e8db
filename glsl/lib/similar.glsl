// Which eye hits may lend light to each other, and which pixel of a block is estimated in a pass: what the sampling
// modes of Mara, Luebke and McGuire 2013 (section 2.3.2) need. Their guides, depth and normal, are taken in world
// space, so that hits behind mirrors and glass are compared where they are and not where they are seen.
//
// Include shared/scene.glsl, shared/photon.glsl and lib/sampling.glsl before.

// Surfaces of a lower reflectance lend no light: theirs is within rounding.
const float LENDS = 1e-20;

// Light that leaves a Lambert surface is its arriving light times the hit's factor; that of others depends on the
// direction.
bool lambert_hit(EyeHit hit) {
    return hit.d.y == 0u && hit.d.z == 0u;
}

// Width of a pixel [scene units] at a point, across the direction of sight. For hits seen by way of mirrors it is too
// small, so that fewer neighbours count as similar.
float pixel_width(vec3 position, Camera c) {
    float at_one = 2.0 * length(c.right) / float(c.width);
    return max(at_one * (c.orthographic != 0u ? 1.0 : distance(position, c.position)), 1e-30);
}

// Weight in [0, 1] of the light at y for x, `apart` pixels away: 0 where their planes are a pixel apart, their normals
// differ by more than 26 degrees (cosine 0.9), or they are farther from each other than pixels on one plane can be.
float similarity(EyeHit x, EyeHit y, float apart, Camera c) {
    vec3 position = uintBitsToFloat(x.a.xyz);
    vec3 offset = uintBitsToFloat(y.a.xyz) - position;
    vec3 x_normal = oct_decode(x.a.w), y_normal = oct_decode(y.a.w);
    float width = pixel_width(position, c);
    float height = max(abs(dot(offset, x_normal)), abs(dot(offset, y_normal)));
    float facing = min(dot(x_normal, y_normal), dot(oct_decode(x.b.w), oct_decode(y.b.w)));
    float slope = max(abs(dot(x_normal, oct_decode(x.d.x))), 0.05);
    if (length(offset) * slope > 2.0 * (apart + 1.0) * width) return 0.0;
    return clamp(1.0 - height / width, 0.0, 1.0) * clamp((facing - 0.9) * 10.0, 0.0, 1.0);
}

// Place in its block of k x k pixels of the pixel that is estimated in this pass. `jump` has no divisor in common with
// k^2: any k^2 passes that begin at a multiple of k^2 use each place once, far from the one before.
uvec2 chosen_place(Pass pass, uint k, uint jump) {
    uint cells = k * k;
    uint cell = ((pass.index % cells) * jump + hash2(pass.seed, pass.index / cells) % cells) % cells;
    return uvec2(cell % k, cell / k);
}

// The estimated pixel of a block; blocks that the edge of the image cuts have one too.
uvec2 chosen_pixel(uvec2 block, uvec2 place, uint k, Camera c) {
    uvec2 size = min(uvec2(k), uvec2(c.width, c.height) - block * k);
    return block * k + place % size;
}
