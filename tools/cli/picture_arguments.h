// Arguments of the commands that make or show pictures, as values.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "api/halflight/camera.h"
#include "api/halflight/frame_renderer.h"
#include "api/halflight/loaded_scene.h"
#include "api/halflight/picture_file.h"
#include "api/halflight/settings_file.h"
#include "engine/core/error.h"
#include "engine/core/frames.h"
#include "engine/core/versioned_file.h"
#include "engine/settings/render_settings.h"
#include "tools/cli/console.h"

namespace halflight {

/// An option that edits the scene by name. Options come after the edits of a settings file, so they are kept as text.
struct EditOption {
    using Add = void (*)(SceneEdits& edits, const std::string& source, const std::string& text);
    const char* name;  // "--light"
    Add add;
    std::string text;
};

/// Decides which messages go where.
struct LogChoice {
    LogLevel level = LogLevel::note;            // messages on stderr
    std::optional<std::filesystem::path> file;  // file to which all messages are appended
    bool quiet() const { return level < LogLevel::note; }
};

/// Arguments of every command that makes pictures of a scene. Ranges are checked, names of cameras are not.
struct ViewArguments {
    SceneChoice choice;  // scene
    CameraChoice view;   // camera
    LogChoice log;
    /// Values of the options and files for the table of settings (engine/settings/settings_table.h). Camera and size
    /// are chosen later, from the scene and the members below.
    RenderSettings settings;
    std::optional<int> width;              // width of the picture, pixels; none: not given
    std::optional<int> height;             // height of the picture, pixels; none: not given
    int usual_width = 1280;                // width if neither is given, pixels
    std::vector<EditOption> edit_options;  // options that are in `choice.edits` already

    std::string device;
    bool gl_debug = false;
};

/// Arguments of `halflight render`; names of displays are not checked yet.
struct RenderArguments : ViewArguments {
    bool demo = false;                                   // the scene is demo_scene()
    bool needs_surfaces = false;                         // refuses scenes without surfaces
    std::optional<std::filesystem::path> settings_file;  // settings file, whose contents are in `settings` already
    std::vector<std::string> left_out;                   // entries of that file that options exclude
    // distinct pictures; names of sequences have placeholders; not empty without a movie
    std::vector<std::filesystem::path> outputs;
    OutputOptions output;                        // what the pictures hold
    std::optional<std::filesystem::path> movie;  // movie of all frames, .mp4 or .mov

    std::vector<FrameNumber> frames;  // frames of a sequence, in order; empty: one picture, of settings.frame
    Shutter shutter;
    bool overwrite = false;                     // replaces frames, or a checkpoint, that were made with other settings
    std::vector<std::string> accept_sources{};  // SequenceOptions::accept_sources
    ListPart part;                              // part of `frames`, or of the samples of a single picture, to render
    bool develop = false;                       // makes pictures from the .exr of frames instead of rendering
    bool merge = false;                         // joins the parts of a single picture instead of rendering it
    bool check = false;                         // renders nothing and checks that all frames are there
    std::optional<double> checkpoint;  // seconds between two saves of the samples of a single picture; none: no saves

    std::optional<std::filesystem::path> ocio;
    bool fstop_needs_focus = false;  // --fstop was given, and no output has an exposure that it could set
    bool no_shader_cache = false;
    bool json_progress = false;  // progress as lines of JSON, also if quiet()
    bool watch = false;          // renders again whenever a file of the picture changes
    std::optional<std::filesystem::path> stats;
    std::optional<std::filesystem::path> graph;
};

/// Arguments of `halflight view`; the picture has the size of the window.
struct PreviewArguments : ViewArguments {
    PreviewArguments() { settings.samples = 1024; }  // samples after which rendering stops

    std::optional<std::filesystem::path> settings_file;  // file to load and save; none: the file beside the scene
    VersionedFile settings_version;                      // the settings file, as it was when it was read
    std::vector<Bookmark> bookmarks;                     // bookmarks of the settings file
    /// The settings file as it was read, to be taken in parts if it does not suit the scene (settings_parts.h).
    struct Source {
        std::filesystem::path path;
        std::string text;
        std::vector<std::string> left_out;                           // what is wrong with entries that were left out
        std::function<PreviewArguments(const SavedSettings&)> with;  // the arguments with these settings in its place
    };
    std::shared_ptr<const Source> settings_source;  // null: there is no settings file
    bool chose_size = false;                        // an option or the settings file has set width and height
    std::optional<double> ui_scale;                 // size of text and controls; none: that of the monitor
    double budget = 100;                            // time until the first picture of a view, ms
    std::optional<std::filesystem::path> script;
    bool watch = false;  // loads files anew that change on disk
    std::optional<std::filesystem::path> ocio;
    bool no_shader_cache = false;
};

/// Text for stdout without its last newline: --help, --version.
struct Help {
    std::string text;
};

/// Error of an unusable command line; what() is one line "subject: what is wrong".
class UsageError : public Error {
  public:
    using Error::Error;
};

/// Parses the command line of `halflight view`. Throws UsageError.
std::variant<Help, PreviewArguments> parse_view_arguments(int argc, const char* const* argv);

/// Reads the settings file that the arguments name, or else the one beside the scene, if it exists. Entries that the
/// program does not know are left out.
void take_settings(PreviewArguments& arguments);

}  // namespace halflight
