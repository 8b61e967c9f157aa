// Execution of scripts; script.h lists the commands.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "api/halflight/edit_text.h"
#include "engine/core/image_tools.h"
#include "engine/io/files.h"
#include "engine/settings/settings_table.h"
#include "tools/view/clock.h"
#include "tools/view/inspection.h"
#include "tools/view/linear_picture.h"
#include "tools/view/viewer.h"

namespace halflight::view {
namespace {

constexpr double kLongInput = 1e6;  // seconds
constexpr double kGrace = 0.5;      // seconds

/// Returns settings in which the named one has a value.
RenderSettings settings_with(const char* name, const std::string& value) {
    RenderSettings settings;
    if (const std::string problem = setting(name).set(settings, value); !problem.empty()) throw Error(name, problem);
    return settings;
}

/// Returns whether a command may read a file or pose the scene, so that the script waits for it.
bool opens(const std::string& command) {
    constexpr std::string_view kAll[] = {"open",    "animation", "frame", "environment",
                                         "variant", "undo",      "redo",  "reload"};
    return std::ranges::find(kAll, command) != std::end(kAll);
}

}  // namespace

void Viewer::step_script() {
    while (next_command_ < script_.size() && !quit_) {
        const Command& command = script_[next_command_];
        if (opening_.valid() && !script_opens_ && !play_ && !finish_opening()) return;  // a key has started an opening
        try {
            if (command.name == "wait") {
                if (!wait_done(command)) return;
            } else if (opens(command.name)) {
                if (!open_done(command)) return;
            } else if (command.name == "play") {
                if (!play_done(command)) return;
            } else if (command.name == "input") {
                if (!input_done(command)) return;
            } else {
                execute(command);
                writer_.finish();  // files are complete before the next command
                report_files();
            }
        } catch (const Error& error) {
            throw Error(fmt::format("{}:{}", arguments_.script->string(), command.line), error.what());
        }
        if (!opening_.valid()) edit_history_.record(session_.document(), false);
        if (std::exchange(takes_settings_, false)) edit_history_.mark_saved(session_.document());
        view_history_.settle(session_.view());
        ++next_command_;
        frames_due_ = std::max(frames_due_, 1);
    }
    quit_ = true;
}

/// Returns whether the window shows what the command waits for.
bool Viewer::wait_done(const Command& command) {
    request_picture();
    const RenderThread::Status status = thread_.status();
    if (status.ended || status.failed == request_) throw Error("", status.error);
    if (command.numbers.empty()) return drawn_request_ == request_;
    if (command.words[0] == "error") {
        thread_.limit(kMostSamples);
        const bool enough = drawn_request_ == request_ && relmse_ && *relmse_ < command.numbers[0];
        if (enough) thread_.limit(drawn_samples_);
        return enough;
    }
    const int samples = static_cast<int>(command.numbers[0]);
    thread_.limit(samples);
    return drawn_request_ == request_ && drawn_samples_ >= samples;
}

/// Returns whether the command has finished; the first call starts it.
bool Viewer::open_done(const Command& command) {
    if (thread_.status().ended) throw Error("", thread_.status().error);
    if (command.name == "reload" && !script_opens_) {
        if (!arguments_.watch) throw Error("reload", "needs --watch");
        script_opens_ = reload_changed();
        return false;
    }
    if (!std::exchange(script_opens_, true)) {
        const Timeline& t = session_.timeline();
        if (command.name == "open")
            to_open_.push_back(command.words[0]);
        else if (command.name == "environment")
            start_opening(command.name, session_.lighting(parse_environment(command.name, command.words[0])));
        else if (command.name == "variant")
            start_opening(command.name, session_.dressing(command.words[0]));
        else if (command.name == "undo" || command.name == "redo")
            undo(command.name == "redo");
        else if (command.name == "animation")
            next_pose_ = {command.words[0], 0};
        else
            next_pose_ = {t.animation, static_cast<FrameNumber>(command.numbers[0])};
        open_next();
    }
    if (!finish_opening()) return false;
    script_opens_ = false;
    return true;
}

/// Returns whether the animation has played for the command's time; the first call starts it.
bool Viewer::play_done(const Command& command) {
    const RenderThread::Status status = thread_.status();
    if (status.ended || status.failed == request_) throw Error("", status.error);
    if (!play_) set_playing(true);
    if (!play_) throw Error("play", "no animation is chosen");
    request_picture();
    advance_playback();
    if (!play_ || now() - play_->since < command.numbers[0] || !finish_opening())
        return false;  // a failed picture does not end the playback
    set_playing(false);
    return true;
}

/// Returns whether the time for real input is over; the first call starts it. Pictures gain samples meanwhile.
bool Viewer::input_done(const Command& command) {
    if (!input_until_) input_until_ = now() + (command.numbers.empty() ? kLongInput : command.numbers[0]);
    thread_.limit(session_.samples);
    frames_due_ = std::max(frames_due_, 1);
    const bool there = command.numbers.empty() && std::filesystem::exists(command.words[1]);
    if (there && window_.events().empty() && !input_seen_end_) {
        input_seen_end_ = true;  // events may be on their way from the window system
        input_until_ = now() + kGrace;
    }
    if (now() < *input_until_) return false;
    input_seen_end_ = false;
    input_until_.reset();
    return true;
}

/// Returns what actions have changed, for tests of real input.
nlohmann::ordered_json Viewer::state() const {
    const auto newest = thread_.picture();
    nlohmann::ordered_json region;  // null: none
    if (newest && newest->region) {
        const PixelWindow& w = newest->region->window;
        region = {w.first.x, w.first.y, w.end.x, w.end.y};
    }
    return {{"layer", session_.layer_view.layer},
            {"exposure", session_.transform.stops()},
            {"bookmarks", session_.bookmarks.size()},
            {"messages", toasts_.total()},
            {"clicks", gui_.clicks()},
            {"view", thread_.view()},
            {"samples", newest ? newest->samples() : 0},
            {"region", region},
            {"selection", session_.name_of(session_.selection)},
            {"size", {picture_size_.x, picture_size_.y}},
            {"animation", session_.timeline().animation},
            {"frame", session_.timeline().frame},
            {"focus", session_.transform.camera.lens.blurs() ? session_.transform.camera.lens.focus.distance : 0},
            {"camera", {session_.pose().from.x, session_.pose().from.y, session_.pose().from.z}}};
}

void Viewer::execute(const Command& c) {
    if (execute_edit(c)) return;
    const auto n = [&](std::size_t i) { return c.numbers.at(i); };
    const ivec2 size = picture_size_;
    const dvec2 point = c.numbers.size() >= 2 ? dvec2(n(0), n(1)) : dvec2(size) / 2.0;
    const dvec2 drag = point / double(size.y);
    const CameraPose& pose = session_.pose();
    if (c.name == "camera") session_.take_camera(c.words[0]);
    if (c.name == "orbit") session_.move(orbit(pose, kPi * drag));
    if (c.name == "pan") session_.move(pan(pose, drag));
    if (c.name == "turn") session_.move(turn(pose, pose.vertical_fov * drag));
    if (c.name == "dolly") session_.move(dolly(pose, n(0), session_.diagonal()));
    if (c.name == "fly") session_.move(fly(pose, {n(0), n(1), n(2)}));
    if (c.name == "walk") session_.move(walk(pose, {n(0), n(1), n(2)}));
    if (c.name == "focus" && !session_.focus(point, size)) throw Error("focus", "there is no surface at this pixel");
    if (c.name == "lens") session_.focus_lens(point, size);
    if (c.name == "fstop") session_.transform.camera.lens.fstop = static_cast<float>(n(0));
    if (c.name == "key") {
        const KeyPress press = key_press(c.words[0]);
        perform(action_of(press)->action, press, point);
        undo_waiting();
    }
    if (c.name == "view") {
        const std::vector<std::string> all = layer_view_names();
        if (std::ranges::find(all, c.words[0]) == all.end())
            throw Error("view", "unknown layer '{}'; valid are {}", c.words[0], fmt::join(all, ", "));
        session_.layer_view.layer = c.words[0];
    }
    if (c.name == "reference") {
        reference_ = read_linear(c.words[0]);
        if (picture_) update_error();
    }
    if (c.name == "component") {
        const auto known = std::ranges::find(kComponents, c.words[0]);
        if (known == kComponents.end())
            throw Error("component", "unknown component '{}'; valid are {}", c.words[0], fmt::join(kComponents, ", "));
        session_.layer_view.components[static_cast<std::size_t>(known - kComponents.begin())] = c.on();
    }
    if (c.name == "compare") {
        update_picture();
        compare(c.on());
    }
    if (c.name == "against") compare_with(c.words[0]);
    if (c.name == "comparison") {
        const std::array<std::string, 3> names = {"split", "difference", "flicker"};
        const auto known = std::ranges::find(names, c.words[0]);
        if (known == names.end())
            throw Error("comparison", "unknown mode '{}'; valid are {}", c.words[0], fmt::join(names, ", "));
        set_comparison(static_cast<ComparisonMode>(known - names.begin()));
    }
    if (c.name == "probe") {
        update_picture();
        const auto complete = thread_.complete_picture();
        const auto known = picture_ ? probe(*picture_, complete.get(), size, ivec2(point)) : std::nullopt;
        if (!known) throw Error("probe", "there is no picture at this pixel");
        write_file(c.words[2], json_of(*known).dump(2) + "\n");
    }
    if (c.name == "histogram") {
        update_picture();
        if (!picture_) throw Error("histogram", "there is no picture yet");
        write_file(c.words[0], json_of(histogram(picture_->result.beauty, session_.transform.stops())).dump(2) + "\n");
    }
    if (c.name == "state") write_file(c.words[0], state().dump(2) + "\n");
    if (c.name == "split") split_ = static_cast<float>(n(0));
    if (c.name == "exposure") session_.transform.exposure = static_cast<float>(n(0));
    if (c.name == "transform") {
        ViewTransform transform = session_.transform;
        transform.display = c.words[0];
        transform.view = c.words[1];
        colors_.view(transform);  // throws if a name is unknown
        session_.transform = transform;
    }
    if (c.name == "rotation") session_.edits.environment_rotation = n(0);
    if (c.name == "intensity") session_.edits.environment_intensity = static_cast<float>(n(0));
    if (c.name == "emission") session_.edits.emission = static_cast<float>(n(0));
    if ((c.name == "light" && !c.numbers.empty()) || c.name == "place" || c.name == "aim") {
        const std::size_t lights = session_.lights().size();
        if (n(0) < 0 || n(0) >= static_cast<double>(lights))
            throw Error(c.name, "there is no light {}; the scene has {}, numbered from 0", n(0), lights);
        const dvec3 triple = c.numbers.size() == 2 ? dvec3(0) : dvec3(n(1), n(2), n(3));
        if (c.name == "aim" && !unit_direction(triple)) throw Error("aim", "the direction is zero or not finite");
        LightEdit& light = light_edit(session_.edits, fmt::format("{}", n(0)));
        if (c.numbers.size() == 2)
            light.factor = static_cast<float>(n(1));
        else if (c.name == "light")
            light.color = vec3(triple), light.temperature.reset();
        else if (c.name == "place")
            light.position = triple;
        else
            light.direction = unit_direction(triple);
    }
    if (c.name == "tint") session_.edits.environment_tint = vec3(n(0), n(1), n(2));
    if (c.name == "clay") session_.edits.clay = c.on();
    if (c.name == "preview") session_.modes.preview = preview_named(c.words[0]), session_.modes.denoise = false;
    if (c.name == "denoise") {
        constexpr std::array<std::string_view, 3> kNames = {"off", "preview", "always"};
        const auto known = std::ranges::find(kNames, c.words[0]);
        if (known == kNames.end())
            throw Error("denoise", "unknown choice '{}'; valid are {}", c.words[0], fmt::join(kNames, ", "));
        session_.set_denoising(static_cast<Denoising>(known - kNames.begin()));
    }
    if (c.name == "clamp") session_.modes.clamp = static_cast<float>(n(0));
    if (c.name == "lamps") session_.modes.show_lamps = c.on();
    if (c.name == "backfaces") session_.modes.backfaces = settings_with("backfaces", c.words[0]).backfaces;
    if (c.name == "region") {
        const auto whole = [&](std::size_t i) { return static_cast<int>(n(i)); };
        const auto region =
            c.numbers.empty() ? std::nullopt : region_of({{whole(0), whole(1)}, {whole(2), whole(3)}}, picture_size_);
        if (!region && !c.numbers.empty()) throw Error("region", "has no pixels of the picture");
        set_region(region);
    }
    if (c.name == "measure") session_.measure = c.on();
    if (c.name == "culling") session_.culling = settings_with("culling", c.words[0]).culling;
    if (c.name == "section") {
        const auto known = std::ranges::find(sections(), c.words[0], &Section::name);
        if (known == sections().end()) throw Error("section", "there is no section '{}'", c.words[0]);
        section_ = c.words[0];
    }
    if (c.name == "bounces") session_.bounces = static_cast<int>(n(0));
    if (c.name == "bookmark") session_.bookmark(c.words[0]);
    if (c.name == "recall") session_.recall(c.words[0]);
    if (c.name == "save") {
        const std::string file = session_.settings_file().string();
        if (settings_changed()) throw Error(file, "another program has changed it since it was read, so it is kept");
        save(file);
    }
    if (c.name == "quit") quit_ = true;
    if (c.name == "screenshot") {
        update_picture(), frame();  // shows the latest changes
        screenshot(c.words[0]);
    }
    if (c.name == "window") {
        update_picture(), frame();  // panels need a frame to find their sizes
        frame(c.words[0]);
    }
    if (c.name == "timings") {
        write_file(c.words[0], timings_.json().dump(2) + "\n");
        timings_.reset();
    }
}

}  // namespace halflight::view
