// Values of settings files, whose errors name file and element.
#pragma once

#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "api/halflight/scene_edits.h"
#include "engine/core/error.h"
#include "engine/core/short_number.h"
#include "engine/core/suggestion.h"

namespace halflight::settings {

using Json = nlohmann::ordered_json;

/// A value of the file and its place there, for messages.
class Element {
  public:
    Element(const std::filesystem::path& file, const Json& json, std::string place = "")
        : file_(file), json_(json), place_(std::move(place)) {}

    /// Returns file and place for messages.
    std::string where() const { return file_.string() + (place_.empty() ? "" : ": " + place_); }
    template <class... Args>
    [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
        throw Error(where(), fmt::format(format, std::forward<Args>(args)...));
    }

    bool is_string() const { return json_.is_string(); }
    bool is_number() const { return json_.is_number(); }
    bool is_object() const { return json_.is_object(); }
    bool is_list() const { return json_.is_array(); }
    std::optional<Element> find(const char* key) const {
        const auto found = json_.find(key);
        if (found == json_.end()) return std::nullopt;
        return Element(file_, *found, place_.empty() ? key : place_ + "." + key);
    }
    /// Throws Error unless the value is an object with keys in `known` only.
    void check_keys(const std::set<std::string>& known) const {
        if (!json_.is_object()) fail("is no object");
        for (const auto& [key, unused] : json_.items())
            if (!known.contains(key))
                fail("there is no setting '{}'{}", key, did_you_mean(key, {known.begin(), known.end()}));
    }
    std::vector<std::pair<std::string, Element>> members() const {
        if (!json_.is_object()) fail("is no object");
        std::vector<std::pair<std::string, Element>> all;
        for (const auto& [key, value] : json_.items()) all.emplace_back(key, Element(file_, value, place_ + "." + key));
        return all;
    }
    /// Returns the members of an object whose keys are indices.
    std::vector<std::pair<std::size_t, Element>> indexed() const {
        std::vector<std::pair<std::size_t, Element>> all;
        for (const auto& [key, value] : members()) {
            std::size_t index = 0;
            std::from_chars(key.data(), key.data() + key.size(), index);
            if (key != std::to_string(index)) fail("'{}' is no index", key);
            all.emplace_back(index, value);
        }
        return all;
    }
    double number() const {
        constexpr double kMost = std::numeric_limits<float>::max();
        return number(-kMost, kMost);
    }
    std::vector<Element> items() const {
        if (!json_.is_array()) fail("is no list");
        std::vector<Element> all;
        for (std::size_t i = 0; i < json_.size(); ++i)
            all.emplace_back(file_, json_[i], fmt::format("{}[{}]", place_, i));
        return all;
    }

    std::string text() const {
        if (!json_.is_string()) fail("is no text");
        return json_.get<std::string>();
    }
    bool truth() const {
        if (!json_.is_boolean()) fail("is neither true nor false");
        return json_.get<bool>();
    }
    double number(const EditRange& range) const { return number(range.lower, range.upper); }
    double number(double lower, double upper) const {
        const double value = json_.is_number() ? json_.get<double>() : NAN;
        if (!(value >= lower && value <= upper)) fail("is no number from {} to {}", lower, upper);
        return value;
    }
    int whole(int lower, int upper) const {
        const double value = number(lower, upper);
        if (value != std::floor(value)) fail("is no whole number");
        return static_cast<int>(value);
    }
    dvec3 triple(const EditRange& range) const { return triple(range.lower, range.upper); }
    dvec3 triple(double lower, double upper) const {
        const auto numbers = items();
        if (numbers.size() != 3) fail("is no list of three numbers");
        return {numbers[0].number(lower, upper), numbers[1].number(lower, upper), numbers[2].number(lower, upper)};
    }

  private:
    const std::filesystem::path& file_;
    const Json& json_;
    std::string place_;
};

inline constexpr double kFar = 1e30;  // largest coordinate and radiance

/// Calls f with the value of a key if the object has it.
template <class F>
void with(const Element& object, const char* key, F&& f) {
    if (const auto value = object.find(key)) f(*value);
}

inline Json list(const dvec3& v) {
    return {v.x, v.y, v.z};
}
inline Json list(const vec3& v) {
    return {short_number(v.x), short_number(v.y), short_number(v.z)};
}

}  // namespace halflight::settings
