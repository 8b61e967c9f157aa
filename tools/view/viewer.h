// The program `halflight view`: connects window, session and render thread.
#pragma once

#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/view/display.h"
#include "tools/view/edit_history.h"
#include "tools/view/gui.h"
#include "tools/view/overlay.h"
#include "tools/view/panels.h"
#include "tools/view/script.h"
#include "tools/view/timings.h"

namespace halflight::view {

class Viewer {
  public:
    /// Loads the scene, then opens the window. Throws Error, also for an invalid script.
    explicit Viewer(const PreviewArguments& arguments);

    /// Runs until the window is closed, a signal asks to stop, or the script ends. Throws Error "SCRIPT:LINE: what"
    /// where a line fails, or where the window is closed before it.
    void run();

  private:
    void frame(const std::filesystem::path& shot = {});  // Draws a frame; `shot`: file to write the window to.
    void keys();
    void key(char key, const dvec2& point);
    void request_picture();
    void update_picture();
    void update_error();
    void open_dropped_files();
    void start_opening(const std::string& activity, std::function<Session::Opened()> opening);
    void open_next();       // Starts the next waiting file or frame on the render thread.
    bool finish_opening();  // Returns whether nothing is waiting or being opened.
    void set_playing(bool on);
    void advance_playback();  // Requests the frame that is due, once the previous one is visible.
    std::uint32_t next_frame() const;
    void compare(bool on);
    void reload_shaders();
    std::vector<std::string> notices(const RenderThread::Status& status) const;
    void perform(const PanelRequests& requests);
    void screenshot(const std::filesystem::path& path);
    std::filesystem::path unused_name(const char* extension) const;
    std::string title() const;

    bool scripted() const { return arguments_.script.has_value(); }
    void step_script();
    bool wait_done(const Command& command);
    bool open_done(const Command& command);
    bool play_done(const Command& command);
    void execute(const Command& command);

    void undo(bool again);  // Restores the state before the last edit, or after it where it was undone (`again`).
    bool execute_edit(const Command& command);  // Returns whether the command is an edit.

    /// Runs f. In a script its errors propagate; in the window they become the message.
    template <class F>
    void attempt(const F& f);

    PreviewArguments arguments_;
    std::vector<Command> script_;
    std::size_t next_command_ = 0;
    bool script_opens_ = false;  // a command that opens something has started
    ColorConfig colors_;
    Session session_;
    ViewProcessor processor_;
    Window window_;
    Gui gui_;
    Display display_;
    Navigation navigation_;
    Timings timings_;
    PassHistory history_;
    EditHistory edit_history_;
    std::string message_;
    std::deque<std::filesystem::path> to_open_;
    std::optional<PanelRequests::FrameRequest> next_pose_;     // frame to show next
    std::optional<PanelRequests::FrameRequest> opening_pose_;  // frame being opened
    // no picture of the session's current frame has been drawn yet
    bool pose_pending_ = false;
    std::future<Session::Opened> opening_;  // result of the opening; valid while something is being opened
    struct Play {
        double since;         // start time of the playback, seconds
        std::uint32_t first;  // frame shown at that time
    };
    std::optional<Play> play_;
    std::optional<std::string> comparison_;  // description of picture B
    float split_ = 0.5f;                     // split of Display::draw()
    std::uint64_t reloads_ = 0;              // reloads of the render thread's shaders that the display has followed
    bool panels_shown_ = true;
    bool quit_ = false;
    int frames_due_ = 3;  // frames to draw; Dear ImGui needs some after each event

    std::optional<Request> requested_;        // the current request
    std::uint64_t request_ = 0;               // number of `requested_`
    ViewTransform transform_;                 // current transform of the display
    LayerView layer_view_;                    // layer view of the displayed picture
    std::optional<Scale> scale_;              // colour scale of the displayed picture
    std::shared_ptr<const Picture> picture_;  // displayed picture
    std::optional<Image> reference_;          // RGB; a script's `reference`
    std::optional<double> relmse_;            // relMSE of the displayed picture against it, else Picture::relmse
    std::uint64_t drawn_request_ = 0;         // number of the request of the picture in the window
    int drawn_samples_ = 0;                   // number of samples of that picture; 0: a coarse one
    RenderThread thread_;                     // last member, so that it ends first
};

}  // namespace halflight::view
