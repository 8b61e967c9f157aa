// Values of settings as text: for each type its kind, its accepted names, its text, and the inverse of the text. This
// file is part of settings_table.cpp.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/names.h"
#include "engine/core/suggestion.h"
#include "engine/settings/layers.h"
#include "engine/settings/settings_table.h"

namespace halflight::setting_values {

inline constexpr const char* kNone = "none";
inline constexpr const char* kAuto = "auto";
inline std::span<const PrimaryVisibility> primaries() {
    static constexpr PrimaryVisibility kAll[] = {PrimaryVisibility::automatic, PrimaryVisibility::raster,
                                                 PrimaryVisibility::traced};
    return kAll;
}

inline std::span<const Backfaces> backface_modes() {
    static constexpr Backfaces kAll[] = {Backfaces::automatic, Backfaces::cull, Backfaces::show};
    return kAll;
}

/// Separators of lists. Newlines join the values of an option that is given several times.
inline constexpr const char* kSeparators = ",\n";

template <class Choices>
std::string names_of(const Choices& choices) {
    std::vector<std::string> names;
    for (const auto choice : choices) names.emplace_back(name(choice));
    return fmt::format("{}", fmt::join(names, ", "));
}

template <class Choices, class Enum>
std::string parse_name(const Choices& choices, const std::string& text, Enum& value) {
    for (const Enum choice : choices)
        if (text == name(choice)) return value = choice, "";
    return fmt::format("expects one of {}, not '{}'", names_of(choices), text);
}

/// Conversion of a value to and from text. names() returns accepted names, or "" for numbers and free text. parse()
/// sets the value. It returns what is wrong with the text, or "" if the value was set.
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
        value = static_cast<T>(parsed) + T(0);  // makes 0 of -0, which settings files do not hold
        return "";
    }
};

/// An exposure: "auto", or a number of stops.
template <>
struct Value<Exposure> {
    static constexpr Setting::Type type = Setting::Type::number;
    static std::string names() { return "auto, or a number from -64 to 64"; }
    static std::string text(const Exposure& exposure) {
        return exposure.automatic ? kAuto : Value<float>::text(exposure.stops);
    }
    static std::string parse(const Setting& s, const std::string& text, Exposure& exposure) {
        if (text == kAuto) return exposure = Exposure(), "";
        float stops = 0;
        std::string problem = Value<float>::parse(s, text, stops);
        if (!problem.empty())
            return fmt::format("expects auto or a number from {} to {}, not '{}'", s.lower, s.upper, text);
        exposure = stops;
        return problem;
    }
};

/// A focus: "auto", "none", a distance, or a point of the picture.
template <>
struct Value<Focus> {
    static constexpr Setting::Type type = Setting::Type::text;
    static constexpr const char* kInfinity = "infinity";
    static std::string names() { return "auto, none, infinity, a number, or X,Y"; }
    static std::string text(const Focus& focus) {
        switch (focus.kind) {
            case Focus::Kind::open:
                return kAuto;
            case Focus::Kind::none:
                return kNone;
            case Focus::Kind::distance:
                return std::isinf(focus.distance) ? kInfinity : fmt::format("{}", focus.distance);
            case Focus::Kind::point:
                break;
        }
        return fmt::format("{},{}", focus.point.x, focus.point.y);
    }
    static std::string parse(const Setting& s, const std::string& text, Focus& focus) {
        using Kind = Focus::Kind;
        if (text == kAuto) return focus = {}, "";
        if (text == kNone) return focus = {.kind = Kind::none}, "";
        constexpr double kFar = std::numeric_limits<double>::infinity();
        if (text == kInfinity) return focus = {.kind = Kind::distance, .distance = kFar}, "";
        const auto number = [](std::string_view part, double lower, double upper, double& value) {
            const auto [at, error] = std::from_chars(part.data(), part.data() + part.size(), value);
            return error == std::errc() && at == part.data() + part.size() && value >= lower && value <= upper;
        };
        const std::size_t comma = std::min(text.find(','), text.size());
        const std::string_view first = std::string_view(text).substr(0, comma);
        if (comma == text.size()) {
            Focus at{.kind = Kind::distance};
            if (number(first, s.lower, s.upper, at.distance)) return focus = at, "";
        } else {
            Focus at{.kind = Kind::point};
            const std::string_view second = std::string_view(text).substr(comma + 1);
            if (number(first, 0, 1, at.point.x) && number(second, 0, 1, at.point.y)) return focus = at, "";
        }
        return fmt::format("expects {}, {}, {}, a distance from {} to {}, or X,Y from 0 to 1, not '{}'", kAuto, kNone,
                           kInfinity, s.lower, s.upper, text);
    }
};

/// A rectangle of pixels: "none" or "X0,Y0,X1,Y1".
template <>
struct Value<std::optional<PixelWindow>> {
    static constexpr Setting::Type type = Setting::Type::text;
    static std::string names() { return fmt::format("{}, or X0,Y0,X1,Y1", kNone); }
    static std::string text(const std::optional<PixelWindow>& window) {
        if (!window) return kNone;
        return fmt::format("{},{},{},{}", window->first.x, window->first.y, window->end.x, window->end.y);
    }
    static std::string parse(const Setting& s, const std::string& text, std::optional<PixelWindow>& value) {
        if (text == kNone) return value.reset(), "";
        const std::vector<std::string> parts = split_names(text, kSeparators);
        PixelWindow window;
        int* const to[] = {&window.first.x, &window.first.y, &window.end.x, &window.end.y};
        bool good = parts.size() == std::size(to);
        for (std::size_t i = 0; good && i < parts.size(); ++i) good = Value<int>::parse(s, parts[i], *to[i]).empty();
        if (!good)
            return fmt::format("expects X0,Y0,X1,Y1, whole numbers from {} to {}, not '{}'", s.lower, s.upper, text);
        if (window.first.x >= window.end.x || window.first.y >= window.end.y)
            return fmt::format("has no pixels: X1 and Y1 must exceed X0 and Y0 in '{}'", text);
        value = window;
        return "";
    }
};

/// A whole number, or "auto", which leaves it open.
template <>
struct Value<std::optional<int>> {
    static constexpr Setting::Type type = Setting::Type::whole;
    static std::string names() { return ""; }
    static std::string text(const std::optional<int>& value) { return value ? Value<int>::text(*value) : kAuto; }
    static std::string parse(const Setting& s, const std::string& text, std::optional<int>& value) {
        int parsed = 0;
        if (text == kAuto) return value.reset(), "";
        if (!Value<int>::parse(s, text, parsed).empty())
            return fmt::format("expects auto or a whole number from {} to {}, not '{}'", s.lower, s.upper, text);
        return value = parsed, "";
    }
};

/// A duration in seconds: a number, or a fraction such as "1/250".
template <>
struct Value<ExposureTime> {
    static constexpr Setting::Type type = Setting::Type::number;
    static std::string names() { return ""; }
    static std::string text(const ExposureTime& duration) { return Value<float>::text(duration.seconds); }
    static std::string parse(const Setting& s, const std::string& text, ExposureTime& duration) {
        if (!text.starts_with("1/")) return Value<float>::parse(s, text, duration.seconds);
        double below = 0;
        const char* const end = text.data() + text.size();
        const auto [at, error] = std::from_chars(text.data() + 2, end, below);
        const double seconds = 1 / below;
        if (error != std::errc() || at != end || !(seconds >= s.lower && seconds <= s.upper))
            return fmt::format("expects 0, a number from {} to {} or 1/N, not '{}'", s.lower, s.upper, text);
        duration.seconds = static_cast<float>(seconds);
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

/// The name of one of choices().
template <class Enum, const auto& choices>
struct Choice {
    static constexpr Setting::Type type = Setting::Type::text;
    static std::string names() { return names_of(choices()); }
    static std::string text(Enum value) { return name(value); }
    static std::string parse(const Setting&, const std::string& text, Enum& value) {
        return parse_name(choices(), text, value);
    }
};
template <>
struct Value<PrimaryVisibility> : Choice<PrimaryVisibility, primaries> {};
template <>
struct Value<Backfaces> : Choice<Backfaces, backface_modes> {};
template <>
struct Value<rays::Culling> : Choice<rays::Culling, rays::culling_methods> {};
template <>
struct Value<Projection> : Choice<Projection, projections> {};
template <>
struct Value<Stereo> : Choice<Stereo, stereo_layouts> {};

/// Value of the setting "filter": the name of a shape. Parsing also sets the usual radius of the shape.
template <>
struct Value<PixelFilter> {
    static constexpr Setting::Type type = Setting::Type::text;
    static std::string names() { return names_of(filter_shapes()); }
    static std::string text(const PixelFilter& filter) { return name(filter.shape); }
    static std::string parse(const Setting&, const std::string& text, PixelFilter& filter) {
        const std::string problem = parse_name(filter_shapes(), text, filter.shape);
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

/// Names of layers; "all" stands for those with AovInfo::in_all().
template <>
struct Value<std::vector<std::string>> {
    static constexpr Setting::Type type = Setting::Type::list;
    static std::string names() {
        std::string names = "none, all";
        for (const AovInfo& aov : known_aovs())
            names.append(", ").append(aov.name).append(aov.in_all() ? "" : " (not part of all)");
        return names;
    }
    static std::string meant(const std::string& wanted) {
        std::vector<std::string> all;
        for (const AovInfo& aov : known_aovs()) all.emplace_back(aov.name);
        return did_you_mean(wanted, all);
    }
    static std::string text(const std::vector<std::string>& names) {
        return names.empty() ? kNone : fmt::format("{}", fmt::join(names, ","));
    }
    static std::string parse(const Setting&, const std::string& text, std::vector<std::string>& value) {
        std::vector<std::string> layers;
        if (text == kNone) return value.clear(), "";
        for (const std::string& wanted : split_names(text, kSeparators)) {
            const AovInfo* const found = find_aov(wanted);
            if (wanted == kNone) return "none stands alone";
            if (wanted != "all" && !found)
                return fmt::format("has no layer '{}'; known layers are: {}{}", wanted, names(), meant(wanted));
            for (const AovInfo& aov : known_aovs())
                if ((aov.name == wanted || (wanted == "all" && aov.in_all())) &&
                    std::ranges::find(layers, aov.name) == layers.end())
                    layers.emplace_back(aov.name);
            if (found && found->is_light_group() && std::ranges::find(layers, wanted) == layers.end())
                layers.push_back(wanted);
        }
        value = std::move(layers);
        return "";
    }
};

/// Names of parts. renderer/settings_check.h checks them, since renderer/needs.h knows them.
template <>
struct Value<Kept> {
    static constexpr Setting::Type type = Setting::Type::list;
    static std::string names() { return ""; }
    static std::string text(const Kept& kept) { return kept.text(); }
    static std::string parse(const Setting&, const std::string& text, Kept& value) {
        const std::vector<std::string> names = split_names(text, kSeparators);
        value = text == Kept::everything().text() ? Kept::everything()
                : text == Kept().text()           ? Kept()
                                                  : Kept({names.begin(), names.end()});
        return "";
    }
};

}  // namespace halflight::setting_values
