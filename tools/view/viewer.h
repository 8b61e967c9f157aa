// The program `halflight view`: a window, a session, a render thread, and what comes and goes between them.
#pragma once

#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/view/display.h"
#include "tools/view/gui.h"
#include "tools/view/overlay.h"
#include "tools/view/panels.h"
#include "tools/view/script.h"
#include "tools/view/timings.h"

namespace halflight::view {

class Viewer {
  public:
    /// Loads the scene, then opens the window. Throws Error, also for a script that makes no sense.
    explicit Viewer(const PreviewArguments& arguments);

    /// Until the window is closed, a signal asks to stop, or the script ends. Throws Error "SCRIPT:LINE: what" where a
    /// line cannot be done, also as the window was closed before it.
    void run();

  private:
    void frame(const std::filesystem::path& shot = {});  // to be written: the window as it is then
    void keys();
    void key(char key, const dvec2& point);
    void ask();
    void take_picture();
    void drop();
    void begin(const std::string& activity, std::function<Session::Opened()> opening);
    void open_next();    // of the files that wait, or the moment that does, on the render thread
    bool take_opened();  // whether there is nothing left that waits or is being opened
    void play(bool on);
    void play_on();  // to the frame that is due, once that before it has been seen
    std::uint32_t next_frame() const;
    void compare(bool on);
    void take_shaders();
    std::vector<std::string> notices(const RenderThread::Status& status) const;
    void answer(const Asked& asked);
    void screenshot(const std::filesystem::path& path);
    std::filesystem::path free_name(const char* extension) const;
    std::string title() const;

    bool scripted() const { return arguments_.script.has_value(); }
    void step_script();
    bool waited(const Command& command);
    bool opened(const Command& command);
    bool played(const Command& command);
    void execute(const Command& command);

    /// Does what may fail: in a script that is the end, in the window it is told.
    template <class F>
    void attempt(const F& f);

    PreviewArguments arguments_;
    std::vector<Command> script_;
    std::size_t next_command_ = 0;
    bool script_opens_ = false;  // the command `open` has begun
    ColorConfig colors_;
    Session session_;
    ViewProcessor processor_;
    Window window_;
    Gui gui_;
    Display display_;
    Navigation navigation_;
    Timings timings_;
    PassHistory history_;
    std::string message_;
    std::deque<std::filesystem::path> to_open_;
    std::optional<Asked::Moment> moment_;   // that is to be seen next
    std::optional<Asked::Moment> posing_;   // that is being opened
    bool pose_unseen_ = false;              // no picture of the session's moment has been drawn yet
    std::future<Session::Opened> opening_;  // valid while something is being opened
    struct Play {
        double since;         // seconds
        std::uint32_t first;  // frame that was seen then
    };
    std::optional<Play> play_;
    std::optional<std::string> other_;  // what picture B shows
    float split_ = 0.5f;                // as of Display
    std::uint64_t reloads_ = 0;         // of the render thread's shaders, that the display has followed
    bool panels_shown_ = true;
    bool quit_ = false;
    int frames_due_ = 3;  // Dear ImGui wants some after whatever happens

    std::optional<Request> wanted_;           // that is under way
    std::uint64_t request_ = 0;               // its number
    ViewTransform transform_;                 // that the display has
    Look look_;                               // that the display has
    std::optional<Scale> scale_;              // of the colours that the display has
    std::shared_ptr<const Picture> picture_;  // that the display has
    std::uint64_t drawn_request_ = 0;         // of the picture in the window
    int drawn_samples_ = 0;                   // of that picture; 0: it is a coarse one
    RenderThread thread_;                     // last: it ends first
};

}  // namespace halflight::view
