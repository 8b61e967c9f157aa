// Makes connection rays for the benchmark, as path reuse traces them (shaders/reuse_connect.comp). They go from the 16
// pixels of a group to the hits of their diffuse rays. An entry is (block, group, point, receiver), where the receiver
// changes fastest. A ray is dead where the point or the surface is missing, or one is behind the other.
#include "shaders/shared/path_state.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/shared/reuse_groups.h"
#include "shaders/geometry_tables.glsl"
#include "shaders/scene_tables.glsl"

layout(local_size_x = 64) in;

layout(std430) readonly buffer PathRays { Ray path_rays[]; };
layout(std430) readonly buffer Hits { Hit hits[]; };
layout(std430) readonly buffer States { PathState states[]; };
layout(std430) writeonly buffer Connections { Ray connections[]; };

const uint kGrouping = 0xb36du;  // an arbitrary grouping, equal for all samples

uniform uint first_block;
uniform uint block_stride;

#include "shaders/lib/finite.glsl"
#include "shaders/lib/surface.glsl"
#include "shaders/lib/surface_record.glsl"

void main() {
    uint entry = gl_GlobalInvocationID.x;
    uint block = first_block + (entry >> 12) * block_stride;
    uint group = (entry >> 8) & 15u;
    uint sender = (block << 8) | group | (((entry >> 4) & 15u) << 4);
    uint receiver = sender ^ member_step(entry & 15u, kGrouping);

    Hit hit = hits[sender];
    bool has_point = states[sender].lobe == kLobeDiffuse && hit.triangle != kMiss && finite(hit.t);
    hit.triangle = has_point ? hit.triangle : 0u;
    hit.instance = has_point ? hit.instance : 0u;
    Surface point = surface_at(hit, path_rays[sender].direction);

    SurfacePoint from = load_surface_point(receiver);
    Bsdf b = load_bsdf(receiver);
    vec3 to_point = point.position - from.position;
    bool faces = dot(to_point, b.geometric_normal) > 0.0 && dot(to_point, b.normal) > 0.0 &&
                 dot(to_point, point.geometric_normal) < 0.0;
    // Like a ray to a light, the ray ends before the point's surface, by its error and by the tracer's.
    float margin = point.offset + rounding_bound(8.0) * length(to_point);
    Ray ray;
    ray.origin = offset_ray_origin(from.position, from.offset, b.geometric_normal, to_point);
    ray.t_min = 0.0;
    ray.direction = point.position + margin * point.geometric_normal - ray.origin;
    ray.t_max = has_point && from.is_surface && faces ? 1.0 - rounding_bound(8.0) : -1.0;
    connections[entry] = ray;
}
