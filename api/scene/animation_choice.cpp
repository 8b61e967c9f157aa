#include "api/scene/animation_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <numeric>
#include <set>

#include "engine/core/error.h"
#include "engine/core/suggestion.h"

namespace halflight {
namespace {

/// Returns the title of an animation for messages: its name, or its number.
std::string title(const std::vector<Animation>& animations, std::size_t index) {
    const std::string& name = animations[index].name;
    return name.empty() ? std::to_string(index) : "'" + name + "'";
}

std::string list_of(const std::vector<Animation>& animations) {
    std::string list;
    for (std::size_t i = 0; i < animations.size(); ++i)
        list += fmt::format("{}{} '{}'", i == 0 ? "" : ", ", i, animations[i].name);
    return list.empty() ? "it has none" : "its animations: " + list;
}

/// Finds an animation by name, else by index; names come first because they may be numbers.
std::size_t find_animation(const std::vector<Animation>& animations, const std::string& wanted,
                           const std::filesystem::path& file) {
    const auto named = std::ranges::find(animations, wanted, &Animation::name);
    if (named != animations.end()) return static_cast<std::size_t>(named - animations.begin());
    std::size_t index = 0;
    const auto [end, error] = std::from_chars(wanted.data(), wanted.data() + wanted.size(), index);
    if (error == std::errc() && end == wanted.data() + wanted.size() && index < animations.size()) return index;
    std::vector<std::string> names;
    for (const Animation& animation : animations) names.push_back(animation.name);
    throw Error(file.string(), "no animation '{}': {}{}", wanted, list_of(animations), did_you_mean(wanted, names));
}

/// Warns of animations that drive the same property: only the last one has an effect, which is rarely intended.
void warn_of_conflicts(const std::vector<Animation>& animations, const std::vector<std::size_t>& playing,
                       const Log& log) {
    constexpr std::size_t kMostNamed = 8;
    std::map<std::pair<int, int>, std::size_t> driver;  // animation by field and target
    std::set<std::size_t> in_conflict;
    for (const std::size_t index : playing) {
        for (const AnimationChannel& channel : animations[index].channels) {
            const auto [it, is_new] = driver.try_emplace({channel.field, channel.target}, index);
            if (!is_new && it->second != index) in_conflict.insert({it->second, index});
        }
    }
    if (in_conflict.empty()) return;
    std::vector<std::string> names;
    for (const std::size_t index : in_conflict)
        if (names.size() < kMostNamed) names.push_back(title(animations, index));
    if (in_conflict.size() > kMostNamed) names.push_back(fmt::format("{} more", in_conflict.size() - kMostNamed));
    const std::string last = names.back();
    names.pop_back();
    log.warn("animations {} and {} drive the same properties, and only the last one counts; see --animation",
             fmt::join(names, ", "), last);
}

}  // namespace

std::vector<std::size_t> choose_animations(GltfScene& scene, const std::filesystem::path& file,
                                           const std::string& wanted, const Log& log) {
    if (wanted == "none") return {};
    const std::vector<Animation>& animations = scene.animations();
    std::vector<std::size_t> playing(animations.size());
    std::iota(playing.begin(), playing.end(), std::size_t{0});
    if (wanted != "all") playing = {find_animation(animations, wanted, file)};
    for (const std::string& warning : scene.animation_warnings()) log.warn("{}", warning);
    for (const std::size_t index : playing)
        if (animations[index].damage) throw *animations[index].damage;
    warn_of_conflicts(animations, playing, log);
    return playing;
}

}  // namespace halflight
