// The tracer's arrays (TraceScene::bind()), and access to nodes and triangles. Variant: TraceScene::defines().
#include "shaders/shared/bvh_nodes.h"
#include "shaders/geometry_tables.glsl"
#include "shaders/scene_tables.glsl"

layout(binding = kUnitNodes) uniform usamplerBuffer trace_nodes;
layout(binding = kUnitTriangleVertices) uniform samplerBuffer trace_triangles;
layout(binding = kUnitBlockHeads) uniform usamplerBuffer block_heads;

// Returns the node index of the head of the hierarchy of an instance's block.
uint block_head(uint instance) { return texelFetch(block_heads, int(instance)).x; }
