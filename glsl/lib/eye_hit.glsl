// Eye hits: what of a surface is kept in EyeHit, so that gathered lobes can be evaluated. Include lib/bsdf.glsl and
// shared/photon.glsl before.

// A gathered lobe stays one when its alpha is stored with eleven binary digits.
const float ALPHA_GATHER_STORED = 0.10004;

// An eye hit; `weight` is the throughput and `seen` the triangle with EYE_HIT_BENT. Glass appears by what Schlick's
// formula makes of its index.
EyeHit eye_hit_of(Surface s, vec3 to_eye, vec3 weight, uint seen) {
    float alpha = s.alpha >= ALPHA_GATHER ? max(s.alpha, ALPHA_GATHER_STORED) : s.alpha;
    if (is_glass(s)) alpha = -max(alpha, 1e-4);
    vec3 f0 = s.f0 + s.glass * sqr((s.ior - 1.0) / (s.ior + 1.0));
    uint bytes = packUnorm4x8(vec4(0.0, 0.0, s.metallic, s.coat_f90));
    EyeHit h;
    h.a = uvec4(floatBitsToUint(s.position), oct_encode(s.geometric));
    h.b = uvec4(floatBitsToUint(weight * s.diffuse / PI), oct_encode(s.shading));
    h.c = uvec4(floatBitsToUint(weight), packHalf2x16(vec2(alpha, s.coat_f0)));
    h.d = uvec4(oct_encode(to_eye), packHalf2x16(f0.rg), packHalf2x16(vec2(f0.b, 0.0)) | bytes, seen);
    h.e = uvec4(0u);
    return h;
}

// Reflectance head-on of light that meets a second facet: the sum over metal and coat of the square of F0 times its
// share, for a coat without colour.
vec3 f0_again_of(vec3 f0, float metallic, float coat_f0) {
    if (metallic == 0.0) return f0 * f0;
    float coat = (1.0 - metallic) * coat_f0;
    vec3 metal = clamp(f0 - coat, 0.0, metallic);
    return coat * coat_f0 + metal * metal / metallic;
}

// An eye hit as the surface that it stands for: enough of it to evaluate gathered lobes.
Surface surface_of(EyeHit hit, out vec3 to_eye, out vec3 through) {
    Surface s;
    s.position = uintBitsToFloat(hit.a.xyz);
    s.geometric = oct_decode(hit.a.w);
    s.shading = oct_decode(hit.b.w);
    through = uintBitsToFloat(hit.c.xyz);
    to_eye = oct_decode(hit.d.x);
    vec2 alpha_coat = unpackHalf2x16(hit.c.w);
    s.alpha = abs(alpha_coat.x);
    // Only whether there is any matters here: it decides which lobes are gathered.
    s.transmission = vec3(alpha_coat.x < 0.0 ? 1.0 : 0.0);
    vec4 bytes = unpackUnorm4x8(hit.d.z);
    s.f0 = vec3(unpackHalf2x16(hit.d.y), unpackHalf2x16(hit.d.z).x);
    s.metallic = bytes.z;
    s.coat_f0 = alpha_coat.y;
    s.coat_f90 = bytes.w;
    s.f90 = mix(s.coat_f90, 1.0, s.metallic);
    s.f0_again = f0_again_of(s.f0, s.metallic, s.coat_f0);
    // The throughput is divided out again, because the coat couples the diffuse lobe to the directions.
    vec3 diffuse = uintBitsToFloat(hit.b.xyz) * PI;
    s.diffuse = mix(diffuse / max(through, vec3(1e-30)), vec3(0.0), equal(through, vec3(0.0)));
    s.own_scale = 1.0;
    s.own_below = 1.0;
    s.mean_below = 1.0;
    if (GLOSSY) look_from(s, to_eye);
    return s;
}
