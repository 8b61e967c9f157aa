// The scene as plain values linked by index, independent of files, OpenGL and Embree.
//
// Space: right-handed, +Y up, metres (glTF 2.0, section 3.4). Colours and radiances are linear Rec.709.
// Units: emission in nits taken as radiance (a radiance of 1 is a pixel of 1 before exposure), punctual lights in
// candela and lux (KHR_lights_punctual).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/lens.h"
#include "engine/core/math.h"
#include "engine/core/optics.h"
#include "engine/scene/light_profile.h"
#include "engine/scene/material.h"

namespace halflight {

// --- Geometry ------------------------------------------------------------------------------------------------------

/// One glTF mesh: all its triangle primitives, concatenated in file order. Per-vertex arrays are either empty or as
/// long as `positions`. After loading, positions are finite, triangles have an area and normals have unit length.
struct Mesh {
    std::string name;
    std::vector<vec3> positions;  // positions in object space
    std::vector<vec3> normals;    // unit normals; never empty
    std::vector<vec4> tangents;   // xyz unit, w = +-1 (bitangent = cross(n, t) * w); empty if no normal map needs them
    std::array<std::vector<vec2>, 2> uvs;
    std::vector<vec4> colors;                      // COLOR_0, linear, multiplies base_color
    std::vector<uvec3> triangles;                  // vertex indices, counter-clockwise seen from the front
    std::vector<std::uint32_t> triangle_material;  // per triangle, index into Scene::materials
    bool deforms = false;                          // vertices change with the pose of the scene
};

struct Instance {
    std::string name;
    int mesh = kNone;
    dmat4 object_to_world{1};  // affine; may mirror, may be non-uniform; never NaN
    int node = kNone;          // index of the glTF node of the instance
    bool moves = false;        // object_to_world changes with the pose of the scene
    std::uint32_t light_group =
        kNoLightGroup;            // light group; emitted light is in this group or the material's, whichever is first
    LightLinks links{};           // links of the emitted light, beside those of the material
    std::uint8_t link_class = 0;  // < kMostLinkClasses: objects of one class are in the same links
    bool catcher = false;  // true: shadow catcher, which the camera sees only by the shadows of other objects on it
    bool added = false;    // true: a ground or lamp of an edit; it does not count in world_bounds()
};

// --- Lights and cameras ----------------------------------------------------------------------------------------------

enum class LightType : std::uint8_t { point, spot, directional };

/// A light of KHR_lights_punctual. `range` is a hint for rasterizers without shadows and is not used.
struct PunctualLight {
    std::string name;
    LightType type = LightType::point;
    vec3 intensity{1};                 // colour x intensity: cd (with a profile the greatest one), lux (directional)
    dvec3 position{0};                 // world position
    vec3 direction{0, 0, -1};          // unit, direction of travel of the light (spot, directional)
    float inner_cone = 0;              // radians, 0 <= inner_cone < outer_cone
    float outer_cone = 0.7853981634f;  // radians, <= pi/2
    float radius = 0;                  // metres, of the ball that emits the light (point, spot); 0: a point
    float angle = 0;                   // radians, diameter of the disc in the sky (directional), < pi; 0: a direction
    int profile = kNone;               // index into Scene::light_profiles (point); kNone: all directions alike
    vec3 right{1, 0, 0};               // unit, orthogonal to direction: horizontal angle 0 of the profile
    vec3 up{0, 1, 0};                  // unit, orthogonal to both: horizontal angle 90 degrees
    bool of_environment = false;       // sun of a generated sky, or default lamp: changes with the environment
    std::uint32_t light_group = kNoLightGroup;
    LightLinks links{};
};

/// Lights and choices of lights that a scene needs. Shaders leave out all others (engine/tables/needs.h).
struct LightNeeds {
    bool area_lights = false;
    bool punctual_lights = false;
    bool spot_lights = false;
    bool directional_lights = false;
    bool light_profiles = false;   // some point has a profile
    bool sized_lamps = false;      // some point or spot has a radius
    bool sized_suns = false;       // some directional light has an angle
    bool sun = false;              // a directional light is sampled apart from the others
    bool light_choice = false;     // the scene has two lights or more
    bool light_tree = false;       // a light tree chooses among the lights
    bool environment = false;      // the environment is not black
    bool environment_map = false;  // the environment is not constant
    bool light_links = false;      // some light has LightLinks, of receivers or blockers
    bool shadow_links = false;     // some light has LightLinks of blockers

    bool operator==(const LightNeeds&) const = default;
};

struct Camera {
    std::string name;
    dmat4 camera_to_world{1};  // orthonormal; looks along -Z, +Y up
    bool orthographic = false;
    double vertical_fov = 0.8;  // radians, (0, pi)
    double ortho_height = 2;    // full height of the view, world units
    double aspect = 0;      // width / height that the camera was made for; 0: the image's. The vertical extent is kept.
    double near_plane = 0;  // distance, world units; 0: derived from the scene
    double far_plane = 0;   // distance, world units; 0: infinite
    Lens lens{};            // lens; a pinhole unless it blurs
    Optics optics{};        // projection and eyes
};

/// Radiance from infinite distance: `color`, times the map if there is one.
/// Equirectangular: u = atan2(d.z, d.x) / 2pi + 0.5, v = acos(d.y) / pi from the top row down.
struct Environment {
    std::string name;
    vec3 color{0};  // >= 0
    Image map;      // 3 channels, finite, >= 0; empty: constant
    std::uint32_t light_group = kNoLightGroup;
    LightLinks links{};
    bool black() const { return color == vec3(0); }
};

// --- Scene ---------------------------------------------------------------------------------------------------------

/// Repairs and omissions of the loader. `halflight info` shows them.
struct SceneReport {
    std::vector<std::string> warnings;  // warnings, one line each
    std::size_t non_finite_triangles_dropped = 0;
    std::size_t degenerate_triangles_dropped = 0;
    std::size_t normals_generated = 0;         // vertices whose normals were generated
    std::size_t tangents_generated = 0;        // vertices whose tangents were generated
    std::size_t point_primitives_skipped = 0;  // number of primitives of mode POINTS
    std::size_t line_primitives_skipped = 0;   // number of primitives of mode LINES*
    std::size_t points_drawn = 0;              // number of spheres in place of points
    std::size_t line_segments_drawn = 0;       // number of tubes in place of segments of lines
    std::size_t environment_texels_repaired = 0;
};

/// World bounds, in double so that a scene far from the origin keeps its precision. They hold every instance's
/// transformed object-space box, so they are exact for rotations by right angles and too large for others.
struct WorldBounds {
    dvec3 lower{std::numeric_limits<double>::infinity()};
    dvec3 upper{-std::numeric_limits<double>::infinity()};
    bool empty() const { return lower.x > upper.x; }
};

struct Scene {
    std::string name;  // file name, for messages
    std::vector<TextureImage> images;
    std::vector<Material> materials;  // materials, with a default one if a triangle has none
    std::vector<Mesh> meshes;
    std::vector<Instance> instances;
    std::vector<PunctualLight> lights;
    std::vector<LightProfile> light_profiles;
    std::vector<Camera> cameras;
    Environment environment;
    std::vector<std::string>
        light_groups;  // names of light groups; the last one has all lights that no other has. Empty: no groups
    std::optional<WorldBounds> paged_bounds{};  // bounds of geometry that is in pages; its meshes are then empty
    std::optional<WorldBounds> rest_bounds{};   // bounds at 0 s of a scene that is posed; none: world_bounds()
    SceneReport report;
};

WorldBounds world_bounds(const Scene& scene);

/// Checks indices, lengths and ranges against the comments above. Throws Error that names the first bad element.
void validate(const Scene& scene);
/// Checks a mesh that is not in a scene. `index` is its index in messages, `materials` the number of materials.
void validate(const Mesh& mesh, std::size_t index, std::size_t materials);

/// Returns whether all elements are finite and the last row is 0, 0, 0, 1.
bool is_affine(const dmat4& m);

/// Returns the link classes of objects that do not cast the shadows of every light, one bit each.
std::uint64_t passed_classes(const Scene& scene);

/// Returns whether the scene has a light source: an emissive or unlit triangle, a punctual light, an environment.
bool has_light(const Scene& scene);
/// Returns a neutral sky for scenes without any light; the caller reports that it was added. It is the CIE overcast sky
/// (Moon and Spencer 1942), L = L_zenith (1 + 2 sin(elevation)) / 3, scaled to a horizontal irradiance of pi, so that a
/// white floor has radiance 1. Below the horizon it has the horizon's radiance, 3/7.
Environment default_sky();

/// Returns a camera that frames the scene from the front, right and above (+Z, +X, +Y). All vertices fit into a picture
/// of that aspect, width / height, with a margin of a tenth at two opposite sides. With `turns`, world_bounds() stay in
/// it while the camera turns about the vertical axis through their centre. Its vertical field of view is 45 degrees.
Camera framing_camera(const Scene& scene, double aspect = 1, bool turns = false);
/// Returns what is wrong with the lens of a camera, or "" if it can be used.
std::string lens_problem(const Camera& camera);
/// Returns what is wrong with the optics of a camera, or "" if they can be used.
std::string optics_problem(const Camera& camera);
/// Returns the radius of the aperture of a lens that blurs, world units (metres). aspect: width / height of the
/// picture.
///
/// The focal length of an f-number is that of a lens focused at infinity with this sensor and field of view. The field
/// of view does not change with the focus.
double aperture_radius(const Camera& camera, double aspect);
/// Returns a camera at `from` that looks at `at`. `vertical_fov` is in radians. Throws Error if they define no view.
Camera look_at_camera(const dvec3& from, const dvec3& at, const dvec3& up, double vertical_fov);

}  // namespace halflight
