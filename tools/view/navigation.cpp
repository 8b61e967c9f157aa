#include "tools/view/navigation.h"

#include <algorithm>
#include <cmath>

namespace halflight::view {
namespace {

constexpr double kDollyNotch = 0.1, kDollyHeight = 2;  // change of ln(distance) per notch and per window height
constexpr double kSpeedNotch = 0.1;
constexpr double kLongest = 0.1;  // maximum time step, seconds: drawing may have paused for long

}  // namespace

void Navigation::suit(const Session& session) {
    constexpr double kReach = 4;  // seconds to the point that the camera orbits
    const double wanted = glm::length(session.pose().at - session.pose().from) / kReach;
    const double power = std::pow(10, std::floor(std::log10(wanted)));
    const double steps = wanted / power;  // [1, 10)
    speed = std::clamp(static_cast<float>(power * (steps < 2 ? 1 : steps < 5 ? 2 : 5)), kLeastSpeed, kMostSpeed);
}

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
            speed = std::clamp(speed * static_cast<float>(std::exp(kSpeedNotch * in.wheel)), kLeastSpeed, kMostSpeed);
    }
    if (in.double_click) session.focus(*in.double_click, size);
    if (!moving_) return;
    const double step = double{speed} * double{in.fast ? kFast : 1} * std::min(in.seconds, kLongest);
    session.move((mode == NavigationMode::walk ? walk : fly)(session.pose(), step * in.movement));
}

}  // namespace halflight::view
