// The scene as plain values linked by index. Nothing here knows of files, OpenGL or Embree.
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
#include "engine/core/math.h"

namespace halflight {

inline constexpr int kNone = -1;  ///< "no such thing" for every index below

// --- Textures ---------------------------------------------------------------------------------------------------

enum class Wrap : std::uint8_t { repeat, mirrored_repeat, clamp_to_edge };

/// 8-bit RGBA, row-major, top row first, as decoded: whether colour is sRGB-encoded is told by who refers to it.
struct TextureImage {
    std::string name;
    int width = 0;
    int height = 0;
    std::vector<std::uint8_t> rgba;  // 4 * width * height
};

/// A use of a texture. (u, v) = uv_transform * (s, t, 1), v from the top row down (glTF).
struct TextureRef {
    int image = kNone;  // index into Scene::images
    int uv_set = 0;     // 0 or 1
    Wrap wrap_u = Wrap::repeat;
    Wrap wrap_v = Wrap::repeat;
    bool nearest = false;                                          // no bilinear filter
    glm::mat3x2 uv_transform{vec2(1, 0), vec2(0, 1), vec2(0, 0)};  // columns; KHR_texture_transform
    explicit operator bool() const { return image != kNone; }
};

// --- Materials: shaders/SHADING.md says what they mean -----------------------------------------------------------

enum class AlphaMode : std::uint8_t { opaque, mask, blend };

struct Material {
    std::string name;
    vec4 base_color{1};  // linear, [0,1]; a: coverage
    TextureRef base_color_texture;
    float metallic = 1;                     // [0,1]
    float roughness = 1;                    // [0,1], perceptual: alpha = roughness^2
    TextureRef metallic_roughness_texture;  // G roughness, B metallic
    TextureRef normal_texture;              // tangent space
    float normal_scale = 1;
    vec3 emission{0};             // radiance, >= 0: emissiveFactor x emissiveStrength
    TextureRef emission_texture;  // sRGB, multiplies
    AlphaMode alpha_mode = AlphaMode::opaque;
    float alpha_cutoff = 0.5f;
    bool double_sided = false;               // kept for tools: light transport treats every surface as two-sided
    bool unlit = false;                      // KHR_materials_unlit: base colour is emitted, nothing is reflected
    float ior = 1.5f;                        // >= 1
    float specular = 1;                      // KHR_materials_specular, [0,1]
    TextureRef specular_texture;             // A
    vec3 specular_color{1};                  // >= 0
    TextureRef specular_color_texture;       // sRGB
    float clearcoat = 0;                     // [0,1]
    TextureRef clearcoat_texture;            // R
    float clearcoat_roughness = 0;           // [0,1]
    TextureRef clearcoat_roughness_texture;  // G
    TextureRef clearcoat_normal_texture;
    float clearcoat_normal_scale = 1;
    float transmission = 0;           // [0,1], thin-walled
    TextureRef transmission_texture;  // R
};

// --- Geometry ------------------------------------------------------------------------------------------------------

/// One glTF mesh: all its triangle primitives, concatenated in file order. Per-vertex arrays are either empty or as
/// long as `positions`. After loading: positions finite, triangles of non-zero area, normals unit length.
struct Mesh {
    std::string name;
    std::vector<vec3> positions;  // object space
    std::vector<vec3> normals;    // unit; never empty
    std::vector<vec4> tangents;   // xyz unit, w = +-1 (bitangent = cross(n, t) * w); empty if no normal map needs them
    std::array<std::vector<vec2>, 2> uvs;
    std::vector<vec4> colors;                      // COLOR_0, linear, multiplies base_color
    std::vector<uvec3> triangles;                  // vertex indices, counter-clockwise seen from the front
    std::vector<std::uint32_t> triangle_material;  // per triangle, index into Scene::materials
    bool deforms = false;                          // has other positions in other poses of the scene
};

struct Instance {
    std::string name;
    int mesh = kNone;
    dmat4 object_to_world{1};  // affine; may mirror, may be non-uniform; never NaN
    int node = kNone;          // glTF node it came from
    bool moves = false;        // object_to_world is another one in other poses of the scene
};

// --- Lights and cameras ----------------------------------------------------------------------------------------------

enum class LightType : std::uint8_t { point, spot, directional };

/// KHR_lights_punctual. `range` is a hint for rasterizers without shadows and is not used.
struct PunctualLight {
    std::string name;
    LightType type = LightType::point;
    vec3 intensity{1};                 // colour x intensity: cd (point, spot), lux (directional)
    dvec3 position{0};                 // world
    vec3 direction{0, 0, -1};          // unit, the way the light travels (spot, directional)
    float inner_cone = 0;              // radians, 0 <= inner_cone < outer_cone
    float outer_cone = 0.7853981634f;  // radians, <= pi/2
};

struct Camera {
    std::string name;
    dmat4 camera_to_world{1};  // orthonormal; looks along -Z, +Y up
    bool orthographic = false;
    double vertical_fov = 0.8;  // radians, (0, pi)
    double ortho_height = 2;    // full height of the view, world units
    double aspect = 0;          // width / height the camera was made for; 0: that of the image. Vertical extent rules.
    double near_plane = 0;      // world units; 0: chosen from the scene
    double far_plane = 0;       // world units; 0: infinite
};

/// Radiance from infinitely far: `color` times the map where there is one.
/// Equirectangular: u = atan2(d.z, d.x) / 2pi + 0.5, v = acos(d.y) / pi from the top row down.
struct Environment {
    std::string name;
    vec3 color{0};  // >= 0
    Image map;      // 3 channels, finite, >= 0; empty: constant
    bool black() const { return color == vec3(0); }
};

// --- The whole -----------------------------------------------------------------------------------------------------

/// What loading had to mend, leave out or refuse to guess. Shown by `halflight info`.
struct SceneReport {
    std::vector<std::string> warnings;  // one line each
    std::size_t non_finite_triangles_dropped = 0;
    std::size_t degenerate_triangles_dropped = 0;
    std::size_t normals_generated = 0;         // vertices
    std::size_t tangents_generated = 0;        // vertices
    std::size_t point_primitives_skipped = 0;  // primitives of mode POINTS
    std::size_t line_primitives_skipped = 0;   // primitives of mode LINES*
    std::size_t environment_texels_repaired = 0;
};

struct Scene {
    std::string name;  // of the file, for messages
    std::vector<TextureImage> images;
    std::vector<Material> materials;  // never empty when there is a triangle: a default one is appended
    std::vector<Mesh> meshes;
    std::vector<Instance> instances;
    std::vector<PunctualLight> lights;
    std::vector<Camera> cameras;
    Environment environment;
    SceneReport report;
};

/// World bounds, in double so that a scene far from the origin keeps its precision. Holds every instance's transformed
/// object-space box: exact where instances are turned by right angles only, otherwise somewhat too large.
struct WorldBounds {
    dvec3 lower{std::numeric_limits<double>::infinity()};
    dvec3 upper{-std::numeric_limits<double>::infinity()};
    bool empty() const { return lower.x > upper.x; }
};
WorldBounds world_bounds(const Scene& scene);

/// Throws Error that names the first element which is not as the comments above promise (indices, lengths, ranges).
void validate(const Scene& scene);

bool has_emission(const Material& material);
/// Whether anything in the scene gives light: emissive triangles, unlit ones, punctual lights, environment.
bool has_light(const Scene& scene);
/// A neutral sky for scenes without any light; the caller says that it was added. The CIE overcast sky (Moon and
/// Spencer 1942), L = L_zenith (1 + 2 sin(elevation)) / 3, scaled to an irradiance of pi on the horizontal, so that a
/// white floor shows 1; below the horizon it goes on with the horizon's 3/7.
Environment default_sky();

/// A camera that sees the whole scene (as world_bounds() has it) from the front, right and above (+Z, +X, +Y) in every
/// picture that is at least as wide as high; vertical fov 45 degrees.
Camera framing_camera(const Scene& scene);
/// Throws Error where the three do not define a view.
Camera look_at_camera(const dvec3& from, const dvec3& at, const dvec3& up, double vertical_fov);

}  // namespace halflight
