// The sums of the film, exact ones (lib/exact_sum.glsl), and where each begins.

// Per pixel: three channels of the value, of its square, of the value times the squared footprint scale of the pass.
const uint FILM_SUMS = 9u;    // Sums of a pixel of the film.
const uint FILM_SQUARES = 3u; // First sum of the squares.
const uint FILM_SCALED = 6u;  // First sum of the values times the squared footprint scale.

// Layers: three channels each, but one of depth and of coverage.
const uint LAYER_SUMS = 17u;         // Sums of a pixel's layers.
const uint LAYER_AT_ALBEDO = 0u;     // First sum of the albedo.
const uint LAYER_AT_NORMAL = 3u;     // First sum of the shading normal.
const uint LAYER_AT_DEPTH = 6u;      // Sum of the depths of samples that met a surface.
const uint LAYER_AT_COVERAGE = 7u;   // Number of samples that met a surface.
const uint LAYER_AT_DIRECT = 8u;     // First sum of emitted and direct light.
const uint LAYER_AT_INDIRECT = 11u;  // First sum of indirect light other than caustic.
const uint LAYER_AT_CAUSTIC = 14u;   // First sum of caustic light.

// What a pass knows of the first surface that a pixel shows: albedo, normal, depth.
const uint AOV_FLOATS = 7u;    // Floats of a pixel.
const uint AOV_AT_NORMAL = 3u; // First float of the normal.
const uint AOV_AT_DEPTH = 6u;  // Float of the depth, infinite where nothing was met.

const float EXACT_LARGEST = 70368744177664.0; // 2^46; greater summands are cut, so that 2^17 of them fit.
