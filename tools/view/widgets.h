// Controls of the side bar: a label on the left, with a tooltip, and a control that takes the rest of the line. A label
// that is too long stands above its control, so that neither is cut.
#pragma once

#include <imgui.h>

#include <span>
#include <string>
#include <vector>

#include "engine/core/math.h"
#include "engine/settings/constraints.h"
#include "engine/settings/settings_table.h"

namespace halflight::view {

// Typed values are clamped, too: settings files allow no others.
inline constexpr ImGuiSliderFlags kClamp = ImGuiSliderFlags_AlwaysClamp;
inline constexpr ImGuiSliderFlags kLogarithmic = ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic;

inline const ImVec4 kErrorColor{1, 0.6f, 0.5f, 1};

void text(const std::string& line);        ///< Shows a line, wrapped at the width of the panel.
void faint_text(const std::string& line);  ///< Shows a line of less weight.
void error_text(const std::string& line);  ///< Shows a line in the colour of errors.
/// Returns the text if it is not wider than `width`, else its begin and its end with "..." between them: names of one
/// scene often differ at their end only.
std::string shortened(const std::string& text, float width);
/// Gives the last item a tooltip; empty: none. It stands beside the window of the item if there is room, so that it
/// covers no other items.
void tooltip(const char* help);
void close_by_escape();  ///< Closes the current menu or list if Escape is pressed; call it before its end.
/// Shows a name and its value. A value that does not fit beside the name stands below it.
void value(const char* name, const std::string& text, const char* help = "");
void heading(const char* title);  ///< Shows the heading of a group of controls.

/// Starts a line with a label; the next control takes the rest of the line. Use an id without text for the control.
void label(const char* text, const char* help = "");

bool slider(const char* name, int& value, int lower, int upper, const char* help, ImGuiSliderFlags flags = kClamp,
            const char* format = "%d");
bool slider(const char* name, double& value, double lower, double upper, const char* format, const char* help);
bool slider(const char* name, float& value, float lower, float upper, const char* format, const char* help,
            ImGuiSliderFlags flags = kClamp);
/// Shows a slider for a setting of the table, with its help text as tooltip.
bool slider(const char* name, const char* setting_name, int& value);
bool slider(const char* name, const char* setting_name, float& value, const char* format, ImGuiSliderFlags flags);
/// Returns whether a double click has begun to type into a slider since the last call, after its first click had
/// changed the value. The first click may have made an edit whose value the double click cannot remove.
bool wants_state_before_click();
/// Shows a box for a flag; returns whether the user has changed it. against: a constraint that the box would break. The
/// box is then greyed, and the tooltip says why. Null: none.
bool checkbox(const char* name, bool& value, const char* help, const Constraint* against = nullptr);
/// Shows three numbers below each other, so that all their digits are visible. speed: change per pixel of a drag.
bool drag(const char* name, dvec3& value, float speed, const char* help);
/// Shows a heading that folds what follows it; returns whether that is shown. open: it is at first.
bool foldable(const std::string& title, bool open);
/// Shows a combo box; returns whether another item was chosen.
bool choose(const char* name, std::string& chosen, std::span<const std::string> all, const char* help);
/// Shows a picker for a linear colour in [0, 1], which it shows gamma-encoded.
bool pick_color(const char* name, vec3& linear, const char* help);
/// Shows a button; returns whether it was clicked. same_line: stands beside the last item if there is room.
bool button(const char* name, const char* help, bool same_line = false);
bool radio(const char* name, bool on, const char* help, bool same_line = false);

}  // namespace halflight::view
