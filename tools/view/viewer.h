// The program `halflight view`: connects window, session and render thread.
#pragma once

#include <deque>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tools/cli/file_watch.h"
#include "tools/view/bars.h"
#include "tools/view/clock.h"
#include "tools/view/display.h"
#include "tools/view/edit_history.h"
#include "tools/view/file_prompt.h"
#include "tools/view/file_writer.h"
#include "tools/view/gui.h"
#include "tools/view/object_overlay.h"
#include "tools/view/overlay.h"
#include "tools/view/progress.h"
#include "tools/view/script.h"
#include "tools/view/side_bar.h"
#include "tools/view/timings.h"
#include "tools/view/toasts.h"
#include "tools/view/unsaved_prompt.h"
#include "tools/view/view_history.h"

namespace halflight::view {

class Viewer {
  public:
    using Reread = std::function<PreviewArguments()>;
    /// Opens the window, which shows the progress while the scene is loaded. Throws Error, also for an invalid script.
    /// reread: parses the command line anew, with the settings file as it is now, for --watch.
    explicit Viewer(const PreviewArguments& arguments, Reread reread = {});

    /// Runs until the window is closed, a signal asks to stop, or the script ends. Throws Error "SCRIPT:LINE: what"
    /// if a line fails, or if the window is closed before it.
    void run();

  private:
    Session::Opened load_first();
    void tell_of_settings();
    /// Draws a frame; `shot`: file to write the window to. All waiting input is taken in before.
    void frame(const std::filesystem::path& shot = {});
    void declare();  // Takes in input and declares all panels; performs what they request.
    WindowLayout layout() const;
    void follow_window();  // Gives the picture the size of its area if it fills a window that the user has resized.
    void request_picture();
    void update_picture();
    /// Finds the exposure from the picture if it is to be metered and the picture shows the current light.
    void meter();
    void meter_again(std::uint64_t first_request);  // Leaves the exposure to the pictures from this request on.
    bool has_metered_exposure() const;              // Returns whether metering has found the exposure, or is going to.
    void update_error();
    void apply_transform();
    void reload_shaders();
    Progress progress() const;
    std::string picture_text(const WindowLayout& layout) const;
    std::optional<std::string> comparison_text() const;  // Describes picture B; none: there is none.
    std::vector<std::string> notices() const;
    std::string title() const;

    // The following functions are defined in viewer_opening.cpp.

    void open_dropped_files();
    /// Starts an opening on the render thread. of_file: it may fail, and the samples of the picture are kept until it
    /// has succeeded.
    void start_opening(const std::string& activity, std::function<Session::Opened()> opening, bool of_file = false);
    void open_next();       // Starts the next waiting file or frame on the render thread.
    bool finish_opening();  // Returns whether nothing is waiting or being opened.
    void set_playing(bool on);
    void advance_playback();  // Requests the frame that is due, once the previous one is visible.
    FrameNumber next_frame() const;

    // The following functions are defined in viewer_reload.cpp.

    /// Adds to an opening that it finds the files that the scene names, before it reads them.
    std::function<Session::Opened()> finding_files(const std::filesystem::path& scene,
                                                   std::function<Session::Opened()> opening);
    void watch_files();  // Watches the files of the open scene.
    /// Loads what has changed on disk. Returns whether something has.
    bool reload_changed();
    void take_colors();
    void take_settings_file();
    /// Tells that files on disk cannot be used, so that the picture shows earlier ones. what: key of `outdated_`.
    void tell_outdated(const std::string& what, const std::string& why);

    // The following functions are defined in viewer_region.cpp.

    void ask_for_region();  // The next drag in the picture draws a region.
    void set_region(const std::optional<Region>& region);
    /// Gives the mouse to the region that is drawn; returns whether the mouse belongs to it.
    bool drag_region(const WindowLayout& layout);
    bool leave_region();  // Stops drawing a region; returns whether one was being drawn.
    void show_region(const WindowLayout& layout) const;
    int sample_limit() const { return session_.samples + samples_before_region_; }

    // The following functions are defined in viewer_actions.cpp.

    /// Performs an action. point: pixel of the picture under the mouse; none: the mouse is elsewhere.
    void perform(Action action, const KeyPress& press, const std::optional<dvec2>& point);
    bool available(Action action) const;  // Returns whether an action would have an effect now.
    void play_or_stop();                  // Plays the first animation if none has been chosen.
    void show_other_view(bool next);      // Restores the view before the last move of the camera, or after it.
    // Looks at the selected object, else at the one visible at a pixel.
    void frame_object(const std::optional<dvec2>& point);
    void perform(const PanelRequests& requests);
    void recall(std::size_t number);
    void step_layer(int step);
    std::string with_samples(int samples) const;  // Describes the picture for a comparison.
    void compare(bool on);
    void compare_with(const std::filesystem::path& path);  // Takes the picture of a file as B.
    void take(const FilePrompt::Answer& answer, PanelRequests& requests);
    void take_size(const std::string& text);  // Gives the picture a size, WxH, that the window does not change.
    void fill_window(bool on);
    void set_comparison(ComparisonMode mode);
    float shown_split() const;                     // Returns the split of Display::draw() in the current mode.
    bool settings_changed() const;                 // Returns whether another program has written the settings file.
    void save(const std::filesystem::path& file);  // Saves the settings; later saves go to the same file.
    /// Saves the picture. all_layers: an .exr takes all layers, not only the one shown.
    void screenshot(const std::filesystem::path& path, bool all_layers = false);
    /// Returns the newest picture of the current view with all layers in full resolution; null: there is none yet.
    std::shared_ptr<const Picture> complete_picture() const;
    bool in_full() const;  // Returns whether the shown picture is of the open scene and has full resolution.
    /// Saves the picture, once it has full resolution and the layers that are wanted.
    void save_picture(const std::filesystem::path& path, bool all_layers = false);
    void save_numbered(const char* extension);  // Saves the picture under an unused name, once while it is waited for.
    void save_waiting_pictures();
    std::filesystem::path unused_name(const char* extension);
    void report_files();  // Tells the user which files have been written.
    /// Shows a message to the user. It replaces the message of the same topic.
    void tell(std::string message, std::string topic = {}) {
        toasts_.tell(std::move(message), now(), std::move(topic));
    }

    // The following functions are defined in play_script.cpp.

    bool scripted() const { return arguments_.script.has_value(); }
    /// Returns whether mouse and keys act.
    bool takes_input() const { return !scripted() || input_until_; }
    void step_script();
    bool wait_done(const Command& command);
    bool open_done(const Command& command);
    bool play_done(const Command& command);
    bool input_done(const Command& command);
    nlohmann::ordered_json state() const;
    void execute(const Command& command);

    // The following functions are defined in viewer_edits.cpp.

    void undo(bool again);  // Restores the state before the last edit, or after it if it was undone (`again`).
    void restore(const SavedSettings& state, const std::string& activity);
    void revert();  // Removes all edits of the scene, as an edit.
    /// Undoes, redoes or reverts as asked by keys. Steps wait while something is being opened.
    void undo_waiting();
    void record_edits();
    bool execute_edit(const Command& command);  // Returns whether the command is an edit.
    /// Returns whether no edits would be lost. Otherwise it asks the user, and f() follows later if the user agrees.
    bool may_lose_edits(const std::string& what, std::function<void()> f);
    void ask_about_edits();
    /// Starts the change once nothing else is being opened. The newest one counts.
    void change_environment(const EnvironmentChoice& environment);
    void change_variant(const std::string& variant);
    void step_handles();
    void hide_selected();
    void add_lamp(LampKind kind);  // Adds it in the middle of the picture.
    void duplicate_lamp();
    /// Gives the mouse to the handles of the selected object; returns whether they take it.
    bool drag_handles(const WindowLayout& layout);
    void select_clicked(const WindowLayout& layout);
    void drag_handle(const dvec2& from, const dvec2& to);  // Drags from pixel to pixel; throws Error without a handle.

    /// Runs f. In a script its errors propagate; in the window they become messages.
    template <class F>
    void attempt(const F& f);

    PreviewArguments arguments_;
    Reread reread_;
    FileWatch watch_;                              // files of the picture
    std::shared_ptr<const FileWatch> named_;       // files that the scene names
    std::shared_ptr<const FileWatch> finding_;     // the same of the scene that is being opened
    bool reloading_ = false;                       // the opening loads the scene anew
    bool takes_settings_ = false;                  // the opening takes the settings file
    std::map<std::string, std::string> outdated_;  // why "scene", "settings" or "colours" on disk are not used
    std::vector<Command> script_;
    std::size_t next_command_ = 0;
    bool input_seen_end_ = false;        // the file that ends real input is there
    std::optional<double> input_until_;  // time until which a script takes real input, seconds
    bool script_opens_ = false;          // a command that opens something has started
    bool panels_shown_ = true;
    ColorConfig colors_;
    ViewProcessor processor_;
    Window window_;
    Gui gui_;
    ivec2 picture_size_;  // size of the picture, pixels
    bool fills_window_;   // whether resizing the window changes that size
    ivec2 window_size_;   // size of the framebuffer for which it was chosen
    Display display_;
    float split_ = 0.5f;  // split of Display::draw()
    Session session_;
    Navigation navigation_;
    Timings timings_;
    PassHistory history_;
    EditHistory edit_history_;
    ViewHistory view_history_;
    // State at the last click that was not the second of two; none after an opening, which may have changed the scene.
    std::optional<SavedSettings> before_click_;
    bool reverts_ = false;   // all edits of the scene have to be removed
    int undos_waiting_ = 0;  // steps to undo; negative: to redo
    struct Saving {
        std::filesystem::path file;
        SavedSettings state;
    };
    std::deque<Saving> saving_;  // settings that are being written, in order
    UnsavedPrompt unsaved_prompt_;
    bool discards_edits_ = false;  // the user has agreed to lose the edits
    SampleClock sample_clock_;
    Toasts toasts_;
    FilePrompt file_prompt_;
    Outliner outliner_;
    Gizmo gizmo_;
    LampKind last_kind_ = LampKind::point;  // kind of the lamp that was added last
    std::optional<int> lit_handle_;         // axis of the handle under the mouse
    ObjectOverlay object_overlay_;
    std::function<void()> next_change_;  // starts the change of environment or variant that waits; null: none
    bool restoring_ = false;             // the opening brings back an earlier state
    std::set<float> metered_;            // exposures that metering has found for the scene, stops
    std::uint64_t first_metered_ = 0;    // number of the first request whose pictures metering may take
    bool tells_metering_ = false;        // the user has asked for metering
    std::string section_ = "Look";       // open section of the side bar
    bool shortcuts_shown_ = false;
    std::deque<std::filesystem::path> to_open_;
    std::string opening_name_;                                 // name of the file being opened
    std::optional<PanelRequests::FrameRequest> next_pose_;     // frame to show next
    std::optional<PanelRequests::FrameRequest> opening_pose_;  // frame being opened
    // no picture of the session's current frame has been drawn yet
    bool pose_pending_ = false;
    std::future<Session::Opened> opening_;  // result of the opening; valid while something is being opened
    struct Play {
        double since;       // start time of the playback, seconds
        FrameNumber first;  // frame shown at that time
    };
    std::optional<Play> play_;
    std::optional<std::string> comparison_;  // description of picture B
    ivec2 comparison_size_{0};               // size of picture B, pixels
    ComparisonMode comparison_mode_ = ComparisonMode::split;
    bool picking_ = false;                // the next click in the picture focuses the lens
    bool press_used_ = false;             // the last press of the left button has done something else than navigate
    bool plays_next_ = false;             // the animation that is being opened will play
    bool drawing_region_ = false;         // the next drag in the picture draws a region
    std::optional<dvec2> region_corner_;  // where that drag began, pixels of the picture
    int samples_before_region_ = 0;  // samples that the view had when the region was set; 0: no region, or a later view
    std::uint64_t reloads_ = 0;      // reloads of the render thread's shaders that the display has followed
    bool quit_ = false;
    int frames_due_ = 3;     // frames to draw; Dear ImGui needs some after each event
    double last_input_ = 0;  // time of the last input, seconds

    std::optional<Request> requested_;        // the current request
    std::uint64_t request_ = 0;               // number of `requested_`
    std::optional<double> input_time_;        // time of the oldest input since the last drawn frame
    ViewTransform transform_;                 // current transform of the display
    LayerView layer_view_;                    // layer view of the displayed picture
    std::optional<Scale> scale_;              // colour scale of the displayed picture
    std::shared_ptr<const Picture> picture_;  // displayed picture
    std::optional<Image> reference_;          // RGB; a script's `reference`
    std::optional<double> relmse_;            // relMSE of the displayed picture against it, else Picture::relmse
    std::uint64_t first_of_scene_ = 0;        // number of the first request of the scene that is open
    std::uint64_t drawn_request_ = 0;         // number of the request of the picture in the window
    int drawn_samples_ = 0;                   // number of samples of that picture; 0: a coarse one
    std::set<std::filesystem::path> names_;   // names of files that have been given out
    std::map<std::filesystem::path, bool> waiting_pictures_;  // pictures to save at full resolution: with all layers?
    FileWriter writer_;
    RenderThread thread_;  // last member, so that it ends first
};

template <class F>
void Viewer::attempt(const F& f) {
    if (scripted()) return f();
    try {
        f();
    } catch (const std::bad_alloc&) {
        toasts_.fail("out of memory", now());
    } catch (const std::exception& error) {
        toasts_.fail(error.what(), now());
    }
}

}  // namespace halflight::view
