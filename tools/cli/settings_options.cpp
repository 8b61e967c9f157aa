#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "api/halflight/settings_file.h"
#include "engine/io/files.h"
#include "tools/cli/installation.h"
#include "tools/cli/options.h"
#include "tools/cli/settings_parts.h"

namespace halflight {
namespace {

/// Takes the size of the settings file. If one side was given, the other follows from the file's aspect.
/// Pictures with an aspect of their own take the width only, since the viewer saves the size of its window.
template <class Given>
void take_size(const ivec2& size, const Given& given, bool own_aspect, ViewArguments& a) {
    const auto scaled = [](int side, int to, int from) {
        return static_cast<int>(std::clamp(std::round(double(side) * to / from), 1.0, double{kMaxSide}));
    };
    const bool width = given("--width"), height = given("--height");
    if (given("--size") || (width && height)) return;
    if (own_aspect) {
        const int eyes = static_cast<int>(eyes_in_picture(a.settings.optics).x);
        if (!width && !height) a.width = std::max(size.x / eyes, 1) * eyes;
        return;
    }
    a.width = height ? scaled(*a.height, size.x, size.y) : width ? *a.width : size.x;
    a.height = width ? scaled(*a.width, size.y, size.x) : height ? *a.height : size.y;
}

/// Sets the aspect of the camera of a scene that has none: that of one eye's picture.
void set_aspect(ViewArguments& a) {
    if (a.width && a.height) a.view.aspect = eye_aspect(a.settings.optics, {*a.width, *a.height});
}

/// Options that override a setting of the file, besides the setting's own option.
struct Override {
    std::string_view setting;
    const char* option;
};
constexpr Override kOverrides[] = {
    {"display", "--view"},         {"view", "--display"},       {"samples", "--time"},
    {"samples", "--error"},        {"exposure", "--iso"},       {"exposure", "--shutter-speed"},
    {"exposure", "--fstop"},       {"aperture", "--fstop"},     {"denoise", "--preview"},
    {"preview", "--shutter"},      {"preview", "--checkpoint"},  // the mode filter, too, which they do not exclude
    {"preview", "--adaptive"},     {"preview", "--crop"},       {"preview", "--overscan"},
    {"preview", "--sample-parts"},
};

/// Returns whether an option of a file, --preview or --denoise, gives way: it cannot be combined with an option that
/// was given. `with`: settings with the option of the file.
template <class Given>
bool gives_way(const std::string& option, const RenderSettings& with, const Occasion& occasion, const Given& given) {
    const auto of_file = [&](const char* other) { return other == option; };
    return (option == "--preview" || option == "--denoise") &&
           std::ranges::any_of(known_constraints(), [&](const Constraint& c) {
               return c.broken_by(with, occasion) && ((c.one.option(of_file) && c.other.option(given)) ||
                                                      (c.other.option(of_file) && c.one.option(given)));
           });
}

/// Takes the values of the file, except if given(option) says that an option was given.
template <class A, class Given>
void take(const SavedSettings& s, const std::filesystem::path& file, const Given& given, const Occasion& occasion,
          A& a) {
    if (!given("--camera") && !given("--look-from")) {
        if (const auto* name = std::get_if<std::string>(&s.camera)) {
            a.view.camera = *name;
            a.view.source = file.string();
        }
        if (const auto* pose = std::get_if<CameraPose>(&s.camera)) a.view.pose = *pose;
    }
    std::set<std::string_view> taken;
    for (const Setting& setting : known_settings()) {
        const auto overrides = [&](const Override& o) {
            // An f-number beside a focus sets no exposure. The table has the focus before the exposure.
            const bool blurs = o.option == std::string_view("--fstop") && o.setting == "exposure" &&
                               a.settings.view.camera.lens.focus.chosen();
            return o.setting == setting.name && given(o.option) && !blurs;
        };
        const std::string option = fmt::format("--{}", setting.name);
        if (!s.given.contains(setting.name) || given(option) || std::ranges::any_of(kOverrides, overrides)) continue;
        RenderSettings with = a.settings;
        copy_setting(setting, s.settings, with);
        if (gives_way(option, with, occasion, given)) continue;
        a.settings = std::move(with);
        taken.insert(setting.name);
    }
    // Denoising and preview modes exclude each other: an entry of the file ends the other one, which it does not name.
    bool& denoise = a.settings.denoise;
    Preview& preview = a.settings.preview;
    if (taken.contains("preview") && preview.any() && !taken.contains("denoise")) denoise = false;
    if (taken.contains("denoise") && denoise && !taken.contains("preview")) preview = {};
    const Optics& optics = a.settings.optics;
    const bool own_aspect = optics.projection != Projection::camera || eyes_in_picture(optics) != dvec2(1);
    if constexpr (std::is_same_v<A, PreviewArguments>) a.chose_size |= s.size.has_value();
    if (s.size) take_size(*s.size, given, std::is_same_v<A, RenderArguments> && own_aspect, a);
    if (!given("--variant")) a.choice.variant = s.variant;
    if (!given("--line-width")) a.choice.line_width = s.line_width;
    if (!given("--env") && !given("--sky"))
        a.choice.environment = s.environment, a.choice.light_azimuth = s.light_azimuth;
    const SceneEdits of_options = std::exchange(a.choice.edits, s.edits);
    if (given("--env-rotation")) a.choice.edits.environment_rotation = of_options.environment_rotation;
    if (given("--env-intensity")) a.choice.edits.environment_intensity = of_options.environment_intensity;
    if (given("--light-group")) a.choice.edits.light_groups.clear(), a.choice.edits.each_light = false;
    a.choice.edits_source = file.string();
    a.choice.keys = s.keys;
    for (const EditOption& option : a.edit_options) option.add(a.choice.edits, option.name, option.text);
    if (s.moment) {
        if (!given("--animation")) a.choice.animation = s.moment->animation;
        if (!given("--fps")) a.choice.frame_rate = s.moment->rate;
        if (!given("--frame") && !given("--frames")) a.settings.frame = s.moment->frame;
    }
}

/// Reads the settings file of the viewer, without entries that cannot be used. `given` has the names of the options
/// that were given.
void take_file(const std::set<std::string>& given, PreviewArguments& a) {
    const auto file = a.settings_file.value_or(settings_file_for(a.choice.scene));
    a.settings_version = versioned(file);
    std::error_code none;
    if (!std::filesystem::exists(file, none)) return;
    auto source = std::make_shared<PreviewArguments::Source>();
    source->path = file;
    source->text = read_settings_text(file);
    source->with = [base = a, given, file](const SavedSettings& settings) {
        PreviewArguments with = base;
        take(
            settings, file, [&](const std::string& option) { return given.contains(option); }, {}, with);
        for (const std::optional<int> side : {with.width, with.height})
            if (side && std::clamp(*side, kMinWindow, kMaxWindow) != *side)
                throw Error("size", "has a side of {} pixels; the viewer takes {} to {}", *side, kMinWindow,
                            kMaxWindow);
        with.bookmarks = settings.bookmarks;
        return with;
    };
    try {
        a = source->with(parse_settings(source->text, file));
    } catch (const Error&) {
        SettingsParts parts(source->text, file);
        source->left_out = parts.drop_unfit(source->with);
        a = source->with(parts.settings());
    }
    a.settings_source = std::move(source);
}

}  // namespace

void add_settings_option(Options& options, RenderArguments& a) {
    options.group("Picture");
    options.path(
        "--settings", "FILE.json",
        "settings file of `halflight view`: camera, lights, size, exposure, samples, preview modes, ...; other "
        "options override it",
        a.settings_file);
}

void take_size_options(const CLI::App& app, ViewArguments& a) {
    if (app.count("--width") > 0) a.width = a.settings.width;
    if (app.count("--height") > 0) a.height = a.settings.height;
    set_aspect(a);
}

void use_settings(const CLI::App& app, RenderArguments& a) {
    const auto given = [&](const std::string& option) { return halflight::given(app, option); };
    SavedSettings saved = read_settings(*a.settings_file);
    Preview preview_of_file = saved.settings.preview;
    const bool part_of_samples = given("--part") && a.frames.empty();
    if (part_of_samples && !given("--preview")) saved.settings.preview = {};
    if (a.frames.empty()) saved.settings.preview.temporal = preview_of_file.temporal = false;  // no earlier frames
    Occasion occasion = occasion_of(a);
    occasion.part_of_sequence = false;  // other parts would differ: check_combinations() refuses it
    occasion.light_groups = false;      // they end the cache alone
    take(saved, *a.settings_file, given, occasion, a);
    set_aspect(a);
    // The viewer, which saves such files, shows no light groups.
    const bool groups = a.choice.edits.each_light || !a.choice.edits.light_groups.empty();
    if (groups && !given("--preview")) a.settings.preview.cache = false;
    if (saved.settings.denoise && !a.settings.denoise && !given("--denoise")) a.left_out.emplace_back("denoise");
    if (preview_of_file.any() && a.settings.preview != preview_of_file && !given("--preview"))
        a.left_out.emplace_back(a.settings.preview.any() ? "a mode of preview" : "preview");
}

void use_settings(const CLI::App& app, PreviewArguments& a) {
    std::set<std::string> given;
    for (const CLI::Option* option : app.get_options())
        if (option->count() > 0)
            for (const std::string& name : option->get_lnames()) given.insert("--" + name);
    take_file(given, a);
}

void take_settings(PreviewArguments& a) {
    take_file({}, a);
}

}  // namespace halflight
