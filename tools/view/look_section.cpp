// The section "Look": layer, components, exposure, colour, comparison. Nothing here needs new samples.
#include <fmt/format.h>

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

void color(PanelContext& c) {
    heading("Colour");
    ViewTransform& t = c.session.transform;
    float stops = t.exposure.stops;
    slider("Exposure", "exposure", stops, "%.2f stops", kClamp);
    if (stops != t.exposure.stops) t.exposure = stops;
    const ActionRow& meter = row_of(Action::meter);
    if (button(meter.label, fmt::format("{} ({})", meter.help, meter.keys).c_str()))
        c.requests.actions.push_back(meter.action);
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
    if (button(c.now.comparing ? "Replace B" : "Keep as B", "keeps the picture as B for comparison (K)"))
        c.requests.actions.push_back(Action::keep);
    if (button("File as B ...", "takes the picture of a file as B (Ctrl+Shift+K)", true))
        c.requests.actions.push_back(Action::compare_file);
    if (c.now.comparing && button("Close comparison", "removes the picture B (Ctrl+K)", true))
        c.requests.actions.push_back(Action::close_comparison);
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
