// The command line as values.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "engine/color/color.h"
#include "engine/core/error.h"
#include "engine/core/frames.h"
#include "engine/core/math.h"
#include "engine/core/pixel_filter.h"
#include "engine/rays/tracer.h"
#include "engine/settings/estimator.h"
#include "engine/settings/frame_settings.h"
#include "engine/settings/preview.h"
#include "engine/tables/needs.h"
#include "tools/halflight/camera_pose.h"
#include "tools/halflight/scene_edits.h"
#include "tools/measure/bench/bench.h"
#include "tools/measure/compare/compare.h"
#include "tools/measure/converge/plan.h"
#include "tools/measure/converge/reference.h"

namespace halflight {

inline constexpr int kMaxSide = 65536;  ///< of a picture, pixels; what the driver can do is told by the renderer

/// What --env asks for: nothing, a constant radiance, a map.
using EnvironmentChoice = std::variant<std::monostate, vec3, std::filesystem::path>;

/// What is looked at, of whatever command makes a picture; ranges are checked, names of cameras are not yet.
struct ViewArguments {
    std::filesystem::path scene;
    bool allow_outside = false;  // files that the scene names outside its folder

    std::optional<int> width;   // pixels
    std::optional<int> height;  // pixels
    int usual_width = 1280;     // where neither is given
    std::optional<std::string> camera;
    std::optional<dvec3> look_from;
    std::optional<dvec3> look_at;
    dvec3 up{0, 1, 0};
    double vertical_fov = 45;        // degrees
    std::optional<CameraPose> pose;  // of a file of settings

    PixelFilter::Shape filter = PixelFilter::Shape::box;
    std::optional<double> filter_radius;  // pixels
    PixelFilter pixel_filter() const { return {filter, filter_radius.value_or(usual_radius(filter))}; }

    int bounces = 8;
    EnvironmentChoice environment;
    SceneEdits edits;  // of a file of settings

    std::string device;
    bool gl_debug = false;
    bool quiet = false;
};

/// `halflight render`; names of displays are not checked yet.
struct RenderArguments : ViewArguments {
    std::optional<std::filesystem::path> settings;  // settings_file.h; what it says is in its places already
    // .exr or .png, no two alike; of a sequence with placeholders; none only where there is a movie
    std::vector<std::filesystem::path> outputs;
    std::optional<std::filesystem::path> movie;  // .mp4 or .mov, of all frames

    std::optional<int> samples;
    std::optional<double> time;  // seconds
    std::optional<double> error;
    ErrorMetric error_metric = ErrorMetric::relmse;
    bool best_effort = false;  // a picture whose error was not reached is one
    std::uint32_t seed = 0;
    std::uint32_t frame = 0;
    float clamp = 0;  // RenderSettings::clamp

    std::vector<std::uint32_t> frames;     // of a sequence, in their order; empty: one picture, of `frame`
    std::optional<FrameRate> frame_rate;   // none: the scene's, see AnimatedScene; frame 0 is at 0 s
    std::optional<std::string> animation;  // name, number, "all" or "none"
    double shutter = 0;                    // open for so much of a frame, [0,1]
    std::optional<int> shutter_times;      // at which it is seen meanwhile
    bool overwrite = false;                // frames of other settings are replaced
    ListPart part;                         // of `frames`: those that are to be made
    bool check = false;                    // make none, see that all are there
    bool reproducible = false;             // no date in files

    std::vector<std::string> aovs;
    bool half = false;
    std::optional<std::filesystem::path> ocio;
    ViewTransform view;
    std::string working_space;  // of EXR colour; empty: linear Rec.709

    rays::Culling culling = rays::Culling::automatic;
    PrimaryVisibility primary = PrimaryVisibility::automatic;
    bool strict = false;  // bad values are an error
    Kept kept;
    bool keep_all = false;
    Estimator estimator;
    Preview preview;
    bool no_shader_cache = false;
    std::optional<std::filesystem::path> stats;
    std::optional<std::filesystem::path> graph;
};

/// `halflight view`; the window's size is the picture's.
struct PreviewArguments : ViewArguments {
    std::optional<std::filesystem::path> settings;  // to be saved, and read already; none: beside the scene
    std::vector<Bookmark> bookmarks;                // that it has
    std::optional<int> samples;                     // per pixel, after which nothing more is done
    Preview preview;                                // modes that are on at the start
    float clamp = 0;                                // RenderSettings::clamp, likewise
    double budget = 100;                            // ms until the first picture of a view
    std::optional<std::string> animation;           // as of RenderArguments; none: at rest
    std::optional<FrameRate> frame_rate;            // of the animation; none: the scene's
    std::uint32_t frame = 0;                        // that is seen first
    std::optional<std::filesystem::path> script;
    std::optional<std::filesystem::path> ocio;
    ViewTransform view;
    bool no_shader_cache = false;
};

/// `halflight converge`; the view's size has defaults of its own.
struct ConvergeArguments : ViewArguments {
    std::filesystem::path folder;  // of the reports
    converge::Plan plan;
    std::vector<Estimator> estimators;  // as asked for, none: the default one; the plan has them by method
    std::vector<Preview> previews;      // likewise
    bench::Clock clock = bench::Clock::wall;
    bool require_agreement = false;      // of the external renderer with the other methods
    converge::ReferenceOrder reference;  // folder: empty for the default one
};

/// `halflight info`.
struct InfoArguments {
    std::optional<std::filesystem::path> scene;
    bool device = false;      // list devices
    bool needs = false;       // what rendering does without
    bool time = false;        // what that saves
    RenderArguments picture;  // what memory is told for: settings, size, camera, layers, ...; without files
    bool png = false;         // that there would be one
    bool json = false;
    bool allow_outside = false;
};

/// Lines for stdout, the last one without its end: --help, --version.
struct Help {
    std::string text;
};

/// The command line asks for something that makes no sense; what() is one line "subject: what is wrong".
class UsageError : public Error {
  public:
    using Error::Error;
};

using bench::BenchArguments;      // `halflight bench`
using compare::CompareArguments;  // `halflight compare`

using Arguments = std::variant<Help, RenderArguments, PreviewArguments, ConvergeArguments, InfoArguments,
                               BenchArguments, CompareArguments>;
Arguments parse_arguments(int argc, const char* const* argv);

/// Whether the name ends in `.extension`, in any case.
bool has_extension(const std::filesystem::path& path, std::string_view extension);

}  // namespace halflight
