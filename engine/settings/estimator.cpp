#include "engine/settings/estimator.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/names.h"

namespace halflight {
namespace {

/// Value and first word that leave the choice to a pilot.
constexpr std::string_view kPilot = "auto";

/// A technique of the estimator: its key in lists and its values.
struct Key {
    const char* name;
    std::vector<std::string> values;
    std::function<std::string(const Estimator&)> get;
    std::function<void(Estimator&, std::size_t value)> set;
};

template <class Choice, std::size_t N>
Key key(const char* key_name, const Choice (&choices)[N], Choice Estimator::*which) {
    Key k{key_name,
          {},
          [=](const Estimator& e) { return std::string(name(e.*which)); },
          [&choices, which](Estimator& e, std::size_t value) { e.*which = choices[value]; }};
    for (const Choice choice : choices) k.values.emplace_back(name(choice));
    return k;
}

const std::vector<Key>& keys() {
    static const std::vector<Key> all{
        key("lights", kLightChoices, &Estimator::lights), key("sun", kSunChoices, &Estimator::sun),
        key("reuse", kReuses, &Estimator::reuse),         key("camera", kCameraRays, &Estimator::camera),
        key("shadow", kShadowRays, &Estimator::shadow),   key("sampler", kSamplePoints, &Estimator::sampler),
    };
    return all;
}

/// Returns "key=what" for each key that is `wanted`, joined by commas.
template <class What, class Wanted>
std::string listed(const What& what, const Wanted& wanted) {
    std::vector<std::string> all;
    for (const Key& key : keys())
        if (wanted(key)) all.push_back(fmt::format("{}={}", key.name, what(key)));
    return fmt::format("{}", fmt::join(all, ","));
}

bool every(const Key&) {
    return true;
}

}  // namespace

const char* name(Reuse reuse) {
    return name_among(kReuses, {"auto", "off", "4", "8", "16"}, reuse);
}

const char* name(CameraRays rays) {
    return name_among(kCameraRays, {"auto", "1", "2", "4", "8", "16"}, rays);
}

const char* name(ShadowRays rays) {
    return name_among(kShadowRays, {"auto", "1", "2", "4", "8"}, rays);
}

const char* name(SamplePoints points) {
    return name_among(kSamplePoints, {"sobol", "blue-noise", "independent"}, points);
}

bool leaves_open(const Estimator& e) {
    return e.reuse == Reuse::automatic || e.camera == CameraRays::automatic || e.shadow == ShadowRays::automatic;
}

std::string text(const Estimator& estimator) {
    return listed([&](const Key& key) { return key.get(estimator); }, every);
}

std::string difference(const Estimator& estimator, std::span<const Estimator> others) {
    return listed([&](const Key& key) { return key.get(estimator); },
                  [&](const Key& key) {
                      const std::string own = key.get(estimator);
                      return own != key.get({}) ||
                             std::ranges::any_of(others, [&](const Estimator& e) { return key.get(e) != own; });
                  });
}

Estimator estimator_named(std::string_view list) {
    Estimator estimator;
    std::vector<std::string> given;
    const std::vector<std::string> words = split_names(list);
    for (const std::string& one : words) {
        if (one == kPilot && &one == &words.front()) {
            estimator.reuse = Reuse::automatic;
            estimator.camera = CameraRays::automatic;
            estimator.shadow = ShadowRays::automatic;
            continue;
        }
        const std::size_t equals = std::min(one.find('='), one.size());
        const std::string name(one.substr(0, equals));
        if (one == kPilot) throw Error(std::string(list), "'{}' stands first or not at all", kPilot);
        const auto key = std::ranges::find_if(keys(), [&](const Key& k) { return k.name == name; });
        if (key == keys().end())
            throw Error(std::string(list), "'{}' is no technique; there are: {}", one, known_estimators());
        if (equals == one.size())
            throw Error(std::string(list), "'{}' has no value; there are: {}", one, fmt::join(key->values, ", "));
        const auto value = std::ranges::find(key->values, one.substr(equals + 1));
        if (value == key->values.end())
            throw Error(std::string(list), "there is no {}; there are: {}", one, fmt::join(key->values, ", "));
        if (std::ranges::find(given, name) != given.end()) throw Error(std::string(list), "'{}' is given twice", name);
        key->set(estimator, static_cast<std::size_t>(value - key->values.begin()));
        given.push_back(name);
    }
    return estimator;
}

std::string known_estimators() {
    return fmt::format("{},{}", kPilot, listed([](const Key& key) { return fmt::join(key.values, "|"); }, every));
}

}  // namespace halflight
