#include "tools/halflight/options.h"
#include "tools/halflight/settings_file.h"

namespace halflight {
namespace {

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
    if (!given("--bounces") && s.bounces) a.bounces = *s.bounces;
    if (!given("--env")) a.environment = s.environment;
    a.edits = s.edits;
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
    a.bookmarks = settings.bookmarks;
}

}  // namespace

void add_settings_option(Options& options, RenderArguments& a) {
    options.group("Picture");
    options.path(
        "--settings", "FILE.json",
        "camera, lights, exposure, samples, ... as `halflight view` has saved them; other options override it",
        a.settings);
}

void use_settings(const CLI::App& app, RenderArguments& a) {
    take(read_settings(*a.settings), given_to(app), a);
}

void use_settings(const CLI::App& app, PreviewArguments& a) {
    take_file(given_to(app), a);
}

void take_settings(PreviewArguments& a) {
    take_file([](const char*) { return false; }, a);
}

}  // namespace halflight
