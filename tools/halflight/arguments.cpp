#include "tools/halflight/arguments.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "engine/core/error.h"
#include "renderer/render.h"
#include "renderer/replicates.h"
#include "tools/halflight/options.h"

namespace halflight {
namespace {

constexpr const char* kColourGroup = "Colour";

rays::Culling culling_named(const std::string& option, const std::string& text) {
    using enum rays::Culling;
    for (const rays::Culling culling : {automatic, off, compute, raster}) {
        if (text == rays::name(culling)) return culling;
    }
    throw UsageError(option, "unknown way '{}'; there are: auto, compute, raster, off", text);
}

PrimaryVisibility primary_named(const std::string& option, const std::string& text) {
    using enum PrimaryVisibility;
    for (const PrimaryVisibility primary : {automatic, raster, traced}) {
        if (text == name(primary)) return primary;
    }
    throw UsageError(option, "unknown way '{}'; there are: auto, raster, traced", text);
}

std::string known_aov_names() {
    std::string names;
    for (const AovInfo& aov : known_aovs())
        names.append(names.empty() ? "" : ", ").append(aov.name).append(aov.debug ? " (not in all)" : "");
    return names;
}

std::vector<std::string> aov_names(const std::string& option, const std::string& list) {
    std::vector<std::string> names;
    for (const std::string& name : split_names(list)) {
        const auto same = [&](const AovInfo& aov) { return aov.name == name || (name == "all" && !aov.debug); };
        if (std::ranges::none_of(known_aovs(), same))
            throw UsageError(option, "there is no '{}', only all, {}", name, known_aov_names());
        for (const AovInfo& aov : known_aovs())
            if (same(aov) && std::ranges::find(names, aov.name) == names.end()) names.emplace_back(aov.name);
    }
    return names;
}

Kept kept_items(const std::string& option, const std::string& list) {
    const std::vector<std::string> known = keepable_names();
    std::set<std::string, std::less<>> names;
    for (const std::string& name : split_names(list)) {
        if (std::ranges::find(known, name) == known.end())
            throw UsageError(option, "'{}' cannot be kept, only {}", name, fmt::join(known, ", "));
        names.insert(name);
    }
    return Kept(std::move(names));
}

void add_error_option(Options& options, RenderArguments& a) {
    options.value("--error", "E",
                  "as many samples as it takes for the error to be below E at 95 %; --samples and --time limit it",
                  [&](const auto& name, const auto& text) { a.error = real(name, text, 1e-12, 1e12); });
}

void add_layer_options(Options& options, RenderArguments& a) {
    options
        .value("--aov", "NAME,...", "further layers of the .exr, `all` or some of: " + known_aov_names(),
               [&](const auto& name, const auto& text) { a.aovs = aov_names(name, text); })
        ->multi_option_policy(CLI::MultiOptionPolicy::Join);
    options.flag("--half", a.half, "colour as half floats in the .exr; data stays float");
}

void add_technique_options(Options& options, RenderArguments& a) {
    options.value("--estimator", "KEY=VALUE,...",
                  "techniques; auto leaves to a pilot what pays in the scene: " + known_estimators(),
                  [&](const auto& name, const auto& text) { a.estimator = estimator(name, text); });
    options.value("--preview", "NAME,...",
                  "make pictures of few samples look better, at the price of a bias: " + known_previews() +
                      " (temporal keeps light of earlier frames, and needs --frames)",
                  [&](const auto& name, const auto& text) { a.preview = preview(name, text); });
}

void add_picture_options(Options& options, RenderArguments& a) {
    add_size_options(options, a);
    add_filter_options(options, a);
    add_clamp_option(options, a.clamp);
    options.value("--samples", "N", "samples per pixel (default 64)",
                  [&](const auto& name, const auto& text) { a.samples = whole(name, text, 1, kMaxSamples); });
    options.value("--time", "SECONDS", "as many samples as the time allows",
                  [&](const auto& name, const auto& text) { a.time = real(name, text, 0.001, 1e9); });
    add_error_option(options, a);
    options.value("--error-metric", "NAME", "what E is: relmse (default), mse",
                  [&](const auto& name, const auto& text) {
                      if (text == "mse" || text == "relmse")
                          a.error_metric = text == "mse" ? ErrorMetric::mse : ErrorMetric::relmse;
                      else
                          throw UsageError(name, "there is no metric '{}', only relmse, mse", text);
                  });
    options.flag("--best-effort", a.best_effort, "write the picture, too, if it ends before its error is below E");
    options.value("--seed", "N", "another seed, another noise (default 0)",
                  [&](const auto& name, const auto& text) { a.seed = whole(name, text, 0u, ~0u); });
    options.value("--frame", "N",
                  "frame number, which the noise depends on and, with --animation, the pose (default 0)",
                  [&](const auto& name, const auto& text) { a.frame = whole(name, text, 0u, ~0u); });
    add_layer_options(options, a);
}

void add_color_options(Options& options, RenderArguments& a) {
    options.group(kColourGroup);
    add_view_options(options, a.ocio, a.view, " of the .png");
    options.value("--working-space", "NAME",
                  "linear space of colour in the .exr: rec709, acescg or one of the config (default rec709)",
                  [&](const auto&, const auto& text) { a.working_space = text; });
}

void add_run_options(Options& options, RenderArguments& a) {
    add_device_options(options, a);
    options.value("--culling", "WAY", "how hits are found, never which: auto (default), compute, raster, off",
                  [&](const auto& name, const auto& text) { a.culling = culling_named(name, text); });
    options.value("--primary", "WAY",
                  "how what the camera sees is found: raster, traced, or auto (default), which traces where there are "
                  "more than twice as many triangles as pixels",
                  [&](const auto& name, const auto& text) { a.primary = primary_named(name, text); });
    add_technique_options(options, a);
    options.flag("--strict", a.strict, "write nothing if any pass gives a NaN, an infinity or a negative radiance");
    options
        .value(
            "--keep", "NAME,...",
            "build this, too, though the scene has no use for it: names as in `halflight info SCENE --needs`, except "
            "those marked *. Costs time and memory, never changes the picture",
            [&](const auto& name, const auto& text) { a.kept = kept_items(name, text); })
        ->multi_option_policy(CLI::MultiOptionPolicy::Join);
    options.flag("--keep-all", a.keep_all, "the same of all that can be kept");
    options.flag("--no-shader-cache", a.no_shader_cache,
                 "neither look for compiled shaders in $XDG_CACHE_HOME/halflight/programs nor keep them there");
    options.path("--stats", "FILE.json",
                 "write what was done, and the time of each pass; counting makes it slower. Of a sequence: a line for "
                 "each frame, added to the file",
                 a.stats);
    options.path("--dump-graph", "FILE.dot", "write the frame's graph of passes for Graphviz", a.graph);
}

/// The file that a name leads to, there or not.
std::filesystem::path place(const std::filesystem::path& name) {
    std::error_code error;  // is told by whoever opens it
    const auto absolute = std::filesystem::absolute(name, error);
    const auto canonical = std::filesystem::weakly_canonical(absolute, error);
    return error ? absolute : canonical;
}

using Paths = std::vector<std::filesystem::path>;

/// No file is written twice, or over what is read.
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
    if (a.settings) read.push_back(*a.settings);
    if (a.movie) written.push_back(*a.movie);
    if (a.stats) written.push_back(*a.stats);
    if (a.graph) written.push_back(*a.graph);
    check_files(read, written);
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
    check_files(a);  // of the settings, too
    if (!a.error) exclude(app, "--samples", "--time");
    for (const char* option : {"--error-metric", "--best-effort"})
        if (given(option) && !a.error) throw UsageError(option, "needs --error");
    if (a.error && a.samples && *a.samples < kFirstLook * kReplicates)
        throw UsageError("--samples", "{} are too few to tell an error: it takes {}", *a.samples,
                         kFirstLook * kReplicates);
    check_camera_options(app);
    const bool exr = std::ranges::any_of(a.outputs, [](const auto& path) { return has_extension(path, "exr"); });
    for (const char* option : {"--aov", "--half", "--working-space"})
        if (given(option) && !exr) throw UsageError(option, "is for an .exr, and none is asked for");
    const bool png = std::ranges::any_of(a.outputs, [](const auto& path) { return has_extension(path, "png"); });
    for (const char* option : {"--display", "--view", "--look", "--exposure"})
        if (given(option) && !png && !a.movie) throw UsageError(option, "is for a .png, and none is asked for");
}

/// Options of `halflight render` on which memory depends (tools/slurm/submit knows them, too), and --png.
constexpr const char* kMemoryOptions[] = {"--settings", "--camera", "--look-from", "--look-at", "--up",   "--vfov",
                                          "--width",    "--height", "--error",     "--aov",     "--half", "--shutter",
                                          "--bounces",  "--env",    "--estimator", "--preview", "--png"};

void add_memory_options(Options& options, InfoArguments& a) {
    add_settings_option(options, a.picture);
    add_camera_options(options, a.picture);
    add_size_options(options, a.picture);
    add_error_option(options, a.picture);
    add_layer_options(options, a.picture);
    options.flag("--png", a.png, "a .png is written, too");
    options.group("Sequence");
    add_shutter_option(options, a.picture);
    add_light_options(options, a.picture);
    options.group("Run");
    add_technique_options(options, a.picture);
}

void check(const InfoArguments& a, const CLI::App& app) {
    if (a.needs && !a.scene) throw UsageError("--needs", "is about a scene, and none is given");
    for (const char* option : kMemoryOptions)
        if (app.count(option) > 0 && !a.scene) throw UsageError(option, "is about a scene, and none is given");
    check_camera_options(app);
    exclude(app, "--shutter", "--error");
    exclude(app, "--preview", "--error");
    exclude(app, "--preview", "--shutter");
    if (a.time && !a.needs) throw UsageError("--time", "goes together with --needs");
    if (!a.scene && !a.device) throw UsageError("SCENE", "is missing; see halflight info --help");
}

void check_leftovers(const CLI::App& app, const std::string& command) {
    const auto extras = app.remaining();
    if (!extras.empty()) throw UsageError(extras.front(), "is not expected; see {} --help", command);
}

/// CLI11's messages are "--option: what" or a sentence.
UsageError usage_error(const CLI::ParseError& error, const std::string& command) {
    const std::string text = error.what();
    const auto colon = text.find(": ");
    if (dynamic_cast<const CLI::RequiredError*>(&error))
        return UsageError(text.substr(0, text.find(' ')), "is missing; see {} --help", command);
    if (colon == std::string::npos) return UsageError("arguments", text);
    if (dynamic_cast<const CLI::ArgumentMismatch*>(&error))
        return UsageError(text.substr(0, colon), "wants exactly one value");
    return UsageError(text.substr(0, colon), text.substr(colon + 2));
}

}  // namespace

bool has_extension(const std::filesystem::path& path, std::string_view extension) {
    const std::string own = path.extension().string();
    return std::ranges::equal(own, "." + std::string(extension), {}, [](unsigned char c) { return std::tolower(c); });
}

Arguments parse_arguments(int argc, const char* const* argv) {
    CLI::App app("Hybrid raster and ray-traced global illumination.", "halflight");
    app.set_version_flag("--version", "halflight " HALFLIGHT_VERSION, "Print the version and exit");
    app.allow_extras();
    app.require_subcommand(0, 1);  // after one, its name may be that of a file

    RenderArguments render;
    CLI::App& render_app = *app.add_subcommand("render", "Render a glTF scene to .exr and .png");
    render_app.allow_extras();
    render_app.add_option("SCENE", render.scene, "glTF 2.0 scene, .gltf or .glb")->type_name("")->required();
    render_app
        .add_option("OUTPUT", render.outputs, ".exr: scene-linear, with layers; .png: through the view transform")
        ->type_name("");
    Options options(render_app);
    add_settings_option(options, render);
    add_camera_options(options, render);
    add_picture_options(options, render);
    add_sequence_options(options, render);
    add_light_options(options, render);
    add_color_options(options, render);
    add_run_options(options, render);

    PreviewArguments preview;
    CLI::App& preview_app = *app.add_subcommand("view", "Show a scene in a window, to walk about in it");
    preview_app.allow_extras();
    add_preview_options(preview_app, preview);

    ConvergeArguments converge;
    CLI::App& converge_app = *app.add_subcommand("converge", "Measure error against run time, and report it");
    converge_app.allow_extras();
    add_converge_options(converge_app, converge);

    InfoArguments info;
    CLI::App& info_app = *app.add_subcommand("info", "Tell what a scene holds, or which devices there are");
    info_app.allow_extras();
    info_app.add_option("SCENE", info.scene, "glTF 2.0 scene, .gltf or .glb")->type_name("");
    info_app.add_flag("--device", info.device, "list the devices tried, and why each was or was not taken");
    info_app.add_flag("--needs", info.needs, "list what rendering the scene does without, why, and the bytes saved");
    info_app.add_flag("--time", info.time, "with --needs: measure the time that each of it saves; takes minutes");
    info_app.add_flag("--json", info.json, "as JSON");
    info_app.add_flag("--allow-outside", info.allow_outside, "the scene may name files outside its folder");
    info_app.footer(
        "Options of picture, camera, sequence, light and run are those of `halflight render`: memory is told for the "
        "picture that "
        "they ask for.");
    Options info_options(info_app);
    add_memory_options(info_options, info);

    BenchArguments bench;
    CLI::App& bench_app = *app.add_subcommand("bench", "Measure rays per second of several tracers, in turns");
    bench_app.allow_extras();
    bench::add_options(bench_app, bench);

    CompareArguments compare;
    CLI::App& compare_app = *app.add_subcommand("compare", "Tell how far two pictures are apart, layer by layer");
    compare_app.allow_extras();
    compare::add_options(compare_app, compare);

    try {
        app.parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
        std::string text = app.help();
        text.erase(text.find_last_not_of('\n') + 1);
        return Help{text};
    } catch (const CLI::CallForVersion& version) {
        return Help{version.what()};
    } catch (const CLI::ParseError& error) {
        throw usage_error(error, render_app.parsed()     ? "halflight render"
                                 : preview_app.parsed()  ? "halflight view"
                                 : converge_app.parsed() ? "halflight converge"
                                 : bench_app.parsed()    ? "halflight bench"
                                 : compare_app.parsed()  ? "halflight compare"
                                                         : "halflight info");
    }
    check_leftovers(app, "halflight");
    if (render_app.parsed()) {
        check_leftovers(render_app, "halflight render");
        check_files(render);  // before the settings are read, which may be one of them
        if (render.settings) use_settings(render_app, render);
        check(render, render_app);
        return render;
    }
    if (preview_app.parsed()) {
        check_leftovers(preview_app, "halflight view");
        check_camera_options(preview_app);
        use_settings(preview_app, preview);
        check_preview_options(preview_app, preview);
        return preview;
    }
    if (converge_app.parsed()) {
        check_leftovers(converge_app, "halflight converge");
        check_converge_options(converge_app, converge);
        return converge;
    }
    if (info_app.parsed()) {
        check_leftovers(info_app, "halflight info");
        check(info, info_app);
        if (info.picture.settings) use_settings(info_app, info.picture);
        return info;
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
    throw UsageError("command", "is missing; see halflight --help");
}

}  // namespace halflight
