// The section "Quality": samples, light paths, preview modes, tracing.
#include "tools/view/side_bar.h"
#include "tools/view/widgets.h"

namespace halflight::view {
namespace {

struct DenoisingRow {
    Denoising denoising;
    const char* name;
    const char* help;
};
constexpr DenoisingRow kDenoising[] = {
    {Denoising::off, "Off", "the picture is the mean of its samples"},
    {Denoising::preview, "Preview only", "a quick filter on pictures of few samples; it ends at 256 samples"},
    {Denoising::always, "Always",
     "the denoiser of final pictures (--denoise), each time the samples have doubled; saved pictures have it, too"}};

void denoising(PanelContext& c) {
    heading("Denoise");
    for (const DenoisingRow& row : kDenoising)
        if (radio(row.name, c.session.denoising() == row.denoising, row.help, &row != kDenoising))
            c.session.set_denoising(row.denoising);
}

void modes(PanelContext& c) {
    PreviewModes& modes = c.session.modes;
    heading("Preview modes");
    faint_text("Biased: less noise in early pictures. All but the clamp fade out as samples are added.");
    for (const PreviewMode& mode : known_preview_modes()) {
        if (mode.flag == &Preview::filter) continue;  // one of the choices above
        checkbox(mode.description, modes.preview.*mode.flag, "a bias, which the window names",
                 c.session.against([&](RenderSettings& s) { s.preview.*mode.flag = true; }));
    }
    bool clamped = modes.clamp > 0;
    if (checkbox("Clamp indirect light", clamped, setting("clamp").help)) {
        if (!clamped) c.session.switched_off.clamp = modes.clamp;
        modes.clamp = clamped ? c.session.switched_off.clamp : 0;
    }
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
    action_button(c, Action::draw_region);
    action_button(c, Action::whole_picture, true);
}

}  // namespace

void quality_section(PanelContext& c) {
    heading("Samples");
    slider("Samples", c.session.samples, 1, 1 << 16, "samples per pixel after which rendering stops", kLogarithmic);
    slider("Bounces", "bounces", c.session.bounces);
    backfaces(c.session.modes.backfaces);
    region(c);
    denoising(c);
    modes(c);
    heading("Tracing");
    culling(c.session.culling);
}

}  // namespace halflight::view
