// What `halflight view` keeps beside a scene, and `halflight render --settings` makes its picture by: a file of JSON.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "tools/halflight/arguments.h"

namespace halflight {

/// What is not told is left to the scene and to the command line.
struct SavedSettings {
    std::variant<std::monostate, std::string, CameraPose> camera;  // of the scene by name or number, or of one's own
    ViewTransform view;
    std::optional<ivec2> size;  // pixels
    std::optional<int> samples;
    std::optional<int> bounces;
    std::optional<Preview> preview;
    std::optional<float> clamp;     // RenderSettings::clamp
    EnvironmentChoice environment;  // a map's name leads to the file from the folder that is current
    SceneEdits edits;
    struct Moment {
        std::string animation;  // as of --animation
        std::uint32_t frame = 0;
        FrameRate rate;
        bool operator==(const Moment&) const = default;
    };
    std::optional<Moment> moment;  // none: at rest
    std::vector<Bookmark> bookmarks;
    bool operator==(const SavedSettings&) const = default;
};

/// SCENE.halflight.json.
std::filesystem::path settings_file_of(const std::filesystem::path& scene);

/// What the file that arguments.settings names, or else the one beside the scene, has to say, where it is there.
void take_settings(PreviewArguments& arguments);

/// Throws Error that names file and element: what it does not know, too.
SavedSettings read_settings(const std::filesystem::path& path);
/// Of what the file holds, which is not looked at.
SavedSettings parse_settings(std::string_view text, const std::filesystem::path& path);
/// The file is there complete or not at all (files.h).
void write_settings(const std::filesystem::path& path, const SavedSettings& settings);
/// What it holds then: names of maps lead to them from `folder`.
std::string settings_text(const SavedSettings& settings, const std::filesystem::path& folder);

}  // namespace halflight
