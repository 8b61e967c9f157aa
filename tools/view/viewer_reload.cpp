// Files that change on disk while they are open: --watch.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "engine/io/files.h"
#include "engine/io/gltf/named_files.h"
#include "tools/view/viewer.h"

namespace halflight::view {
namespace {

bool differ(const std::vector<VersionedFile>& files) {
    return std::ranges::any_of(files, [](const auto& file) { return versioned(file.path).version != file.version; });
}

}  // namespace

std::function<Session::Opened()> Viewer::finding_files(const std::filesystem::path& scene,
                                                       std::function<Session::Opened()> opening) {
    if (!arguments_.watch) return opening;
    const auto found = std::make_shared<FileWatch>();
    finding_ = found;
    return [found, scene, opening = std::move(opening)] {
        for (const std::filesystem::path& file : files_named_by(scene)) found->add(file);
        return opening();
    };
}

void Viewer::watch_files() {
    if (!arguments_.watch) return;
    watch_ = named_ ? *named_ : FileWatch();
    watch_.add(session_.files());
    watch_.add(colors_.files());
    watch_.add(session_.settings_version());
}

bool Viewer::reload_changed() {
    if (!arguments_.watch || opening_.valid() || !saving_.empty() || !watch_.changed()) return false;
    frames_due_ = std::max(frames_due_, 2);
    if (differ(colors_.files())) take_colors();
    const VersionedFile settings = versioned(session_.settings_file());
    watch_.replace(settings);
    if (session_.settings_changed()) take_settings_file();
    if (opening_.valid()) return true;  // the settings file has another environment or variant
    if (!watch_.differs()) return true;
    watch_.renew();
    attempt([&] {
        const std::string name = session_.file().filename().string();
        start_opening(fmt::format("loading {} anew", name), finding_files(session_.file(), session_.reloading()), true);
        reloading_ = true;
    });
    return true;
}

void Viewer::take_colors() {
    for (const VersionedFile& file : colors_.files()) watch_.replace(versioned(file.path));
    try {
        const ColorConfig colors = ColorConfig::load(arguments_.ocio);
        processor_ = colors.view(session_.transform);
        display_.set_view(processor_);
        colors_ = colors;
        session_.set_colors(colors);
        watch_.add(colors.files());
        outdated_.erase("colours");
        tell(fmt::format("{} was loaded anew", colors.source()), "reload");
    } catch (const Error& error) {
        tell_outdated("colours", error.what());
    }
}

void Viewer::take_settings_file() {
    const std::string name = session_.settings_file().filename().string();
    if (!opening_.valid()) edit_history_.record(session_.document(), false);
    if (edit_history_.unsaved())
        return tell(fmt::format("{} has changed on disk; the edits of this window stay", name), "reload");
    try {
        PreviewArguments a;
        if (session_.file() == arguments_.choice.scene) {
            a = reread_();
        } else {
            a.choice.scene = session_.file();
            take_settings(a);
        }
        const SavedSettings document = session_.document(a);
        session_.set_settings_version(a.settings_version);
        takes_settings_ = true;
        restore(document, "reading the settings");
        outdated_.erase("settings");
        tell(fmt::format("{} was read", name), "reload");
    } catch (const Error& error) {
        tell_outdated("settings", error.what());
    }
}

void Viewer::tell_outdated(const std::string& what, const std::string& why) {
    outdated_[what] = fmt::format("{} (the picture shows the files before)", why);
    Console(arguments_.log.level).warn("{}", why);
    frames_due_ = std::max(frames_due_, 1);
}

}  // namespace halflight::view
