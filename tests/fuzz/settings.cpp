#include "api/halflight/settings_file.h"

#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/targets.h"

namespace halflight::fuzz {
namespace {

const std::filesystem::path kFile = "/there is none/settings.json";

void check_pose(const CameraPose& pose) {
    Scene scene;
    scene.cameras.push_back(camera_of(pose));
    validate(scene);
}

/// Removes the environment map, whose path may be written in another form than it was read.
SavedSettings without_map(SavedSettings settings) {
    if (std::holds_alternative<std::filesystem::path>(settings.environment)) settings.environment = {};
    return settings;
}

void write_and_read(const SavedSettings& settings) {
    const std::string text = settings_text(settings, kFile.parent_path());
    try {
        const SavedSettings again = parse_settings(text, kFile);
        if (without_map(again) != without_map(settings)) throw Broken("what is written is not what is read");
        if (settings_text(again, kFile.parent_path()) != text) throw Broken("it changes whenever it is written");
    } catch (const Error& error) {
        throw Broken(std::string("what is written cannot be read: ") + error.what());
    }
}

}  // namespace

void settings(std::string_view input) {
    check_errors(kFile.string(), [&] {
        const SavedSettings read = parse_settings(input, kFile);
        if (const auto* pose = std::get_if<CameraPose>(&read.camera)) check_pose(*pose);
        for (const Bookmark& bookmark : read.bookmarks) check_pose(bookmark.pose);
        write_and_read(read);
    });
}

}  // namespace halflight::fuzz
