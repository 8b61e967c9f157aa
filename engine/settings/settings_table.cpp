#include "engine/settings/settings_table.h"

#include "engine/settings/constraints.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cassert>
#include <utility>
#include <vector>

#include "engine/core/error.h"
#include "engine/settings/layers.h"
#include "engine/settings/setting_values.h"

namespace halflight {
namespace {

/// Completes a row with the functions for the value of its member.
template <class Member>
Setting row(Member member, Setting s) {
    using V = setting_values::Value<std::remove_cvref_t<decltype(member(std::declval<RenderSettings&>()))>>;
    s.type = V::type;
    s.values = V::names();
    s.get = [member](const RenderSettings& settings) { return V::text(member(settings)); };
    s.set = [member, row = s](RenderSettings& settings, const std::string& text) {
        return V::parse(row, text, member(settings));
    };
    return s;
}

std::vector<Setting> make_table() {
    constexpr const char *kCamera = "Camera", *kPicture = "Picture", *kLight = "Light", *kColour = "Colour",
                         *kRun = "Run";
    constexpr double kMaxUint = 4294967295;
    static const std::string radius_help = [] {
        std::vector<std::string> radii;
        for (const PixelFilter::Shape shape : filter_shapes())
            radii.push_back(fmt::format("{} {}", name(shape), usual_radius(shape)));
        return fmt::format("radius of the filter; by default that of its shape: {}", fmt::join(radii, ", "));
    }();
    return {
        row([](auto& s) -> auto& { return s.width; },
            {
                .name = "width",
                .group = kPicture,
                .metavar = "PIXELS",
                .help = "width; by default it follows from the height and the camera's aspect",
                .lower = 1,
                .upper = kMaxSide,
                .memory = true,
            }),
        row([](auto& s) -> auto& { return s.height; },
            {
                .name = "height",
                .group = kPicture,
                .metavar = "PIXELS",
                .help = "height; by default it follows from the width and the camera's aspect",
                .lower = 1,
                .upper = kMaxSide,
                .memory = true,
            }),
        row([](auto& s) -> auto& { return s.crop; },
            {
                .name = "crop",
                .group = kPicture,
                .metavar = "X0,Y0,X1,Y1",
                .help = "renders only the pixels from X0,Y0 to before X1,Y1; 0,0 is the upper left pixel of the whole "
                        "picture, whose size stays the display window. Coordinates may lie beyond its edges",
                .lower = -kMaxSide,
                .upper = 2 * kMaxSide,
                .memory = true,
            }),
        row([](auto& s) -> auto& { return s.overscan; },
            {
                .name = "overscan",
                .group = kPicture,
                .metavar = "PIXELS",
                .help = "pixels that are added on each side of the picture, or of its crop",
                .lower = 0,
                .upper = 16384,
                .memory = true,
            }),
        row([](auto& s) -> auto& { return s.transparent; },
            {
                .name = "transparent",
                .group = kPicture,
                .help = "shows no environment behind the scene; alpha is then the share of each pixel that surfaces "
                        "cover",
            }),
        row([](auto& s) -> auto& { return s.show_lamps; },
            {
                .name = "show-lamps",
                .group = kPicture,
                .help = "the camera sees lamps that have a radius and suns that have an angle",
                .saved = true,
                .memory = true,
            }),
        row([](auto& s) -> auto& { return s.backfaces; },
            {
                .name = "backfaces",
                .group = kPicture,
                .metavar = "MODE",
                .help = "back faces of single-sided materials. auto: the camera does not see them, neither directly "
                        "nor by perfect mirrors and clear glass. cull: no ray meets them, so light passes them, too. "
                        "show: the camera and all rays meet them",
                .saved = true,
            }),
        row([](auto& s) -> auto& { return s.optics.projection; },
            {
                .name = "projection",
                .group = kCamera,
                .metavar = "NAME",
                .help = "projection of the picture; auto is that of the camera, perspective or orthographic",
                .saved = true,
                .memory = true,
            }),
        row([](auto& s) -> auto& { return s.optics.fisheye_fov; },
            {
                .name = "fisheye-fov",
                .group = kCamera,
                .metavar = "DEGREES",
                .help = "angle across the image circle of a fisheye",
                .lower = 0.01,
                .upper = 360,
                .saved = true,
            }),
        row([](auto& s) -> auto& { return s.optics.stereo; },
            {
                .name = "stereo",
                .group = kCamera,
                .metavar = "NAME",
                .help = "eye that the picture shows, or arrangement of the views of both eyes in it; the picture's "
                        "size is then that of both views together",
                .saved = true,
                .memory = true,
            }),
        row([](auto& s) -> auto& { return s.optics.eye_distance; },
            {
                .name = "eye-distance",
                .group = kCamera,
                .metavar = "METRES",
                .help = "distance between the eyes of --stereo",
                .lower = 1e-6,
                .upper = 1e6,
                .saved = true,
            }),
        row([](auto& s) -> auto& { return s.optics.convergence; },
            {
                .name = "convergence",
                .group = kCamera,
                .metavar = "METRES",
                .help =
                    "distance at which a point has the same place in the views of both eyes of --stereo; 0 is infinity",
                .lower = 1e-6,
                .upper = 1e9,
                .zero = true,
                .saved = true,
            }),
        row([](auto& s) -> auto& { return s.view.camera.lens.focus; },
            {
                .name = "focus",
                .group = kCamera,
                .metavar = "DISTANCE|X,Y",
                .help =
                    "distance that is sharp, or point of the picture (0,0 to 1,1) whose surface is sharp, for depth "
                    "of field. By default the scene's camera decides",
                .lower = 1e-6,
                .upper = 1e9,
                .saved = true,
                .memory = true,
            }),
        row([](auto& s) -> auto& { return s.view.camera.lens.fstop; },
            {
                .name = "fstop",
                .group = kCamera,
                .metavar = "N",
                .help = "f-number. With --focus it sets the blur, else the exposure, as that of a physical camera; 0: "
                        "not set, or 16 if --iso or --shutter-speed is given",
                .lower = 0.1,
                .upper = 1000,
                .zero = true,
                .saved = true,
                .memory = true,
                .slider_from = 0.5,
                .slider_to = 64,
            }),
        row([](auto& s) -> auto& { return s.view.camera.lens.aperture; },
            {
                .name = "aperture",
                .group = kCamera,
                .metavar = "MM",
                .help = "diameter of the aperture, for depth of field, in place of that of --fstop; 0: --fstop decides",
                .lower = 1e-6,
                .upper = 1e6,
                .zero = true,
                .saved = true,
                .memory = true,
            }),
        row([](auto& s) -> auto& { return s.view.camera.lens.sensor; },
            {
                .name = "sensor",
                .group = kCamera,
                .metavar = "MM",
                .help = "length of the sensor along the longer side of the picture, from which --fstop gets the focal "
                        "length; 0: that of the scene's camera, or 36",
                .lower = 0.1,
                .upper = 1000,
                .zero = true,
                .saved = true,
            }),
        row([](auto& s) -> auto& { return s.view.camera.lens.blades; },
            {
                .name = "blades",
                .group = kCamera,
                .metavar = "N",
                .help = "number of blades of the aperture; 0: that of the scene's camera, or a round aperture",
                .lower = 3,
                .upper = 64,
                .zero = true,
                .saved = true,
            }),
        row([](auto& s) -> auto& { return s.view.camera.lens.rotation; },
            {
                .name = "blade-rotation",
                .group = kCamera,
                .metavar = "DEGREES",
                .help = "turn of the blades, counterclockwise as seen from behind the camera",
                .lower = -360,
                .upper = 360,
                .saved = true,
            }),
        row([](auto& s) -> auto& { return s.filter; },
            {
                .name = "filter",
                .group = kPicture,
                .metavar = "NAME",
                .help = "reconstruction filter of pixels",
            }),
        row([](auto& s) -> auto& { return s.filter.radius; },
            {
                .name = "filter-radius",
                .group = kPicture,
                .metavar = "PIXELS",
                .help = radius_help.c_str(),
                .lower = 0.01,
                .upper = kMaxFilterRadius,
            }),
        row([](auto& s) -> auto& { return s.clamp; },
            {
                .name = "clamp",
                .group = kPicture,
                .metavar = "LUMINANCE",
                .help = "limits the luminance of each sample of a pixel's indirect light: fewer fireflies, less light; "
                        "0 sets no limit",
                .lower = 1e-6,
                .upper = 1e30,
                .zero = true,
                .saved = true,
                .slider_from = 0.01,
                .slider_to = 1000,
            }),
        row([](auto& s) -> auto& { return s.texture_lod; },
            {
                .name = "texture-lod",
                .group = kPicture,
                .help = "chooses mip levels of textures by the footprint of rays: less reading of textures that do not "
                        "fit into memory, but biased",
                .memory = true,
            }),
        row([](auto& s) -> auto& { return s.samples; },
            {
                .name = "samples",
                .aliases = "-s,--spp",
                .group = kPicture,
                .metavar = "N",
                .help = "samples per pixel",
                .lower = 1,
                .upper = kMaxSamples,
                .saved = true,
            }),
        row([](auto& s) -> auto& { return s.parts; },
            {
                .name = "sample-parts",
                .group = kPicture,
                .metavar = "N",
                .help = "sums samples in N parts. Several machines can render them with --part, and `halflight merge` "
                        "joins them to the same bits",
                .lower = 1,
                .upper = 4096,
            }),
        row([](auto& s) -> auto& { return s.time_limit; },
            {
                .name = "time",
                .group = kPicture,
                .metavar = "SECONDS",
                .help = "adds samples until the time is spent; 0 sets no limit",
                .lower = 1e-9,
                .upper = 1e9,
                .zero = true,
            }),
        row([](auto& s) -> auto& { return s.error; },
            {
                .name = "error",
                .group = kPicture,
                .metavar = "E",
                .help =
                    "adds samples until the error is below E at 95 % confidence; --samples and --time are upper limits",
                .lower = 1e-12,
                .upper = 1e12,
                .memory = true,
            }),
        row([](auto& s) -> auto& { return s.seed; },
            {
                .name = "seed",
                .group = kPicture,
                .metavar = "N",
                .help = "seed of the noise",
                .upper = kMaxUint,
            }),
        row([](auto& s) -> auto& { return s.frame; },
            {
                .name = "frame",
                .group = kPicture,
                .metavar = "N",
                .help = "frame number, which decides the noise and, with --animation, the pose",
                .lower = kLeastFrame,
                .upper = kMostFrame,
                .fingerprint = false,  // each frame has its own fingerprint
            }),
        row([](auto& s) -> auto& { return s.denoise; },
            {
                .name = "denoise",
                .group = kPicture,
                .help = "filters noise out of the finished picture. The result is biased, but approaches the mean of "
                        "the samples as they become more; layers and --error refer to that mean",
                .saved = true,
                .memory = true,
            }),
        row([](auto& s) -> auto& { return s.keep_noisy; },
            {
                .name = "keep-noisy",
                .group = kPicture,
                .help = "keeps what the denoiser needs as NAME.noisy.exr beside each frame or picture, from which "
                        "`halflight denoise` makes denoised ones. Without --denoise, the frames themselves stay noisy",
                .memory = true,
            }),
        row([](auto& s) -> auto& { return s.denoise_frames; },
            {
                .name = "denoise-frames",
                .group = kPicture,
                .metavar = "N",
                .help =
                    "frames before and after each frame from which the denoiser takes light, too: less flicker; auto "
                    "is 2 for sequences, and 0 for single pictures and crops",
                .upper = kMaxDenoiseFrames,
                .memory = true,
            }),
        row([](auto& s) -> auto& { return s.denoise_error; },
            {
                .name = "denoise-error",
                .group = kPicture,
                .metavar = "N",
                .help = "estimates the error of the denoised picture by two further pictures of N samples, which are "
                        "not part of it; 0 makes no estimate",
                .lower = 0,
                .upper = kMaxSamples,
                .memory = true,
            }),
        row([](auto& s) -> auto& { return s.adaptive; },
            {
                .name = "adaptive",
                .group = kPicture,
                .help =
                    "gives noisy parts of the picture more samples and others fewer, without bias; --samples is then "
                    "the mean number, at least 16, or with --error or --time its limit",
                .memory = true,
            }),
        row([](auto& s) -> auto& { return s.aovs; },
            {
                .name = "aov",
                .group = kPicture,
                .metavar = "NAME,...",
                .help = "additional layers of the .exr",
                .memory = true,
            }),
        row([](auto& s) -> auto& { return s.half_color; },
            {
                .name = "half",
                .group = kPicture,
                .help = "stores colour layers of the .exr as half floats; data layers stay float",
                .memory = true,
            }),
        row([](auto& s) -> auto& { return s.bounces; },
            {
                .name = "bounces",
                .group = kLight,
                .metavar = "N",
                .help =
                    "reflections and refractions along a path; 0 shows light sources only, 1 direct light; auto is 8, "
                    "and 32 in scenes with solid glass",
                .upper = kMaxBounces,
                .saved = true,
                .memory = true,
                .slider_to = 32,
            }),
        row([](auto& s) -> auto& { return s.view.display; },
            {
                .name = "display",
                .group = kColour,
                .metavar = "NAME",
                .help = "OpenColorIO display of the .png or window; by default that of the config",
                .saved = true,
            }),
        row([](auto& s) -> auto& { return s.view.view; },
            {
                .name = "view",
                .group = kColour,
                .metavar = "NAME",
                .help = "OpenColorIO view; by default that of the display",
                .saved = true,
            }),
        row([](auto& s) -> auto& { return s.view.look; },
            {
                .name = "look",
                .group = kColour,
                .metavar = "NAME",
                .help = "OpenColorIO look; by default those of the view",
                .saved = true,
            }),
        row([](auto& s) -> auto& { return s.view.exposure; },
            {
                .name = "exposure",
                .group = kColour,
                .metavar = "STOPS",
                .help = "exposure of the .png or window; auto changes pictures that are far too bright or dark",
                .lower = -64,
                .upper = 64,
                .saved = true,
                .slider_from = -20,
                .slider_to = 20,
            }),
        row([](auto& s) -> auto& { return s.view.camera.iso; },
            {
                .name = "iso",
                .group = kColour,
                .metavar = "S",
                .help = "sensitivity of a physical camera, whose exposure replaces auto; 0: not set, or 100 if --fstop "
                        "or --shutter-speed sets an exposure",
                .lower = 1,
                .upper = 1e7,
                .zero = true,
                .saved = true,
            }),
        row([](auto& s) -> auto& { return s.view.camera.shutter_speed; },
            {
                .name = "shutter-speed",
                .group = kColour,
                .metavar = "SECONDS",
                .help = "exposure time of a physical camera, such as 1/250; 0: not set, or 1/125 if --fstop or --iso "
                        "sets an exposure",
                .lower = 1e-6,
                .upper = 1e5,
                .zero = true,
                .saved = true,
            }),
        row([](auto& s) -> auto& { return s.culling; },
            {
                .name = "culling",
                .group = kRun,
                .metavar = "METHOD",
                .help = "culling method of rays, which never changes the picture",
                .fingerprint = false,
            }),
        row([](auto& s) -> auto& { return s.primary; },
            {
                .name = "primary",
                .group = kRun,
                .metavar = "METHOD",
                .help = "method that finds the surfaces that the camera sees; auto traces if there is more than one "
                        "triangle per four pixels, else rasterizes",
            }),
        row([](auto& s) -> auto& { return s.estimator; },
            {
                .name = "estimator",
                .group = kRun,
                .metavar = "KEY=VALUE,...",
                .help = "sampling techniques (auto lets a pilot render choose those that pay in the scene)",
                .memory = true,
            }),
        row([](auto& s) -> auto& { return s.preview; },
            {
                .name = "preview",
                .group = kRun,
                .metavar = "NAME,...",
                .help = "biased modes that improve pictures of few samples (temporal reuses light of earlier frames)",
                .saved = true,
                .memory = true,
            }),
        row([](auto& s) -> auto& { return s.kept; },
            {
                .name = "keep",
                .group = kRun,
                .metavar = "NAME,...",
                .help = "builds parts of the renderer that the scene does not need: names without a * in `halflight "
                        "info SCENE --needs`; costs time and memory, never changes the picture",
                .fingerprint = false,
            }),
    };
}

}  // namespace

std::span<const Setting> known_settings() {
    static const std::vector<Setting> table = make_table();
    return table;
}

const Setting& setting(std::string_view name) {
    const auto found = std::ranges::find(known_settings(), name, &Setting::name);
    assert(found != known_settings().end());
    return *found;
}

void copy_setting(const Setting& setting, const RenderSettings& from, RenderSettings& to) {
    [[maybe_unused]] const std::string problem = setting.set(to, setting.get(from));
    assert(problem.empty());
}

std::string settings_markdown() {
    std::string text =
        "# Settings and layers\n\n"
        "`halflight info --list-settings > docs/settings.md` writes this page from the tables in\n"
        "`engine/settings/settings_table.cpp` and `engine/settings/layers.cpp`.\n\n"
        "## Settings\n\n"
        "`--NAME` is the option of a setting.\n\n"
        "- *file*: settings files hold it, and `halflight view` has the option, too.\n"
        "- *frame*: it is part of the fingerprint of a frame. `--overwrite` replaces frames with another value.\n"
        "- *memory*: the memory estimate of `halflight info SCENE` depends on it; `info` has the option, too.\n\n"
        "| Setting | Values | Default | Used in | Purpose |\n|---|---|---|---|---|\n";
    const auto escaped = [](const std::string& cell) {
        std::string text_of_cell;
        for (const char c : cell) text_of_cell.append(c == '|' ? "\\" : "").push_back(c);
        return text_of_cell;
    };
    for (const Setting& s : known_settings()) {
        std::vector<std::string> used;
        if (s.saved) used.emplace_back("file");
        if (s.fingerprint) used.emplace_back("frame");
        if (s.memory) used.emplace_back("memory");
        const bool is_number = s.type == Setting::Type::whole || s.type == Setting::Type::number;
        const std::string range = fmt::format("{}{}{} to {}", s.zero ? "0, " : "",
                                              s.type == Setting::Type::whole ? "whole, " : "", s.lower, s.upper);
        const std::string values = !s.values.empty()               ? s.values
                                   : is_number                     ? range
                                   : s.type == Setting::Type::flag ? "yes, no"
                                                                   : s.metavar;
        text += fmt::format("| `{}` | {} | {} | {} | {} |\n", s.name, escaped(values), s.get({}), fmt::join(used, ", "),
                            s.help);
    }
    text +=
        "\n## Settings that cannot be combined\n\n"
        "`engine/settings/constraints.cpp` has this table. *Mathematics*: the combination has no meaning. *Not built*: "
        "it\n"
        "has one, and the program lacks it.\n\n" +
        constraints_markdown();
    text += "\n## Layers\n\n`--aov NAME,...` adds layers to an .exr.\n\n" + layers_markdown();
    return text;
}

void check_setting_ranges(const RenderSettings& settings) {
    RenderSettings scratch;
    for (const Setting& s : known_settings())
        if (const std::string problem = s.set(scratch, s.get(settings)); !problem.empty())
            throw Error("render settings", "{} {}", s.name, problem);
}

}  // namespace halflight
