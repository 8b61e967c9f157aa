// Menu bar, status line, shortcut sheet and messages.
#pragma once

#include <string>

#include "tools/view/progress.h"
#include "tools/view/side_bar.h"
#include "tools/view/toasts.h"

namespace halflight::view {

/// Declares the menu bar. Chosen actions go to the requests.
void menu_bar(PanelContext& c);
/// Declares the status line: the progress on the left, the picture on the right.
void status_line(const Rectangle& where, const Progress& progress, const std::string& right);
/// Shows the progress in the middle of the area, where there is no picture yet.
void waiting_text(const Rectangle& area, const Progress& progress);
/// Declares the sheet of mouse and keys; `open` becomes false if the user closes it.
void shortcut_sheet(bool& open);
/// Declares the messages at the lower edge of the picture's area, the newest at the bottom. Those that would reach its
/// upper half wait until newer ones are gone. Removes those that the user dismisses.
void messages(const Rectangle& area, Toasts& toasts);

}  // namespace halflight::view
