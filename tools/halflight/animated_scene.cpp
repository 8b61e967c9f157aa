#include "tools/halflight/animated_scene.h"

#include <algorithm>

#include "tools/halflight/animation_choice.h"
#include "tools/halflight/loading.h"

namespace halflight {

AnimatedScene::AnimatedScene(const RenderArguments& a, const Console& console) {
    bool lit_later = false;
    if (a.frames.empty() && !a.animation) {
        scene_ = load_scene(a.scene, a.allow_outside, console);
    } else {
        file_.emplace(a.scene, gltf_options(a.allow_outside));
        frame_rate_ = choose_frame_rate(a.frame_rate, *file_, console);
        const std::string wanted = a.animation.value_or(a.frames.empty() ? "none" : "all");
        playing_ = choose_animations(*file_, a.scene, wanted, console);
        lit_later = drive_light(*file_, playing_);
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

void set_frame(RenderSettings& settings, AnimatedScene& scene, std::uint32_t frame) {
    const FrameRate& rate = scene.frame_rate();
    settings.frame = frame;
    settings.camera = scene.camera(rate.seconds(frame)).camera;
    if (std::ranges::find(settings.aovs, "motion") != settings.aovs.end())
        settings.previous_camera = scene.camera(rate.seconds(static_cast<double>(frame) - 1)).camera;
}

}  // namespace halflight
