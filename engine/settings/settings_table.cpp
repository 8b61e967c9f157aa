#include "engine/settings/settings_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cassert>
#include <charconv>
#include <set>
#include <type_traits>
#include <vector>

#include "engine/core/error.h"
#include "engine/settings/layers.h"

namespace halflight {
namespace {

constexpr const char* kNone = "none";
constexpr rays::Culling kCullings[] = {rays::Culling::automatic, rays::Culling::compute, rays::Culling::raster,
                                       rays::Culling::off};
constexpr PrimaryVisibility kPrimaries[] = {PrimaryVisibility::automatic, PrimaryVisibility::raster,
                                            PrimaryVisibility::traced};
constexpr PixelFilter::Shape kFilters[] = {PixelFilter::Shape::box, PixelFilter::Shape::blackman_harris};

std::vector<std::string> split(const std::string& list) {
    std::vector<std::string> names;
    for (std::size_t from = 0, to = 0; from <= list.size(); from = to + 1) {
        to = std::min(list.find_first_of(",\n", from), list.size());
        names.push_back(list.substr(from, to - from));
    }
    return names;
}

template <class Enum, std::size_t N>
std::string names_of(const Enum (&choices)[N]) {
    std::vector<std::string> names;
    for (const Enum choice : choices) names.emplace_back(name(choice));
    return fmt::format("{}", fmt::join(names, ", "));
}

template <class Enum, std::size_t N>
std::string parse_name(const Enum (&choices)[N], const std::string& text, Enum& value) {
    for (const Enum choice : choices)
        if (text == name(choice)) return value = choice, "";
    return fmt::format("expects one of {}, not '{}'", names_of(choices), text);
}

/// Traits of the type of a setting: its kind, accepted names, text, and the inverse of text.
template <class T>
struct Value;

template <class T>
requires(std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) struct Value<T> {
    using Parsed = std::conditional_t<std::is_floating_point_v<T>, double, T>;
    static constexpr Setting::Type type = std::is_floating_point_v<T> ? Setting::Type::number : Setting::Type::whole;
    static std::string names() { return ""; }
    static std::string text(T value) { return fmt::format("{}", value); }
    static std::string parse(const Setting& s, const std::string& text, T& value) {
        Parsed parsed{};
        const char* const end = text.data() + text.size();
        const auto [at, error] = std::from_chars(text.data(), end, parsed);
        const bool in_range =
            (parsed >= Parsed(s.lower) && parsed <= Parsed(s.upper)) || (s.zero && parsed == Parsed(0));
        if (error != std::errc() || at != end || !in_range)
            return fmt::format("expects {}a {} from {} to {}, not '{}'", s.zero ? "0 or " : "",
                               type == Setting::Type::whole ? "whole number" : "number", s.lower, s.upper, text);
        value = static_cast<T>(parsed);
        return "";
    }
};

template <>
struct Value<bool> {
    static constexpr Setting::Type type = Setting::Type::flag;
    static std::string names() { return ""; }
    static std::string text(bool value) { return value ? "yes" : "no"; }
    static std::string parse(const Setting&, const std::string& text, bool& value) {
        if (text != "yes" && text != "no") return fmt::format("expects yes or no, not '{}'", text);
        value = text == "yes";
        return "";
    }
};

template <>
struct Value<std::string> {
    static constexpr Setting::Type type = Setting::Type::text;
    static std::string names() { return ""; }
    static std::string text(const std::string& value) { return value; }
    static std::string parse(const Setting&, const std::string& text, std::string& value) { return value = text, ""; }
};

template <class Enum, const auto& kChoices>
struct Choice {
    static constexpr Setting::Type type = Setting::Type::text;
    static std::string names() { return names_of(kChoices); }
    static std::string text(Enum value) { return name(value); }
    static std::string parse(const Setting&, const std::string& text, Enum& value) {
        return parse_name(kChoices, text, value);
    }
};
template <>
struct Value<rays::Culling> : Choice<rays::Culling, kCullings> {};
template <>
struct Value<PrimaryVisibility> : Choice<PrimaryVisibility, kPrimaries> {};

/// A filter by the name of its shape, which also sets the usual radius.
template <>
struct Value<PixelFilter> {
    static constexpr Setting::Type type = Setting::Type::text;
    static std::string names() { return names_of(kFilters); }
    static std::string text(const PixelFilter& filter) { return name(filter.shape); }
    static std::string parse(const Setting&, const std::string& text, PixelFilter& filter) {
        const std::string problem = parse_name(kFilters, text, filter.shape);
        if (problem.empty()) filter.radius = usual_radius(filter.shape);
        return problem;
    }
};

/// An error and its metric: "0.01" or "0.01 mse".
template <>
struct Value<std::optional<ErrorTarget>> {
    static constexpr Setting::Type type = Setting::Type::number;
    static std::string names() { return ""; }
    static std::string text(const std::optional<ErrorTarget>& target) {
        return target ? fmt::format("{} {}", target->error, name(target->metric)) : kNone;
    }
    static std::string parse(const Setting& s, const std::string& text, std::optional<ErrorTarget>& target) {
        ErrorTarget parsed;
        const std::size_t space = std::min(text.find(' '), text.size());
        if (text == kNone) return target.reset(), "";
        std::string problem = Value<double>::parse(s, text.substr(0, space), parsed.error);
        constexpr ErrorMetric kMetrics[] = {ErrorMetric::relmse, ErrorMetric::mse};
        if (problem.empty() && space < text.size())
            problem = parse_name(kMetrics, text.substr(space + 1), parsed.metric);
        if (problem.empty()) target = parsed;
        return problem;
    }
};

/// Sets the value to f(text); returns the message of its Error.
template <class T, class F>
std::string parse_by(const F& f, const std::string& text, T& value) {
    try {
        value = f(text);
    } catch (const Error& error) {
        return error.what();
    }
    return "";
}

template <>
struct Value<Estimator> {
    static constexpr Setting::Type type = Setting::Type::text;
    static std::string names() { return known_estimators(); }
    static std::string text(const Estimator& estimator) { return halflight::text(estimator); }
    static std::string parse(const Setting&, const std::string& text, Estimator& value) {
        return parse_by(estimator_named, text, value);
    }
};

template <>
struct Value<Preview> {
    static constexpr Setting::Type type = Setting::Type::text;
    static std::string names() { return fmt::format("{}, {}", kNone, known_previews()); }
    static std::string text(const Preview& preview) { return halflight::text(preview); }
    static std::string parse(const Setting&, const std::string& text, Preview& value) {
        return parse_by(preview_named, text, value);
    }
};

/// Names of layers; "all" stands for those that are not for debugging.
template <>
struct Value<std::vector<std::string>> {
    static constexpr Setting::Type type = Setting::Type::list;
    static std::string names() {
        std::string names = "none, all";
        for (const AovInfo& aov : known_aovs())
            names.append(", ").append(aov.name).append(aov.debug() ? " (not part of all)" : "");
        return names;
    }
    static std::string text(const std::vector<std::string>& names) {
        return names.empty() ? kNone : fmt::format("{}", fmt::join(names, ","));
    }
    static std::string parse(const Setting&, const std::string& text, std::vector<std::string>& value) {
        std::vector<std::string> layers;
        if (text == kNone) return value.clear(), "";
        for (const std::string& wanted : split(text)) {
            if (wanted != "all" && !find_aov(wanted))
                return fmt::format("has no layer '{}'; known layers are: {}", wanted, names());
            for (const AovInfo& aov : known_aovs())
                if ((aov.name == wanted || (wanted == "all" && !aov.debug())) &&
                    std::ranges::find(layers, aov.name) == layers.end())
                    layers.emplace_back(aov.name);
        }
        value = std::move(layers);
        return "";
    }
};

/// Names of parts. They are not checked, since renderer/needs.h knows them.
template <>
struct Value<Kept> {
    static constexpr Setting::Type type = Setting::Type::list;
    static std::string names() { return ""; }
    static std::string text(const Kept& kept) { return kept.text(); }
    static std::string parse(const Setting&, const std::string& text, Kept& value) {
        const std::vector<std::string> names = split(text);
        value = text == Kept::everything().text() ? Kept::everything()
                : text == Kept().text()           ? Kept()
                                                  : Kept({names.begin(), names.end()});
        return "";
    }
};

template <class Member>
Setting row(Setting s, Member member) {
    using V = Value<std::remove_cvref_t<decltype(member(std::declval<RenderSettings&>()))>>;
    s.type = V::type;
    s.values = V::names();
    s.get = [member](const RenderSettings& settings) { return V::text(member(settings)); };
    s.set = [member, row = s](RenderSettings& settings, const std::string& text) {
        return V::parse(row, text, member(settings));
    };
    return s;
}

std::vector<Setting> make_table() {
    constexpr const char *kPicture = "Picture", *kLight = "Light", *kColour = "Colour", *kRun = "Run";
    constexpr double kMaxUint = 4294967295;
    return {
        row(
            {.name = "width",
             .group = kPicture,
             .metavar = "PIXELS",
             .help = "width; by default it follows from the height and the camera's aspect",
             .lower = 1,
             .upper = kMaxSide,
             .memory = true},
            [](auto& s) -> auto& { return s.width; }),
        row(
            {.name = "height",
             .group = kPicture,
             .metavar = "PIXELS",
             .help = "height; by default it follows from the width and the camera's aspect",
             .lower = 1,
             .upper = kMaxSide,
             .memory = true},
            [](auto& s) -> auto& { return s.height; }),
        row(
            {.name = "filter", .group = kPicture, .metavar = "NAME", .help = "reconstruction filter of pixels"},
            [](auto& s) -> auto& { return s.filter; }),
        row(
            {.name = "filter-radius",
             .group = kPicture,
             .metavar = "PIXELS",
             .help = "radius of the filter; by default that of its shape: box 0.5, blackman-harris 1.5",
             .lower = 0.01,
             .upper = kMaxFilterRadius},
            [](auto& s) -> auto& { return s.filter.radius; }),
        row(
            {.name = "clamp",
             .group = kPicture,
             .metavar = "LUMINANCE",
             .help = "largest luminance of one sample of a pixel's indirect light: fewer fireflies, less light; 0 does "
                     "not clamp",
             .lower = 1e-6,
             .upper = 1e30,
             .zero = true,
             .saved = true,
             .slider_from = 0.01,
             .slider_to = 1000},
            [](auto& s) -> auto& { return s.clamp; }),
        row(
            {.name = "samples",
             .group = kPicture,
             .metavar = "N",
             .help = "samples per pixel",
             .lower = 1,
             .upper = kMaxSamples,
             .saved = true},
            [](auto& s) -> auto& { return s.samples; }),
        row(
            {.name = "time",
             .group = kPicture,
             .metavar = "SECONDS",
             .help = "adds samples until the time is spent; 0 sets no limit",
             .lower = 1e-9,
             .upper = 1e9,
             .zero = true},
            [](auto& s) -> auto& { return s.time_limit; }),
        row(
            {.name = "error",
             .group = kPicture,
             .metavar = "E",
             .help =
                 "adds samples until the error is below E at 95 % confidence; --samples and --time are upper limits",
             .lower = 1e-12,
             .upper = 1e12,
             .memory = true},
            [](auto& s) -> auto& { return s.error; }),
        row(
            {.name = "seed", .group = kPicture, .metavar = "N", .help = "seed of the noise", .upper = kMaxUint},
            [](auto& s) -> auto& { return s.seed; }),
        row(
            {.name = "frame",
             .group = kPicture,
             .metavar = "N",
             .help = "frame number, which decides the noise and, with --animation, the pose",
             .upper = kMaxUint,
             .fingerprint = false},  // each frame has a fingerprint of its own
            [](auto& s) -> auto& { return s.frame; }),
        row(
            {.name = "aov",
             .group = kPicture,
             .metavar = "NAME,...",
             .help = "additional layers of the .exr",
             .memory = true},
            [](auto& s) -> auto& { return s.aovs; }),
        row(
            {.name = "half",
             .group = kPicture,
             .help = "stores colour layers of the .exr as half floats; data layers stay float",
             .memory = true},
            [](auto& s) -> auto& { return s.half_color; }),
        row(
            {.name = "bounces",
             .group = kLight,
             .metavar = "N",
             .help = "reflections along a path; 0 shows light sources only, 1 direct light",
             .upper = kMaxBounces,
             .saved = true,
             .memory = true,
             .slider_to = 16},
            [](auto& s) -> auto& { return s.bounces; }),
        row(
            {.name = "display",
             .group = kColour,
             .metavar = "NAME",
             .help = "OpenColorIO display of the .png or window; by default that of the config",
             .saved = true},
            [](auto& s) -> auto& { return s.view.display; }),
        row(
            {.name = "view",
             .group = kColour,
             .metavar = "NAME",
             .help = "OpenColorIO view; by default that of the display",
             .saved = true},
            [](auto& s) -> auto& { return s.view.view; }),
        row(
            {.name = "look",
             .group = kColour,
             .metavar = "NAME",
             .help = "OpenColorIO look; by default those of the view",
             .saved = true},
            [](auto& s) -> auto& { return s.view.look; }),
        row(
            {.name = "exposure",
             .group = kColour,
             .metavar = "STOPS",
             .help = "exposure of the .png or window",
             .lower = -64,
             .upper = 64,
             .saved = true,
             .slider_from = -10,
             .slider_to = 10},
            [](auto& s) -> auto& { return s.view.exposure; }),
        row(
            {.name = "culling",
             .group = kRun,
             .metavar = "METHOD",
             .help = "culling method of rays, which never changes the picture",
             .fingerprint = false},
            [](auto& s) -> auto& { return s.culling; }),
        row(
            {.name = "primary",
             .group = kRun,
             .metavar = "METHOD",
             .help = "primary visibility; auto traces where there are more than twice as many triangles as pixels"},
            [](auto& s) -> auto& { return s.primary; }),
        row(
            {.name = "estimator",
             .group = kRun,
             .metavar = "KEY=VALUE,...",
             .help = "sampling techniques; auto lets a pilot render choose those that pay in the scene",
             .memory = true},
            [](auto& s) -> auto& { return s.estimator; }),
        row(
            {.name = "preview",
             .group = kRun,
             .metavar = "NAME,...",
             .help = "biased modes that improve pictures of few samples; temporal reuses light of earlier frames",
             .saved = true,
             .memory = true},
            [](auto& s) -> auto& { return s.preview; }),
        row(
            {.name = "keep",
             .group = kRun,
             .metavar = "NAME,...",
             .help = "builds parts that the scene does not need: names from `halflight info SCENE --needs` without a "
                     "*; costs time and memory, never changes the picture",
             .fingerprint = false},
            [](auto& s) -> auto& { return s.kept; }),
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
        "- *memory*: the memory estimate of `halflight info SCENE`, which has the option, too, depends on it.\n\n"
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
