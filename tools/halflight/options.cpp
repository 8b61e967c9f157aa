#include "tools/halflight/options.h"

#include <cmath>

namespace halflight {
namespace {

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

}  // namespace

Estimator estimator(const std::string& option, const std::string& list) {
    try {
        return estimator_named(list);
    } catch (const Error& error) {
        throw UsageError(option, error.what());
    }
}

Preview preview(const std::string& option, const std::string& list) {
    try {
        return preview_named(list);
    } catch (const Error& error) {
        throw UsageError(option, error.what());
    }
}

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

CLI::Option* Options::value(const std::string& name, const char* metavar, const std::string& description,
                            std::function<void(const std::string& name, const std::string& text)> parse) {
    return app_
        .add_option_function<std::string>(
            name, [name, parse](const std::string& text) { parse(name, text); }, description)
        ->type_name(metavar)
        ->group(group_);
}

CLI::Option* Options::path(const std::string& name, const char* metavar, const std::string& description,
                           std::optional<std::filesystem::path>& target) {
    return value(name, metavar, description, [&](const auto& n, const auto& text) {
        if (text.empty()) throw UsageError(n, "wants the name of a file");
        target = text;
    });
}

void Options::flag(const std::string& name, bool& target, const std::string& description) {
    app_.add_flag(name, target, description)->group(group_);
}

void add_camera_options(Options& options, ViewArguments& a) {
    options.group("Camera");
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

void add_size_options(Options& options, ViewArguments& a) {
    options.group("Picture");
    options.value("--width", "PIXELS",
                  fmt::format("width (default: from the height and the camera's shape, else {})", a.usual_width),
                  [&](const auto& name, const auto& text) { a.width = whole(name, text, 1, kMaxSide); });
    options.value("--height", "PIXELS", "height (default: from the width and the camera's shape)",
                  [&](const auto& name, const auto& text) { a.height = whole(name, text, 1, kMaxSide); });
}

void add_filter_options(Options& options, ViewArguments& a) {
    options.value("--filter", "NAME", "pixel filter: box (default), blackman-harris",
                  [&](const auto& name, const auto& text) {
                      using enum PixelFilter::Shape;
                      const std::string list = text;
                      for (const PixelFilter::Shape shape : {box, blackman_harris})
                          if (list == halflight::name(shape)) return void(a.filter = shape);
                      throw UsageError(name, "there is no filter '{}', only box, blackman-harris", text);
                  });
    options.value(
        "--filter-radius", "PIXELS",
        fmt::format("how far it reaches from a pixel's centre (default: box {:g}, blackman-harris {:g})",
                    usual_radius(PixelFilter::Shape::box), usual_radius(PixelFilter::Shape::blackman_harris)),
        [&](const auto& name, const auto& text) { a.filter_radius = real(name, text, 0.01, kMaxFilterRadius); });
}

void add_clamp_option(Options& options, float& clamp) {
    options.value(
        "--clamp", "LUMINANCE",
        "the most that one sample of a pixel's indirect light may have: fewer fireflies, less light (default 0: "
        "all that it has)",
        [&](const auto& name, const auto& text) {
            clamp = static_cast<float>(real(name, text, text == "0" ? 0 : 1e-6, 1e30));
        });
}

void add_light_options(Options& options, ViewArguments& a) {
    options.group("Light");
    options.value("--bounces", "N",
                  fmt::format("reflections along a path; 0 shows lights only, 1 direct light (default {})", a.bounces),
                  [&](const auto& name, const auto& text) { a.bounces = whole(name, text, 0, kMaxBounces); });
    add_environment_option(options, a.environment);
}

void add_environment_option(Options& options, EnvironmentChoice& environment) {
    options.value("--env", "FILE|R,G,B", "environment: an equirectangular .exr or .hdr, or a constant radiance",
                  [&](const auto& name, const auto& text) {
                      if (text.empty()) throw UsageError(name, "wants the name of a file or R,G,B");
                      const auto color = triple(text);
                      if (color && glm::any(glm::lessThan(*color, dvec3(0))))
                          throw UsageError(name, "radiance is never negative: '{}'", text);
                      if (color)
                          environment = vec3(*color);
                      else
                          environment = std::filesystem::path(text);
                  });
}

void add_view_options(Options& options, std::optional<std::filesystem::path>& ocio, ViewTransform& view,
                      const std::string& of) {
    options.path("--ocio", "FILE", "OpenColorIO config (default: $OCIO, else a built-in ACES config)", ocio);
    options.value("--display", "NAME", "display" + of + " (default: the config's)",
                  [&](const auto&, const auto& text) { view.display = text; });
    options.value("--view", "NAME", "view" + of + " (default: the display's)",
                  [&](const auto&, const auto& text) { view.view = text; });
    options.value("--look", "NAME", "look" + of + " (default: the view's)",
                  [&](const auto&, const auto& text) { view.look = text; });
    options.value("--exposure", "STOPS", "exposure" + of + " (default 0)", [&](const auto& name, const auto& text) {
        view.exposure = static_cast<float>(real(name, text, -64, 64));
    });
}

void add_device_options(Options& options, ViewArguments& a) {
    options.group("Run");
    options.value("--device", "NAME|N", "where to render; `halflight info --device` lists them",
                  [&](const auto&, const auto& text) { a.device = text; });
    options.flag("--gl-debug", a.gl_debug, "let the driver check every call (slower); its errors have a text then");
    options.flag("--allow-outside", a.allow_outside, "the scene may name files outside its folder");
    options.flag("--quiet", a.quiet, "no progress, no notes; errors only");
}

void exclude(const CLI::App& app, const char* one, const char* other) {
    if (app.count(one) > 0 && app.count(other) > 0) throw UsageError(one, "cannot be given together with {}", other);
}

void check_camera_options(const CLI::App& app) {
    const auto given = [&](const char* option) { return app.count(option) > 0; };
    exclude(app, "--camera", "--look-from");
    if (given("--look-from") != given("--look-at")) throw UsageError("--look-from", "goes together with --look-at");
    for (const char* option : {"--up", "--vfov"})
        if (given(option) && !given("--look-from")) throw UsageError(option, "needs --look-from and --look-at");
}

}  // namespace halflight
