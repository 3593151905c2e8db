// The tile of the scans: 256 invocations, 8 consecutive items each.
#include "lib/chunk.glsl"
#include "lib/subgroup.glsl"

const uint ITEMS = 8u;
const uint TILE = 256u * ITEMS;
