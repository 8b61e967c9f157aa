// The features of shaders and tables that a scene needs; all others are left out. This code uses no OpenGL.
#pragma once

#include <cstddef>
#include <functional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/scene/scene.h"

namespace halflight {

/// Features that a scene uses. On a software driver an untaken branch costs as much as a taken one. So shaders are
/// compiled without unused features (shader_defines), and no table is built for them.
struct SceneNeeds : MaterialNeeds, LightNeeds {
    bool instances = false;      // some block is not in world space
    bool vertex_colors = false;  // some vertex colour is not white
    bool normal_maps = false;    // some normal map or anisotropic lobe needs the tangents of a mesh
    bool alpha = false;          // alpha decides some hit
    bool slivers = false;        // some triangle is a sliver (is_sliver)
    bool catchers = false;       // some object catches shadows (Instance::catcher)
    bool one_sided = false;      // some surface is seen from its front only (is_one_sided)
    bool panes = false;          // light passes some surface straight on (is_pane)
    bool solid_panes = false;    // one of them bounds a solid
    bool every_light = false;    // every light is sampled, and one of the samples is kept (LightChoice::all)

    bool texture_coordinates = false;  // some texture is looked up
    bool texture_transforms = false;
    bool texture_uv_set_1 = false;
    bool texture_mirrored = false;  // some axis repeats mirrored
    bool texture_clamped = false;   // some axis is clamped to its edges
    bool texture_nearest = false;
    bool texture_levels = false;  // some texture has mip levels
    bool texture_deep = false;    // some texture of data has 16 bits

    /// Returns whether next-event estimation has a light to sample.
    bool lights() const { return area_lights || punctual_lights || environment; }
    /// Returns whether rays can meet points, spots and directional lights.
    bool sized_lights() const { return sized_lamps || sized_suns; }
    /// Returns whether a light that a ray meets, or its density, depends on the receiver. No ray meets a punctual light
    /// without a size.
    bool receivers() const {
        return environment_map || sized_lights() || light_links || (light_tree && (area_lights || environment));
    }
    /// Returns whether a path can reach emitted light.
    bool light() const { return lights() || emission; }
    /// Returns the number of texels per vertex (shaders/shared/vertex.h).
    int vertex_stride() const;
    std::size_t surface_record_bytes()
        const;                              ///< Returns the bytes of a surface record (shaders/shared/surface_rows.h).
    std::size_t reuse_point_bytes() const;  ///< Returns the bytes of a ReusePoint with its layers.
    bool operator==(const SceneNeeds&) const = default;
};

/// A row of the table of needs.
struct SceneNeed {
    const char* name;
    bool SceneNeeds::*flag;
    const char* define;  // name of the macro after HALFLIGHT_
    const char* fact;    // statement that is true if the flag is false
};
/// Returns the row of every flag of SceneNeeds.
std::span<const SceneNeed> known_scene_needs();

/// Returns the needs of either, and those that follow from them: a texture needs its lobe, a spot punctual lights.
SceneNeeds united(SceneNeeds a, const SceneNeeds& b);

/// Names of features that are built although the scene does not need them (left_out() in renderer/needs.h lists them).
class Kept {
  public:
    Kept() = default;  ///< Keeps nothing.
    explicit Kept(std::set<std::string, std::less<>> names) : names_(std::move(names)) {}
    static Kept everything();
    bool has(std::string_view name) const { return everything_ || names_.contains(name); }
    bool is_everything() const { return everything_; }
    const std::set<std::string, std::less<>>& names() const { return names_; }  ///< Returns none for everything().
    /// Returns "nothing", "everything", or the names joined by commas.
    std::string text() const;
    bool operator==(const Kept&) const = default;

  private:
    std::set<std::string, std::less<>> names_;
    bool everything_ = false;
};

/// Returns whether the feature can be built without changing a picture and is of use then. Seven are not:
///   - the environment map samples other directions than a constant environment,
///   - the light tree and the separate sun choose other lights,
///   - the test of slivers rounds the hits of other triangles,
///   - mip levels are averages of texels,
///   - shadow catchers without any would be sums that nobody reads,
///   - light links are a departure from physics that pictures name.
bool can_be_kept(const SceneNeed& need);
/// Returns the needs that `kept` names and that can be kept, and those that follow from them.
SceneNeeds kept_needs(const Kept& kept);

/// Returns the macros (name, value) that select the variant of shaders/lib for a scene, sorted by name.
std::vector<std::pair<std::string, std::string>> shader_defines(const SceneNeeds& needs);

}  // namespace halflight
