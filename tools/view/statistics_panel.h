// The panel of statistics: samples, error, culling, pass times, memory.
#pragma once

#include "tools/view/panels.h"

namespace halflight::view {

/// Declares the panel; call it between Gui::begin() and draw(), inside an open window.
void statistics_panel(Session& session, const PanelState& now);

}  // namespace halflight::view
