#include "tools/view/stale_settings.h"

#include <algorithm>
#include <utility>

#include "api/halflight/camera.h"
#include "api/halflight/loaded_scene.h"
#include "api/scene/animation_choice.h"
#include "tools/cli/settings_parts.h"
#include "tools/view/session.h"

namespace halflight::view {
namespace {

/// The file of a scene, at rest. Arguments are checked against it.
class SceneFacts {
  public:
    SceneFacts(const PreviewArguments& plain, const ColorConfig& colors)
        : file_(plain.choice.scene, gltf_options(plain.choice)),
          colors_(colors),
          scene_(file_.at_rest()),
          tree_(file_.tree_at(0, {})) {}

    /// Throws Error if the arguments do not suit the scene.
    void check(const PreviewArguments& a) {
        colors_.view(a.settings.view);
        if (!a.choice.variant.empty() &&
            std::ranges::find(file_.variants(), a.choice.variant) == file_.variants().end())
            throw Error(a.choice.scene.string(), "there is no material variant '{}'", a.choice.variant);
        if (a.choice.animation) choose_animations(file_, a.choice.scene, *a.choice.animation, Log());
        Scene lit = scene_;
        if (!std::holds_alternative<std::monostate>(a.choice.environment))
            set_environment(lit, a.choice.environment, Log(), {.lit_elsewhere = true});
        check_edits(edits_at(a, 0), lit, tree_, a.choice.edits_source);
        Timeline timeline;
        timeline.frame = a.settings.frame;
        timeline.own_cameras = scene_.cameras;
        timeline.take_keys(a, scene_);
        with_lens(choose_camera(scene_, a.view).camera, a.settings.view.camera.lens);
    }

  private:
    GltfScene file_;
    const ColorConfig& colors_;
    Scene scene_;
    SceneTree tree_;
};

}  // namespace

void leave_out_stale(PreviewArguments& a, const ColorConfig& colors, std::vector<std::string>& problems) {
    const std::shared_ptr<const PreviewArguments::Source> source = a.settings_source;
    if (!source) return;
    SettingsParts parts(source->text, source->path);
    std::vector<std::string> found;
    try {
        const PreviewArguments plain = source->with(SavedSettings());
        SceneFacts facts(plain, colors);
        facts.check(plain);
        found = parts.drop_unfit([&](const SavedSettings& one) { facts.check(source->with(one)); });
    } catch (const Error&) {  // the first error stands
        return;
    }
    if (found.empty()) return;
    a = source->with(parts.settings());
    a.settings_source = source;
    problems = std::move(found);
}

}  // namespace halflight::view
