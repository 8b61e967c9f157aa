// Actions of keys, menu and side bar.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "api/halflight/edit_text.h"
#include "api/halflight/picture_file.h"
#include "api/halflight/statistics.h"
#include "engine/core/image_tools.h"
#include "engine/io/exr.h"
#include "engine/io/files.h"
#include "engine/io/ies.h"
#include "engine/io/png.h"
#include "tools/cli/options.h"
#include "tools/view/linear_picture.h"
#include "tools/view/viewer.h"

namespace halflight::view {
namespace {

constexpr std::uint64_t kMostPictureBytes = std::uint64_t{1} << 32;  // maximum size of a picture to compare with
constexpr float kStopStep = 0.25f;                                   // stops per press of a key
constexpr float kMostStops = 64;                                     // limit of exposures by keys
constexpr float kUiStep = 1.125f;  // factor on the scale of text and controls per press of a key

/// Returns the note about the region of a picture that has more samples; "" without one.
std::string region_note(const Picture& picture) {
    if (!picture.region) return "";
    const PixelWindow& w = picture.region->window;
    return fmt::format(", {} in the region {},{},{},{}", picture.samples(), w.first.x, w.first.y, w.end.x, w.end.y);
}

}  // namespace

void Viewer::perform(Action action, const KeyPress& press, const std::optional<dvec2>& point) {
    Exposure& exposure = session_.transform.exposure;
    const auto expose = [&](float stops) {
        exposure = std::clamp(stops, -kMostStops, kMostStops);
        tell(fmt::format("Exposure {:.2f} stops", exposure.stops), "exposure");
    };
    switch (action) {
        case Action::open:
            return file_prompt_.ask(FilePrompt::Purpose::open, session_.file().parent_path());
        case Action::compare_file:
            return file_prompt_.ask(FilePrompt::Purpose::compare, session_.file().parent_path());
        case Action::save:
            if (settings_changed()) return file_prompt_.ask_to_replace(session_.settings_file());
            return save(session_.settings_file());
        case Action::save_as:
            return file_prompt_.ask(FilePrompt::Purpose::save, session_.settings_file().parent_path(),
                                    session_.settings_file().filename().string());
        case Action::screenshot:
            return save_numbered("png");
        case Action::exr:
            return save_numbered("exr");
        case Action::picture_as:
            return file_prompt_.ask(FilePrompt::Purpose::picture, ".", session_.file().stem().string() + ".png",
                                    picture_ && picture_->samples() > 0 ? with_samples(picture_->samples()) : "");
        case Action::quit:
            return window_.close();
        case Action::undo:
            ++undos_waiting_;
            return;
        case Action::redo:
            --undos_waiting_;
            return;
        case Action::revert:
            reverts_ = true;
            return;
        case Action::handles:
            return step_handles();
        case Action::hide_object:
            return hide_selected();
        case Action::add_lamp:
            return add_lamp(last_kind_);
        case Action::duplicate_lamp:
            return duplicate_lamp();
        case Action::unselect:
            if (!leave_region() && !std::exchange(picking_, false)) session_.selection = {};
            return;
        case Action::hide_panels:
            panels_shown_ = !panels_shown_;
            return tell(panels_shown_ ? "Panels shown" : "Panels hidden; H shows them", "panels");
        case Action::larger_ui:
        case Action::smaller_ui:
            gui_.set_scale(gui_.scale() * (action == Action::larger_ui ? kUiStep : 1 / kUiStep));
            return tell(fmt::format("Scale of text and controls {:.2f}", gui_.scale()), "scale");
        case Action::brighter:
            return expose(exposure.stops + kStopStep);
        case Action::darker:
            return expose(exposure.stops - kStopStep);
        case Action::reset_exposure:
            return expose(0);
        case Action::meter:
            if (session_.transform.camera.exposes())
                return tell("\"Exposure of a camera\" in the section Look sets the exposure", "exposure");
            request_picture();
            return meter_again(request_);
        case Action::next_layer:
            return step_layer(1);
        case Action::previous_layer:
            return step_layer(-1);
        case Action::final_layer:
            session_.layer_view.layer = kFinal;
            return step_layer(0);
        case Action::draw_region:
            return ask_for_region();
        case Action::whole_picture:
            set_region({});
            return tell("Whole picture");
        case Action::frame_selected:
            return frame_object(point);
        case Action::frame_all:
            return tell(session_.frame_all(picture_size_) ? "All objects framed" : "The scene has no objects to frame");
        case Action::previous_view:
            return show_other_view(false);
        case Action::next_view:
            return show_other_view(true);
        case Action::focus_lens:
            picking_ = !point;
            if (picking_) return tell("Click the surface to focus on");
            session_.focus_lens(*point, picture_size_);
            return tell("Lens focused");
        case Action::reset_camera: {
            session_.reset_camera();
            const auto camera = session_.scene_camera();
            return tell(camera ? fmt::format("View of {}", session_.name_of({ObjectKind::camera, *camera}))
                               : "Initial view");
        }
        case Action::bookmark:
            session_.bookmark();
            return tell(fmt::format("Bookmark \"{}\" added", session_.bookmarks.back().name));
        case Action::recall:
            return recall(static_cast<std::size_t>(press.key[0] - '1'));
        case Action::play:
            return play_or_stop();
        case Action::keep:
            return compare(true);
        case Action::close_comparison:
            return compare(false);
        case Action::shortcuts:
            shortcuts_shown_ = !shortcuts_shown_;
            return;
    }
}

bool Viewer::available(Action action) const {
    switch (action) {
        case Action::screenshot:
        case Action::exr:
        case Action::picture_as:
        case Action::keep:
            return picture_ != nullptr;
        case Action::undo:
            return edit_history_.can_undo();
        case Action::redo:
            return edit_history_.can_redo();
        case Action::revert:
            return !(session_.edits == SceneEdits()) || !(session_.environment() == EnvironmentChoice()) ||
                   !session_.variant().empty();
        case Action::handles:
            return gizmo_.can_move(session_);
        case Action::hide_object:
            return can_be_hidden(session_.selection, session_);
        case Action::duplicate_lamp:
            return session_.selection.kind == ObjectKind::light;
        case Action::unselect:
            return session_.selection.kind != ObjectKind::none || drawing_region_ || picking_;
        case Action::reset_exposure:
            return session_.transform.exposure.stops != 0;
        case Action::meter:
            return !session_.transform.camera.exposes();
        case Action::final_layer:
            return session_.layer_view.layer != kFinal;
        case Action::whole_picture:
            return session_.region.has_value();
        case Action::frame_selected:
            return session_.selection.kind != ObjectKind::none && session_.selection.kind != ObjectKind::environment;
        case Action::previous_view:
            return view_history_.can_go_back(session_.view());
        case Action::next_view:
            return view_history_.can_go_forward(session_.view());
        case Action::recall:
            return !session_.bookmarks.empty();
        case Action::play:
            return session_.timeline().keyed || !session_.timeline().animations.empty();
        case Action::close_comparison:
            return comparison_.has_value();
        default:
            return true;
    }
}

void Viewer::frame_object(const std::optional<dvec2>& point) {
    if (session_.frame_selection(picture_size_))
        return tell(fmt::format("Framed: {}", session_.name_of(session_.selection)));
    if (session_.selection.kind != ObjectKind::none)
        return tell(fmt::format("{} has no place that could be framed", session_.name_of(session_.selection)));
    if (!point) return tell("Nothing is selected");
    tell(session_.frame_object(*point, picture_size_) ? "Object framed" : "No object under the mouse");
}

void Viewer::show_other_view(bool next) {
    const auto view = next ? view_history_.forward(session_.view()) : view_history_.back(session_.view());
    if (!view) return tell(next ? "There is no later view" : "There is no earlier view");
    session_.take_view(*view);
    tell(next ? "Next view" : "Previous view");
}

void Viewer::play_or_stop() {
    const Timeline& t = session_.timeline();
    if (t.animations.empty() && !t.keyed) return tell("The scene has no animations", "play");
    if (!t.runs()) {
        next_pose_ = {t.animations.front(), 0};
        plays_next_ = true;
        tell(fmt::format("Playing {}", t.animations.front()), "play");
        return open_next();
    }
    set_playing(!play_);
    tell(play_ ? "Playing" : "Stopped", "play");
}

void Viewer::recall(std::size_t number) {
    const auto& all = session_.bookmarks;
    if (number >= all.size()) return tell(fmt::format("There is no bookmark {}", number + 1));
    session_.move(all[number].pose);
    tell(fmt::format("Bookmark \"{}\"", all[number].name));
}

void Viewer::step_layer(int step) {
    const std::vector<std::string> all = layer_view_names();
    std::string& layer = session_.layer_view.layer;
    const auto now = std::ranges::find(all, layer) - all.begin();
    const auto count = static_cast<std::ptrdiff_t>(all.size());
    layer = all[static_cast<std::size_t>((now + step + count) % count)];
    tell(fmt::format("Layer {}: {}", layer, description(layer)), "layer");
}

std::string Viewer::with_samples(int samples) const {
    return fmt::format("{}, {} sample{}", session_.description(), samples, samples == 1 ? "" : "s");
}

void Viewer::compare(bool on) {
    if (!on) {
        if (comparison_) tell("Comparison closed");
        comparison_.reset();
        set_comparison(ComparisonMode::split);
        display_.close_comparison();
        return;
    }
    if (!picture_) throw Error("compare", "there is no picture yet");
    display_.keep_comparison();
    comparison_ = with_samples(picture_->result.stats.samples);
    comparison_size_ = {picture_->result.beauty.width, picture_->result.beauty.height};
    tell("Picture kept as B");
}

void Viewer::compare_with(const std::filesystem::path& path) {
    const std::string bytes = read_file(path, kMostPictureBytes);
    const bool png = is_png(bytes);
    if (!png && !is_exr(bytes)) throw Error(path.string(), "is neither an OpenEXR nor a PNG file");
    Image image = png ? rgb(read_png(path.string(), bytes, kMaxSide)) : read_linear(path);
    const ivec2 size(image.width, image.height);
    display_.set_comparison({std::move(image), png});
    comparison_size_ = size;
    comparison_ = path.filename().string();
    tell(fmt::format("Comparing with {}", *comparison_));
}

void Viewer::set_comparison(ComparisonMode mode) {
    if (mode == ComparisonMode::difference && comparison_ && !display_.can_subtract())
        throw Error("comparison", "a linear picture and a display-encoded one have no difference");
    comparison_mode_ = mode;
    display_.set_difference(mode == ComparisonMode::difference);
}

float Viewer::shown_split() const {
    constexpr double kTurn = 0.5;  // seconds
    if (comparison_mode_ == ComparisonMode::split) return split_;
    if (comparison_mode_ == ComparisonMode::difference) return 1;
    return std::fmod(now(), 2 * kTurn) < kTurn ? 1.0f : 0.0f;
}

void Viewer::take(const FilePrompt::Answer& answer, PanelRequests& requests) {
    switch (answer.purpose) {
        case FilePrompt::Purpose::open:
            requests.open = answer.file;
            return;
        case FilePrompt::Purpose::environment:
            requests.environment = answer.file;
            return;
        case FilePrompt::Purpose::profile:
            return attempt([&] {
                if (session_.selection.kind != ObjectKind::light) return;
                load_ies(answer.file);  // a damaged file changes nothing
                light_edit(session_.edits, session_.references().lights.at(session_.selection.index)).ies =
                    answer.file.string();
            });
        case FilePrompt::Purpose::compare:
            requests.against = answer.file;
            return;
        case FilePrompt::Purpose::save:
            return save(answer.file);
        case FilePrompt::Purpose::picture:
            return attempt([&] { save_picture(answer.file, answer.all_layers); });
    }
}

void Viewer::take_size(const std::string& text) {
    picture_size_ = parse_size("Size", text);
    fills_window_ = false;
    tell(fmt::format("Picture of {}x{} pixels", picture_size_.x, picture_size_.y), "size");
}

void Viewer::fill_window(bool on) {
    fills_window_ = on;
    if (on) picture_size_ = glm::clamp(layout().area.size, ivec2(1), ivec2(kMaxSide));
    tell(on ? "The picture fills its area, whatever the size of the window" : "The picture keeps its size", "size");
}

void Viewer::perform(const PanelRequests& requests) {
    for (const std::string& message : requests.done) tell(message);
    if (requests.pose) attempt([&] { session_.move(*requests.pose); });
    if (requests.size) attempt([&] { take_size(*requests.size); });
    if (requests.fill_window) fill_window(*requests.fill_window);
    if (requests.against) attempt([&] { compare_with(*requests.against); });
    if (requests.comparison) attempt([&] { set_comparison(*requests.comparison); });
    if (requests.pick_focus) picking_ = !picking_;
    if (requests.ask_environment) file_prompt_.ask(FilePrompt::Purpose::environment, session_.file().parent_path());
    if (requests.ask_profile) file_prompt_.ask(FilePrompt::Purpose::profile, session_.file().parent_path());
    if (requests.lamp) attempt([&] { add_lamp(*requests.lamp); });
    if (requests.open) to_open_.push_back(*requests.open);
    if (requests.environment) change_environment(*requests.environment);
    if (requests.variant) change_variant(*requests.variant);
    if (requests.frame) next_pose_ = requests.frame;
    if (requests.frame || requests.play) set_playing(requests.play.value_or(false));
    for (const Action action : requests.actions) attempt([&] { perform(action, {}, std::nullopt); });
}

/// Returns an unused file name in the current folder, made of the scene's name.
std::filesystem::path Viewer::unused_name(const char* extension) {
    for (int i = 1;; ++i) {
        const std::filesystem::path name = fmt::format("{}-{:04}.{}", session_.file().stem().string(), i, extension);
        std::error_code none;
        if (names_.contains(name) || std::filesystem::exists(name, none)) continue;
        names_.insert(name);  // the file may not be there yet
        return name;
    }
}

bool Viewer::settings_changed() const {
    return saving_.empty() && session_.settings_changed();  // else this program is writing it
}

void Viewer::save(const std::filesystem::path& file) {
    saving_.push_back({file, session_.document()});
    writer_.write(file.string(), [file, settings = session_.saved(picture_size_)] { write_settings(file, settings); });
}

bool Viewer::in_full() const {
    return picture_ && picture_->divisor == 1 && picture_->request >= first_of_scene_;
}

std::shared_ptr<const Picture> Viewer::complete_picture() const {
    auto complete = thread_.complete_picture();
    const bool fits = complete && picture_ && complete->view == picture_->view && complete->divisor == 1;
    return fits ? complete : nullptr;
}

void Viewer::screenshot(const std::filesystem::path& path, bool all_layers) {
    if (!picture_) throw Error(path.string(), "not written: there is no picture yet");
    if (!has_extension(path, "exr"))
        return writer_.write(path.string(), [path, image = display_.read(shown_split())] { write_png(path, image); });
    const auto complete = all_layers ? complete_picture() : nullptr;
    if (all_layers && !complete) throw Error(path.string(), "not written: there is no picture with all layers yet");
    const bool all = complete != nullptr;
    const std::shared_ptr<const Picture> picture = all ? complete : picture_;
    if (all && picture->samples() < picture_->samples())
        tell(fmt::format("All layers are of a picture of {} samples", picture->samples()));
    const RenderStats& stats = picture->result.stats;
    PictureInfo facts{
        .camera = picture->camera,
        .working_space = colors_.linear_space(""),
        .samples = stats.samples,
        .comments =
            fmt::format("scene {}, shown by halflight view, {} samples{}, {}", session_.file().filename().string(),
                        stats.samples, region_note(*picture), session_.description()),
        .filter = text(PixelFilter{}),
        .lens = lens_text(picture->camera, stats.lens, {picture->result.beauty.width, picture->result.beauty.height}),
        .shutter = "",
        .bias = fmt::format("{}", fmt::join(!all && layer_view_.is_sum() ? stats.layer_biases : stats.biases, "; ")),
        .error = ""};
    writer_.write(path.string(), [path, facts = std::move(facts), picture, view = layer_view_, all] {
        write_picture(path, all ? picture->result : shown_result(view, picture->aovs, picture->result), facts);
    });
}

void Viewer::save_picture(const std::filesystem::path& path, bool all_layers) {
    const bool all = all_layers && has_extension(path, "exr");
    if (scripted() || !picture_ || (in_full() && (!all || complete_picture()))) return screenshot(path, all);
    waiting_pictures_[path] = all;
    tell(fmt::format("The picture is saved once it has {}", all ? "all layers in full resolution" : "full resolution"));
}

void Viewer::save_numbered(const char* extension) {
    const bool waits = std::ranges::any_of(waiting_pictures_, [&](const auto& picture) {
        return names_.contains(picture.first) && has_extension(picture.first, extension);
    });
    if (!waits) save_picture(unused_name(extension));
}

void Viewer::save_waiting_pictures() {
    if (waiting_pictures_.empty() || !in_full() || drawn_request_ != request_) return;
    for (const auto& [path, all_layers] : std::exchange(waiting_pictures_, {}))
        if (all_layers && !complete_picture())
            waiting_pictures_[path] = true;
        else
            attempt([&, to = path, all = all_layers] { screenshot(to, all); });
}

void Viewer::report_files() {
    for (const FileWriter::Result& result : writer_.results()) {
        frames_due_ = std::max(frames_due_, 1);
        if (!saving_.empty() && result.name == saving_.front().file.string()) {
            const Saving saved = std::move(saving_.front());
            saving_.pop_front();
            if (result.error.empty()) {
                edit_history_.mark_saved(saved.state);
                session_.note_saved(saved.file);
                watch_.replace(session_.settings_version());
            }
        }
        if (result.error.empty())
            tell(fmt::format("Saved {}", result.name));
        else if (scripted())
            throw Error("", result.error);
        else
            toasts_.fail(result.error, now());
    }
}

}  // namespace halflight::view
