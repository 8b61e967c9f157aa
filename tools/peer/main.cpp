// halflight-peer: the same picture by Halflight and by Cycles, in turns: agreement, paths per second, error times time.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/statistics.h"
#include "engine/gpu/context.h"
#include "engine/io/gltf.h"
#include "passes/render.h"
#include "tools/peer/cycles.h"

namespace halflight {
namespace {

struct Options {
    std::string scene;
    CyclesSettings cycles;
    int repeats = 5;
    int reference_samples = 1024;
    int block = 16;
};

/// Mean squared error over pixels and channels, less what the noise of the reference adds.
double squared_error(const Image& image, const Image& reference, double reference_error) {
    double sum = 0;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            for (int c = 0; c < 3; ++c) sum += std::pow(double{image.at(x, y)[c]} - reference.at(x, y)[c], 2);
    return sum / (3.0 * image.width * image.height) - reference_error;
}

double mean_of(const Image& image) {
    double sum = 0;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            for (int c = 0; c < 3; ++c) sum += image.at(x, y)[c];
    return sum / (3.0 * image.width * image.height);
}

/// A high-quality picture of ours and the variance of its pixels.
struct Reference {
    Image mean;
    Image variance;    // of the mean
    double error = 0;  // mean of the variance
};

class Ours {
  public:
    Ours(const Options& options) : options_(options), scene_(load_gltf(options.scene)) {
        if (scene_.cameras.empty()) throw Error(options.scene, "has no camera");
        camera_ = scene_.cameras.front();
        for (const Camera& c : scene_.cameras)
            if (c.name == options.cycles.camera) camera_ = c;
    }

    RenderResult render(int samples, std::uint32_t seed, bool variance) {
        RenderSettings s;
        s.width = options_.cycles.width, s.height = options_.cycles.height;
        s.camera = camera_;
        s.samples = samples, s.bounces = options_.cycles.reflections, s.seed = seed;
        if (variance) s.aovs = {"variance"};
        return Renderer(context_, scene_, colors_, s).render();
    }

    Reference reference() {
        RenderResult r = render(options_.reference_samples, 0x5eed, true);
        Reference reference{std::move(r.beauty), std::move(r.aovs.front().image)};
        reference.error = mean_of(reference.variance);
        return reference;
    }

  private:
    const Options& options_;
    gpu::Context context_ = gpu::Context::create({});
    Scene scene_;
    ColorConfig colors_ = ColorConfig::load();
    Camera camera_;
};

/// Mean over `block` x `block` pixels and its difference from the peer's, beside the standard error of the two.
void print_agreement(const Reference& ours, const Image& theirs, int samples_ours, int samples_theirs, int block) {
    const double difference = mean_of(theirs) / mean_of(ours.mean) - 1;
    double worst = 0, worst_beyond = -1;
    int blocks = 0, beyond = 0;
    for (int top = 0; top + block <= theirs.height; top += block) {
        for (int left = 0; left + block <= theirs.width; left += block, ++blocks) {
            double a = 0, b = 0, variance = 0;
            for (int y = top; y < top + block; ++y)
                for (int x = left; x < left + block; ++x)
                    for (int c = 0; c < 3; ++c) {
                        a += ours.mean.at(x, y)[c], b += theirs.at(x, y)[c];
                        // Channels of a sample go together: three of them, not independent, and the peer's noise like
                        // ours.
                        variance += 3 * ours.variance.at(x, y)[c] * (1 + 1.0 * samples_ours / samples_theirs);
                    }
            const double relative = a > 0 ? std::abs(b / a - 1) : 0, error = a > 0 ? std::sqrt(variance) / a : 0;
            worst = std::max(worst, relative);
            worst_beyond = std::max(worst_beyond, relative - error);
            beyond += relative > 0.02 + 2 * error;
        }
    }
    fmt::print(
        "agreement: Cycles' mean is {:+.3f} % of ours; {} blocks of {}x{}: greatest difference {:.2f} %, less its "
        "standard "
        "error {:.2f} %; {} blocks beyond 2 % and two standard errors\n",
        100 * difference, blocks, block, block, 100 * worst, 100 * worst_beyond, beyond);
}

std::string spread(const std::vector<double>& v) {
    return fmt::format("{:.4g} [{:.4g}, {:.4g}]", median(v), quantile(v, 0), quantile(v, 1));
}

void compare(const Options& options) {
    Ours ours(options);
    const Reference reference = ours.reference();
    CyclesSettings many = options.cycles;
    many.samples = options.reference_samples;
    many.seed = 99;
    const Image peer_reference = render_with_cycles(options.scene, many).image;
    print_agreement(reference, peer_reference, options.reference_samples, options.reference_samples, options.block);

    // Each side's error is measured against its own converged picture, so that no difference of models counts as noise.
    const int samples = options.cycles.samples;
    const double paths = 1.0 * options.cycles.width * options.cycles.height * samples;
    std::vector<double> our_rate, their_rate, rate_ratio, our_cost, their_cost, cost_ratio;
    ours.render(1, 0, false);  // warm
    for (int i = 0; i < options.repeats; ++i) {
        const auto seed = static_cast<std::uint32_t>(i + 1);
        const RenderResult a = ours.render(samples, seed, false);
        CyclesSettings settings = options.cycles;
        settings.seed = i + 1;
        const CyclesRun b = render_with_cycles(options.scene, settings);
        our_rate.push_back(paths / a.stats.render_seconds);
        their_rate.push_back(paths / b.seconds);
        rate_ratio.push_back(our_rate.back() / their_rate.back());
        our_cost.push_back(squared_error(a.beauty, reference.mean, reference.error) * a.stats.render_seconds);
        their_cost.push_back(squared_error(b.image, peer_reference, reference.error) * b.seconds);
        cost_ratio.push_back(their_cost.back() / our_cost.back());
        fmt::print("run {}: {:.3f} s, {:.3f} s\n", i + 1, a.stats.render_seconds, b.seconds);
        std::fflush(stdout);
    }
    fmt::print("median [least, greatest] of {} runs in turns, {} samples\n", options.repeats, samples);
    fmt::print("  paths per second     ours {}   Cycles {}   ours / Cycles {}\n", spread(our_rate), spread(their_rate),
               spread(rate_ratio));
    fmt::print("  MSE x seconds        ours {}   Cycles {}   Cycles / ours {}\n", spread(our_cost), spread(their_cost),
               spread(cost_ratio));
}

int run(int argc, char** argv) {
    Options o;
    CLI::App app("The same picture by Halflight and by Blender's Cycles, in turns.");
    app.add_option("SCENE", o.scene, "glTF scene with a camera")->required();
    app.add_option("--script", o.cycles.script, "Cycles' script: SCENE OUT.exr --spp --size --bounces --seed")
        ->required();
    app.add_option("--camera", o.cycles.camera, "camera's name (first one)");
    app.add_option("--width", o.cycles.width, "pixels")->capture_default_str();
    app.add_option("--height", o.cycles.height, "pixels")->capture_default_str();
    app.add_option("--samples", o.cycles.samples, "of each timed picture")->capture_default_str();
    app.add_option("--bounces", o.cycles.reflections, "reflections along a path")->capture_default_str();
    app.add_option("--repeats", o.repeats, "timed pairs")->capture_default_str();
    app.add_option("--reference-samples", o.reference_samples, "of the pictures that errors are measured against")
        ->capture_default_str();
    app.add_option("--block", o.block, "side of the blocks whose means are compared, pixels")->capture_default_str();
    CLI11_PARSE(app, argc, argv);
    try {
        compare(o);
    } catch (const Error& e) {
        fmt::print(stderr, "halflight-peer: {}\n", e.what());
        return 1;
    }
    return 0;
}

}  // namespace
}  // namespace halflight

int main(int argc, char** argv) {
    return halflight::run(argc, argv);
}
