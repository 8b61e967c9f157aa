// The command line as values.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/frames.h"
#include "engine/core/math.h"
#include "engine/settings/render_settings.h"
#include "tools/halflight/camera_pose.h"
#include "tools/halflight/scene_edits.h"
#include "tools/measure/bench/bench.h"
#include "tools/measure/compare/compare.h"
#include "tools/measure/converge/plan.h"
#include "tools/measure/converge/reference.h"

namespace halflight {

/// Value of --env: none, a constant radiance, or a map.
using EnvironmentChoice = std::variant<std::monostate, vec3, std::filesystem::path>;

/// Arguments of every command that makes pictures of a scene. Ranges are checked, names of cameras are not.
struct ViewArguments {
    std::filesystem::path scene;
    bool allow_outside = false;  // the scene may name files outside its folder

    /// Values of the options and files for the table of settings (engine/settings/settings_table.h). Camera and size
    /// are chosen later, from the scene and the members below.
    RenderSettings settings;
    std::optional<int> width;   // pixels, where given
    std::optional<int> height;  // pixels, where given
    int usual_width = 1280;     // width where neither is given
    std::optional<std::string> camera;
    std::optional<dvec3> look_from;
    std::optional<dvec3> look_at;
    dvec3 up{0, 1, 0};
    double vertical_fov = 45;        // degrees
    std::optional<CameraPose> pose;  // from a settings file

    EnvironmentChoice environment;
    SceneEdits edits;  // from a settings file

    std::string device;
    bool gl_debug = false;
    bool quiet = false;
};

/// Arguments of `halflight render`; names of displays are not checked yet.
struct RenderArguments : ViewArguments {
    std::optional<std::filesystem::path> settings_file;  // settings_file.h; its contents are in `settings` already
    // .exr or .png, no two alike; for a sequence with placeholders; none only where there is a movie
    std::vector<std::filesystem::path> outputs;
    std::optional<std::filesystem::path> movie;  // .mp4 or .mov, of all frames
    bool best_effort = false;                    // writes a picture that has not reached its error target

    std::vector<std::uint32_t> frames;     // frames of a sequence, in order; empty: one picture, of settings.frame
    std::optional<FrameRate> frame_rate;   // none: that of the scene, see AnimatedScene; frame 0 is at 0 s
    std::optional<std::string> animation;  // name, number, "all" or "none"
    double shutter = 0;                    // opening time of the shutter, in frames, [0,1]
    std::optional<int> shutter_times;      // number of times in the opening time at which the scene is rendered
    bool overwrite = false;                // replaces frames that were made with other settings
    ListPart part;                         // the part of `frames` to render
    bool check = false;                    // renders nothing and checks that all frames are there
    bool reproducible = false;             // writes no date into files

    std::optional<std::filesystem::path> ocio;
    std::string working_space;  // colour space of the .exr; empty: linear Rec.709

    bool strict = false;  // treats bad values as an error
    bool no_shader_cache = false;
    std::optional<std::filesystem::path> stats;
    std::optional<std::filesystem::path> graph;
};

/// Arguments of `halflight view`; the picture has the size of the window.
struct PreviewArguments : ViewArguments {
    PreviewArguments() { settings.samples = 1024; }  // after which rendering stops

    std::optional<std::filesystem::path> settings_file;  // to load and save; none: the file beside the scene
    std::vector<Bookmark> bookmarks;                     // from the settings file
    double budget = 100;                                 // ms until the first picture of a view
    std::optional<std::string> animation;                // see RenderArguments; none: at rest
    std::optional<FrameRate> frame_rate;                 // frames per second; none: that of the scene
    std::optional<std::filesystem::path> script;
    std::optional<std::filesystem::path> ocio;
    bool no_shader_cache = false;
};

/// Arguments of `halflight converge`; the size of the picture has another default.
struct ConvergeArguments : ViewArguments {
    std::filesystem::path folder;  // for the reports
    converge::Plan plan;
    std::vector<Estimator> estimators;  // to compare; empty: the default one. The plan has one for each method.
    std::vector<Preview> previews;      // to compare; empty: none. The plan has one for each method.
    bench::Clock clock = bench::Clock::wall;
    bool require_agreement = false;      // of the external renderer with the other methods
    converge::ReferenceOrder reference;  // folder: empty for the default one
};

/// Arguments of `halflight info`.
struct InfoArguments {
    std::optional<std::filesystem::path> scene;
    bool device = false;      // lists devices
    bool needs = false;       // lists the parts that rendering leaves out
    bool time = false;        // measures the time that this saves
    RenderArguments picture;  // the picture whose memory is estimated: size, camera, layers, ...; without files
    bool png = false;         // the picture is written as a .png, too
    bool json = false;
    bool allow_outside = false;
};

/// Text for stdout without its last newline: --help, --version.
struct Help {
    std::string text;
};

/// A command line that makes no sense; what() is one line "subject: what is wrong".
class UsageError : public Error {
  public:
    using Error::Error;
};

using bench::BenchArguments;      // `halflight bench`
using compare::CompareArguments;  // `halflight compare`

using Arguments = std::variant<Help, RenderArguments, PreviewArguments, ConvergeArguments, InfoArguments,
                               BenchArguments, CompareArguments>;
Arguments parse_arguments(int argc, const char* const* argv);

/// Returns whether the name ends in `.extension`, in any case.
bool has_extension(const std::filesystem::path& path, std::string_view extension);

}  // namespace halflight
