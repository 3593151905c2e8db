// An eye hit as the surface that it stands for: enough of it to evaluate gathered lobes.
Surface surface_of(EyeHit hit, out vec3 to_eye, out vec3 through) {
    Surface s;
    s.position = uintBitsToFloat(hit.a.xyz);
    s.geometric = oct_decode(hit.a.w);
    s.shading = oct_decode(hit.b.w);
    through = uintBitsToFloat(hit.c.xyz);
    to_eye = oct_decode(hit.d.x);
    float alpha = uintBitsToFloat(hit.c.w);
    s.alpha = abs(alpha);
    // Only whether there is any matters here: it decides which lobes are gathered.
    s.transmission = vec3(alpha < 0.0 ? 1.0 : 0.0);
    vec2 f0_rg = unpackHalf2x16(hit.d.y), f0_b = unpackHalf2x16(hit.d.z);
    s.f0 = vec3(f0_rg, f0_b.x);
    s.f90 = f0_b.y;
    // The throughput is divided out again, because Fresnel couples the diffuse lobe to the directions.
    vec3 diffuse = uintBitsToFloat(hit.b.xyz) * PI;
    s.diffuse = mix(diffuse / max(through, vec3(1e-30)), vec3(0.0), equal(through, vec3(0.0)));
    return s;
}
