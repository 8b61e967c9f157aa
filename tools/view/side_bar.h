// The side bar: one section per task. It stands beside the picture and never covers it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/color/color.h"
#include "tools/view/actions.h"
#include "tools/view/display.h"
#include "tools/view/gizmo.h"
#include "tools/view/navigation.h"
#include "tools/view/outliner.h"
#include "tools/view/pass_history.h"
#include "tools/view/render_thread.h"
#include "tools/view/session.h"
#include "tools/view/window_layout.h"

namespace halflight::view {

struct ComparisonModeRow {
    ComparisonMode mode;
    const char* name;
    const char* help;
};
inline constexpr ComparisonModeRow kComparisonModes[] = {
    {ComparisonMode::split, "Split", "B stands right of a line that can be dragged"},
    {ComparisonMode::difference, "Difference",
     "absolute difference of A and B, either two linear pictures or two display-encoded ones"},
    {ComparisonMode::flicker, "Flicker", "both pictures in turns, each for half a second"}};

/// Contents of the sections, apart from the session.
struct PanelState {
    const Picture* picture = nullptr;      // shown picture; null at first
    const PassHistory* history = nullptr;  // pass times of the pictures so far; not null
    RenderThread::Status status;
    const Picture* complete = nullptr;  // newest picture with all layers; null at first
    std::optional<ivec2> pixel{};       // pixel under the mouse; none: the mouse is elsewhere
    bool comparing = false;             // a comparison picture exists
    ComparisonMode comparison = ComparisonMode::split;
    bool picking = false;                   // the next click in the picture focuses the lens
    bool playing = false;                   // the animation is playing
    FrameNumber frame = 0;                  // frame of the animation that is shown or requested
    ivec2 size{0};                          // size of the picture, pixels
    bool fills_window = false;              // whether resizing the window changes that size
    std::function<bool(Action)> available;  // returns whether an action would have an effect
};

/// Actions requested in the side bar and in the menu. The viewer performs them.
struct PanelRequests {
    std::vector<Action> actions{};     // actions to perform, in order
    std::optional<CameraPose> pose{};  // camera pose to move to
    struct FrameRequest {
        std::string animation;
        FrameNumber frame;
    };
    std::optional<FrameRequest> frame{};  // frame to show
    std::optional<bool> play{};
    std::optional<std::string> size{};               // size of the picture to take, WxH
    std::optional<bool> fill_window{};               // whether resizing the window shall change that size
    std::optional<std::filesystem::path> open{};     // file to open
    std::optional<std::filesystem::path> against{};  // file to compare with
    std::optional<ComparisonMode> comparison{};
    bool pick_focus = false;                         // the next click in the picture focuses the lens
    bool ask_environment = false;                    // the user wants to choose a file
    std::optional<LampKind> lamp{};                  // kind of a lamp to add
    bool ask_profile = false;                        // the user wants to choose a profile for the selected light
    std::optional<EnvironmentChoice> environment{};  // environment to take
    std::optional<std::string> variant{};            // material variant to take
    std::vector<std::string> done{};  // actions that the sections have carried out, as messages to the user
};

/// Everything that a section works with.
struct PanelContext {
    Session& session;
    const ColorConfig& colors;
    Navigation& navigation;
    Outliner& outliner;
    GizmoMode& handles;
    const PanelState& now;
    PanelRequests& requests;
};

/// A section of the side bar. A new one needs its function and a row in side_bar.cpp.
struct Section {
    const char* name;
    const char* help;
    void (*declare)(PanelContext&);
};
std::span<const Section> sections();

/// Shows a button that requests an action. It is grey if the action would have no effect. label: that of the menu
/// unless given.
void action_button(PanelContext& c, Action action, bool same_line = false, const char* label = nullptr);

void scene_section(PanelContext& c);
void camera_section(PanelContext& c);
void light_section(PanelContext& c);
void look_section(PanelContext& c);
void quality_section(PanelContext& c);
void inspect_section(PanelContext& c);

/// Declares the side bar in its rectangle; call it between Gui::begin() and draw(). section: name of the open section,
/// which a click changes.
void side_bar(const Rectangle& where, std::string& section, PanelContext& c);

}  // namespace halflight::view
