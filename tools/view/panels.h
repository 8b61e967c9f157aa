// The panels: what can be set, and what there is to know.
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

/// What panels tell of.
struct Situation {
    const Picture* picture = nullptr;      // that is seen; null at first
    const PassHistory* history = nullptr;  // of pictures so far; not null
    RenderThread::Status status;
    std::string message;      // an error or a note of the window's own; empty: none
    bool comparing = false;   // there is a picture B
    bool playing = false;     // frame after frame
    std::uint32_t frame = 0;  // of the animation, that is seen or will be next
};

/// What panels were asked for that they cannot do themselves.
struct Asked {
    bool screenshot = false;
    bool exr = false;
    bool save = false;
    std::optional<bool> compare{};     // keep the picture as B, or let B go
    std::optional<CameraPose> pose{};  // to move to
    struct Moment {
        std::string animation;
        std::uint32_t frame;
    };
    std::optional<Moment> moment{};  // to be seen
    std::optional<bool> play{};
    bool read_message = false;   // it can go
    std::optional<Room> room{};  // that they leave for labels; none: there are no panels
};

/// Declares all panels, between Gui::begin() and draw().
Asked panels(Session& session, const ColorConfig& colors, Navigation& navigation, const Situation& situation);

}  // namespace halflight::view
