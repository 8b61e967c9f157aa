#include "tools/halflight/arguments.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>

#include "engine/core/error.h"
#include "passes/render.h"

namespace halflight {
namespace {

constexpr int kMaxSamples = 1 << 24;  // a float32 counts no further
constexpr int kMaxBounces = 1024;
constexpr const char* kCameraGroup = "Camera";
constexpr const char* kPictureGroup = "Picture";
constexpr const char* kLightGroup = "Light";
constexpr const char* kColourGroup = "Colour";
constexpr const char* kRunGroup = "Run";

/// All of `text` as a number from `lower` to `upper`; `kind` says in the error what was wanted.
template <class T>
T number(const std::string& option, const std::string& text, T lower, T upper, std::string_view kind) {
    T value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !(value >= lower && value <= upper))
        throw UsageError(option, "wants {} from {} to {}, not '{}'", kind, lower, upper, text);
    return value;
}

template <class T>
T whole(const std::string& option, const std::string& text, T lower, T upper) {
    return number<T>(option, text, lower, upper, "a whole number");
}

double real(const std::string& option, const std::string& text, double lower, double upper) {
    return number<double>(option, text, lower, upper, "a number");
}

rays::Culling culling_named(const std::string& option, const std::string& text) {
    using enum rays::Culling;
    for (const rays::Culling culling : {automatic, off, compute, raster}) {
        if (text == rays::name(culling)) return culling;
    }
    throw UsageError(option, "unknown way '{}'; there are: auto, compute, raster, off", text);
}

/// X,Y,Z
std::optional<dvec3> triple(const std::string& text) {
    dvec3 value;
    const char* at = text.data();
    const char* const last = at + text.size();
    for (int i = 0; i < 3; ++i) {
        if (i > 0 && (at == last || *at++ != ',')) return std::nullopt;
        const auto [end, error] = std::from_chars(at, last, value[i]);
        if (error != std::errc() || !std::isfinite(value[i])) return std::nullopt;
        at = end;
    }
    return at == last ? std::optional(value) : std::nullopt;
}

dvec3 point(const std::string& option, const std::string& text) {
    const auto value = triple(text);
    if (!value) throw UsageError(option, "wants X,Y,Z, not '{}'", text);
    return *value;
}

/// Options that take one value, which a function turns into what it means.
class Options {
  public:
    explicit Options(CLI::App& app) : app_(app) {}

    void group(std::string name) { group_ = std::move(name); }
    CLI::Option* value(const std::string& name, const char* metavar, const std::string& description,
                       std::function<void(const std::string& name, const std::string& text)> parse) {
        return app_
            .add_option_function<std::string>(
                name, [name, parse](const std::string& text) { parse(name, text); }, description)
            ->type_name(metavar)
            ->group(group_);
    }
    CLI::Option* path(const std::string& name, const char* metavar, const std::string& description,
                      std::optional<std::filesystem::path>& target) {
        return value(name, metavar, description, [&](const auto& n, const auto& text) {
            if (text.empty()) throw UsageError(n, "wants the name of a file");
            target = text;
        });
    }
    void flag(const std::string& name, bool& target, const std::string& description) {
        app_.add_flag(name, target, description)->group(group_);
    }

  private:
    CLI::App& app_;
    std::string group_;
};

void add_camera_options(Options& options, RenderArguments& a) {
    options.group(kCameraGroup);
    options.value("--camera", "NAME|N", "camera of the scene, by name or number from 0 (default: the first)",
                  [&](const auto&, const auto& text) { a.camera = text; });
    options.value("--look-from", "X,Y,Z", "a camera of your own: where it is, in metres",
                  [&](const auto& name, const auto& text) { a.look_from = point(name, text); });
    options.value("--look-at", "X,Y,Z", "what it looks at",
                  [&](const auto& name, const auto& text) { a.look_at = point(name, text); });
    options.value("--up", "X,Y,Z", "what is up in its picture (default 0,1,0)",
                  [&](const auto& name, const auto& text) { a.up = point(name, text); });
    options.value("--vfov", "DEGREES", fmt::format("its vertical field of view (default {})", a.vertical_fov),
                  [&](const auto& name, const auto& text) { a.vertical_fov = real(name, text, 0.01, 179); });
}

/// The names in a comma list; a repeated option is joined by line ends.
std::vector<std::string> split_names(const std::string& list) {
    std::vector<std::string> names;
    std::size_t from = 0;
    while (from <= list.size()) {
        const std::size_t to = std::min(list.find_first_of(",\n", from), list.size());
        names.push_back(list.substr(from, to - from));
        from = to + 1;
    }
    return names;
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

void add_picture_options(Options& options, RenderArguments& a) {
    options.group(kPictureGroup);
    options.value("--width", "PIXELS", "width (default: from the height and the camera's shape, else 1280)",
                  [&](const auto& name, const auto& text) { a.width = whole(name, text, 1, kMaxSide); });
    options.value("--height", "PIXELS", "height (default: from the width and the camera's shape)",
                  [&](const auto& name, const auto& text) { a.height = whole(name, text, 1, kMaxSide); });
    options.value("--samples", "N", "samples per pixel (default 64)",
                  [&](const auto& name, const auto& text) { a.samples = whole(name, text, 1, kMaxSamples); });
    options.value("--time", "SECONDS", "as many samples as the time allows, instead of --samples",
                  [&](const auto& name, const auto& text) { a.time = real(name, text, 0.001, 1e9); });
    options.value("--seed", "N", "another seed, another noise (default 0)",
                  [&](const auto& name, const auto& text) { a.seed = whole(name, text, 0u, ~0u); });
    options.value("--frame", "N", "frame number, which the noise depends on (default 0)",
                  [&](const auto& name, const auto& text) { a.frame = whole(name, text, 0u, ~0u); });
    options
        .value("--aov", "NAME,...", "further layers of the .exr, `all` or some of: " + known_aov_names(),
               [&](const auto& name, const auto& text) { a.aovs = aov_names(name, text); })
        ->multi_option_policy(CLI::MultiOptionPolicy::Join);
    options.flag("--half", a.half, "colour as half floats in the .exr; data stays float");
}

void add_light_options(Options& options, RenderArguments& a) {
    options.group(kLightGroup);
    options.value("--bounces", "N",
                  fmt::format("reflections along a path; 0 shows lights only, 1 direct light (default {})", a.bounces),
                  [&](const auto& name, const auto& text) { a.bounces = whole(name, text, 0, kMaxBounces); });
    options.value("--env", "FILE|R,G,B", "environment: an equirectangular .exr or .hdr, or a constant radiance",
                  [&](const auto& name, const auto& text) {
                      if (text.empty()) throw UsageError(name, "wants the name of a file or R,G,B");
                      const auto color = triple(text);
                      if (color && glm::any(glm::lessThan(*color, dvec3(0))))
                          throw UsageError(name, "radiance is never negative: '{}'", text);
                      if (color)
                          a.environment = vec3(*color);
                      else
                          a.environment = std::filesystem::path(text);
                  });
}

void add_color_options(Options& options, RenderArguments& a) {
    options.group(kColourGroup);
    options.path("--ocio", "FILE", "OpenColorIO config (default: $OCIO, else a built-in ACES config)", a.ocio);
    options.value("--display", "NAME", "display of the .png (default: the config's)",
                  [&](const auto&, const auto& text) { a.view.display = text; });
    options.value("--view", "NAME", "view of the .png (default: the display's)",
                  [&](const auto&, const auto& text) { a.view.view = text; });
    options.value("--look", "NAME", "look of the .png (default: the view's)",
                  [&](const auto&, const auto& text) { a.view.look = text; });
    options.value("--exposure", "STOPS", "exposure of the .png (default 0)", [&](const auto& name, const auto& text) {
        a.view.exposure = static_cast<float>(real(name, text, -64, 64));
    });
    options.value("--working-space", "NAME",
                  "linear space of colour in the .exr: rec709, acescg or one of the config (default rec709)",
                  [&](const auto&, const auto& text) { a.working_space = text; });
}

void add_run_options(Options& options, RenderArguments& a) {
    options.group(kRunGroup);
    options.value("--device", "NAME|N", "where to render; `halflight info --device` lists them",
                  [&](const auto&, const auto& text) { a.device = text; });
    options.value("--culling", "WAY", "how hits are found, never which: auto (default), compute, raster, off",
                  [&](const auto& name, const auto& text) { a.culling = culling_named(name, text); });
    options.flag("--gl-debug", a.gl_debug, "let the driver check every call (slower); its errors have a text then");
    options.flag("--allow-outside", a.allow_outside, "the scene may name files outside its folder");
    options.path("--stats", "FILE.json", "write what was done, and the time of each pass; counting makes it slower",
                 a.stats);
    options.path("--dump-graph", "FILE.dot", "write the frame's graph of passes for Graphviz", a.graph);
    options.flag("--quiet", a.quiet, "no progress, no notes; errors only");
}

/// The file that a name leads to, there or not.
std::filesystem::path place(const std::filesystem::path& name) {
    std::error_code error;  // is told by whoever opens it
    const auto absolute = std::filesystem::absolute(name, error);
    const auto canonical = std::filesystem::weakly_canonical(absolute, error);
    return error ? absolute : canonical;
}

/// No file is written twice, or over what is read.
void check_files(const RenderArguments& a) {
    std::vector<std::filesystem::path> read = {a.scene}, written = a.outputs;
    if (const auto* map = std::get_if<std::filesystem::path>(&a.environment)) read.push_back(*map);
    if (a.ocio) read.push_back(*a.ocio);
    if (a.stats) written.push_back(*a.stats);
    if (a.graph) written.push_back(*a.graph);
    for (const auto& path : written) {
        const auto same = [&, at = place(path)](const auto& other) { return place(other) == at; };
        if (std::ranges::count_if(written, same) > 1) throw UsageError(path.string(), "is given twice as output");
        if (std::ranges::any_of(read, same)) throw UsageError(path.string(), "is both input and output");
    }
}

void check(const RenderArguments& a, const CLI::App& app) {
    const auto given = [&](const char* option) { return app.count(option) > 0; };
    const auto exclude = [&](const char* one, const char* other) {
        if (given(one) && given(other)) throw UsageError(one, "cannot be given together with {}", other);
    };
    for (const auto& path : a.outputs) {
        if (!has_extension(path, "exr") && !has_extension(path, "png"))
            throw UsageError(path.string(), "an output is an .exr or a .png");
    }
    check_files(a);
    exclude("--samples", "--time");
    exclude("--camera", "--look-from");
    if (given("--look-from") != given("--look-at")) throw UsageError("--look-from", "goes together with --look-at");
    for (const char* option : {"--up", "--vfov"})
        if (given(option) && !given("--look-from")) throw UsageError(option, "needs --look-from and --look-at");
    const bool exr = std::ranges::any_of(a.outputs, [](const auto& path) { return has_extension(path, "exr"); });
    for (const char* option : {"--aov", "--half", "--working-space"})
        if (given(option) && !exr) throw UsageError(option, "is for an .exr, and none is asked for");
    const bool png = std::ranges::any_of(a.outputs, [](const auto& path) { return has_extension(path, "png"); });
    for (const char* option : {"--display", "--view", "--look", "--exposure"})
        if (given(option) && !png) throw UsageError(option, "is for a .png, and none is asked for");
}

void check(const InfoArguments& a) {
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
        ->type_name("")
        ->required();
    Options options(render_app);
    add_camera_options(options, render);
    add_picture_options(options, render);
    add_light_options(options, render);
    add_color_options(options, render);
    add_run_options(options, render);

    InfoArguments info;
    CLI::App& info_app = *app.add_subcommand("info", "Tell what a scene holds, or which devices there are");
    info_app.allow_extras();
    info_app.add_option("SCENE", info.scene, "glTF 2.0 scene, .gltf or .glb")->type_name("");
    info_app.add_flag("--device", info.device, "list the devices tried, and why each was or was not taken");
    info_app.add_flag("--json", info.json, "as JSON");
    info_app.add_flag("--allow-outside", info.allow_outside, "the scene may name files outside its folder");

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
        throw usage_error(error, render_app.parsed()    ? "halflight render"
                                 : bench_app.parsed()   ? "halflight bench"
                                 : compare_app.parsed() ? "halflight compare"
                                                        : "halflight info");
    }
    check_leftovers(app, "halflight");
    if (render_app.parsed()) {
        check_leftovers(render_app, "halflight render");
        check(render, render_app);
        return render;
    }
    if (info_app.parsed()) {
        check_leftovers(info_app, "halflight info");
        check(info);
        return info;
    }
    if (bench_app.parsed()) {
        check_leftovers(bench_app, "halflight bench");
        return bench;
    }
    if (compare_app.parsed()) {
        check_leftovers(compare_app, "halflight compare");
        return compare;
    }
    throw UsageError("command", "is missing; see halflight --help");
}

}  // namespace halflight
