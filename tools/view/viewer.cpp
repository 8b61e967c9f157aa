#include "tools/view/viewer.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <new>
#include <utility>

#include "api/halflight/picture_file.h"
#include "api/halflight/statistics.h"
#include "engine/core/image_tools.h"
#include "engine/core/metrics.h"
#include "engine/gpu/program_binaries.h"
#include "engine/io/files.h"
#include "engine/io/png.h"
#include "renderer/metering.h"
#include "tools/cli/signals.h"
#include "tools/view/clock.h"

namespace halflight::view {
namespace {

constexpr std::uint64_t kMostScript = 1 << 20;  // maximum size of a script, bytes
constexpr double kIdle = 0.5;                   // seconds to wait for events without anything to draw
constexpr double kMoving = 0.01;                // seconds between frames while a key is held

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

Viewer::Viewer(const PreviewArguments& arguments)
    : arguments_(arguments),
      script_(script_of(arguments)),
      colors_(ColorConfig::load(arguments.ocio)),
      session_(arguments, colors_),
      processor_(colors_.view(arguments.settings.view)),
      window_({*arguments.width, *arguments.height}, title()),
      gui_(window_),
      thread_(colors_, thread_options(arguments)) {
    transform_ = session_.transform;
    display_.set_view(processor_);
    edit_history_.start(session_.document());
    if (scripted()) panels_shown_ = false;
}

template <class F>
void Viewer::attempt(const F& f) {
    if (scripted()) return f();
    try {
        f();
    } catch (const std::bad_alloc&) {
        message_ = "out of memory";
    } catch (const std::exception& error) {
        message_ = error.what();
    }
}

std::string Viewer::title() const {
    const auto camera = session_.scene_camera();
    const std::string name = camera ? session_.scene().cameras[*camera].name : "";
    return one_line(fmt::format("halflight: {}{}", session_.file().filename().string(),
                                name.empty() ? "" : fmt::format(" ({})", name)));
}

void Viewer::run() {
    while (!window_.closing() && !quit_ && stop_signal() == 0) {
        const bool at_once = frames_due_ > 0 || play_ || next_command_ < script_.size();
        const double patience = navigation_.moving() || at_once ? kMoving : kIdle;
        if (window_.wait(patience) || navigation_.moving()) frames_due_ = std::max(frames_due_, 2);
        if (!scripted()) open_dropped_files(), advance_playback();
        reload_shaders();
        update_picture();
        if (frames_due_ > 0) frame();
        if (scripted()) step_script();
    }
    if (scripted() && !quit_ && stop_signal() == 0 && next_command_ < script_.size())
        throw Error(fmt::format("{}:{}", arguments_.script->string(), script_[next_command_].line),
                    "the window was closed");
}

/// Displays the latest picture if it has the layers of the current view.
void Viewer::update_picture() {
    const auto newest = thread_.picture();
    if (!newest || (newest == picture_ && layer_view_ == session_.layer_view)) return;
    const auto there = [&](const std::string& aov) {
        return std::ranges::find(newest->aovs, aov) != newest->aovs.end();
    };
    if (!std::ranges::all_of(required_aovs(session_.layer_view), there)) return;
    if (newest != picture_) history_.add(*newest);
    picture_ = newest;
    update_error();
    if (session_.transform.metered()) session_.transform.exposure = metered_exposure(picture_->result.beauty);
    layer_view_ = session_.layer_view;
    const DisplayImage shown = display_image(layer_view_, picture_->aovs, picture_->result);
    scale_ = shown.scale;
    display_.set_picture(shown);
    frames_due_ = std::max(frames_due_, 1);
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

void Viewer::open_dropped_files() {
    for (auto& path : window_.dropped()) to_open_.push_back(std::move(path));
    finish_opening();
    open_next();
}

void Viewer::start_opening(const std::string& activity, std::function<Session::Opened()> opening) {
    const auto task = std::make_shared<std::packaged_task<Session::Opened()>>(std::move(opening));
    opening_ = task->get_future();
    thread_.perform(activity, [task] { (*task)(); });
}

void Viewer::open_next() {
    if (opening_.valid()) return;
    if (!to_open_.empty()) {
        const std::filesystem::path path = std::move(to_open_.front());
        to_open_.pop_front();
        attempt([&] { start_opening(fmt::format("loading {}", path.filename().string()), session_.opening(path)); });
        return;
    }
    opening_pose_ = std::exchange(next_pose_, {});
    const Timeline& t = session_.timeline();
    if (!opening_pose_ || (opening_pose_->animation == t.animation && opening_pose_->frame == t.frame))
        return opening_pose_.reset();
    attempt([&] {
        start_opening(fmt::format("frame {}", opening_pose_->frame),
                      session_.posing(opening_pose_->animation, opening_pose_->frame));
    });
}

bool Viewer::finish_opening() {
    if (opening_.valid() && opening_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
        frames_due_ = std::max(frames_due_, 2);
        opening_pose_.reset();
        const std::optional<Play> going_on = std::exchange(play_, {});  // restored unless opening fails
        attempt([&] {
            Session::Opened opened = opening_.get();
            if (opened.start)
                next_pose_.reset();  // drops a frame request for the previous file
            else
                play_ = going_on;
            pose_pending_ = true;
            session_.open(std::move(opened));
        });
    }
    return !opening_.valid() && to_open_.empty() && !next_pose_;
}

void Viewer::set_playing(bool on) {
    play_.reset();
    if (on && !session_.timeline().playing.empty()) play_ = {now(), session_.timeline().frame};
}

void Viewer::advance_playback() {
    if (!play_) return;
    const Timeline& t = session_.timeline();
    if (t.playing.empty() || thread_.status().failed == request_) return set_playing(false);
    if (finish_opening() && play_ && !pose_pending_) {
        const double passed = std::floor((now() - play_->since) * t.rate.numerator / t.rate.denominator);
        const auto due = static_cast<std::uint32_t>(std::fmod(play_->first + passed, t.last + 1.0));
        if (due != t.frame) next_pose_ = {t.animation, due};
    }
    open_next();
}

/// Reloads the display's shaders once the render thread has seen that files changed.
void Viewer::reload_shaders() {
    const std::uint64_t reloads = thread_.status().reloads;
    if (reloads == reloads_) return;
    reloads_ = reloads;
    frames_due_ = std::max(frames_due_, 1);
    attempt([&] { display_.reload_shaders(); });
}

void Viewer::compare(bool on) {
    if (!on) {
        comparison_.reset();
        display_.close_comparison();
        return;
    }
    if (!picture_) throw Error("compare", "there is no picture yet");
    display_.keep_comparison();
    comparison_ = fmt::format("{}, {} samples", session_.description(), picture_->result.stats.samples);
}

/// Requests another picture if the session has changed.
void Viewer::request_picture() {
    Request request = session_.request(window_.framebuffer_size());
    if (!scripted()) thread_.limit(session_.samples);
    if (request == requested_) return;
    if (scripted()) thread_.limit(1);  // the script raises it to the samples that it waits for
    request_ = thread_.show(request);
    requested_ = std::move(request);
    timings_.record_request(request_, now());
    window_.set_title(title());
}

void Viewer::frame(const std::filesystem::path& shot) {
    const ivec2 size = window_.framebuffer_size();
    frames_due_ = std::max(frames_due_ - 1, 0);
    if (size.x == 0 || size.y == 0) return;
    gui_.begin();
    if (!scripted()) {
        attempt([&] { navigation_.steer(session_, gui_.input(), size); });
        keys();
    }
    PanelRequests requests;
    const RenderThread::Status status = thread_.status();
    if (panels_shown_)
        requests = panels(
            session_, colors_, navigation_,
            {picture_.get(), &history_, status, message_, comparison_.has_value(), play_.has_value(), next_frame()});
    draw_overlay({scale_, notices(status), session_.description(), comparison_, requests.label_area}, split_);
    if (requests.pose) attempt([&] { session_.move(*requests.pose); });
    request_picture();
    if (session_.transform != transform_) {
        attempt([&] {
            processor_ = colors_.view(session_.transform);
            display_.set_view(processor_);
            transform_ = session_.transform;
        });
        session_.transform = transform_;  // previous transform, if the new one failed
    }
    display_.draw(size, split_);
    gui_.draw();
    if (!shot.empty()) write_png(shot, window_.read());
    window_.swap();
    if (picture_) {
        drawn_request_ = picture_->request;
        pose_pending_ = pose_pending_ && drawn_request_ != request_;
        drawn_samples_ = picture_->divisor == 1 ? picture_->result.stats.samples : 0;
        timings_.record_shown(*picture_, now());
        if (reference_ && relmse_) timings_.record_error(*relmse_);
    }
    perform(requests);
}

std::uint32_t Viewer::next_frame() const {
    return next_pose_ ? next_pose_->frame : opening_pose_ ? opening_pose_->frame : session_.timeline().frame;
}

/// Returns the lines that must be visible, with or without panels.
std::vector<std::string> Viewer::notices(const RenderThread::Status& status) const {
    std::vector<std::string> lines;
    if (picture_) lines = bias_lines(biases_of(layer_view_, picture_->result.stats));
    if (panels_shown_) return lines;  // panels show errors themselves
    for (const std::string& error : {status.error, status.shader_error})
        if (!error.empty()) lines.push_back(error);
    return lines;
}

void Viewer::perform(const PanelRequests& requests) {
    if (requests.dismiss_message) message_.clear();
    if (requests.frame) next_pose_ = requests.frame;
    if (requests.frame || requests.play) set_playing(requests.play.value_or(false));
    attempt([&] {
        if (requests.compare) compare(*requests.compare);
        if (requests.save) {
            session_.save(window_.framebuffer_size());
            message_ = fmt::format("Saved {}", session_.settings_file().string());
        }
        if (requests.screenshot || requests.exr) screenshot(unused_name(requests.exr ? "exr" : "png"));
    });
}

/// Returns an unused file name in the current folder, made of the scene's name.
std::filesystem::path Viewer::unused_name(const char* extension) const {
    for (int i = 1;; ++i) {
        const std::filesystem::path name = fmt::format("{}-{:04}.{}", session_.file().stem().string(), i, extension);
        std::error_code none;
        if (!std::filesystem::exists(name, none)) return name;
    }
}

void Viewer::screenshot(const std::filesystem::path& path) {
    if (!picture_) throw Error(path.string(), "not written: there is no picture yet");
    if (has_extension(path, "exr")) {
        const RenderStats& stats = picture_->result.stats;
        RenderResult shown = picture_->result;
        if (layer_view_.is_sum()) {
            const Image sum = display_image(layer_view_, picture_->aovs, shown).image;
            for (int y = 0; y < sum.height; ++y)
                for (int x = 0; x < sum.width; ++x) std::copy_n(sum.at(x, y), 3, shown.beauty.at(x, y));
        }
        write_picture(
            path, shown,
            {.camera = picture_->camera,
             .working_space = colors_.linear_space(""),
             .comments = fmt::format("scene {}, shown by halflight view, {} samples, {}",
                                     session_.file().filename().string(), stats.samples, session_.description()),
             .filter = text(PixelFilter{}),
             .lens = lens_text(picture_->camera, stats.lens,
                               double(picture_->result.beauty.width) / picture_->result.beauty.height),
             .shutter = "",
             .bias = fmt::format("{}", fmt::join(layer_view_.is_sum() ? stats.layer_biases : stats.biases, "; ")),
             .error = ""});
    } else {
        write_png(path, display_.read(split_));
    }
    message_ = fmt::format("Saved {}", path.string());
}

void Viewer::keys() {
    const ImGuiIO& io = ImGui::GetIO();
    if (io.WantTextInput) return;
    const dvec2 point(io.MousePos.x * io.DisplayFramebufferScale.x, io.MousePos.y * io.DisplayFramebufferScale.y);
    for (const char k : {'F', 'H', 'L', 'R', '1', '2', '3', '4', '5', '6', '7', '8', '9'})
        if (ImGui::IsKeyPressed(k, false)) attempt([&] { key(k, point); });  // GLFW's key codes are ASCII
    if (io.KeyCtrl && ImGui::IsKeyPressed(GLFW_KEY_S, false)) perform({.save = true});
    if (ImGui::IsKeyPressed(GLFW_KEY_P, false)) perform({.screenshot = true});
    if (ImGui::IsKeyPressed(GLFW_KEY_SPACE, false)) perform({.play = !play_});
}

void Viewer::key(char key, const dvec2& point) {
    if (key == 'F') session_.frame_object(point, window_.framebuffer_size());
    if (key == 'H') panels_shown_ = !panels_shown_;
    if (key == 'L') session_.focus_lens(point, window_.framebuffer_size());
    if (key == 'R') session_.reset_camera();
    const auto number = static_cast<std::size_t>(key - '1');
    if (key >= '1' && key <= '9' && number < session_.bookmarks.size()) session_.move(session_.bookmarks[number].pose);
}

}  // namespace halflight::view
