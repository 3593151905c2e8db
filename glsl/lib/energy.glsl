// The energy of photons: the mean of the channels of their flux. The order of operations is fixed, so that host and
// device agree.

float energy_of(vec3 flux) {
    precise float sum = flux.r + flux.g;
    precise float all = sum + flux.b;
    return all * (1.0 / 3.0);
}

bool not_finite(vec3 v) {
    return any(isnan(v)) || any(isinf(v));
}
