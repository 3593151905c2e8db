#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
#include "lib/linear_id.glsl"
#include "lib/math.glsl"
#include "lib/differentials.glsl"
