#include "tools/view/navigation.h"

#include <algorithm>
#include <cmath>

namespace halflight::view {
namespace {

constexpr double kDollyNotch = 0.1, kDollyHeight = 2;  // change of ln(distance) per notch and per window height
constexpr double kSpeedNotch = 0.1;
constexpr double kLongest = 0.1;  // maximum time step, seconds: drawing may have paused for long

}  // namespace

void Navigation::steer(Session& session, const Input& in, const ivec2& size) {
    moving_ = in.movement != dvec3(0);
    if (in.drag != dvec2(0)) {
        const CameraPose& pose = session.pose();
        if (in.middle || (in.left && in.shift))
            session.move(pan(pose, in.drag));
        else if (in.left && mode == NavigationMode::orbit)
            session.move(orbit(pose, kPi * in.drag));
        else if (in.left)
            session.move(turn(pose, pose.vertical_fov * in.drag));
        else if (in.right)
            session.move(dolly(pose, std::exp(kDollyHeight * in.drag.y), session.diagonal()));
    }
    if (in.wheel != 0) {
        if (mode == NavigationMode::orbit)
            session.move(dolly(session.pose(), std::exp(-kDollyNotch * in.wheel), session.diagonal()));
        else
            speed = std::clamp(speed * static_cast<float>(std::exp(kSpeedNotch * in.wheel)), 0.01f, 100.0f);
    }
    if (in.double_click) session.focus(*in.double_click, size);
    if (!moving_) return;
    const double step = 0.1 * double{speed} * session.diagonal() * std::min(in.seconds, kLongest);
    session.move((mode == NavigationMode::walk ? walk : fly)(session.pose(), step * in.movement));
}

}  // namespace halflight::view
