// What a scene needs of shaders and tables; everything else is left out. Pure: no OpenGL.
#pragma once

#include <functional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace halflight {

/// On a software driver an untaken branch costs as much as a taken one, so everything that is false here is compiled
/// away (shader_defines), and no table is made for it.
struct SceneNeeds {
    bool instances = false;  // some block is not in world space
    bool vertex_colors = false;
    bool normal_maps = false;  // with tangents to go with them
    bool alpha = false;        // alpha decides some hit
    bool slivers = false;      // some triangle is a needle (is_sliver)
    bool unlit = false;
    bool diffuse = false;  // some material scatters diffusely
    bool glossy = false;   // some material reflects specularly, has a coat or transmits
    bool clearcoat = false;
    bool transmission = false;
    bool specular_color = false;  // some material is not white there
    bool emission = false;        // some surface glows, unlit ones included
    bool area_lights = false;
    bool punctual_lights = false;
    bool spot_lights = false;
    bool directional_lights = false;
    bool light_choice = false;     // there are two lights or more
    bool light_tree = false;       // of which a tree chooses
    bool sun = false;              // a directional light is sampled apart from the others
    bool environment = false;      // not black
    bool environment_map = false;  // not constant

    // Texture slots in use, and what their lookups take.
    bool base_color_texture = false;
    bool metallic_roughness_texture = false;
    bool normal_texture = false;
    bool emission_texture = false;
    bool specular_texture = false;
    bool specular_color_texture = false;
    bool clearcoat_texture = false;
    bool clearcoat_roughness_texture = false;
    bool clearcoat_normal_texture = false;
    bool transmission_texture = false;
    bool texture_coordinates = false;  // some texture is looked up, or a normal map turned
    bool texture_transforms = false;
    bool texture_uv_set_1 = false;
    bool texture_mirrored = false;  // some axis repeats mirrored
    bool texture_clamped = false;   // some axis ends at its edges
    bool texture_nearest = false;

    /// Whether anything can be picked by next-event estimation.
    bool lights() const { return area_lights || punctual_lights || environment; }
    /// Whether any path can end in light.
    bool light() const { return lights() || emission; }
    /// Texels per vertex (shaders/shared/vertex.h).
    int vertex_stride() const;
    bool operator==(const SceneNeeds&) const = default;
};

/// One of them, for lists.
struct SceneNeed {
    const char* name;
    bool SceneNeeds::*flag;
    const char* define;  // after HALFLIGHT_
    const char* fact;    // that holds where the flag is down
};
std::span<const SceneNeed> known_scene_needs();

/// What either needs, and what follows from it: a texture needs the lobe that it belongs to, and so on.
SceneNeeds united(SceneNeeds a, const SceneNeeds& b);

/// What is built though nothing needs it: by name, as in the list of what is left out (renderer/needs.h).
class Kept {
  public:
    Kept() = default;  ///< nothing
    explicit Kept(std::set<std::string, std::less<>> names) : names_(std::move(names)) {}
    static Kept everything();
    bool has(std::string_view name) const { return everything_ || names_.contains(name); }
    bool is_everything() const { return everything_; }
    const std::set<std::string, std::less<>>& names() const { return names_; }  ///< empty for everything()
    /// "nothing", "everything", or the names joined by commas.
    std::string text() const;
    bool operator==(const Kept&) const = default;

  private:
    std::set<std::string, std::less<>> names_;
    bool everything_ = false;
};

/// Whether it can be there without changing a picture: all but the environment map, which is sampled by other
/// directions than a constant environment, the light tree and the sun apart, which pick other lights, and the test of
/// needles, which rounds what other triangles' rays meet otherwise.
bool can_be_kept(const SceneNeed& need);
/// Of these, what is kept, and what follows from it: a lobe is there for its texture, and so on.
SceneNeeds kept_needs(const Kept& kept);

/// Macros (name, value) that select the variant of shaders/lib for a scene; sorted by name.
std::vector<std::pair<std::string, std::string>> shader_defines(const SceneNeeds& needs);

}  // namespace halflight
