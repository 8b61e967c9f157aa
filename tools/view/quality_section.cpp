// The section "Quality": samples, light paths, preview modes, tracing.
#include <fmt/format.h>

#include "tools/view/side_bar.h"
#include "tools/view/widgets.h"

namespace halflight::view {
namespace {

void modes(PreviewModes& modes) {
    heading("Preview modes");
    faint_text("Biased: less noise in early pictures. All but the clamp fade out as samples are added.");
    for (const PreviewMode& mode : known_preview_modes())
        checkbox(mode.description, modes.preview.*mode.flag, "a bias, which the window names");
    bool clamped = modes.clamp > 0;
    if (checkbox("Clamp indirect light", clamped, setting("clamp").help)) modes.clamp = clamped ? 10.0f : 0.0f;
    if (clamped) slider("Luminance", "clamp", modes.clamp, "%.2f", kLogarithmic);
}

void culling(rays::Culling& chosen) {
    label("Culling", setting("culling").help);
    if (!ImGui::BeginCombo("##culling", rays::name(chosen))) return;
    for (const rays::Culling one : rays::culling_methods())
        if (ImGui::Selectable(name(one), one == chosen)) chosen = one;
    close_by_escape();
    ImGui::EndCombo();
}

void backfaces(Backfaces& chosen) {
    label("Back faces", setting("backfaces").help);
    if (!ImGui::BeginCombo("##backfaces", name(chosen))) return;
    for (const Backfaces one : {Backfaces::automatic, Backfaces::cull, Backfaces::show})
        if (ImGui::Selectable(name(one), one == chosen)) chosen = one;
    close_by_escape();
    ImGui::EndCombo();
}

void region(PanelContext& c) {
    const auto act = [&](Action action, bool same_line) {
        const ActionRow& row = row_of(action);
        if (button(row.label, fmt::format("{} ({})", row.help, row.keys).c_str(), same_line))
            c.requests.actions.push_back(action);
    };
    act(Action::draw_region, false);
    if (c.session.region) act(Action::whole_picture, true);
}

}  // namespace

void quality_section(PanelContext& c) {
    heading("Samples");
    slider("Samples", c.session.samples, 1, 1 << 16, "samples per pixel after which rendering stops", kLogarithmic);
    slider("Bounces", "bounces", c.session.bounces);
    backfaces(c.session.modes.backfaces);
    region(c);
    modes(c.session.modes);
    heading("Tracing");
    culling(c.session.culling);
}

}  // namespace halflight::view
