#include "tools/halflight/animated_scene.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <numeric>
#include <set>

#include "tools/halflight/loading.h"

namespace halflight {
namespace {

/// For people: its name, or its number.
std::string title(const std::vector<Animation>& animations, std::size_t index) {
    const std::string& name = animations[index].name;
    return name.empty() ? std::to_string(index) : "'" + name + "'";
}

std::string list_of(const std::vector<Animation>& animations) {
    std::string list;
    for (std::size_t i = 0; i < animations.size(); ++i)
        list += fmt::format("{}{} '{}'", i == 0 ? "" : ", ", i, animations[i].name);
    return list.empty() ? "it has none" : "it has " + list;
}

/// By name, which comes first since a name may be a number, or by index.
std::size_t find_animation(const std::vector<Animation>& animations, const std::string& wanted,
                           const std::filesystem::path& file) {
    const auto named = std::ranges::find(animations, wanted, &Animation::name);
    if (named != animations.end()) return static_cast<std::size_t>(named - animations.begin());
    std::size_t index = 0;
    const auto [end, error] = std::from_chars(wanted.data(), wanted.data() + wanted.size(), index);
    if (error == std::errc() && end == wanted.data() + wanted.size() && index < animations.size()) return index;
    throw Error(file.string(), "no animation '{}': {}", wanted, list_of(animations));
}

std::vector<std::size_t> choose_animations(GltfScene& scene, const RenderArguments& a) {
    const std::string wanted = a.animation.value_or(a.frames.empty() ? "none" : "all");
    if (wanted == "none") return {};
    const std::vector<Animation>& animations = scene.animations();
    if (wanted != "all") return {find_animation(animations, wanted, a.scene)};
    std::vector<std::size_t> all(animations.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    return all;
}

/// Of animations that drive the same thing only the last one is seen, which is seldom what was meant.
void warn_of_conflicts(const std::vector<Animation>& animations, const std::vector<std::size_t>& playing,
                       const Console& console) {
    constexpr std::size_t kMostNamed = 8;
    std::map<std::pair<AnimatedProperty, int>, std::size_t> driver;
    std::set<std::size_t> in_conflict;
    for (const std::size_t index : playing) {
        for (const AnimationChannel& channel : animations[index].channels) {
            const auto [it, is_new] = driver.try_emplace({channel.property, channel.target}, index);
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
    console.warn("animations {} and {} drive the same things, of which the last one wins; --animation chooses",
                 fmt::join(names, ", "), last);
}

/// Whether light may come later where there is none at 0 s.
bool drive_light(const std::vector<Animation>& animations, const std::vector<std::size_t>& playing) {
    return std::ranges::any_of(playing, [&](std::size_t index) {
        return std::ranges::any_of(animations[index].channels, [](const AnimationChannel& channel) {
            return of_light(channel.property) || channel.property == AnimatedProperty::emissive_factor ||
                   channel.property == AnimatedProperty::emissive_strength;
        });
    });
}

}  // namespace

AnimatedScene::AnimatedScene(const RenderArguments& a, const Console& console) {
    bool lit_later = false;
    if (a.frames.empty() && !a.animation) {
        scene_ = load_scene(a.scene, a.allow_outside, console);
    } else {
        file_.emplace(a.scene, gltf_options(a.allow_outside));
        playing_ = choose_animations(*file_, a);
        if (!playing_.empty()) {
            for (const std::string& warning : file_->animation_warnings()) console.warn("{}", warning);
            warn_of_conflicts(file_->animations(), playing_, console);
            lit_later = drive_light(file_->animations(), playing_);
        }
        surfaces_move_ = file_->surfaces_move(playing_);
        scene_ = file_->at(0, playing_);
        for (const std::string& warning : scene_.report.warnings) console.warn("{}", warning);
        files_ = file_->files();
        if (playing_.empty()) file_.reset();  // with its copy of the images
    }
    const bool chosen = !std::holds_alternative<std::monostate>(a.environment);
    if (chosen || !lit_later) set_environment(scene_, a.environment, console);
    edits_ = a.edits;
    apply(edits_, scene_);
    camera_ = choose_camera(scene_, a);
}

bool AnimatedScene::pose(double seconds) {
    if (!surfaces_move_ || seconds == posed_at_) return false;
    Environment environment = std::move(scene_.environment);  // which has its edits
    try {
        file_->pose(scene_, seconds, playing_);
    } catch (...) {
        scene_.environment = std::move(environment);
        throw;
    }
    apply(edits_, scene_);
    scene_.environment = std::move(environment);
    posed_at_ = seconds;
    return true;
}

void AnimatedScene::deform_by(Deformer* deformer) {
    file_->deform_by(deformer);
    posed_at_.reset();
}

Scene AnimatedScene::posed(double seconds) {
    Scene posed = file_->at(seconds, playing_);
    apply(edits_, posed);
    return posed;
}

ChosenCamera AnimatedScene::camera(double seconds) {
    ChosenCamera chosen = camera_;
    if (chosen.index && !playing_.empty()) chosen.camera = file_->cameras_at(seconds, playing_).at(*chosen.index);
    return chosen;
}

void set_frame(RenderSettings& settings, AnimatedScene& scene, const FrameRate& rate, std::uint32_t frame) {
    settings.frame = frame;
    settings.camera = scene.camera(rate.seconds(frame)).camera;
    if (std::ranges::find(settings.aovs, "motion") != settings.aovs.end())
        settings.previous_camera = scene.camera(rate.seconds(static_cast<double>(frame) - 1)).camera;
}

}  // namespace halflight
