// Opening of files, and playing of animations.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <utility>

#include "tools/view/viewer.h"

namespace halflight::view {
namespace {

/// Returns whether the light may differ by many stops. The controls of a sky or of a colour change brightness on
/// purpose.
bool of_other_kind(const EnvironmentChoice& before, const EnvironmentChoice& now) {
    const bool has_controls = std::holds_alternative<ClearSky>(now) || std::holds_alternative<vec3>(now);
    return !(before == now) && !(has_controls && before.index() == now.index());
}

}  // namespace

void Viewer::open_dropped_files() {
    for (auto& path : window_.dropped()) to_open_.push_back(std::move(path));
    finish_opening();
    open_next();
}

void Viewer::start_opening(const std::string& activity, std::function<Session::Opened()> opening, bool of_file) {
    const auto task = std::make_shared<std::packaged_task<Session::Opened()>>(std::move(opening));
    opening_ = task->get_future();
    thread_.perform(
        activity, [task] { (*task)(); }, !of_file);
}

void Viewer::open_next() {
    if (opening_.valid() || unsaved_prompt_.asking()) return;
    if (!to_open_.empty()) {
        const std::filesystem::path path = std::move(to_open_.front());
        to_open_.pop_front();
        const bool scene = has_extension(path, "glb") || has_extension(path, "gltf");
        if (scene && !may_lose_edits("another scene is opened", [this, path] { to_open_.push_front(path); })) return;
        opening_name_ = path.filename().string();
        attempt([&] {
            auto opening = session_.opening(path);
            start_opening(fmt::format("loading {}", path.filename().string()),
                          scene ? finding_files(path, std::move(opening)) : std::move(opening), true);
        });
        return;
    }
    if (next_change_) {
        opening_name_.clear();
        const auto change = std::exchange(next_change_, {});
        return attempt([&] { change(); });
    }
    if (takes_input() && reload_changed() && opening_.valid()) return;
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
        before_click_.reset();
        const bool restores = std::exchange(restoring_, false);
        const bool pose_only = std::exchange(opening_pose_, {}).has_value();
        const bool plays = pose_only && std::exchange(plays_next_, false);  // also ends if opening fails
        const std::optional<Play> going_on = std::exchange(play_, {});      // restored unless opening fails
        const bool reloads = std::exchange(reloading_, false);
        const std::shared_ptr<const FileWatch> found = std::exchange(finding_, {});
        const auto opened_result = [&] {
            if (!reloads) return std::optional(opening_.get());
            try {
                return std::optional(opening_.get());
            } catch (const std::exception& error) {  // a file that is being written ends no script
                play_ = going_on;
                watch_.add(*found);
                tell_outdated("scene", error.what());
                return std::optional<Session::Opened>();
            }
        };
        attempt([&] {
            std::optional<Session::Opened> result = opened_result();
            if (!result) return;
            Session::Opened& opened = *result;
            if (opened.start)
                next_pose_.reset();  // drops a frame request for the previous file
            else
                play_ = going_on;
            plays_next_ &= next_pose_.has_value();
            pose_pending_ = true;
            const bool other_scene = opened.start.has_value();
            const std::vector<std::string> cameras = session_.references().cameras;
            const EnvironmentChoice light = session_.environment();
            session_.open(std::move(opened));
            if (found) named_ = found;
            if (!pose_only) watch_files();
            if (reloads) {
                outdated_.erase("scene");
                first_of_scene_ = request_ + 1;
                if (session_.references().cameras != cameras) view_history_.start(session_.view());
                tell(session_.warning().empty() ? fmt::format("{} was loaded anew", session_.file().filename().string())
                                                : session_.warning(),
                     "reload");
            }
            if (other_scene) {
                outdated_.clear();
                edit_history_.start(session_.document());
                saving_.clear();  // the settings that wait to be saved belong to the scene before
                for (const auto& [path, all_layers] : std::exchange(waiting_pictures_, {}))
                    toasts_.fail(fmt::format("{} was not saved: another scene was opened", path.string()), now());
                metered_.clear();
                first_metered_ = first_of_scene_ = request_ + 1;
                view_history_.start(session_.view());
                navigation_.suit(session_);
            } else if (!restores && of_other_kind(light, session_.environment()) && has_metered_exposure()) {
                meter_again(request_ + 1);
            }
            const std::string name = std::exchange(opening_name_, {});
            if (!pose_only && !name.empty()) tell(fmt::format("Opened {}", name));
            if (other_scene) tell_of_settings();
            if (plays) set_playing(true);
        });
    }
    return !opening_.valid() && to_open_.empty() && !next_pose_ && !next_change_;
}

void Viewer::set_playing(bool on) {
    play_.reset();
    if (on && session_.timeline().runs()) play_ = {now(), session_.timeline().frame};
}

void Viewer::advance_playback() {
    if (!play_) return;
    const Timeline& t = session_.timeline();
    if (!t.runs() || thread_.status().failed == request_) return set_playing(false);
    if (finish_opening() && play_ && !pose_pending_) {
        const double passed = std::floor((now() - play_->since) * t.rate.numerator / t.rate.denominator);
        const auto due = static_cast<FrameNumber>(std::fmod(std::max<double>(play_->first, 0) + passed, t.last + 1.0));
        if (due != t.frame) next_pose_ = {t.animation, due};
    }
    open_next();
}

FrameNumber Viewer::next_frame() const {
    return next_pose_ ? next_pose_->frame : opening_pose_ ? opening_pose_->frame : session_.timeline().frame;
}

}  // namespace halflight::view
