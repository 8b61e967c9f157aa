// The section "Scene": the file, its animation, and what it contains.
#include <fmt/format.h>

#include <algorithm>

#include "api/halflight/statistics.h"
#include "tools/view/inspector.h"
#include "tools/view/widgets.h"

namespace halflight::view {
namespace {

/// Shows the combo box even if no animation is chosen, so that one can be chosen.
void animation(const Timeline& t, PanelContext& c) {
    heading("Animation");
    if (!t.animations.empty()) {
        std::vector<std::string> all = {"none", "all"};
        all.insert(all.end(), t.animations.begin(), t.animations.end());
        std::string chosen = t.animation;
        if (choose("Animation", chosen, all, "animation that moves the scene")) c.requests.frame = {chosen, 0};
    }
    if (!t.runs()) return;
    int frame = static_cast<int>(std::clamp(c.now.frame, FrameNumber{0}, FrameNumber{1} << 24));
    if (slider("Frame", frame, 0, static_cast<int>(t.last), "frame of the animation"))
        c.requests.frame = {t.animation, frame};
    bool play = c.now.playing;
    if (checkbox("Play (Space)", play, "plays the animation in a loop; late frames are left out"))
        c.requests.play = play;
    value("Time", fmt::format("{:.2f} s of {:.2f} s", t.rate.seconds(c.now.frame), t.rate.seconds(t.last)));
}

void variants(PanelContext& c) {
    if (c.session.variants().empty()) return;
    std::vector<std::string> all = {"the file's own"};
    all.insert(all.end(), c.session.variants().begin(), c.session.variants().end());
    std::string chosen = c.session.variant().empty() ? all[0] : c.session.variant();
    if (choose("Variant", chosen, all, "material variant of the file"))
        c.requests.variant = chosen == all[0] ? "" : chosen;
}

}  // namespace

void scene_section(PanelContext& c) {
    const Scene& scene = c.session.scene();
    heading("File");
    text(c.session.file().filename().string());
    tooltip(c.session.file().string().c_str());
    if (c.session.took_settings())
        faint_text(fmt::format("with the settings of {}", c.session.settings_file().filename().string()));
    action_button(c, Action::open);
    action_button(c, Action::save, true);
    action_button(c, Action::screenshot);
    action_button(c, Action::exr, true);
    action_button(c, Action::picture_as, true);
    if (c.session.timeline().keyed || !c.session.timeline().animations.empty()) animation(c.session.timeline(), c);
    heading("Objects");
    variants(c);
    object_list(c);
    inspector(c);
    if (!ImGui::CollapsingHeader("Contents")) return;
    std::size_t triangles = 0;
    for (const Instance& instance : scene.instances)
        triangles += scene.meshes[static_cast<std::size_t>(instance.mesh)].triangles.size();
    const auto count = [](const char* what, std::size_t number) { value(what, fmt::format("{}", number)); };
    count("Instances", scene.instances.size());
    count("Meshes", scene.meshes.size());
    if (triangles > 0) count("Triangles", triangles);
    value("Environment", environment_name(scene.environment));
    value("Diagonal", fmt::format("{:.6g} m", c.session.diagonal()), "diagonal of the scene's bounds, world units");
}

}  // namespace halflight::view
