// Makes connection rays between the first surfaces of a group and the points that its paths have found. Stores the
// density with which each surface would have found the point (SHADING.md, Path reuse). Each work group has one block of
// 16x16 pixels. An entry is (path that found the point, step to a member of its group). The HALFLIGHT_GROUP_SIZE rays
// towards a point follow one another. All rays to points without light are dead, and so is the ray of the path itself,
// step 0, which has arrived already.
#include "shaders/shared/frame_block.h"
#include "shaders/shared/path_state.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/shared/reuse_groups.h"
#include "shaders/geometry_tables.glsl"  // tables of triangle lights
#include "shaders/scene_tables.glsl"

layout(local_size_x = 256) in;

const uint kGroupSize = uint(HALFLIGHT_GROUP_SIZE);  // pixels that share their paths

layout(std430) readonly buffer PrimaryRays { Ray primary_rays[]; };
layout(std430) writeonly buffer Connections { Ray connections[]; };
layout(std430) writeonly buffer Densities { float densities[]; };  // density per area times y.distance^2, if visible

layout(std140) uniform FrameBlock { Frame frame; };

#include "shaders/lib/offset.glsl"
#include "shaders/lib/reuse.glsl"
#include "shaders/lib/reuse_points.glsl"
#include "shaders/lib/surface_record.glsl"

shared uint gives[256];  // 1: there is light at the path's point

void main() {
    uint path = gl_GlobalInvocationID.x;
    vec3 light = given_light(path, kAllLight);
    gives[gl_LocalInvocationIndex] = light != vec3(0.0) && all_finite(light) ? 1u : 0u;
    barrier();

    SurfacePoint from = load_surface_point(path);
    Bsdf b = load_bsdf(path);
    vec3 wo = -primary_rays[path].direction;
    uint grouping = sample_grouping(frame.seed, frame.sample_index);
    for (uint i = 0u; i < kGroupSize; ++i) {
        uint finder = path ^ member_step(i, grouping);
        uint entry = finder * kGroupSize + i;
        ReusePoint y = load_point(finder);
        Sight sight = sight_of(y, from.position, finder == path);
        float density = scatter_density(b, shared_value(b, wo, sight.direction)) * sight.geometry;
        density = gives[finder & 255u] != 0u && from.is_surface ? density : 0.0;
        densities[entry] = density;

        // Like a ray to a light, the ray ends before the point's surface, by its error and by the tracer's.
        float margin = y.offset + rounding_bound(8.0) * distance(y.position, from.position);
        vec3 origin = offset_ray_origin(from.position, from.offset, b.geometric_normal, sight.direction);
        vec3 direction = y.position + margin * y.geometric_normal - origin;
        bool live = density > 0.0 && finder != path && direction != vec3(0.0);
        connections[entry] = Ray(live ? origin : vec3(0.0), 0.0, live ? direction : vec3(1.0),
                                 live ? 1.0 - rounding_bound(8.0) : -1.0);
    }
}
