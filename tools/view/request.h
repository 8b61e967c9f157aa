// All inputs of a picture of the viewer, and the picture that is made of them.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "api/halflight/scene_edits.h"
#include "engine/settings/data_window.h"
#include "renderer/render.h"

namespace halflight::view {

/// Biased modes that improve pictures of few samples, whose effects RenderStats::biases describes, and what rays meet.
struct PreviewModes {
    Preview preview{};  // RenderSettings::preview; from some number of samples on, the picture is a plain mean
    float clamp = 0;    // RenderSettings::clamp
    Backfaces backfaces = Backfaces::automatic;  // RenderSettings::backfaces
    bool denoise = false;  // RenderSettings::denoise of the whole picture; coarse ones are filtered. Excludes `preview`
    bool show_lamps = false;  // RenderSettings::show_lamps
    bool operator==(const PreviewModes&) const = default;
};

inline constexpr int kMostSamples = 1 << 24;  ///< maximum samples of a picture: a float32 counts no further

/// Returns whether two cameras are equal, their names included.
bool same(const Camera& a, const Camera& b);

/// All inputs of a picture.
struct Request {
    /// Reference scene: the pose of the file at 0 s, before edits; not null. Pictures of all poses depend on it
    /// (PreparedScene::update()), and all poses share its images.
    std::shared_ptr<const Scene> reference;
    std::shared_ptr<const Scene> scene;  // scene at the frame, before edits; the reference itself if nothing moves
    std::shared_ptr<const SceneTree> reference_tree{};  // nodes of the reference; null: the scene has no file
    std::shared_ptr<const SceneTree> tree{};            // nodes of the scene
    std::shared_ptr<const paging::PageSource> pages{};  // geometry of scenes in pages; null: the scenes have it
    std::size_t pool_bytes = 0;                         // memory for pages; 0: half of what the budget has left
    SceneEdits edits;
    FrameNumber frame = 0;  // FrameSettings::frame
    Camera camera;
    ivec2 size{0};  // size of the picture, pixels
    // Pixels that take samples after the first whole picture; none: all of them.
    std::optional<PixelWindow> region{};
    int bounces = 8;
    std::vector<std::string> aovs;
    PreviewModes modes{};
    rays::Culling culling = rays::Culling::automatic;
    bool measure = false;  // RenderSettings::measure
    bool operator==(const Request& other) const;
};
/// Returns whether samples that were made for one request can also give the picture of another one: the requests differ
/// in AOVs and region only.
bool serves(const Request& made, const Request& wanted);
/// Returns the AOVs that samples are made with, whatever a request wants. Mattes would need much memory. They are made
/// from samples of their own.
std::vector<std::string> sampled_aovs();
/// Returns the AOVs of a complete picture: all that cost no rays of their own. Pictures are complete whenever their
/// samples have doubled, so that another layer can be shown at once.
std::vector<std::string> complete_aovs();
/// Returns whether motion of surfaces is wanted; it needs a comparison of poses before the samples begin.
bool wants_motion(const Request& request);
/// Returns the names of the mattes among the AOVs.
std::vector<std::string> mattes_of(const std::vector<std::string>& aovs);

struct Picture {
    std::uint64_t request = 0;       // number of the request that the picture was made for
    std::uint64_t view = 0;          // number of the first request that its samples were made for
    int divisor = 1;                 // request's width and height divided by the picture's; 1: whole picture
    double seconds = 0;              // time since the first request that its samples were made for, seconds
    Camera camera;                   // camera of the request
    std::vector<std::string> aovs;   // names of the result's AOVs: those of the request, and others
    std::optional<double> relmse{};  // estimated_relmse() of a whole picture or its region; none for a coarse one
    RenderResult result{};
    struct RegionSamples {
        PixelWindow window;
        int samples;  // least number of samples of its pixels
    };
    std::optional<RegionSamples> region{};  // region that takes samples; none: the whole picture does
    /// Returns the number of samples of the pixels that take samples; 0 for a coarse picture.
    int samples() const { return divisor > 1 ? 0 : region ? region->samples : result.stats.samples; }
};

}  // namespace halflight::view
