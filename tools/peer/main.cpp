// halflight-peer: the same picture by Halflight and by Cycles, in turns: agreement, paths per second, error times time.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
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

/// A converged picture: the mean of two independent ones. Half their difference has its noise, whatever the samplers
/// correlate.
struct Reference {
    Image mean;
    Image noise;
    double error = 0;  // mean squared noise
};

Reference mean_of_two(const Image& a, const Image& b) {
    Reference r{Image(a.width, a.height, 3), Image(a.width, a.height, 3), 0};
    for (int y = 0; y < a.height; ++y)
        for (int x = 0; x < a.width; ++x)
            for (int c = 0; c < 3; ++c) {
                r.mean.at(x, y)[c] = 0.5f * (a.at(x, y)[c] + b.at(x, y)[c]);
                r.noise.at(x, y)[c] = 0.5f * (a.at(x, y)[c] - b.at(x, y)[c]);
            }
    r.error = squared_error(r.noise, Image(a.width, a.height, 3), 0);
    return r;
}

class Ours {
  public:
    Ours(const Options& options) : options_(options), scene_(load_gltf(options.scene)) {
        if (scene_.cameras.empty()) throw Error(options.scene, "has no camera");
        camera_ = scene_.cameras.front();
        for (const Camera& c : scene_.cameras)
            if (c.name == options.cycles.camera) camera_ = c;
    }

    RenderResult render(int samples, std::uint32_t seed) {
        RenderSettings s;
        s.width = options_.cycles.width, s.height = options_.cycles.height;
        s.camera = camera_;
        s.samples = samples, s.bounces = options_.cycles.reflections, s.seed = seed;
        return Renderer(context_, scene_, colors_, s).render();
    }

  private:
    const Options& options_;
    gpu::Context context_ = gpu::Context::create({});
    Scene scene_;
    ColorConfig colors_ = ColorConfig::load();
    Camera camera_;
};

double block_mean(const Image& image, int left, int top, int block) {
    double sum = 0;
    for (int y = top; y < top + block; ++y)
        for (int x = left; x < left + block; ++x)
            for (int c = 0; c < 3; ++c) sum += image.at(x, y)[c];
    return sum / (3.0 * block * block);
}

/// Means over blocks of pixels, and their differences beside the standard error that the noise of both sides gives a
/// block.
void print_agreement(const Reference& ours, const Reference& theirs, int block) {
    double worst = 0, variance = 0;
    std::vector<double> differences;
    for (int top = 0; top + block <= ours.mean.height; top += block) {
        for (int left = 0; left + block <= ours.mean.width; left += block) {
            const double mean = block_mean(ours.mean, left, top, block);
            if (mean <= 0) continue;
            differences.push_back(std::abs(block_mean(theirs.mean, left, top, block) / mean - 1));
            worst = std::max(worst, differences.back());
            for (const Image* noise : {&ours.noise, &theirs.noise})
                variance += std::pow(block_mean(*noise, left, top, block) / mean, 2);
        }
    }
    const double error = std::sqrt(variance / static_cast<double>(differences.size()));
    const auto beyond =
        std::count_if(differences.begin(), differences.end(), [&](double d) { return d > 0.02 + error; });
    fmt::print(
        "agreement: Cycles' mean is {:+.3f} % of ours; {} blocks of {}x{} differ by {:.2f} % in the median, {:.2f} % "
        "at most, "
        "with a standard error of {:.2f} %; {} by more than 2 % plus that\n",
        100 * (mean_of(theirs.mean) / mean_of(ours.mean) - 1), differences.size(), block, block,
        100 * median(differences), 100 * worst, 100 * error, beyond);
}

std::string spread(const std::vector<double>& v) {
    return fmt::format("{:.4g} [{:.4g}, {:.4g}]", median(v), quantile(v, 0), quantile(v, 1));
}

void compare(const Options& options) {
    Ours ours(options);
    const int many = options.reference_samples;
    const Reference reference = mean_of_two(ours.render(many, 1001).beauty, ours.render(many, 1002).beauty);
    const auto cycles = [&](int cycles_samples, int seed) {
        CyclesSettings settings = options.cycles;
        settings.samples = cycles_samples, settings.seed = seed;
        return render_with_cycles(options.scene, settings);
    };
    const Reference peer_reference = mean_of_two(cycles(many, 1001).image, cycles(many, 1002).image);
    print_agreement(reference, peer_reference, options.block);

    // Each side's error is measured against its own converged picture, so that no difference of models counts as noise.
    const int samples = options.cycles.samples;
    const double paths = 1.0 * options.cycles.width * options.cycles.height * samples;
    std::vector<double> our_rate, their_rate, rate_ratio, our_cost, their_cost, cost_ratio;
    for (int i = 0; i < options.repeats; ++i) {
        const auto seed = static_cast<std::uint32_t>(i + 1);
        const RenderResult a = ours.render(samples, seed);
        const CyclesRun b = cycles(samples, i + 1);
        our_rate.push_back(paths / a.stats.render_seconds);
        their_rate.push_back(paths / b.seconds);
        rate_ratio.push_back(our_rate.back() / their_rate.back());
        our_cost.push_back(squared_error(a.beauty, reference.mean, reference.error) * a.stats.render_seconds);
        their_cost.push_back(squared_error(b.image, peer_reference.mean, peer_reference.error) * b.seconds);
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
    app.add_option("--reference-samples", o.reference_samples,
                   "of each of the two pictures whose mean errors are measured against")
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
