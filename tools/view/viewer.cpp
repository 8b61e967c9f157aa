#include "tools/view/viewer.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <thread>
#include <utility>

#include "engine/core/image_tools.h"
#include "engine/core/metrics.h"
#include "engine/gpu/program_binaries.h"
#include "engine/io/files.h"
#include "engine/io/png.h"
#include "renderer/metering.h"
#include "tools/cli/signals.h"
#include "tools/view/fonts.h"
#include "tools/view/widgets.h"

namespace halflight::view {
namespace {

constexpr std::uint64_t kMostScript = 1 << 20;  // maximum size of a script, bytes
constexpr double kIdle = 0.5;                   // seconds to wait for events without anything to draw
constexpr double kTurn = 0.1;                   // seconds between frames while two pictures flicker
constexpr double kMoving = 0.01;                // seconds between frames while a key is held
// Frames after input: one performs an action, the next opens its dialog, Dear ImGui measures that unseen and then draws
// it.
constexpr int kFramesAfterInput = 4;
constexpr double kFade = 0.3;  // seconds in which the window behind a dialog becomes dark

std::vector<Command> script_of(const PreviewArguments& a) {
    if (!a.script) return {};
    return parse_script(a.script->string(), read_file(*a.script, kMostScript));
}

RenderThread::Options thread_options(const PreviewArguments& a) {
    return {.context = {.device = a.device,
                        .binaries_folder = a.no_shader_cache ? "" : gpu::default_binaries_folder(),
                        .debug = a.gl_debug},
            .budget = 1e-3 * a.budget,
            .changed = &Window::wake};
}

}  // namespace

Viewer::Viewer(const PreviewArguments& arguments, Reread reread)
    : arguments_(arguments),
      reread_(std::move(reread)),
      script_(script_of(arguments)),
      panels_shown_(!scripted()),
      colors_(ColorConfig::load(arguments.ocio)),
      processor_(colors_.view({})),
      window_(one_line(fmt::format("halflight: {}", arguments.choice.scene.filename().string()))),
      gui_(window_, arguments.ui_scale),
      picture_size_(*arguments.width, *arguments.height),
      fills_window_(!arguments.chose_size),
      session_(arguments, colors_, load_first()),
      writer_(&Window::wake),
      thread_(colors_, thread_options(arguments)) {
    transform_ = session_.transform;
    processor_ = colors_.view(transform_);
    display_.set_view(processor_);
    edit_history_.start(session_.document());
    view_history_.start(session_.view());
    navigation_.suit(session_);
    named_ = std::exchange(finding_, {});
    watch_files();
    if (!scripted()) window_size_ = {0, 0};  // a picture that fills the window takes its size from the first frame on
    tell_of_settings();
    if (gui_.has_font()) return;
    Console(arguments.log.level).warn("{}", kNoFont);
    tell(kNoFont);
}

/// Tells that a settings file has changed the scene, or which of its entries were left out.
void Viewer::tell_of_settings() {
    if (!session_.warning().empty())
        tell(session_.warning());
    else if (session_.took_settings())
        tell(fmt::format("{} was read", session_.settings_file().filename().string()));
}

/// Loads the scene on a thread of its own, so that the window is there from the first moment.
Session::Opened Viewer::load_first() {
    window_.resize(window_size(picture_size_, panels_shown_ ? gui_.parts() : Parts(), window_.largest()));
    window_size_ = window_.framebuffer_size();
    std::packaged_task<Session::Opened()> task(
        finding_files(arguments_.choice.scene, Session::starting(arguments_, colors_)));
    std::future<Session::Opened> result = task.get_future();
    std::jthread loader([task = std::move(task)]() mutable {
        task();
        Window::wake();
    });
    const double start = now();
    while (result.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
        if (window_.closing() || stop_signal() != 0) {
            // Nothing can interrupt the loading of a scene, and nothing has been written yet.
            const bool early = scripted() && stop_signal() == 0;
            if (early) fail(1, "the window was closed before the script began");
            std::_Exit(early ? 1 : stop_signal() != 0 ? 128 + stop_signal() : 0);
        }
        const double seconds = now() - start;
        std::string activity = fmt::format("loading {}", arguments_.choice.scene.filename().string());
        if (seconds >= 1) activity += fmt::format(", {:.0f} s", seconds);
        gui_.begin();
        const Rectangle whole{{0, 0}, window_.framebuffer_size()};
        waiting_text(whole, {.activity = activity, .divisor = 0});
        display_.draw(whole.size, whole, split_);
        gui_.draw();
        window_.swap();
        window_.wait(0.1);
    }
    loader.join();
    return result.get();
}

std::string Viewer::title() const {
    const auto camera = session_.scene_camera();
    const std::string name = camera ? session_.scene().cameras[*camera].name : "";
    return one_line(fmt::format("halflight: {}{}{}", session_.file().filename().string(),
                                name.empty() ? "" : fmt::format(" ({})", name),
                                edit_history_.unsaved() ? ", not saved" : ""));
}

void Viewer::run() {
    while (!quit_ && stop_signal() == 0) {
        if (window_.closing()) {
            if (may_lose_edits("the viewer ends", [this] { quit_ = true; })) break;
            window_.stay_open();
            frames_due_ = kFramesAfterInput, last_input_ = now();
        }
        const bool asks = file_prompt_.asking() || unsaved_prompt_.asking();
        if (asks && now() - last_input_ < kFade) frames_due_ = std::max(frames_due_, 1);
        const bool at_once = frames_due_ > 0 || play_ || next_command_ < script_.size();
        const bool turns = comparison_ && comparison_mode_ == ComparisonMode::flicker;
        const double patience = navigation_.moving() || at_once ? kMoving : turns ? kTurn : kIdle;
        const bool event = window_.wait(patience);
        if (event || navigation_.moving()) frames_due_ = std::max(frames_due_, 2);
        if (!window_.events().empty()) frames_due_ = kFramesAfterInput, last_input_ = now();
        if (takes_input()) open_dropped_files(), advance_playback();
        report_files();
        if (toasts_.expire(now()) || turns) frames_due_ = std::max(frames_due_, 1);
        reload_shaders();
        update_picture();
        if (frames_due_ > 0) frame();
        save_waiting_pictures();
        if (scripted()) step_script();
    }
    if (scripted() && !quit_ && stop_signal() == 0 && next_command_ < script_.size())
        throw Error(fmt::format("{}:{}", arguments_.script->string(), script_[next_command_].line),
                    "the window was closed");
    writer_.finish();
    for (const FileWriter::Result& result : writer_.results())
        if (!result.error.empty()) throw Error("", result.error);
    if (!waiting_pictures_.empty())
        throw Error("picture", "not saved: the viewer was closed before the picture had full resolution");
}

/// Displays the latest picture that has the layers of the current view. While samples are made, that may be an older
/// picture of the same view, so that a change of layer shows at once.
void Viewer::update_picture() {
    const auto newest = thread_.picture();
    if (!newest) return;
    if (newest->divisor == 1) sample_clock_.record(newest->view, newest->samples(), now());
    const auto shows = [&](const Picture& picture) {
        return std::ranges::all_of(required_aovs(session_.layer_view), [&](const std::string& aov) {
            return std::ranges::find(picture.aovs, aov) != picture.aovs.end();
        });
    };
    std::shared_ptr<const Picture> best = newest;
    if (!shows(*best)) best = thread_.complete_picture();
    if (!best || best->view != newest->view || !shows(*best)) return;
    if (best == picture_ && layer_view_ == session_.layer_view) return;
    if (best != picture_) history_.add(*best);
    picture_ = std::move(best);
    update_error();
    meter();
    layer_view_ = session_.layer_view;
    const DisplayImage shown = display_image(layer_view_, picture_->aovs, picture_->result);
    scale_ = shown.scale;
    display_.set_picture(shown);
    frames_due_ = std::max(frames_due_, 1);
}

void Viewer::meter() {
    if (!session_.transform.metered() || !picture_ || picture_->request < first_metered_) return;
    const float stops = metered_exposure(picture_->result.beauty);
    metered_.insert(stops);
    session_.transform.exposure = stops;
    edit_history_.meter(stops);
    if (std::exchange(tells_metering_, false) || stops != 0)
        tell(fmt::format("Exposure {:.2f} stops by metering", stops), "exposure");
}

void Viewer::meter_again(std::uint64_t first_request) {
    session_.transform.exposure.automatic = true;
    first_metered_ = first_request;
    tells_metering_ = true;
}

bool Viewer::has_metered_exposure() const {
    const ViewTransform& t = session_.transform;
    return t.metered() || (!t.camera.exposes() && metered_.contains(t.exposure.stops));
}

void Viewer::update_error() {
    relmse_ = picture_->relmse;
    if (!reference_ || picture_->divisor > 1) return;
    const Image shown = rgb(picture_->result.beauty);
    if (shown.width != reference_->width || shown.height != reference_->height)
        throw Error("reference", "has {}x{} pixels, and the picture has {}x{}", reference_->width, reference_->height,
                    shown.width, shown.height);
    relmse_ = mean_of(relative_squared_error_map(shown, *reference_));
}

/// Reloads the display's shaders once the render thread has seen that files changed.
void Viewer::reload_shaders() {
    const std::uint64_t reloads = thread_.status().reloads;
    if (reloads == reloads_) return;
    reloads_ = reloads;
    frames_due_ = std::max(frames_due_, 1);
    attempt([&] { display_.reload_shaders(); });
}

/// Requests another picture if the session has changed.
void Viewer::request_picture() {
    Request request = session_.request(picture_size_);
    if (!session_.region || (requested_ && !serves(*requested_, request))) samples_before_region_ = 0;
    if (!scripted()) thread_.limit(sample_limit());
    const double asked = std::exchange(input_time_, {}).value_or(now());
    if (request == requested_) return;
    if (scripted()) thread_.limit(1);  // the script raises it to the samples that it waits for
    request_ = thread_.show(request);
    requested_ = std::move(request);
    timings_.record_request(request_, asked);
}

WindowLayout Viewer::layout() const {
    return lay_out(window_.framebuffer_size(), panels_shown_ ? gui_.parts() : Parts(), picture_size_);
}

void Viewer::follow_window() {
    const ivec2 size = window_.framebuffer_size();
    if (size == window_size_ || size.x == 0 || size.y == 0) return;
    window_size_ = size;
    const ivec2 area = layout().area.size;
    if (fills_window_) picture_size_ = glm::clamp(area, ivec2(1), ivec2(kMaxSide));
}

Progress Viewer::progress() const {
    const RenderThread::Status status = thread_.status();
    const auto newest = thread_.picture();
    const bool current = newest && newest->view == thread_.view();
    const bool whole = current && newest->divisor == 1;
    return {.activity = status.activity,
            .samples = whole ? std::max(newest->samples(), status.samples) : 0,
            .limit = sample_limit(),
            .divisor = current  ? newest->divisor
                       : newest ? 1
                                : 0,
            .seconds = sample_clock_.seconds(),
            .relmse = whole ? newest->relmse : std::nullopt,
            .denoised = whole && newest->result.stats.denoised ? newest->result.stats.samples : 0,
            .region = requested_ && requested_->region ? std::optional(requested_->region->size()) : std::nullopt};
}

/// Returns layer and size of the picture for the status line, with the scale if it is not shown pixel for pixel.
std::string Viewer::picture_text(const WindowLayout& layout) const {
    const int percent = static_cast<int>(std::lround(100.0 * layout.picture.size.x / picture_size_.x));
    return fmt::format("{}, {}x{}{}", session_.layer_view.layer, picture_size_.x, picture_size_.y,
                       percent == 100 ? "" : fmt::format(" at {} %", percent));
}

std::optional<std::string> Viewer::comparison_text() const {
    if (!comparison_ || comparison_size_ == picture_size_) return comparison_;
    return fmt::format("{}, {}x{} stretched to {}x{}", *comparison_, comparison_size_.x, comparison_size_.y,
                       picture_size_.x, picture_size_.y);
}

void Viewer::declare() {
    const WindowLayout now = layout();
    const Progress work = progress();
    if (const auto time = gui_.event_time(); time && !input_time_) input_time_ = time;
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Left) && !ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left))
        before_click_ = session_.document();
    PanelRequests requests;
    if (takes_input() && !unsaved_prompt_.asking() && !file_prompt_.asking()) {
        const dvec2 point = picture_point(now, picture_size_, gui_.mouse());
        const bool in_picture = now.picture.contains(gui_.mouse()) && !ImGui::GetIO().WantCaptureMouse;
        if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) press_used_ = false;
        if (picking_ && in_picture && ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
            picking_ = false;
            press_used_ = true;
            attempt([&] { perform(Action::focus_lens, {}, point); });
        } else {
            Input input = gui_.input(now, picture_size_);
            if (press_used_ || drag_region(now) || drag_handles(now))
                input.left = false, input.double_click.reset();
            else
                select_clicked(now);
            attempt([&] { navigation_.steer(session_, input, picture_size_); });
        }
        if (!ImGui::IsMouseDown(ImGuiMouseButton_Left)) press_used_ = false;
        // Escape closes lists, menus and sheets first.
        const bool open = shortcuts_shown_ || ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopup);
        for (const KeyPress& press : gui_.pressed())
            if (const ActionRow* row = action_of(press); row && !(open && row->action == Action::unselect))
                attempt([&] { perform(row->action, press, in_picture ? std::optional(point) : std::nullopt); });
        const bool held = std::ranges::any_of(ImGui::GetIO().MouseDown, std::identity());
        view_history_.record(session_.view(), view::now(), held || navigation_.moving() || ImGui::IsAnyItemActive());
    }
    if (panels_shown_) {
        const auto complete = thread_.complete_picture();
        std::optional<ivec2> pixel;
        if (now.picture.contains(gui_.mouse()))
            pixel = ivec2(glm::floor(picture_point(now, picture_size_, gui_.mouse())));
        const PanelState state{.picture = picture_.get(),
                               .history = &history_,
                               .status = thread_.status(),
                               .complete = complete.get(),
                               .pixel = pixel,
                               .comparing = comparison_.has_value(),
                               .comparison = comparison_mode_,
                               .picking = picking_,
                               .playing = play_.has_value(),
                               .frame = next_frame(),
                               .size = picture_size_,
                               .fills_window = fills_window_,
                               .available = [this](Action action) { return available(action); }};
        PanelContext context{session_, colors_, navigation_, outliner_, gizmo_.mode, state, requests};
        menu_bar(context);
        side_bar(now.side, section_, context);
        status_line(now.status, work, picture_text(now));
    }
    if (panels_shown_)
        object_overlay_.draw(session_, gizmo_, now, picture_size_, gui_.scale(), lit_handle_,
                             section_ == "Scene" || section_ == "Light");
    if (panels_shown_ || drawing_region_) show_region(now);
    if (panels_shown_ || !scripted()) {
        messages(scale_ ? above_scale(now.area) : now.area, toasts_);
        shortcut_sheet(shortcuts_shown_);
        if (const auto answer = file_prompt_.declare()) take(*answer, requests);
    }
    draw_overlay(
        {.area = now.area,
         .picture = now.picture,
         .scale = scale_,
         .notices = notices(),
         .here = picture_ && picture_->samples() > 0 ? with_samples(picture_->samples()) : session_.description(),
         .other = comparison_text(),
         .shown = comparison_mode_ == ComparisonMode::split        ? ""
                  : comparison_mode_ == ComparisonMode::difference ? "absolute difference of A and B"
                  : shown_split() == 1                             ? "A"
                                                                   : "B"},
        split_);
    if (!picture_) waiting_text(now.area, work);
    if (wants_state_before_click() && before_click_ && !opening_.valid()) {
        requests.environment.reset();
        restore(*std::exchange(before_click_, {}), "restoring");
    }
    perform(requests);
    if (takes_input()) ask_about_edits(), undo_waiting(), record_edits();
    window_.set_title(title());
}

void Viewer::apply_transform() {
    if (session_.transform == transform_) return;
    attempt([&] {
        processor_ = colors_.view(session_.transform);
        display_.set_view(processor_);
        transform_ = session_.transform;
    });
    session_.transform = transform_;  // previous transform, if the new one failed
}

void Viewer::frame(const std::filesystem::path& shot) {
    frames_due_ = std::max(frames_due_ - 1, 0);
    const ivec2 size = window_.framebuffer_size();
    if (size.x == 0 || size.y == 0) return;
    follow_window();
    for (bool more = true; more;) {
        gui_.begin();
        declare();
        more = gui_.pending();
        if (more) gui_.skip();
    }
    request_picture();
    meter();
    apply_transform();
    update_picture();  // shows a layer at once whose picture is there already
    display_.draw(size, layout().picture, shown_split());
    gui_.draw();
    if (!shot.empty()) write_png(shot, window_.read());
    window_.swap();
    if (!picture_) return;
    drawn_request_ = picture_->request;
    pose_pending_ = pose_pending_ && drawn_request_ != request_;
    drawn_samples_ = picture_->samples();
    timings_.record_shown(*picture_, now());
    if (reference_ && relmse_) timings_.record_error(*relmse_);
}

/// Returns the lines that must be visible, with or without panels.
std::vector<std::string> Viewer::notices() const {
    std::vector<std::string> lines;
    if (picture_) lines = bias_lines(biases_of(layer_view_, picture_->result.stats));
    if (picture_ && layer_view_.layer != session_.layer_view.layer)
        lines.push_back(fmt::format("{} is still shown; {} follows", layer_view_.layer, session_.layer_view.layer));
    const RenderThread::Status status = thread_.status();
    for (const std::string& error : {status.error, status.shader_error})
        if (!error.empty()) lines.push_back(error);
    for (const auto& [what, why] : outdated_) lines.push_back(why);
    return lines;
}

}  // namespace halflight::view
