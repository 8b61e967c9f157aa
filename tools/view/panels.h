// The panels of the window: settings and information.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "engine/color/color.h"
#include "tools/view/navigation.h"
#include "tools/view/overlay.h"
#include "tools/view/pass_history.h"
#include "tools/view/session.h"

namespace halflight::view {

/// Contents of the panels, apart from the session.
struct PanelState {
    const Picture* picture = nullptr;      // shown picture; null at first
    const PassHistory* history = nullptr;  // pass times of the pictures so far; not null
    RenderThread::Status status;
    std::string message;      // error or note of the window; empty: none
    bool comparing = false;   // a comparison picture exists
    bool playing = false;     // the animation is playing
    std::uint32_t frame = 0;  // frame of the animation that is shown or requested
};

/// Actions requested in the panels that the caller has to perform.
struct PanelRequests {
    bool screenshot = false;
    bool exr = false;
    bool save = false;
    std::optional<bool> compare{};     // true: keep the picture for comparison; false: close the comparison
    std::optional<CameraPose> pose{};  // camera pose to move to
    struct FrameRequest {
        std::string animation;
        std::uint32_t frame;
    };
    std::optional<FrameRequest> frame{};  // frame to show
    std::optional<bool> play{};
    bool dismiss_message = false;           // the message can be removed
    std::optional<LabelArea> label_area{};  // area beside the panel; none: there are no panels
};

/// Declares all panels; call it between Gui::begin() and draw().
PanelRequests panels(Session& session, const ColorConfig& colors, Navigation& navigation, const PanelState& situation);

}  // namespace halflight::view
