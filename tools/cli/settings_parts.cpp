#include "tools/cli/settings_parts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <utility>

#include "engine/core/error.h"

namespace halflight {
namespace {

constexpr const char* kVersionKey = "halflight_settings";
constexpr std::string_view kLists[] = {"lights",      "materials",    "transforms",      "nodes",
                                       "hide",        "bookmarks",    "shadow_catchers", "light_groups",
                                       "light_links", "shadow_links", "added_lights"};

/// Returns a number for settings that decide together; 0: the setting stands alone.
int joint_group(std::string_view key) {
    for (const std::string_view name : {"focus", "fstop", "aperture", "sensor", "blades", "blade-rotation"})
        if (key == name) return 1;
    for (const std::string_view name : {"display", "view", "look"})
        if (key == name) return 2;
    return 0;
}

}  // namespace

SettingsParts::SettingsParts(std::string_view text, std::filesystem::path path) : path_(std::move(path)) {
    const Json file = Json::parse(text, nullptr, false);
    const bool known = file.is_object() && file.contains(kVersionKey);
    if (!known) parse_settings(text, path_);  // throws
    version_[kVersionKey] = file.value(kVersionKey, Json());
    parsed(Json::object());  // throws for another version
    Json groups[3];
    for (const auto& [key, value] : file.items()) {
        if (key == kVersionKey) continue;
        const int group = joint_group(key);
        if (group > 0) {
            groups[group][key] = value;
        } else if (std::ranges::find(kLists, key) == std::end(kLists) || !value.is_structured()) {
            parts_.push_back({{key, value}});
        } else {
            // A list of lights is that of an object with their numbers.
            const bool numbered = value.is_object() || key == "lights";
            for (const auto& [name, member] : value.items())
                parts_.push_back({{key, numbered ? Json{{name, member}} : Json::array({member})}});
        }
    }
    for (Json& group : groups)
        if (!group.is_null()) parts_.push_back(std::move(group));
}

SavedSettings SettingsParts::parsed(const Json& part) const {
    Json file = version_;
    file.update(part);
    return parse_settings(file.dump(), path_);
}

std::vector<std::string> SettingsParts::drop_unfit(const std::function<void(const SavedSettings&)>& fits) {
    std::vector<std::string> problems;
    const std::string prefix = path_.string() + ": ";
    // Fitting entries on which others depend: edits name its sun and added lights, lenses suit its camera.
    Json base = Json::object();
    const auto is_base = [](const Json& part) {
        return part.contains("environment") || part.contains("camera") || part.contains("added_lights");
    };
    const auto drop = [&](bool of_base) {
        std::erase_if(parts_, [&](const Json& part) {
            if (is_base(part) != of_base) return false;
            Json with = base;
            with.update(part, true);
            try {
                fits(parsed(with));
                if (of_base) base = std::move(with);
                return false;
            } catch (const Error& error) {
                std::string_view what = error.what();
                if (what.starts_with(prefix)) what.remove_prefix(prefix.size());
                const std::string key = part.begin().key();
                problems.push_back(what.starts_with(key) ? std::string(what) : fmt::format("{}: {}", key, what));
                return true;
            }
        });
    };
    drop(true);
    drop(false);
    return problems;
}

SavedSettings SettingsParts::settings() const {
    Json file = Json::object();
    for (const Json& part : parts_) {
        for (const auto& [key, value] : part.items()) {
            if (value.is_array() && file.contains(key) && std::ranges::find(kLists, key) != std::end(kLists))
                file[key].insert(file[key].end(), value.begin(), value.end());
            else if (value.is_object() && file.contains(key))
                file[key].update(value);
            else
                file[key] = value;
        }
    }
    return parsed(file);
}

std::string left_out_warning(const std::filesystem::path& path, const std::vector<std::string>& problems) {
    return fmt::format("{}: {} left out, and the file stays as it is until settings are saved: {}", path.string(),
                       problems.size() == 1 ? "an entry is" : fmt::format("{} entries are", problems.size()),
                       fmt::join(problems, "; "));
}

}  // namespace halflight
