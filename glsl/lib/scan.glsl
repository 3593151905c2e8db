// The tile of the scans: 256 invocations, ITEMS consecutive items each. Items are read a second time rather than held,
// so that ITEMS can be large where barriers are dear (a CPU) and small where neighbouring reads have to be near each
// other.
#include "lib/chunk.glsl"
#include "lib/subgroup.glsl"

layout(constant_id = 8) const uint ITEMS = 8;
const uint TILE = 256u * ITEMS;
