#include "api/halflight/settings_file.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <tuple>

#include "api/scene/settings_edits.h"
#include "engine/core/error.h"
#include "engine/core/suggestion.h"
#include "engine/io/files.h"
#include "engine/settings/constraints.h"
#include "engine/settings/settings_table.h"

namespace halflight {
namespace {

using settings::Element;
using settings::Json;
using settings::kFar;
using settings::list;
using settings::with;
namespace fs = std::filesystem;

constexpr int kVersion = 1;
constexpr std::uint64_t kMaxBytes = 16 << 20;

/// Parses JSON. Throws Error that names the file, and the line and column of a syntax error.
Json parse_json(std::string_view text, const fs::path& path) {
    try {
        return Json::parse(text);
    } catch (const Json::parse_error& error) {
        const std::string_view before = text.substr(0, error.byte - 1);
        throw Error(path.string(), "is not valid JSON at line {}, column {}", 1 + std::ranges::count(before, '\n'),
                    before.size() - before.rfind('\n'));  // npos is -1
    } catch (const Json::out_of_range&) {
        throw Error(path.string(), "is not valid JSON: a number is too large");
    }
}

CameraPose read_pose(const Element& e) {
    std::set<std::string> known{"from", "at", "up", "vfov_degrees", "ortho_height", "near", "far"};
    if (e.find("vfov")) known.insert("vfov");  // files of earlier releases have it; no message suggests it
    e.check_keys(known);
    CameraPose pose;
    with(e, "from", [&](const Element& v) { pose.from = v.triple(-kFar, kFar); });
    with(e, "at", [&](const Element& v) { pose.at = v.triple(-kFar, kFar); });
    with(e, "up", [&](const Element& v) { pose.up = v.triple(-kFar, kFar); });
    with(e, "vfov_degrees", [&](const Element& v) { pose.vertical_fov = glm::radians(v.number(0.005, 180)); });
    with(e, "vfov", [&](const Element& v) {  // files of earlier releases have radians
        if (e.find("vfov_degrees")) v.fail("is there beside 'vfov_degrees'");
        pose.vertical_fov = glm::radians(exact_degrees(v.number(1e-4, kPi)));
    });
    with(e, "ortho_height", [&](const Element& v) {
        pose.ortho_height = v.number(1e-30, kFar);
        pose.orthographic = true;
    });
    with(e, "near", [&](const Element& v) { pose.near_plane = v.number(0, kFar); });
    with(e, "far", [&](const Element& v) { pose.far_plane = v.number(0, kFar); });
    try {
        camera_of(pose);
    } catch (const Error& error) {
        e.fail("{}", error.reason());
    }
    return pose;
}

ivec2 read_size(const Element& e) {
    const auto sides = e.items();
    if (sides.size() != 2) e.fail("is no list of two numbers");
    return {sides[0].whole(1, kMaxSide), sides[1].whole(1, kMaxSide)};
}

void read_setting(const Element& e, const Setting& setting, SavedSettings& s) {
    std::string text;
    if (setting.type == Setting::Type::flag)
        text = e.truth() ? "yes" : "no";
    else if (setting.type == Setting::Type::whole && e.is_string() && setting.get(RenderSettings()) == "auto")
        text = e.text();
    else if (setting.type == Setting::Type::whole)
        text = fmt::format(
            "{}", e.whole(static_cast<int>(setting.zero ? 0 : setting.lower), static_cast<int>(setting.upper)));
    else if (setting.type == Setting::Type::number)
        text = e.is_string() && !setting.values.empty()
                   ? e.text()
                   : fmt::format("{}", e.number(setting.zero ? 0 : setting.lower, setting.upper));
    else
        text = e.text();
    if (const std::string problem = setting.set(s.settings, text); !problem.empty()) e.fail("{}", problem);
    if (!setting.get(s.settings).empty()) s.given.insert(setting.name);  // an empty text leaves the setting open
}

void write_setting(const Setting& setting, const SavedSettings& s, Json& json) {
    const std::string text = setting.get(s.settings);
    if (text.empty()) return;
    if (setting.type == Setting::Type::flag)
        json[setting.name] = text == "yes";
    else if (setting.type == Setting::Type::text || std::isalpha(static_cast<unsigned char>(text[0])))
        json[setting.name] = text;
    else
        json[setting.name] = Json::parse(text);
}

Json pose_json(const CameraPose& pose) {
    Json json{{"from", list(pose.from)},
              {"at", list(pose.at)},
              {"up", list(pose.up)},
              {"vfov_degrees", exact_degrees(pose.vertical_fov)}};
    if (pose.orthographic) json["ortho_height"] = pose.ortho_height;
    if (pose.near_plane > 0) json["near"] = pose.near_plane;
    if (pose.far_plane > 0) json["far"] = pose.far_plane;
    return json;
}

void read_environment(const Element& e, const fs::path& folder, SavedSettings& s) {
    e.check_keys({"map", "color", "preset", "sky", "azimuth", "rotation", "intensity", "tint"});
    std::string found;
    for (const char* kind : {"map", "color", "preset", "sky"}) {
        if (!e.find(kind)) continue;
        if (!found.empty()) e.fail("has both '{}' and '{}'", found, kind);
        found = kind;
    }
    with(e, "map", [&](const Element& v) { s.environment = settings::read_path(v, folder); });
    with(e, "color", [&](const Element& v) { s.environment = vec3(v.triple(0, kFar)); });
    with(e, "preset", [&](const Element& v) {
        const auto presets = sky_presets();
        const auto preset =
            std::ranges::find_if(presets, [wanted = v.text()](SkyPreset p) { return wanted == name(p); });
        if (preset == presets.end()) v.fail("is none of neutral, studio, sky, overcast");
        s.environment = *preset;
    });
    with(e, "sky", [&](const Element& v) {
        v.check_keys({"elevation", "azimuth", "turbidity", "albedo", "altitude"});
        ClearSky sky;
        with(v, "elevation", [&](const Element& n) { sky.elevation = n.number(kLeastElevation, 90); });
        with(v, "azimuth", [&](const Element& n) { sky.azimuth = n.number(-360, 360); });
        with(v, "turbidity", [&](const Element& n) { sky.turbidity = n.number(kLeastTurbidity, kMostTurbidity); });
        with(v, "albedo", [&](const Element& n) { sky.ground_albedo = n.number(0, 1); });
        with(v, "altitude", [&](const Element& n) { sky.altitude = n.number(0, kMostAltitude); });
        s.environment = sky;
    });
    with(e, "azimuth", [&](const Element& v) { s.light_azimuth = v.number(kEditRotation); });
    with(e, "rotation", [&](const Element& v) { s.edits.environment_rotation = v.number(kEditRotation); });
    with(e, "intensity",
         [&](const Element& v) { s.edits.environment_intensity = static_cast<float>(v.number(kEditFactor)); });
    with(e, "tint", [&](const Element& v) { s.edits.environment_tint = vec3(v.triple(kEditColor)); });
}

Json environment_json(const SavedSettings& s, const fs::path& folder) {
    Json json = Json::object();
    if (const auto* map = std::get_if<fs::path>(&s.environment)) json["map"] = settings::path_json(*map, folder);
    if (const auto* color = std::get_if<vec3>(&s.environment)) json["color"] = list(*color);
    if (const auto* preset = std::get_if<SkyPreset>(&s.environment)) json["preset"] = name(*preset);
    if (const auto* sky = std::get_if<ClearSky>(&s.environment))
        json["sky"] = {{"elevation", sky->elevation},
                       {"azimuth", sky->azimuth},
                       {"turbidity", sky->turbidity},
                       {"albedo", sky->ground_albedo},
                       {"altitude", sky->altitude}};
    if (s.light_azimuth) json["azimuth"] = *s.light_azimuth;
    json["rotation"] = s.edits.environment_rotation;
    json["intensity"] = short_number(s.edits.environment_intensity);
    if (s.edits.environment_tint != vec3(1)) json["tint"] = list(s.edits.environment_tint);
    return json;
}

SavedSettings::Moment read_moment(const Element& e) {
    SavedSettings::Moment moment;
    e.check_keys({"name", "frame", "fps"});
    const auto name = e.find("name");
    if (!name) e.fail("needs a name");
    moment.animation = name->text();
    if (moment.animation.empty()) name->fail("is empty");
    with(e, "frame", [&](const Element& v) {
        const double frame = v.number(kLeastFrame, kMostFrame);
        if (frame != std::floor(frame)) v.fail("is no whole number");
        moment.frame = static_cast<FrameNumber>(frame);
    });
    with(e, "fps", [&](const Element& v) { moment.rate = parse_frame_rate(v.where(), v.text()); });
    return moment;
}

}  // namespace

bool SavedSettings::operator==(const SavedSettings& other) const {
    const auto same = [&](std::string_view name) {
        return setting(name).get(settings) == setting(name).get(other.settings);
    };
    const auto rest = [](const SavedSettings& s) {
        return std::tie(s.given, s.camera, s.size, s.variant, s.line_width, s.environment, s.light_azimuth, s.edits,
                        s.keys, s.moment, s.bookmarks);
    };
    return rest(*this) == rest(other) && std::ranges::all_of(given, same);
}

std::set<std::string_view> saved_settings() {
    std::set<std::string_view> names;
    for (const Setting& setting : known_settings())
        if (setting.saved) names.insert(setting.name);
    return names;
}

void take_settings(const SavedSettings& s, const fs::path& path, SceneChoice& scene, CameraChoice& camera) {
    if (const auto* name = std::get_if<std::string>(&s.camera)) {
        camera.camera = *name;
        camera.source = path.string();
    }
    if (const auto* pose = std::get_if<CameraPose>(&s.camera)) camera.pose = *pose;
    scene.variant = s.variant;
    scene.line_width = s.line_width;
    scene.environment = s.environment;
    scene.light_azimuth = s.light_azimuth;
    scene.edits = s.edits;
    scene.edits_source = path.string();
    scene.keys = s.keys;
    if (s.moment) scene.animation = s.moment->animation, scene.frame_rate = s.moment->rate;
}

fs::path settings_file_of(const fs::path& scene) {
    return scene.string() + ".halflight.json";
}

SavedSettings read_settings(const fs::path& path) {
    return parse_settings(read_settings_text(path), path);
}

std::string read_settings_text(const fs::path& path) {
    return read_file(path, kMaxBytes);
}

SavedSettings parse_settings(std::string_view text, const fs::path& path) {
    const Json json = parse_json(text, path);
    const Element file(path, json);
    std::set<std::string> keys{"halflight_settings", "camera",      "size",         "environment",
                               "emission",           "lights",      "clay",         "materials",
                               "transforms",         "animation",   "bookmarks",    "variant",
                               "line_width",         "nodes",       "hide",         "shadow_catchers",
                               "light_groups",       "lamp_radius", "sun_angle",    "ground",
                               "glass_shadows",      "light_links", "shadow_links", "added_lights",
                               "keys"};
    for (const std::string_view name : saved_settings()) keys.emplace(name);
    file.check_keys(keys);
    const auto version = file.find("halflight_settings");
    if (!version) file.fail("has no 'halflight_settings', the version of its format");
    if (version->whole(0, 1 << 30) != kVersion) version->fail("is not {}, the version that is known", kVersion);

    SavedSettings s;
    with(file, "camera", [&](const Element& v) {
        if (v.is_string())
            s.camera = v.text();
        else
            s.camera = read_pose(v);
    });
    for (const Setting& setting : known_settings())
        if (setting.saved) with(file, setting.name, [&](const Element& v) { read_setting(v, setting, s); });
    RenderSettings whole = s.settings;
    whole.preview.temporal = false;  // single pictures leave it out
    if (const Constraint* const row = broken_constraint(whole)) {
        const char* const option = row->one.options[0];
        (option ? file.find(option + 2) : std::nullopt).value_or(file).fail("{}", row->text());
    }
    with(file, "size", [&](const Element& v) { s.size = read_size(v); });
    with(file, "variant", [&](const Element& v) { s.variant = v.text(); });
    with(file, "line_width", [&](const Element& v) { s.line_width = v.number(kLineWidth); });
    with(file, "environment", [&](const Element& v) { read_environment(v, path.parent_path(), s); });
    settings::read_edits(file, path.parent_path(), s.edits);
    with(file, "keys", [&](const Element& v) { settings::read_keys(v, s.keys); });
    with(file, "animation", [&](const Element& v) { s.moment = read_moment(v); });
    with(file, "bookmarks", [&](const Element& v) {
        for (const Element& one : v.items()) {
            one.check_keys({"name", "camera"});
            const auto name = one.find("name"), camera = one.find("camera");
            if (!name || !camera) one.fail("needs a name and a camera");
            s.bookmarks.push_back({name->text(), read_pose(*camera)});
        }
    });
    return s;
}

void write_settings(const fs::path& path, const SavedSettings& s) {
    write_file(path, settings_text(s, path.parent_path()));
}

std::string settings_text(const SavedSettings& s, const fs::path& folder) {
    Json json{{"halflight_settings", kVersion}};
    if (const auto* name = std::get_if<std::string>(&s.camera)) json["camera"] = *name;
    if (const auto* pose = std::get_if<CameraPose>(&s.camera)) json["camera"] = pose_json(*pose);
    if (s.size) json["size"] = {s.size->x, s.size->y};
    for (const Setting& setting : known_settings())
        if (s.given.contains(setting.name)) write_setting(setting, s, json);
    if (!s.variant.empty()) json["variant"] = s.variant;
    if (s.line_width > 0) json["line_width"] = s.line_width;
    json["environment"] = environment_json(s, folder);
    settings::write_edits(s.edits, folder, json);
    if (!s.keys.empty()) json["keys"] = settings::keys_json(s.keys);
    if (s.moment)
        json["animation"] = {{"name", s.moment->animation},
                             {"frame", s.moment->frame},
                             {"fps", fmt::format("{}/{}", s.moment->rate.numerator, s.moment->rate.denominator)}};
    json["bookmarks"] = Json::array();
    for (const Bookmark& b : s.bookmarks)
        json["bookmarks"].push_back({{"name", b.name}, {"camera", pose_json(b.pose)}});
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace halflight
