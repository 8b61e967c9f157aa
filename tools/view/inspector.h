// The list of objects and the properties of objects, as parts of the sections Scene and Light.
#pragma once

#include "tools/view/side_bar.h"

namespace halflight::view {

inline constexpr float kMostKelvin = 12000;  ///< Upper end of sliders of colour temperatures.

/// Declares search field and list of all objects, with their visibility. A click selects an object.
void object_list(PanelContext& c);
/// Declares the properties of the selected object.
void inspector(PanelContext& c);
/// Declares the properties of a light, by its index.
void light_properties_of(PanelContext& c, std::size_t index);
/// Declares menu items that add a lamp, one for each kind. In pages, surfaces are grey.
void lamp_kinds(PanelContext& c);
/// Declares the emission of a material, by its index. `shown` is the material as edits leave it.
void emission_property(PanelContext& c, std::size_t index, const Material& shown);
/// Declares the choice of the environment, and its edits.
void environment_properties(PanelContext& c);

}  // namespace halflight::view
