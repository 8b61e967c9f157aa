#include "tools/view/stale_settings.h"

#include <algorithm>
#include <utility>

#include "api/halflight/camera.h"
#include "api/halflight/loaded_scene.h"
#include "api/scene/animation_choice.h"
#include "tools/cli/settings_parts.h"

namespace halflight::view {
namespace {

/// The file of a scene, at rest. Arguments are checked against it.
class SceneFacts {
  public:
    SceneFacts(const PreviewArguments& plain, const ColorConfig& colors)
        : file_(plain.scene, gltf_options(plain)),
          colors_(colors),
          scene_(file_.at_rest()),
          tree_(file_.tree_at(0, {})) {}

    /// Throws Error if the arguments do not suit the scene.
    void check(const PreviewArguments& a) {
        colors_.view(a.settings.view);
        if (!a.variant.empty() && std::ranges::find(file_.variants(), a.variant) == file_.variants().end())
            throw Error(a.scene.string(), "there is no material variant '{}'", a.variant);
        if (a.animation) choose_animations(file_, a.scene, *a.animation, Log());
        Scene lit = scene_;
        if (!std::holds_alternative<std::monostate>(a.environment))
            set_environment(lit, a.environment, Log(), {.lit_elsewhere = true});
        check_edits(a.edits, lit, tree_, a.edits_source);
        with_lens(choose_camera(scene_, a).camera, a.settings.view.camera.lens);
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
