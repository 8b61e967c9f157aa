// Settings files: JSON that `halflight view` saves beside a scene, and that `halflight render --settings` reads.
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "api/halflight/loaded_scene.h"
#include "engine/settings/render_settings.h"

namespace halflight {

/// Contents of a settings file. Scene and command line decide on missing members.
struct SavedSettings {
    std::variant<std::monostate, std::string, CameraPose> camera;  // scene camera by name or number, or a free camera
    RenderSettings settings;              // values of the settings in `given`; others are ignored
    std::set<std::string_view> given{};   // names of given settings, whose table row is `saved`
    std::optional<ivec2> size;            // size of the picture, pixels
    std::string variant;                  // material variant; empty: the file's own materials
    double line_width = 0;                // diameter of points and lines, world units; 0: they are left out
    EnvironmentChoice environment;        // environment; paths of maps are relative to the current folder
    std::optional<double> light_azimuth;  // SceneChoice::light_azimuth, degrees, kEditRotation
    SceneEdits edits;
    EditKeys keys;  // edits over frames
    struct Moment {
        std::string animation;  // value of --animation
        FrameNumber frame = 0;
        FrameRate rate;
        bool operator==(const Moment&) const = default;
    };
    std::optional<Moment> moment;  // time at which the scene is posed; none: at rest
    std::vector<Bookmark> bookmarks;
    bool operator==(const SavedSettings& other) const;
};
/// Returns the names of all settings that settings files can hold: SavedSettings::given for a complete file.
std::set<std::string_view> saved_settings();

/// Takes environment, edits and their keys, variant, line width, animation and camera of the file at `path`.
void take_settings(const SavedSettings& settings, const std::filesystem::path& path, SceneChoice& scene,
                   CameraChoice& camera);

/// Returns SCENE.glb.halflight.json.
std::filesystem::path settings_file_of(const std::filesystem::path& scene);

/// Reads a settings file. Throws Error that names file and element, also for unknown settings.
SavedSettings read_settings(const std::filesystem::path& path);
/// Reads the contents of a settings file. Throws Error if it is missing or too long.
std::string read_settings_text(const std::filesystem::path& path);
/// Parses the contents of the file at `path`, which is not read.
SavedSettings parse_settings(std::string_view text, const std::filesystem::path& path);
/// Writes the file completely or not at all: under a temporary name, then renamed. Throws Error if it cannot.
void write_settings(const std::filesystem::path& path, const SavedSettings& settings);
/// Returns the contents of the file; paths of maps are relative to `folder`. Throws Error if the name of a map is
/// not UTF-8, as JSON needs.
std::string settings_text(const SavedSettings& settings, const std::filesystem::path& folder);

}  // namespace halflight
