// Handles on the picture that move, rotate and scale the selected node, or move the selected light and change its
// shape. Each handle changes the number of an edit that the command line has, too. Uses no window.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/view/light_handles.h"

namespace halflight::view {

/// Changes the translation of an edit so that rotation and scale leave the pivot where `before` has put it.
void keep_pivot(const NodeFrame& frame, const NodeEdit& before, NodeEdit& edit);

enum class GizmoMode { none, move, rotate, scale };
const char* name(GizmoMode mode);
/// Returns the mode of a name. Throws Error for other names.
GizmoMode gizmo_mode(const std::string& name);

class Gizmo {
  public:
    static constexpr int kAll = 3;    ///< axis of the handle in the middle: moves freely, scales along all axes
    static constexpr int kSize = 4;   ///< axis of the handle of a light's radius or angle, which every mode has
    static constexpr int kLight = 5;  ///< axis of the first LightHandle, which every mode has

    /// A handle, pixels of the picture.
    struct Handle {
        int axis;  // 0 to 2, kAll, kSize, or kLight + LightHandle
        std::vector<PictureLine> lines;
    };

    GizmoMode mode = GizmoMode::none;

    /// Returns whether handles of some mode can move the selected object.
    static bool can_move(const Session& session);
    /// Returns the handles of the selected object; none if it cannot be moved and has no size. Axes that point at the
    /// camera have none. The handle of a size has the lines of the ball, or of the cone in which a directional light is
    /// seen, and of a square. length: that of the handles, pixels.
    std::vector<Handle> handles(const Session& session, const ivec2& size, double length) const;
    /// Returns the axis of the handle at a pixel, within `reach` pixels. The square in the middle counts as a whole.
    static std::optional<int> axis_at(const std::vector<Handle>& handles, const dvec2& point, double reach);

    /// Starts to drag the handle of an axis at a pixel.
    void begin(const Session& session, const ivec2& size, double length, int axis, const dvec2& point);
    /// Drags to a pixel: changes the edit of the session.
    void drag(Session& session, const dvec2& point);
    void end(Session& session);
    bool dragging() const { return drag_.has_value(); }
    std::optional<int> axis() const { return drag_ ? std::optional(drag_->axis) : std::nullopt; }

  private:
    /// Place and axes of the selected object's edit.
    struct Axes {
        dvec3 origin;       // world units
        dvec3 axes[3];      // change of place per unit of translation; otherwise directions
        dmat3 to_world{1};  // translations of the edit to the world
        bool is_light = false;
        NodeFrame frame{};  // axes and place of a node, if a node is edited
    };
    /// The size of the selected light: a ball about `place`, or a cone with its apex there.
    struct LightSize {
        bool is_cone;
        double value;     // radius, world units, or angle, degrees
        dvec3 place;      // world units
        dvec3 axis{0};    // of a cone, as long as handles, world units
        dvec3 across{0};  // of a cone: at right angles to the axis and to the view, as long as the axis
    };
    struct Drag {
        int axis;
        Selection object;
        Axes at;
        Camera camera;
        ivec2 size;
        double length;                        // length of handles, pixels
        NodeEdit node{};                      // edit at the start
        dvec3 position{0};                    // position of the light at the start
        dvec2 first, last;                    // first and latest pixel
        double turned = 0;                    // angle so far, radians
        std::optional<LightSize> of_light{};  // size at the start, if the drag changes it
        std::optional<LightShape> shape{};    // shape at the start, if the drag changes it
    };
    std::optional<Axes> axes(const Session& session) const;
    std::vector<Handle> axis_handles(const Session& session, const ivec2& size, double length) const;
    static std::optional<LightSize> light_size(const Session& session, const ivec2& size, double length);
    static std::optional<Handle> size_handle(const Session& session, const ivec2& size, double length);
    static double size_at(const Drag& d, const dvec2& point);
    static void drag_size(const Drag& d, Session& session, const dvec2& point);
    static double along(const Drag& d, const dvec3& axis, const dvec2& point);
    static std::optional<dvec3> on_plane(const Drag& d, const dvec3& normal, const dvec2& point);
    static double turn(const Drag& d, const dvec2& from, const dvec2& to);

    std::optional<Drag> drag_;
};

}  // namespace halflight::view
