#include "tools/cli/installation.h"
#include "tools/cli/options.h"

namespace halflight {

ivec2 parse_size(const std::string& subject, const std::string& text) {
    const std::size_t x = text.find('x');
    if (x == std::string::npos) throw UsageError(subject, "expects WIDTHxHEIGHT in pixels, not '{}'", text);
    return {whole(subject, text.substr(0, x), kMinWindow, kMaxWindow),
            whole(subject, text.substr(x + 1), kMinWindow, kMaxWindow)};
}

void add_preview_options(CLI::App& app, PreviewArguments& a) {
    app.add_option("SCENE", a.choice.scene,
                   "glTF 2.0 scene, .gltf or .glb (default: one that is installed with the program)")
        ->type_name("");
    a.width = 1280, a.height = 720;
    a.settings.preview = {.cache = true, .filter = true};
    Options options(app);
    add_camera_options(options, a);
    options.settings(a.settings, &Setting::saved);
    options.group("Picture");
    options.value("--size", "WxH",
                  fmt::format("size of the picture in pixels, {} to {} a side (default {}x{}); the window shows it "
                              "whole, smaller on small screens",
                              kMinWindow, kMaxWindow, *a.width, *a.height),
                  [&](const auto& name, const auto& text) {
                      const ivec2 size = parse_size(name, text);
                      a.width = size.x, a.height = size.y;
                      a.chose_size = true;
                  });
    options.settings(a.settings, &Setting::saved);
    options.setting(setting("texture-lod"), a.settings);
    options.value(
        "--budget", "MS",
        fmt::format("time until a changed view is shown, in milliseconds; slow views are shown at a lower resolution "
                    "first (default {:g})",
                    a.budget),
        [&](const auto& name, const auto& text) { a.budget = real(name, text, 1, 1e6); });
    options.value("--ui-scale", "S", "factor on the size of text and controls, 0.5 to 4 (default: that of the monitor)",
                  [&](const auto& name, const auto& text) { a.ui_scale = real(name, text, 0.5, 4); });
    options.path("--settings", "FILE.json",
                 "settings file: read at the start if it exists, written by Ctrl-S (default: SCENE.glb.halflight.json)",
                 a.settings_file);
    options.group("Animation");
    add_animation_options(options, a.choice.animation, a.choice.frame_rate, "none, the scene at rest");
    options.setting(setting("frame"), a.settings);
    options.group("Light");
    options.settings(a.settings, &Setting::saved);
    add_environment_options(options, a.choice);
    add_variant_option(options, a.choice.variant);
    add_line_width_option(options, a.choice.line_width);
    add_edit_options(options, a);
    add_view_options(options, a.ocio, a.settings);
    add_device_options(options, a);
    add_page_options(options, a);
    add_strict_option(options, a.choice);
    options.settings(a.settings, &Setting::saved);
    options.flag("--no-shader-cache", a.no_shader_cache,
                 "neither reads nor writes compiled shaders in $XDG_CACHE_HOME/halflight/programs");
    options.flag("--watch", a.watch,
                 "loads scene, environment, settings file and colour config anew when they change on disk; edits stay");
    options.path("--script", "FILE", "runs a script, one command per line, and exits; docs/viewer.md lists them",
                 a.script);
}

void finish_preview_options(const CLI::App& app, PreviewArguments& a) {
    check_leftovers(app, "halflight view");
    if (a.choice.scene.empty()) a.choice.scene = demo_scene();
    check_camera_options(app, a.view);
    use_settings(app, a);
    a.choice.mip_levels = a.settings.texture_lod;
    if (a.width && a.height) a.view.aspect = double(*a.width) / *a.height;
    if (given(app, "--frame") && !a.choice.animation) throw UsageError("--frame", "needs --animation");
    if (a.settings.denoise && !given(app, "--preview")) a.settings.preview = {};
    RenderSettings modes;  // the viewer says itself what else it cannot show
    modes.denoise = a.settings.denoise, modes.preview = a.settings.preview;
    check_combinations(app, modes, {}, "");
}

std::variant<Help, PreviewArguments> parse_view_arguments(int argc, const char* const* argv) {
    CLI::App app("Hybrid raster and ray-traced global illumination.", "halflight");
    app.set_help_flag("-h,--help", "prints this help and exits");
    app.allow_extras();
    PreviewArguments arguments;
    CLI::App& view = *app.add_subcommand("view", "Shows a scene in an interactive window");
    view.allow_extras();
    add_preview_options(view, arguments);
    try {
        app.parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
        return help_of(app);
    } catch (const CLI::ParseError& error) {
        throw usage_error(error, "halflight view");
    }
    finish_preview_options(view, arguments);
    return arguments;
}

}  // namespace halflight
