#include "tools/halflight/arguments.h"

#include <fmt/ranges.h>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/core/error.h"
#include "engine/core/suggestion.h"
#include "passes/picture/adaptive.h"
#include "renderer/render.h"
#include "renderer/replicates.h"
#include "renderer/settings_check.h"
#include "tools/cli/options.h"
#include "tools/halflight/converge_options.h"
#include "tools/halflight/render_parts.h"

namespace halflight {
namespace {

void add_picture_options(Options& options, RenderArguments& a) {
    options.group("Picture");
    options.settings(a.settings);
    options.value("--error-metric", "NAME", "metric of --error: relmse, mse (default relmse)",
                  [&](const auto& name, const auto& text) {
                      if (!a.settings.error) throw UsageError(name, "needs --error");
                      const std::string target = fmt::format("{} {}", a.settings.error->error, text);
                      const std::string problem = setting("error").set(a.settings, target);
                      if (!problem.empty()) throw UsageError(name, problem);
                  });
    options.flag("--best-effort", a.best_effort, "writes the picture even if its error target was not reached");
    options.value(
        "--checkpoint", "SECONDS",
        "saves the samples in the folder OUTPUT.checkpoint every SECONDS, and when a signal ends the program; "
        "the same command then goes on from there, to the same bits",
        [&](const auto& name, const auto& text) { a.checkpoint = real(name, text, 0.001, 1e9); });
}

void add_light_options(Options& options, ViewArguments& a) {
    options.group("Light");
    options.settings(a.settings);
    add_environment_options(options, a);
    add_variant_option(options, a.variant);
    add_line_width_option(options, a.line_width);
    add_edit_options(options, a);
}

void add_color_options(Options& options, RenderArguments& a) {
    add_view_options(options, a.ocio, a.settings);
    options.value("--working-space", "NAME",
                  "linear colour space of the .exr: rec709, acescg or a space of the config (default rec709)",
                  [&](const auto&, const auto& text) { a.working_space = text; });
}

void add_run_options(Options& options, RenderArguments& a) {
    add_device_options(options, a);
    options.settings(a.settings);
    options.flag(
        "--keep-all", [&] { a.settings.kept = Kept::everything(); }, "builds all parts that --keep can name");
    options.flag(
        "--strict", [&] { a.strict = a.strict_textures = true; },
        "fails if any pass yields a NaN, an infinity or a negative radiance, and if an image cannot be read that an "
        "optional extension of the scene adds");
    add_page_options(options, a);
    options.value("--page-schedule", "NAME",
                  fmt::format("how pages are found that rays need: demand, set or queries (default {}); see "
                              "docs/page-files.md",
                              name(paging::kDefaultPageSchedule)),
                  [&](const auto& option, const auto& text) {
                      const auto found =
                          std::ranges::find(paging::kPageSchedules, text, [](auto s) { return std::string(name(s)); });
                      if (found == std::end(paging::kPageSchedules))
                          throw UsageError(option, "expects demand, set or queries, not '{}'", text);
                      a.settings.page_schedule = *found;
                  });
    options.value("--texture-pool", "SIZE",
                  "loads textures in tiles, and sets the memory for tiles on the device, such as 512M. By default, "
                  "textures that do not fit into the memory budget get half of what it has left",
                  [&](const auto& name, const auto& text) {
                      a.settings.tile_bytes = size_of_text(name, text);
                      a.tile_textures = true;
                  });
    options.value("--progress", "text|json",
                  "form of progress on stderr: a bar or lines of text, or lines of JSON, which --quiet leaves (default "
                  "text)",
                  [&](const auto& name, const auto& text) {
                      if (text != "text" && text != "json")
                          throw UsageError(name, "expects text or json, not '{}'", text);
                      a.json_progress = text == "json";
                  });
    options.flag("--no-shader-cache", a.no_shader_cache,
                 "neither reads nor writes compiled shaders in $XDG_CACHE_HOME/halflight/programs");
    options.path("--stats", "FILE.json",
                 "writes statistics, including the time of each pass; measuring makes rendering slower. For a "
                 "sequence, appends one line per frame",
                 a.stats);
    options.path("--dump-graph", "FILE.dot", "writes the render graph of the frame for Graphviz", a.graph);
}

/// Returns the absolute path of a file, which need not exist.
std::filesystem::path place(const std::filesystem::path& name) {
    std::error_code error;  // ignored: opening the file reports the error
    const auto absolute = std::filesystem::absolute(name, error);
    const auto canonical = std::filesystem::weakly_canonical(absolute, error);
    return error ? absolute : canonical;
}

using Paths = std::vector<std::filesystem::path>;

/// Throws UsageError where a file is written twice, or read and written.
void check_files(const Paths& read, const Paths& written) {
    std::set<std::filesystem::path> inputs, outputs;
    for (const auto& path : read) inputs.insert(place(path));
    for (const auto& path : written) {
        const auto at = place(path);
        if (!outputs.insert(at).second) throw UsageError(path.string(), "is given twice as output");
        if (inputs.contains(at)) throw UsageError(path.string(), "is both input and output");
    }
}

void check_files(const RenderArguments& a) {
    Paths read = {a.scene}, written = output_files(a);
    if (const auto* map = std::get_if<std::filesystem::path>(&a.environment)) read.push_back(*map);
    if (a.ocio) read.push_back(*a.ocio);
    if (a.settings_file) read.push_back(*a.settings_file);
    if (a.movie) written.push_back(*a.movie);
    if (a.stats) written.push_back(*a.stats);
    if (a.graph) written.push_back(*a.graph);
    check_files(read, written);
}

/// Throws UsageError where options of denoising and of adaptive samples do not fit together.
void check_filter_options(const CLI::App& app, const RenderArguments& a) {
    const RenderSettings& s = a.settings;
    if (s.preview.any()) exclude(app, "--denoise", "--preview");
    exclude(app, "--denoise", "--shutter");  // the halves of one shutter time have few samples
    if (s.preview.any()) exclude(app, "--adaptive", "--preview");
    exclude(app, "--adaptive", "--shutter");
    if (!s.error) exclude(app, "--adaptive", "--time");
    for (const char* option : {"--denoise-frames", "--denoise-error"})
        if (app.count(option) > 0 && !s.denoise) throw UsageError(option, "needs --denoise");
    if (!s.denoise && std::ranges::find(s.aovs, "denoiser") != s.aovs.end())
        throw UsageError("--aov", "the layer denoiser needs --denoise");
    if (s.denoise && s.samples < 2) throw UsageError("--denoise", "needs at least two --samples");
    if (s.adaptive && s.samples < kLeastAdaptiveSamples)
        throw UsageError("--adaptive", "needs at least {} --samples", kLeastAdaptiveSamples);
    if (s.adaptive && s.denoise_error > 0 && s.denoise_error < kLeastAdaptiveSamples)
        throw UsageError("--denoise-error", "needs at least {} samples where --adaptive is given",
                         kLeastAdaptiveSamples);
}

/// Throws UsageError where something else is requested that keeps no checkpoint.
void check_checkpoint(const CLI::App& app, const RenderArguments& a) {
    if (!a.checkpoint) return;
    for (const char* other : {"--frames", "--turntable", "--shutter", "--error", "--adaptive", "--denoise-frames"})
        exclude(app, "--checkpoint", other);
    const Preview& preview = a.settings.preview;
    if (preview.cache || preview.temporal)
        throw UsageError("--checkpoint", "cannot be combined with the preview modes cache and temporal");
}

void check(const RenderArguments& a, const CLI::App& app) {
    const auto given = [&](const char* option) { return app.count(option) > 0; };
    if (a.outputs.empty() && !a.movie) throw UsageError("OUTPUT", "is missing; see halflight render --help");
    for (const auto& path : a.outputs) {
        if (!has_extension(path, "exr") && !has_extension(path, "png"))
            throw UsageError(path.string(), "an output is an .exr or a .png");
    }
    check_sequence_options(app, a);
    check_preview_options(app, a);
    check_filter_options(app, a);
    check_checkpoint(app, a);
    check_files(a);  // includes the files that settings name
    const bool error = a.settings.error.has_value();
    if (a.best_effort && !error) throw UsageError("--best-effort", "needs --error");
    if (error && a.settings.samples < kFirstLook * kReplicates)
        throw UsageError("--samples", "{} are too few to estimate an error: it takes {}", a.settings.samples,
                         kFirstLook * kReplicates);
    if (const std::string problem = kept_problem(a.settings.kept); !problem.empty())
        throw UsageError("--keep", problem);
    check_camera_options(app, a);
    check_environment_options(app);
    const bool exr = std::ranges::any_of(a.outputs, [](const auto& path) { return has_extension(path, "exr"); });
    for (const char* option : {"--aov", "--half", "--working-space"})
        if (given(option) && !exr) throw UsageError(option, "needs an .exr output");
    const bool png = std::ranges::any_of(a.outputs, [](const auto& path) { return has_extension(path, "png"); });
    for (const char* option : {"--display", "--view", "--look", "--exposure", "--iso", "--shutter-speed"})
        if (given(option) && !png && !a.movie) throw UsageError(option, "needs a .png output or a movie");
    if (given("--fstop") && !given("--focus") && !png && !a.movie)
        throw UsageError("--fstop", "needs a .png output, a movie or --focus");
}

/// Returns the options of `halflight render` on which memory depends (tools/slurm/submit lists them, too), and --png.
std::vector<std::string> memory_options() {
    std::vector<std::string> names = {"--settings",      "--camera",  "--look-from",  "--look-at", "--up",
                                      "--vfov",          "--shutter", "--env",        "--sky",     "--env-rotation",
                                      "--env-intensity", "--variant", "--line-width", "--png",     "--light",
                                      "--material",      "--node",    "--hide"};
    for (const Setting& s : known_settings())
        if (s.memory) names.push_back(fmt::format("--{}", s.name));
    return names;
}

void add_memory_options(Options& options, InfoArguments& a) {
    add_settings_option(options, a.picture);
    add_camera_options(options, a.picture);
    options.settings(a.picture.settings, &Setting::memory);
    options.group("Picture");
    options.settings(a.picture.settings, &Setting::memory);
    options.flag("--png", a.png, "includes a .png output in the memory estimate");
    options.group("Sequence");
    add_shutter_option(options, a.picture);
    add_light_options(options, a.picture);
    options.group("Run");
    options.settings(a.picture.settings, &Setting::memory);
    add_memory_option(options);
    add_strict_option(options, a.picture);
}

void check(const InfoArguments& a, const CLI::App& app) {
    if (a.needs && !a.scene) throw UsageError("--needs", "needs a SCENE");
    if (a.names && !a.scene) throw UsageError("--names", "needs a SCENE");
    if (a.check && !a.scene) throw UsageError("--check", "needs a page file");
    for (const std::string& option : memory_options())
        if (app.count(option) > 0 && !a.scene) throw UsageError(option, "needs a SCENE");
    check_camera_options(app, a.picture);
    check_environment_options(app);
    exclude(app, "--shutter", "--error");
    exclude(app, "--preview", "--error");
    exclude(app, "--preview", "--shutter");
    if (a.picture.settings.preview.any()) exclude(app, "--denoise", "--preview");
    exclude(app, "--denoise", "--shutter");
    if (a.time && !a.needs) throw UsageError("--time", "needs --needs");
    if (!a.scene && !a.device) throw UsageError("SCENE", "is missing; see halflight info --help");
}

std::vector<std::string> commands_of(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
    return names;
}

/// Throws UsageError for an unknown command, and for an unknown option before the command.
void check_command(const CLI::App& app) {
    const auto extras = app.remaining();
    const std::vector<std::string> commands = commands_of(app);
    if (!extras.empty() && !extras.front().starts_with('-'))
        throw UsageError(extras.front(), "is no command; commands are: {}{}", fmt::join(commands, ", "),
                         did_you_mean(extras.front(), commands));
    check_leftovers(app, "halflight");
}

}  // namespace

Arguments parse_arguments(int argc, const char* const* argv) {
    CLI::App app("Hybrid raster and ray-traced global illumination.", "halflight");
    app.set_help_flag("-h,--help", "prints this help and exits");
    app.set_version_flag("--version", "halflight " HALFLIGHT_VERSION, "prints the version and exits");
    app.allow_extras();
    app.require_subcommand(0, 1);  // later words may be files with the name of a command

    RenderArguments render;
    CLI::App& render_app = *app.add_subcommand("render", "Renders a glTF scene to .exr and .png");
    render_app.allow_extras();
    render_app.add_option("SCENE", render.scene, "glTF 2.0 scene, .gltf or .glb")->type_name("")->required();
    render_app
        .add_option("OUTPUT", render.outputs, ".exr: scene-linear, with layers; .png: through the view transform")
        ->type_name("");
    Options options(render_app);
    add_settings_option(options, render);
    add_camera_options(options, render);
    options.settings(render.settings);
    add_picture_options(options, render);
    add_sequence_options(options, render);
    add_light_options(options, render);
    add_color_options(options, render);
    add_run_options(options, render);

    PreviewArguments preview;
    CLI::App& preview_app = *app.add_subcommand("view", "Shows a scene in an interactive window");
    preview_app.allow_extras();
    add_preview_options(preview_app, preview);

    ConvergeArguments converge;
    CLI::App& converge_app = *app.add_subcommand("converge", "Measures error against run time and writes a report");
    converge_app.allow_extras();
    add_converge_options(converge_app, converge);

    InfoArguments info;
    bool settings_page = false;
    CLI::App& info_app = *app.add_subcommand("info", "Lists the contents of a scene, or the devices");
    info_app.allow_extras();
    info_app
        .add_option("SCENE", info.scene,
                    "glTF 2.0 scene, .gltf or .glb, a list of such files, NAME.parts.json, or a page file")
        ->type_name("");
    info_app.add_flag("--device", info.device, "lists the devices, and why each was or was not chosen");
    info_app.add_flag("--needs", info.needs,
                      "lists the parts that rendering leaves out for the scene, the reasons and the bytes saved");
    info_app.add_flag(
        "--names", info.names,
        "lists cameras, variants, lights, materials, meshes and nodes as options of `halflight render`, with "
        "the values that they have");
    info_app.add_flag("--check", info.check, "reads a page file as a whole and tests the checksums of all its parts");
    info_app.add_flag("--time", info.time,
                      "measures, with --needs, the time that leaving out each part saves; takes minutes");
    info_app.add_flag("--list-settings", settings_page,
                      "prints the tables of all render settings and layers in Markdown");
    info_app.add_flag("--json", info.json, "prints JSON");
    info_app.add_flag("--allow-outside", info.picture.allow_outside,
                      "allows the scene to name files outside its folder");
    info_app.footer(
        "The options for picture, camera, sequence, light and run are those of `halflight render`. They describe the "
        "picture whose memory is estimated.");
    Options info_options(info_app);
    add_memory_options(info_options, info);

    PackArguments pack;
    CLI::App& pack_app = *app.add_subcommand("pack", "Converts a scene that is larger than memory to a page file");
    pack_app.allow_extras();
    pack_app.add_option("SCENE", pack.scene, "glTF 2.0 scene, .gltf or .glb, or a list of such files, NAME.parts.json")
        ->type_name("")
        ->required();
    pack_app.add_option("OUTPUT", pack.output, "page file")->type_name("")->required();
    Options pack_options(pack_app);
    pack_options.group("Run");
    pack_options.flag("--allow-outside", pack.allow_outside, "allows the scene to name files outside its folder");
    add_memory_option(pack_options);
    pack_options.flag("--quiet", pack.quiet, "prints errors only, neither progress nor notes");

    BenchArguments bench;
    CLI::App& bench_app = *app.add_subcommand("bench", "Measures rays per second of several tracers, interleaved");
    bench_app.allow_extras();
    bench::add_options(bench_app, bench);

    CompareArguments compare;
    CLI::App& compare_app = *app.add_subcommand("compare", "Measures the difference of two pictures, layer by layer");
    compare_app.allow_extras();
    compare::add_options(compare_app, compare);

    try {
        app.parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
        return help_of(app);
    } catch (const CLI::CallForVersion& version) {
        return Help{version.what()};
    } catch (const CLI::ParseError& error) {
        throw usage_error(error, render_app.parsed()     ? "halflight render"
                                 : preview_app.parsed()  ? "halflight view"
                                 : converge_app.parsed() ? "halflight converge"
                                 : pack_app.parsed()     ? "halflight pack"
                                 : bench_app.parsed()    ? "halflight bench"
                                 : compare_app.parsed()  ? "halflight compare"
                                                         : "halflight info");
    }
    check_command(app);
    if (render_app.parsed()) {
        check_leftovers(render_app, "halflight render");
        if (render.turntable > 0 && render.frames.empty()) {
            render.frames.resize(static_cast<std::size_t>(render.turntable));
            std::iota(render.frames.begin(), render.frames.end(), 0u);
        }
        check_files(render);  // precedes reading: the settings file may be one of the files
        take_size_options(render_app, render);
        if (render.settings_file) use_settings(render_app, render);
        const RenderSettings& s = render.settings;
        if ((s.time_limit > 0 || s.error) && render_app.count("--samples") == 0) render.settings.samples = kMaxSamples;
        check(render, render_app);
        render.picture_bytes = picture_bytes(render);
        render.mip_levels = render.settings.texture_lod;
        if (!render.frames.empty() && !render.animation) render.animation = "all";
        return render;
    }
    if (preview_app.parsed()) {
        finish_preview_options(preview_app, preview);
        return preview;
    }
    if (converge_app.parsed()) {
        check_leftovers(converge_app, "halflight converge");
        take_size_options(converge_app, converge);
        check_converge_options(converge_app, converge);
        return converge;
    }
    if (info_app.parsed()) {
        check_leftovers(info_app, "halflight info");
        if (settings_page) {
            std::string page = settings_markdown();
            page.pop_back();  // Help ends without a newline
            return Help{page};
        }
        check(info, info_app);
        take_size_options(info_app, info.picture);
        if (info.picture.settings_file) use_settings(info_app, info.picture);
        info.picture.mip_levels = info.picture.settings.texture_lod;
        return info;
    }
    if (pack_app.parsed()) {
        check_leftovers(pack_app, "halflight pack");
        check_files({pack.scene}, {pack.output});
        return pack;
    }
    if (bench_app.parsed()) {
        check_leftovers(bench_app, "halflight bench");
        return bench;
    }
    if (compare_app.parsed()) {
        check_leftovers(compare_app, "halflight compare");
        if (compare.map) check_files({compare.image, compare.reference}, {*compare.map});
        return compare;
    }
    throw UsageError("command", "is missing; commands are: {}", fmt::join(commands_of(app), ", "));
}

}  // namespace halflight
