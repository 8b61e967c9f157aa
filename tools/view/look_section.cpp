// The section "Look": layer, components, exposure, colour, comparison. Nothing here needs new samples.
#include <algorithm>

#include "tools/view/side_bar.h"
#include "tools/view/widgets.h"

namespace halflight::view {
namespace {

void layer(PanelContext& c) {
    heading("Layer");
    LayerView& view = c.session.layer_view;
    const std::vector<std::string> all = layer_view_names();
    choose("Layer", view.layer, all, "picture or layer of data; \".\" and \",\" step through them");
    faint_text(description(view.layer));
    if (view.layer != kFinal) return;
    for (std::size_t i = 0; i < kComponents.size(); ++i) {
        std::string name(kComponents[i]);
        std::ranges::replace(name, '_', ' ');
        checkbox(name.c_str(), view.components[i], "component of the final picture");
    }
}

/// Shows the settings of a camera that decide the exposure.
void physical_camera(PanelContext& c) {
    PhysicalCamera& camera = c.session.transform.camera;
    bool exposes = camera.exposes();
    if (checkbox("Exposure of a camera", exposes,
                 "ISO, shutter speed and f-number decide the exposure, for light in physical units; \"Exposure\" "
                 "corrects it"))
        c.session.set_physical_exposure(exposes);
    if (!exposes) return;
    float iso = camera.iso > 0 ? camera.iso : float(PhysicalCamera::kUsualIso);
    if (slider("ISO", iso, 25, 409600, "%.0f", "sensitivity", kLogarithmic)) camera.iso = iso;
    constexpr float kSlowest = 0.03f, kFastest = 8000;  // 1/s
    float seconds =
        camera.shutter_speed.seconds > 0 ? camera.shutter_speed.seconds : float(PhysicalCamera::kUsualSeconds);
    // A fraction below one second. The limits of the seconds are swapped, so that the knob stays in its place.
    const bool fraction = seconds < 1;
    float shown = fraction ? 1 / seconds : seconds;
    if (slider("Shutter speed", shown, fraction ? kSlowest : 1 / kSlowest, fraction ? kFastest : 1 / kFastest,
               fraction ? "1/%.0f s" : "%.1f s", "exposure time, seconds; it blurs no motion", kLogarithmic))
        camera.shutter_speed = {fraction ? 1 / shown : shown};
    float fstop = camera.lens.fstop > 0 ? camera.lens.fstop : float(PhysicalCamera::kUsualFstop);
    if (slider("F-number", fstop, 0.7f, 64, "f/%.1f", "f-number, also that of the depth of field", kLogarithmic))
        camera.lens.fstop = fstop;
}

void color(PanelContext& c) {
    heading("Colour");
    ViewTransform& t = c.session.transform;
    float stops = t.exposure.stops;
    slider("Exposure", "exposure", stops, "%.2f stops", kClamp);
    if (stops != t.exposure.stops) t.exposure = stops;
    action_button(c, Action::meter);
    physical_camera(c);
    std::string display = t.display.empty() ? c.colors.default_display() : t.display;
    const std::vector<std::string> displays = c.colors.displays();
    if (choose("Display", display, displays, "kind of display")) {
        t.display = display;
        t.view.clear();
    }
    std::string view = t.view.empty() ? c.colors.default_view(display) : t.view;
    const std::vector<std::string> views = c.colors.views(display);
    if (choose("View", view, views, "view transform")) t.view = view;
    std::vector<std::string> looks = c.colors.looks();
    if (looks.empty()) return;
    looks.insert(looks.begin(), "From the view");
    std::string look = t.look.empty() ? looks.front() : t.look;
    if (choose("Look", look, looks, "look before the view transform")) t.look = look == looks.front() ? "" : look;
}

void comparison(PanelContext& c) {
    heading("Comparison");
    if (!c.now.picture) return faint_text("There is no picture yet.");
    action_button(c, Action::keep, false, c.now.comparing ? "Replace B" : "Keep as B");
    action_button(c, Action::compare_file, true, "File as B ...");
    action_button(c, Action::close_comparison, true);
    if (!c.now.comparing) return;
    for (const ComparisonModeRow& row : kComparisonModes)
        if (radio(row.name, c.now.comparison == row.mode, row.help, &row != kComparisonModes))
            c.requests.comparison = row.mode;
}

}  // namespace

void look_section(PanelContext& c) {
    layer(c);
    color(c);
    comparison(c);
}

}  // namespace halflight::view
