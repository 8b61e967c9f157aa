#include "api/sequence/frame_maker.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "api/sequence/statistics_file.h"
#include "engine/core/interruption.h"
#include "engine/core/steps.h"
#include "engine/core/stopwatch.h"
#include "engine/gpu/context.h"

namespace halflight {

FrameMaker::FrameMaker(LoadedScene& scene, const RenderSettings& settings, const RendererOptions& renderer,
                       const SequenceOptions& options, const SequenceEvents& events, const Log& log,
                       const FrameFiles& files, const FileClaims* claims)
    : options_(options),
      events_(events),
      log_(log),
      files_(files),
      requested_view_(settings.view),
      scene_(scene),
      warnings_(scene),
      noisy_files_(noisy_files(claims)),
      renderer_(scene, settings, with_files(renderer)) {
    log_.note("{} x {} pixels, camera {}, on {}", settings.width, settings.height, scene.chosen_camera().origin,
              renderer_.context().renderer());
}

FrameMaker::~FrameMaker() {
    renderer_.context().make_current();  // the developer needs it
}

void FrameMaker::make(FrameNumber frame, Movie* movie) {
    Stopwatch clock;
    StepTimes times;
    const Interruptible stops([&] {
        if (events_.go_on && !events_.go_on()) throw Stopped();
    });
    const StepWatch programs([](const char*, int) { interruption_point(); });
    const auto go_on = [](double) {
        interruption_point();
        return true;
    };
    const std::optional<std::filesystem::path> exr = files_.developable(frame);
    if (!exr) renderer_.find_estimator(go_on);
    renderer_.find_exposure(go_on);
    if (!exposure_noted_) {
        note_exposure(requested_view_, renderer_.settings(), scene_, log_);
        if (noisy_files_ && requested_view_.metered() && !renderer_.settings().view.metered())
            noisy_files_->set_exposure(renderer_.settings().view.exposure.stops);
    }
    exposure_noted_ = true;
    if (exr) return develop(frame, *exr, movie);
    const RenderResult result = renderer_.render(
        frame, [&](const RenderProgress& progress) { return !events_.progress || events_.progress(frame, progress); });
    times.load = renderer_.load_seconds();
    times.render = clock.lap() - times.load;
    if (result.stats.interrupted) throw Stopped();
    warnings_.tell(renderer_.scene(), log_);
    if (result.stats.biases != logged_biases_) {
        for (const std::string& bias : result.stats.biases) log_.note("biased: {}", bias);
        logged_biases_ = result.stats.biases;
    }
    if (const std::string& problem = renderer_.checkpoint_problem(); !problem.empty())
        log_.warn("frame {}: samples are not saved: {}", frame, problem);
    const std::vector<std::filesystem::path> outputs = pictures_of(options_, frame);
    const std::string error = judge(result.stats, options_.output, main_file(options_, frame), log_);
    if (movie) movie->add(result.view);

    const auto write = [&] {
        PictureInfo info = this->info(result, error);
        files_.add_fingerprints(frame, info);
        write_pictures(outputs, result, info, log_);
        times.write = clock.lap();
        times.total = clock.seconds();
        if (!options_.stats) return;
        nlohmann::ordered_json line{{"frame", frame}, {"time", scene_.time_of(frame)}};
        line.update(run_statistics(renderer_, result.stats, times, outputs));
        append_line(*options_.stats, line_of(line));
    };
    events_.writing ? events_.writing(write) : write();
    renderer_.remove_checkpoint(frame);
}

void FrameMaker::develop(FrameNumber frame, const std::filesystem::path& exr, Movie* movie) {
    renderer_.context().make_current();
    if (!developer_) developer_.emplace(renderer_.context(), renderer_.colors(), renderer_.settings(), options_.output);
    const RenderResult result = developer_->develop(exr);
    if (movie) movie->add(result.view);
    const auto write = [&] {
        PictureInfo info = this->info(result, "");
        info.frame = frame;
        files_.add_fingerprints(frame, info);
        write_pictures(files_.missing_pictures(frame), result, info, log_);
        if (options_.stats)
            append_line(*options_.stats, line_of({{"frame", frame},
                                                  {"time", scene_.time_of(static_cast<double>(frame))},
                                                  {"developed", exr.string()}}));
    };
    events_.writing ? events_.writing(write) : write();
}

std::shared_ptr<NoisyFiles> FrameMaker::noisy_files(const FileClaims* claims) {
    const bool shared = claims && files_.denoises_near();
    if (!files_.keeps_noisy() && !shared) return nullptr;
    return std::make_shared<NoisyFiles>(
        NoisyFiles::Options{.picture = [this](FrameNumber n) { return main_file(options_, n); },
                            .sums = files_.sums(),
                            .edits = files_.edits(),
                            .reach = files_.reach(),
                            .keep = files_.keeps_noisy(),
                            .overwrite = options_.overwrite,
                            .accept_sources = options_.accept_sources,
                            .pattern = claims ? options_.outputs[0] : "",
                            .sequence = claims,
                            .compression = lossless(options_.output.exr.compression),
                            .listed = [this](FrameNumber n) { return files_.listed(n); },
                            .info = [this](const RenderResult& result) { return info(result, ""); }});
}

RendererOptions FrameMaker::with_files(RendererOptions renderer) const {
    renderer.noisy_files = noisy_files_;
    return renderer;
}

PictureInfo FrameMaker::info(const RenderResult& result, const std::string& error) const {
    PictureInfo info = picture_info(renderer_, result, options_.output, error);
    info.frame_rate = scene_.frame_rate();
    info.frame = renderer_.settings().frame;
    return info;
}

}  // namespace halflight
