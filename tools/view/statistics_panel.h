// The panel that tells how the picture is made, and what it costs.
#pragma once

#include "tools/view/panels.h"

namespace halflight::view {

/// Between Gui::begin() and draw(), in an open window.
void statistics_panel(Session& session, const Situation& now);

}  // namespace halflight::view
