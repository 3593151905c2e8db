// The sums of the film, exact ones (lib/exact_sum.glsl), and where each begins.

// Per pixel: three channels of the value, of its square, of the value times the squared footprint scale of the pass.
const uint FILM_SUMS = 9u;    // sums of a pixel of the film
const uint FILM_SQUARES = 3u; // first sum of the squares
const uint FILM_SCALED = 6u;  // first sum of the values times the squared footprint scale

// Layers: three channels each, but one of depth and of coverage.
const uint LAYER_SUMS = 17u;         // sums of a pixel's layers
const uint LAYER_AT_ALBEDO = 0u;     // first sum of the albedo
const uint LAYER_AT_NORMAL = 3u;     // first sum of the shading normal
const uint LAYER_AT_DEPTH = 6u;      // sum of the depths of samples that met a surface
const uint LAYER_AT_COVERAGE = 7u;   // number of samples that met a surface
const uint LAYER_AT_DIRECT = 8u;     // first sum of emitted and direct light
const uint LAYER_AT_INDIRECT = 11u;  // first sum of indirect light other than caustic
const uint LAYER_AT_CAUSTIC = 14u;   // first sum of caustic light

// What a pass knows of the first surface that a pixel shows: albedo, normal, depth.
const uint AOV_FLOATS = 7u;    // floats of a pixel
const uint AOV_AT_NORMAL = 3u; // first float of the normal
const uint AOV_AT_DEPTH = 6u;  // float of the depth, infinite where nothing was met

const float EXACT_LARGEST = 70368744177664.0; // 2^46; greater summands are cut, so that 2^17 of them fit
