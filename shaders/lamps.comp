// Finds the lights with a size that scattered rays meet on their way (SHADING.md, Lights with a size). These lights
// hide nothing, so a ray may meet several. One of them is kept in proportion to its light and stands for all.
//
// Variants: HALFLIGHT_FIRST_HIT (rays from the first surface, for which HALFLIGHT_SHADOW_RAYS lights were sampled),
// HALFLIGHT_CAMERA (camera rays of all paths, which add the light of all lamps that they meet to the light seen).
#include "shaders/shared/frame_block.h"
#include "shaders/shared/light.h"
#include "shaders/shared/path_state.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/geometry_tables.glsl"  // tables of triangle lights
#include "shaders/scene_tables.glsl"

layout(local_size_x = 64) in;

layout(std140) uniform FrameBlock { Frame frame; };
uniform usamplerBuffer list;    // R32UI: path indices
uniform usamplerBuffer header;  // RGBA32UI: ListHeader
#include "shaders/lib/hit_texels.glsl"
#include "shaders/lib/ray_texels.glsl"
OPTIONAL(!HALFLIGHT_CAMERA) layout(std430) readonly buffer States { PathState states[]; };
OPTIONAL(!HALFLIGHT_CAMERA) layout(std430) readonly buffer Receivers { Receiver receivers[]; };  // origins of the rays
OPTIONAL(!HALFLIGHT_CAMERA) layout(std430) writeonly buffer MetLamps { MetLamp met_lamps[]; };
OPTIONAL(HALFLIGHT_CAMERA) layout(std430) buffer LightSeen { vec4 light_seen[]; };  // SampleInputs::lamps
uniform samplerBuffer media;  // RGBA32F: media of the rays (medium_towards())

uniform uint depth;    // number of the vertex that the rays leave
uniform float weight;  // weight of a camera ray in the mean
uniform bool begins;   // true: the mean is empty so far

const bool kCamera = HALFLIGHT_CAMERA != 0;

#include "shaders/lib/dimensions.glsl"
#include "shaders/lib/finite.glsl"
#include "shaders/lib/next_event.glsl"

float infinity() { return uintBitsToFloat(0x7f800000u); }

// A ray that looks for lights.
struct Search {
    Receiver from;
    vec3 direction;    // unit
    float limit;       // distance of what the ray hits
    float nearest;     // distances of lamps that a camera shows
    float farthest;
    float pdf;         // PathState::pdf
    bool sees;         // the path has met perfect mirrors and clear glass alone; set with shadow links
    vec3 throughput;
    vec4 medium;
    float number;      // uniform in [0, 1); each choice leaves another one
    float sum;         // sum of the light met so far, by its largest channel
    MetLamp kept;
    uint seen;         // first row of light_seen
};

SizedLight light_of_row(Search ray, int row) {
    return sized_light(ray.from.position, texelFetch(scene_lights, row), texelFetch(scene_lights, row + 1).xyz,
                       texelFetch(scene_lights, row + 2).y);
}

// Returns the distance at which a ray meets a light, infinite for a disc, or -1.
float distance_to(Search ray, SizedLight light, bool is_disc) {
    float cosine = dot(ray.direction, light.axis);
    vec3 across = ray.direction - cosine * light.axis;  // its length is the sine, without the cancellation of 1 - cos^2
    float squared_sine = dot(across, across);
    float bound = is_disc ? light.size : light.size * light.size / max(light.square, 1e-37);
    bool inside = light.spread == 2.0;
    bool meets = light.spread > 0.0 && (inside || (cosine > 0.0 && squared_sine < bound));
    float way = is_disc ? infinity() : distance_to_ball(light, cosine, squared_sine);
    if (kCamera && !is_disc) meets = meets && way >= ray.nearest && way <= ray.farthest;
    return meets && way >= 0.0 && (is_disc ? isinf(ray.limit) : way < ray.limit) ? way : -1.0;
}

// Adds the light of a row that the ray meets at `way`. `factor` multiplies the density of light samples.
void meet(inout Search ray, uint number, float way, float probability, float factor) {
    int row = int(number) * kLightStride;
    uint link_set = link_set_entry(entry_of_light(number));
    if (!lights_receiver(link_set, ray.from) || (sampled_alone(link_set) && !ray.sees)) return;
    uint group = kLightGroups > 0u ? group_of_light(number) : 0u;
    SizedLight light = light_of_row(ray, row);
    vec3 radiance = texelFetch(scene_lights, row + 3).rgb * light.radiance;
    if (kSpotLights || kLightProfiles) {
        uint kind = light_kind(word_of_float(texelFetch(scene_lights, row).w));
        radiance *= angular_falloff(row, kind, -ray.direction);
    }
    if (kCamera) {
        ray.kept.light += radiance;
        if (kLightGroups > 0u) light_seen[ray.seen + 1u + group].rgb += weight * radiance;
        return;
    }
    if (kVolume) radiance *= transmittance(ray.medium, isinf(way) ? endless_way(ray.medium) : way);
    vec3 more = ray.throughput * radiance *
                met_light_weight(ray.pdf, factor * probability * density_of(light));
    float value = max(more.r, max(more.g, more.b));
    ray.sum += value;
    float share = ray.sum > 0.0 ? value / ray.sum : 0.0;
    bool taken = ray.number < share || share >= 1.0 || isnan(share);  // NaN is kept and counted
    ray.number = taken ? ray.number / share : (ray.number - share) / (1.0 - share);
    if (taken) ray.kept = MetLamp(more / value, way, float_of_word(group), 0u, 0u, 0u);
}

// Meets the balls of the light tree, whose nodes bound them. Returns whether the walk has come to its end.
bool meet_lamps_of_tree(inout Search ray, float factor) {
    const uint kMostWaiting = 3u * (kLightTreeDepth / 2u) + 4u;
    vec4 balls[kMostWaiting];
    uint nodes[kMostWaiting];
    balls[0] = uintBitsToFloat(texelFetch(light_tree, 1));
    nodes[0] = 0u;
    uint waiting = 1u;
    uint names = light_tree_header().names;
    uvec2 lights = uvec2(kNoLight);  // lights of the leaf that was found
    while (waiting > 0u || lights.x != kNoLight) {
        // Looking for a lamp on the ray takes most steps, so it has a loop of its own.
        int row = 0;
        float way = -1.0;
        uint light = kNoLight;
        while (way < 0.0 && (waiting > 0u || lights.x != kNoLight)) {
            light = lights.x;
            lights = uvec2(lights.y, kNoLight);
            if (light != kNoLight) {
                row = int(light) * kLightStride;
                uint kind = light_kind(word_of_float(texelFetch(scene_lights, row).w));
                bool is_lamp = kind == kLightPoint || kind == kLightSpot;
                way = is_lamp ? distance_to(ray, light_of_row(ray, row), false) : -1.0;
            } else {
                uint entry = nodes[--waiting];
                vec4 ball = balls[waiting];
                vec3 to_centre = ball.xyz - ray.from.position;
                float along = dot(to_centre, ray.direction);
                vec3 across = to_centre - along * ray.direction;
                // Bounds have roundings of their own and lie in coordinates of the scene's size.
                float reach = ball.w + 1e-5 * (length(to_centre) + ball.w + length(ray.from.position));
                bool meets = dot(across, across) <= reach * reach && along >= -reach && along - reach <= ray.limit;
                bool leaf = (entry & 0x80000000u) != 0u;
                uint node = (entry >> 3) & 0x0fffffffu;
                if (meets && leaf) {
                    int at = int(names + 2u * node);
                    uint child = entry & 3u;
                    lights.x = texelFetch(light_tree, at)[child];
                    lights.y = (entry & 4u) != 0u ? texelFetch(light_tree, at + 1)[child] : kNoLight;
                } else if (meets) {
                    int first = kLightTreeHeaderTexels + int(node) * kLightTreeWidth;
                    uint links = (texelFetch(light_tree, first).w & kLightTreeLinkMask) +
                                 ((texelFetch(light_tree, first + 1).w & kLightTreeLinkMask) << kLightTreeLinkBits);
                    uvec4 sized = texelFetch(light_tree, int(names + 2u * node + 1u));  // of inner nodes
                    for (uint k = 0u; k < uint(kLightTreeWidth); ++k) {
                        uvec4 child_texel = texelFetch(light_tree, first + int(k));
                        if (child_texel.w == kLightTreeNone) continue;
                        LightNode child = light_child(child_texel, ball);
                        bool is_leaf = (child_texel.w & kLightTreeLeaf) != 0u;
                        if (!is_leaf && sized[k] == 0u) continue;
                        uint pair = (child_texel.w & kLightTreePair) != 0u ? 4u : 0u;
                        balls[waiting] = vec4(child.centre, child.radius);
                        nodes[waiting++] = is_leaf ? 0x80000000u | (node << 3) | pair | k : (links + k) << 3;
                    }
                }
            }
        }
        if (way >= 0.0) {
            vec4 head = texelFetch(scene_lights, row);
            float gain = 1.0;
            if (!kCamera)
                gain = light_tree_gain(light_way(ray.from, true, light_trail(word_of_float(head.w)), 0u),
                                       environment_share(ray.from));
            meet(ray, light, way, texelFetch(scene_lights, row + 3).w * gain, factor);
        }
    }
    return waiting == 0u && lights.x == kNoLight;
}

// Meets all lights with a size that the ray may meet.
void find_lights(inout Search ray, uint path) {
    if (!kCamera)
        ray.number = sample_1d(path_sampler(frame, path),
                               vertex_dimension(depth, kDimensionRoulette) + kDimensionsOfSizes);
    const float factor = HALFLIGHT_FIRST_HIT != 0 ? float(HALFLIGHT_SHADOW_RAYS) : 1.0;  // event_of() has the same factor
    uint lights = uint(light_texels() / kLightStride);
    if (kSun && kSizedSuns) {
        int sun = int(lights - 1u) * kLightStride;
        float way_to_sun = distance_to(ray, light_of_row(ray, sun), true);
        if (way_to_sun >= 0.0) meet(ray, lights - 1u, way_to_sun, 1.0, 1.0);
    }
    // Rows of lights with a size come last among those of points, spots and directional lights. The last one has their
    // number, without those that a light tree holds.
    uint end = lights - min(kSuns, lights);
    if (end > 0u && light_kind(word_of_float(texelFetch(scene_lights, int(end - 1u) * kLightStride).w)) ==
                        kLightEnvironment)
        --end;
    int last = int(end) * kLightStride - kLightStride;
    uint kind = end > 0u ? light_kind(word_of_float(texelFetch(scene_lights, last).w)) : kLightNone;
    bool is_punctual = kind >= kLightPoint && kind <= kLightDirectional;
    uint count = is_punctual ? word_of_float(texelFetch(scene_lights, last + 2).z) : 0u;
    uint light = end - count;
    for (; light < end; ++light) {
        int row = int(light) * kLightStride;
        bool is_disc = light_kind(word_of_float(texelFetch(scene_lights, row).w)) == kLightDirectional;
        float way = distance_to(ray, light_of_row(ray, row), is_disc);
        if (way >= 0.0) meet(ray, light, way, texelFetch(scene_lights, row + 3).w, factor);
    }
    bool finished = light == end;
    if (kLightTree && HALFLIGHT_SIZED_LAMPS != 0) finished = meet_lamps_of_tree(ray, factor) && finished;
    // Drivers end long loops: llvmpipe after 65535 steps of all loops of a kernel. The NaN is counted later.
    if (!finished) ray.sum = not_a_number();
}

// Adds the lamps that the camera ray of a path meets to the light seen.
void add_to_light_seen(uint path) {
    const uint rows = 1u + kLightGroups;
    Ray ray = load_ray(path);
    Hit hit = load_hit(path);
    bool is_miss = hit.triangle == kMiss;
    if (HALFLIGHT_CATCHERS != 0) is_miss = is_miss || catches_shadows(is_miss ? 0u : hit.triangle);  // seen through
    Search s;
    s.from = receiver_at(ray.origin, vec3(0.0), 0u);  // class 0 is in all links
    s.direction = ray.direction;
    s.sees = true;
    s.limit = is_miss ? infinity() : finite(hit.t) ? hit.t : 0.0;
    if (ray.t_max < 0.0) s.limit = -1.0;  // a dead ray
    s.nearest = ray.t_min;
    s.farthest = ray.t_max;
    s.sum = 0.0;
    s.kept = MetLamp(vec3(0.0), 0.0, 0.0, 0u, 0u, 0u);
    s.seen = path * rows;
    for (uint i = 0u; i < (begins ? rows : 0u); ++i) light_seen[s.seen + i] = vec4(0.0);
    find_lights(s, path);
    light_seen[s.seen].rgb += weight * (s.kept.light + s.sum);
}

void main() {
    if (kCamera) {
        add_to_light_seen(gl_GlobalInvocationID.x);
        return;
    }
    uint entry = gl_GlobalInvocationID.x;
    if (entry >= texelFetch(header, 0).w) return;
    uint path = texelFetch(list, int(entry)).x;
    Ray ray = load_ray(path);
    Hit hit = load_hit(path);
    bool is_miss = hit.triangle == kMiss;
    Search s;
    s.from = receivers[path];
    s.direction = normalize(ray.direction);
    s.limit = is_miss ? infinity() : finite(hit.t) ? hit.t * length(ray.direction) : 0.0;
    s.pdf = states[path].pdf;
    s.sees = ray.t_min > 0.0;  // first_scatter.glsl
    s.throughput = states[path].throughput;
    if (kVolume) s.medium = texelFetch(media, int(path));
    s.sum = 0.0;
    s.kept = MetLamp(vec3(0.0), infinity(), float_of_word(0u), 0u, 0u, 0u);
    if (kSizedLights) find_lights(s, path);
    s.kept.light *= s.sum;
    met_lamps[path] = s.kept;
}
