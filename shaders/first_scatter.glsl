// Kernel body shared by shaders/diffuse.comp and shaders/glossy.comp. It sends a ray from the first surface through the
// component that kGlossyRays names, if this component is picked.
#include "shaders/shared/frame_block.h"
#include "shaders/shared/light.h"
#include "shaders/shared/path_state.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/scene_tables.glsl"
#include "shaders/lib/ray_cone.glsl"

layout(local_size_x = 64) in;

layout(std140) uniform FrameBlock { Frame frame; };
layout(std430) readonly buffer PrimaryRays { Ray primary_rays[]; };
layout(std430) writeonly buffer PathRays { Ray path_rays[]; };
layout(std430) writeonly buffer States { PathState states[]; };
layout(std430) writeonly buffer List { uint list[]; };
layout(std430) buffer Header { ListHeader header; };
OPTIONAL(HALFLIGHT_RECEIVERS) layout(std430) writeonly buffer Receivers { Receiver receivers[]; };
OPTIONAL(HALFLIGHT_TEXTURE_LEVELS) layout(std430) writeonly buffer Cones { RayCone cones[]; };
OPTIONAL(HALFLIGHT_VOLUME) layout(std430) writeonly buffer Media { vec4 media[]; };

#include "shaders/lib/dimensions.glsl"
#include "shaders/lib/offset.glsl"
#include "shaders/lib/path_list.glsl"
#include "shaders/lib/surface_record.glsl"

DEFINE_APPEND(append_path, header)

void main() {
    uint path = gl_GlobalInvocationID.x;
    SurfacePoint point = load_surface_point(path);
    Bsdf b = load_bsdf(path);
    vec3 wo = -primary_rays[path].direction;
    Sampler random = path_sampler(frame, path);
    vec2 choice = sample_2d(random, vertex_dimension(0u, kDimensionLobe));
    vec2 xi = sample_2d(random, vertex_dimension(0u, kDimensionDirection));
    bool is_diffuse = picks_diffuse(b, choice.x);
    BsdfSample s = kGlossyRays ? sample_glossy(b, wo, xi, choice.y) : sample_diffuse(b, wo, xi, choice.y);
    float p = kGlossyRays ? 1.0 - b.p_diffuse : b.p_diffuse;
    bool wanted = point.is_surface && is_diffuse != kGlossyRays && s.weight != vec3(0.0);
    const uint lobe = kGlossyRays ? kLobeGlossy : kLobeDiffuse;
    if (HALFLIGHT_FIRST_SCATTER != 0 && !wanted) states[path].lobe = kLobeNone;
    uint place = append_path(wanted);
    if (wanted) {
        states[path] = PathState(s.weight / p, p * s.pdf, vec3(0.0), lobe, vec3(0.0), 0u, vec3(0.0), 0u);
        // The camera sees this ray's hit in a perfect mirror or through clear glass.
        const bool kMarks = HALFLIGHT_BACKFACES != 0 || HALFLIGHT_SHADOW_LINKS != 0;
        bool marked = kGlossyRays && kMarks && s.pdf == 0.0;
        path_rays[path] = ray_from(point.position, point.offset, b.geometric_normal, s.direction, marked);
        list[place] = path;
        if (kTextureLevels)
            cones[path] = scattered_cone(camera_cone(frame), distance(point.position, primary_rays[path].origin), s.pdf);
        if (kVolume) media[path] = medium_towards(b, vec4(0.0), s.direction);
        if (HALFLIGHT_RECEIVERS != 0)
            receivers[path] =
                Receiver(point.position, float_of_word(point.link_class), b.geometric_normal, 0.0);
    }
}
