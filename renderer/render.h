// The renderer: a scene, settings, pictures.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/color/color.h"
#include "engine/device/prepared_scene.h"
#include "engine/gpu/context.h"
#include "engine/scene/scene.h"
#include "engine/settings/estimator.h"
#include "engine/settings/frame_settings.h"
#include "engine/settings/preview.h"
#include "engine/settings/visibility.h"
#include "engine/tables/needs.h"
#include "renderer/render_result.h"

namespace halflight {

class RadianceCache;

/// An arbitrary output variable that can be asked for by name.
struct AovInfo {
    std::string_view name;         // EXR layer ("albedo", "depth")
    std::string_view channels;     // after the layer's name ("RGB", "XYZ", "Z")
    std::string_view description;  // one line with units
    bool debug = false;            // tells how the picture was made, not what it shows; may differ from run to run
    bool at_centre = false;        // of the ray through the pixel's centre alone: has no mean over samples or times
    bool at_any_time = false;      // made of what all samples leave behind: can still be asked for after them
};
/// Of known_aovs(), by name; null for others.
const AovInfo* find_aov(std::string_view name);
/// Those for debugging come last.
std::span<const AovInfo> known_aovs();

/// Those of the first picture, and what is the same for all pictures of a renderer.
struct RenderSettings : FrameSettings {
    int width = 1280;  // pixels, > 0
    int height = 720;  // pixels, > 0
    int bounces = 8;   // reflections along a path, >= 0: 0 emission only, 1 direct light
    // > 0: the most luminance that a sample of a pixel's indirect light may have; brighter ones keep their hue and are
    // dimmed to it. A bias, which RenderStats names.
    float clamp = 0;
    std::vector<std::string> aovs;  // names of known_aovs(); Error for others
    bool half_color = false;        // colour layers as half floats; data stays float32
    bool want_view = false;         // also the picture through `view`
    ViewTransform view;
    rays::Culling culling = rays::Culling::automatic;          // who finds hits; never changes the picture
    PrimaryVisibility primary = PrimaryVisibility::automatic;  // who finds what the camera sees
    // What is built though the scene has no use for it: passes, buffers, tables, shader code. Never changes the
    // picture. Of renderers that share a scene, the scene's.
    Kept kept{};
    Estimator estimator{};  // of renderers that share a scene, the scene's
    // A bias, which RenderStats names; not where there is an error to reach. Layers are without, but for the cache.
    Preview preview{};
    // That preview.cache uses; it may be shared by renderers of one scene with as many bounces. Null: one of its own.
    // Pictures depend on what was made with it before.
    std::shared_ptr<RadianceCache> radiance_cache{};
    int pictures = 0;      // that will be made at most, of `samples` each; 0: any number
    bool measure = false;  // wait for the GPU after each pass to tell its time, and count rays and culling (slower)
    // What is rendered at once: bands of whole rows of 16x16 blocks, of so many pixels at most where one row allows it.
    // Half a gigabyte of buffers by default, of a large picture.
    std::size_t band_pixels = std::size_t{1} << 20;
    // Of visibility state, which bands have each to themselves; where there are too many for that, the last ones share.
    std::size_t state_bytes = std::size_t{256} << 20;
    // Bands get their samples in turns instead of one band after the other, so that there is a whole picture after each
    // sample, to be seen by RenderProgress::picture. Never changes a picture; keeps the sums of all bands in memory, up
    // to 200 bytes per pixel. Where there is an error to reach, bands come one after the other all the same.
    bool in_turns = false;
};

/// Renders one picture after the other. What it learns about visibility and about who traces fastest lives on from band
/// to band and from picture to picture, and decides about time alone: a picture is a function of scene and settings,
/// whatever was rendered before, preview modes apart. Needs its context current on the calling thread for as long as it
/// lives.
class Renderer {
  public:
    /// Shares a scene, which must outlive it. Throws Error for settings out of range, for raster culling of a scene
    /// that was prepared without it, and for limits of the driver.
    Renderer(PreparedScene&, const ColorConfig&, RenderSettings);
    /// Prepares a scene of its own. The context must outlive it.
    Renderer(gpu::Context&, const Scene&, const ColorConfig&, const RenderSettings&);
    Renderer(Renderer&&) noexcept;
    ~Renderer();

    /// Throws Error for settings out of range.
    RenderResult render(const FrameSettings&, const ProgressCallback& = {});
    /// The picture of the RenderSettings.
    RenderResult render(const ProgressCallback& = {});
    /// Of a renderer with a scene of its own: brings it to another pose (PreparedScene::update). What was learned of
    /// who traces fastest and of what is visible lives on where the pose needs no other shaders or buffers; the
    /// radiance cache is emptied. Throws Error; the renderer is of no use then.
    void update(const Scene&);
    /// Of a renderer that shares its scene, the same after an update() of that which has returned true.
    void follow_scene();
    /// Camera cut: the next picture has nothing in common with the last one, and what was learned is forgotten, the
    /// radiance cache with it. (Other scenes and sizes have renderers of their own.)
    void forget(std::string reason);
    /// The compiled frame graph in Graphviz' dot language.
    std::string graph_dot() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace halflight
