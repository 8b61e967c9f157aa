// halflight-peer: the same picture by Halflight and by Cycles, in turns: agreement, paths per second, error times time.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/image_tools.h"
#include "engine/core/statistics.h"
#include "engine/gpu/context.h"
#include "engine/io/files.h"
#include "engine/io/gltf/gltf.h"
#include "engine/io/png.h"
#include "renderer/render.h"
#include "tools/common/tool_main.h"
#include "tools/measure/peer/agreement.h"
#include "tools/measure/peer/cycles.h"
#include "tools/measure/peer/report.h"

namespace halflight::peer {
namespace {

// What agreement means: relative difference of the whole picture, and of a block beside one standard error.
constexpr double kWholeTolerance = 0.01;
constexpr double kBlockTolerance = 0.02;

struct Options {
    std::string scene;
    CyclesSettings cycles;
    std::string estimator;
    int repeats = 5;
    int reference_seeds = 8;
    int reference_samples = 256;
    int block = 16;  // pixels
    bool check = false;
    std::string picture;
    std::string json;
};

class Ours {
  public:
    Ours(const Options& options) : options_(options), scene_(load_gltf(options.scene)) {
        if (!options.estimator.empty()) estimator_ = estimator_named(options.estimator);
        if (scene_.cameras.empty()) throw Error(options.scene, "has no camera");
        if (!scene_.environment.black())
            throw Error(options.scene, "has an environment, which the script is not told of; converge --external can");
        camera_ = scene_.cameras.front();
        for (const Camera& c : scene_.cameras)
            if (c.name == options.cycles.camera) camera_ = c;
    }

    const std::string& camera() const { return camera_.name; }

    RenderResult render(int samples, std::uint32_t seed) {
        RenderSettings s;
        s.width = options_.cycles.width, s.height = options_.cycles.height;
        s.camera = camera_;
        s.samples = samples, s.bounces = options_.cycles.reflections, s.seed = seed;
        s.estimator = estimator_;
        return Renderer(context_, scene_, colors_, s).render();
    }

  private:
    const Options& options_;
    gpu::Context context_ = gpu::Context::create({});
    Scene scene_;
    ColorConfig colors_ = ColorConfig::load();
    Camera camera_;
    Estimator estimator_;
};

CyclesRun cycles(const Options& options, int samples, int seed) {
    CyclesSettings settings = options.cycles;
    settings.samples = samples, settings.seed = seed;
    return render_with_cycles(options.scene, settings);
}

std::string spread(const std::vector<double>& v) {
    return fmt::format("{:.4g} [{:.4g}, {:.4g}]", median(v), quantile(v, 0), quantile(v, 1));
}

/// Agreement of converged pictures, and these.
struct Ground {
    Converged ours;
    Converged theirs;
    Agreement agreement;
};

Ground measure_agreement(const Options& options, Ours& ours) {
    std::vector<Image> mine, theirs;
    for (int i = 0; i < options.reference_seeds; ++i) {
        const int seed = 1001 + i;  // none of the timed pictures'
        mine.push_back(rgb(ours.render(options.reference_samples, static_cast<std::uint32_t>(seed)).beauty));
        theirs.push_back(cycles(options, options.reference_samples, seed).image);
    }
    return {converge(mine), converge(theirs), compare(mine, theirs, options.block, kBlockTolerance)};
}

/// Each side's error is measured against its own converged picture, so that no difference of models counts as noise.
nlohmann::json measure_speed(const Options& options, Ours& ours, const Ground& ground) {
    const int samples = options.cycles.samples;
    const double paths = 1.0 * options.cycles.width * options.cycles.height * samples;
    const auto cost = [](const Image& image, const Converged& truth, double seconds) {
        return (mean_squared_error(image, truth.mean) - truth.squared_error) * seconds;
    };
    std::vector<double> our_rate, their_rate, rate_ratio, our_cost, their_cost, cost_ratio;
    for (int i = 0; i < options.repeats; ++i) {
        const RenderResult a = ours.render(samples, static_cast<std::uint32_t>(i + 1));
        const CyclesRun b = cycles(options, samples, i + 1);
        our_rate.push_back(paths / a.stats.render_seconds);
        their_rate.push_back(paths / b.seconds);
        rate_ratio.push_back(our_rate.back() / their_rate.back());
        our_cost.push_back(cost(rgb(a.beauty), ground.ours, a.stats.render_seconds));
        their_cost.push_back(cost(b.image, ground.theirs, b.seconds));
        cost_ratio.push_back(their_cost.back() / our_cost.back());
        fmt::print("run {}: {:.3f} s, {:.3f} s\n", i + 1, a.stats.render_seconds, b.seconds);
        std::fflush(stdout);
    }
    fmt::print("median [least, greatest] of {} runs in turns, {} samples\n", options.repeats, samples);
    fmt::print("  paths per second     ours {}   Cycles {}   ours / Cycles {}\n", spread(our_rate), spread(their_rate),
               spread(rate_ratio));
    fmt::print("  MSE x seconds        ours {}   Cycles {}   Cycles / ours {}\n", spread(our_cost), spread(their_cost),
               spread(cost_ratio));
    return {{"samples", samples},
            {"paths_per_second", {{"ours", our_rate}, {"cycles", their_rate}, {"ours_by_cycles", rate_ratio}}},
            {"mse_seconds", {{"ours", our_cost}, {"cycles", their_cost}, {"cycles_by_ours", cost_ratio}}}};
}

/// Returns whether the pictures agree as asked.
bool measure(Options options) {
    Ours ours(options);
    options.cycles.camera = ours.camera();  // Blender's first one is another: it sorts them by name
    const Ground ground = measure_agreement(options, ours);
    const Agreement& agreement = ground.agreement;
    fmt::print("agreement of {} pictures of {} samples each\n{}", options.reference_seeds, options.reference_samples,
               text(agreement));
    std::fflush(stdout);
    const bool agree = std::abs(agreement.whole.relative) <= kWholeTolerance && agreement.beyond == 0;
    if (!options.picture.empty()) {
        write_png(options.picture, picture(ground.ours.mean, ground.theirs.mean, agreement,
                                           ColorConfig::load().view({}), 2 * kBlockTolerance));
    }
    nlohmann::json report = {{"schema", 1},
                             {"scene", options.scene},
                             {"width", options.cycles.width},
                             {"height", options.cycles.height},
                             {"imported_metals", options.cycles.imported_metals},
                             {"reference_seeds", options.reference_seeds},
                             {"reference_samples", options.reference_samples},
                             {"agreement", json(agreement)}};
    report["agreement"]["agree"] = agree;
    if (options.repeats > 0) report["speed"] = measure_speed(options, ours, ground);
    if (!options.json.empty()) write_file(options.json, report.dump(2) + '\n');
    return agree;
}

int run(int argc, char** argv) {
    Options o;
    CLI::App app("The same picture by Halflight and by Blender's Cycles, in turns.", "halflight-peer");
    app.add_option("SCENE", o.scene, "glTF scene with a camera")->required();
    app.add_option("--script", o.cycles.script, "Cycles' script: SCENE OUT.exr --spp --size --bounces --seed")
        ->required();
    app.add_option("--camera", o.cycles.camera, "camera's name (first one)");
    app.add_option("--width", o.cycles.width, "pixels")->capture_default_str();
    app.add_option("--height", o.cycles.height, "pixels")->capture_default_str();
    app.add_option("--samples", o.cycles.samples, "of each timed picture")->capture_default_str();
    app.add_option("--bounces", o.cycles.reflections, "reflections along a path")->capture_default_str();
    app.add_option("--estimator", o.estimator, "our techniques: " + known_estimators());
    app.add_option("--repeats", o.repeats, "timed pairs; 0: the agreement only")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
    app.add_option("--reference-seeds", o.reference_seeds,
                   "pictures of each, whose means are compared and whose scatter tells the standard errors")
        ->check(CLI::Range(2, 50))
        ->capture_default_str();
    app.add_option("--reference-samples", o.reference_samples, "of each of these pictures")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    app.add_option("--block", o.block, "side of the blocks whose means are compared, pixels")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    app.add_flag("--imported-metals", o.cycles.imported_metals,
                 "metals as Blender imports them: another model, but the one to time");
    app.add_flag("--check", o.check,
                 "fail where the whole picture differs by more than 1 %, or a block by more than 2 % and "
                 "its standard error");
    app.add_option("--picture", o.picture, "PNG of ours, Cycles', and the difference by pixel and block, +-4 %");
    app.add_option("--json", o.json, "a file for the figures");
    return tool_main(app, argc, argv, [&] {
        if (!measure(o) && o.check) throw Error(o.scene, "the renderers do not agree");
        return 0;
    });
}

}  // namespace
}  // namespace halflight::peer

int main(int argc, char** argv) {
    return halflight::peer::run(argc, argv);
}
