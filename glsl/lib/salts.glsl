// Names of the numbers that keep random sequences apart: each is mixed into a seed where one sequence begins. Two that
// are used with the same seed must differ; what they are does not matter otherwise. Constants that belong to a hash
// function itself stand there (lib/sampling.glsl, lib/hash.glsl).

// Classes of photons, mixed into the seed of a pass.
const uint SALT_CAUSTIC_PHOTONS = 0x9d2c5681u;
const uint SALT_GLOBAL_PHOTONS = 0x2545f491u;

// Decisions at a surface, mixed into the seed of a path there: photons and path tracing.
const uint SALT_LOBE = 0x68bc21ebu;        // which lobe, or absorption
const uint SALT_DIRECTION_U = 0x02e5be93u; // direction within the lobe
const uint SALT_DIRECTION_V = 0x967a889bu;

// Decisions of eye paths at a surface.
const uint SALT_EYE_FACET_U = 0x1b56c4e9u; // facet of a followed lobe
const uint SALT_EYE_FACET_V = 0x7feb352du;
const uint SALT_EYE_CHOICE = 0x3c6ef372u;   // which continuation, where there is no room for all
const uint SALT_EYE_ROULETTE = 0x9e3779b9u; // whether a faint path goes on

// Whether a path meets what is there in part (alpha blending); mixed into the key of an eye path, or into the seed of a
// photon at a surface, or into the key of a shadow ray.
const uint SALT_COVERAGE = 0xc2b2ae35u;

// Which of the candidates a light sample is; mixed into its key.
const uint SALT_RESAMPLING = 0x27d4eb2fu;

// Sequences that are keyed by pixel or slot, so that they are independent of the camera's and of each other.
const uint SALT_DIRECT_LIGHT = 0x5bd1e995u; // light samples
const uint SALT_PATH_TRACING = 0x85ebca6bu; // gathered lobes of path tracing
const uint SALT_BOUNDARIES = 0x165667b1u;   // directions in which boundaries are sought
const uint SALT_WALK = 0x57a1cu;            // stochastic walks through lists of photons
