// Drawings on the picture that belong to objects: the outline of the selected one, its handles, and marks of lights.
#pragma once

#include <optional>

#include "tools/view/gizmo.h"
#include "tools/view/outline.h"
#include "tools/view/window_layout.h"

namespace halflight::view {

class ObjectOverlay {
  public:
    /// Draws on the picture, and handles also beside it; call it between Gui::begin() and draw(). scale: size of text
    /// and controls. lit: axis of the handle under the mouse. lights: marks the lights.
    void draw(const Session& session, const Gizmo& gizmo, const WindowLayout& layout, const ivec2& size, float scale,
              std::optional<int> lit, bool lights);

    /// Returns the length of handles, and the distance within which the mouse meets them, pixels of the picture.
    static double handle_length(const Rectangle& picture, const ivec2& size, float scale);
    static double handle_reach(const Rectangle& picture, const ivec2& size, float scale);
    /// Returns the light whose mark is at a pixel.
    static std::optional<std::size_t> light_at(const Session& session, const ivec2& size, const dvec2& point,
                                               double reach);

  private:
    Outline outline_;
};

}  // namespace halflight::view
