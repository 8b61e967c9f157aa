#include <algorithm>
#include <cmath>

#include "tools/halflight/options.h"
#include "tools/halflight/settings_file.h"

namespace halflight {
namespace {

/// Where one side is given, the other follows from the file's shape.
template <class Given>
void take_size(const ivec2& size, const Given& given, ViewArguments& a) {
    const auto scaled = [](int side, int to, int from) {
        return static_cast<int>(std::clamp(std::round(double(side) * to / from), 1.0, double{kMaxSide}));
    };
    const bool width = given("--width"), height = given("--height");
    if (given("--size") || (width && height)) return;
    a.width = height ? scaled(*a.height, size.x, size.y) : width ? *a.width : size.x;
    a.height = width ? scaled(*a.width, size.y, size.x) : height ? *a.height : size.y;
}

/// Of either command's arguments; what given(option) says was given goes before the file.
template <class A, class Given>
void take(const SavedSettings& s, const Given& given, A& a) {
    if (!given("--camera") && !given("--look-from")) {
        if (const auto* name = std::get_if<std::string>(&s.camera)) a.camera = *name;
        if (const auto* pose = std::get_if<CameraPose>(&s.camera)) a.pose = *pose;
    }
    if (!given("--display") && !given("--view")) {
        a.view.display = s.view.display;
        a.view.view = s.view.view;
    }
    if (!given("--look")) a.view.look = s.view.look;
    if (!given("--exposure")) a.view.exposure = s.view.exposure;
    if (!given("--samples") && !given("--time") && !given("--error") && s.samples) a.samples = s.samples;
    if (s.size) take_size(*s.size, given, a);
    if (!given("--bounces") && s.bounces) a.bounces = *s.bounces;
    if (!given("--preview") && !given("--error") && !given("--shutter") && s.preview) a.preview = *s.preview;
    if (!given("--clamp") && s.clamp) a.clamp = *s.clamp;
    if (!given("--env")) a.environment = s.environment;
    a.edits = s.edits;
    if (s.moment) {
        if (!given("--animation")) a.animation = s.moment->animation;
        if (!given("--fps")) a.frame_rate = s.moment->rate;
        if (!given("--frame") && !given("--frames")) a.frame = s.moment->frame;
    }
}

auto given_to(const CLI::App& app) {
    return [&app](const char* option) {
        const CLI::Option* known = app.get_option_no_throw(option);
        return known && known->count() > 0;
    };
}

template <class Given>
void take_file(const Given& given, PreviewArguments& a) {
    const auto file = a.settings.value_or(settings_file_of(a.scene));
    std::error_code none;
    if (!std::filesystem::exists(file, none)) return;
    const SavedSettings settings = read_settings(file);
    take(settings, given, a);
    for (std::optional<int>* side : {&a.width, &a.height})
        if (*side) *side = std::clamp(**side, kMinWindow, kMaxWindow);
    a.bookmarks = settings.bookmarks;
}

}  // namespace

void add_settings_option(Options& options, RenderArguments& a) {
    options.group("Picture");
    options.path(
        "--settings", "FILE.json",
        "camera, lights, size, exposure, samples, preview modes, ... as `halflight view` has saved them; other "
        "options override it",
        a.settings);
}

void use_settings(const CLI::App& app, RenderArguments& a) {
    const auto given = given_to(app);
    SavedSettings settings = read_settings(*a.settings);
    if (settings.preview && settings.preview->temporal && !given("--preview")) {
        if (a.frames.empty())
            settings.preview->temporal = false;  // a single picture has no earlier frames
        else if (given("--part"))                // without it, frames would not be those of the whole
            throw UsageError("--part",
                             "{} holds preview mode temporal, whose frames need all those before them; "
                             "--preview without it lets it go",
                             a.settings->string());
    }
    take(settings, given, a);
}

void use_settings(const CLI::App& app, PreviewArguments& a) {
    take_file(given_to(app), a);
}

void take_settings(PreviewArguments& a) {
    take_file([](const char*) { return false; }, a);
}

}  // namespace halflight
