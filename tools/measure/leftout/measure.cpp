#include "tools/measure/leftout/measure.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "engine/core/image_tools.h"
#include "engine/core/statistics.h"
#include "renderer/settings_check.h"

namespace halflight::leftout {
namespace {

using Json = nlohmann::ordered_json;

bool same_pictures(const RenderResult& a, const RenderResult& b) {
    return same_bits(a.beauty, b.beauty) &&
           std::ranges::equal(a.aovs, b.aovs, [](const auto& x, const auto& y) { return same_bits(x.image, y.image); });
}

/// Makes the pictures of one side.
class Runner {
  public:
    Runner(Side& side, RenderSettings settings, const Kept& kept) : side_(side), settings_(std::move(settings)) {
        settings_.kept = kept;
    }

    void start(gpu::Context& context, const Scene& scene, const ColorConfig& colors) {
        renderer_.reset();
        side_.prepare_seconds.push_back(
            bench::time_of([&] { renderer_.emplace(context, scene, colors, settings_); }).cpu);
        side_.compile_seconds.push_back(bench::time_of([&] { last_ = renderer_->render(); }).cpu);
        side_.bytes = last_.stats.gpu_bytes;
        side_.left_out = last_.stats.left_out;
    }
    void take_turn() {
        const Seconds seconds = bench::time_of([&] { last_ = renderer_->render(); });
        side_.sample_seconds.push_back(seconds.cpu / settings_.samples);
    }
    void end() {
        for (double& seconds : side_.compile_seconds) seconds -= settings_.samples * median(side_.sample_seconds);
    }
    const RenderResult& last() const { return last_; }

  private:
    Side& side_;
    RenderSettings settings_;
    std::optional<Renderer> renderer_;
    RenderResult last_;
};

Json both(const std::vector<double>& lean, const std::vector<double>& kept) {
    return {{"lean", lean}, {"kept", kept}};
}

}  // namespace

std::vector<std::string> Comparison::added() const {
    std::vector<std::string> names;
    for (const LeftOut& part : lean.left_out)
        if (std::ranges::find(kept.left_out, part.what, &LeftOut::what) == kept.left_out.end())
            names.push_back(part.what);
    return names;
}

bench::Quartiles Comparison::time_ratio() const {
    return bench::speedup(lean.sample_seconds, kept.sample_seconds);
}

Comparison compare(gpu::Context& context, const Scene& scene, const ColorConfig& colors, const Kept& kept,
                   const Settings& settings, const std::function<void()>& between) {
    if (!kept_problem(kept).empty()) return {};  // a part that cannot be kept by its name
    RenderSettings picture;
    picture.width = settings.width, picture.height = settings.height;
    picture.camera = scene.cameras.empty() ? framing_camera(scene) : scene.cameras.front();
    picture.samples = settings.samples;
    picture.culling = rays::Culling::off;

    Comparison comparison;
    Runner lean(comparison.lean, picture, {}), with(comparison.kept, picture, kept);
    const auto in_turns = [&](int times, auto&& act) {
        for (int i = 0; i < times; ++i) {
            for (Runner* runner : {i % 2 == 0 ? &lean : &with, i % 2 == 0 ? &with : &lean}) {
                between();
                act(*runner);
            }
        }
    };
    in_turns(settings.starts, [&](Runner& runner) { runner.start(context, scene, colors); });
    if (comparison.added().empty()) return comparison;
    in_turns(settings.turns, [](Runner& runner) { runner.take_turn(); });
    lean.end();
    with.end();
    comparison.same_bits = same_pictures(lean.last(), with.last());
    return comparison;
}

Json to_json(const Comparison& c) {
    const bench::Quartiles ratio = c.time_ratio();
    return {{"seconds_per_sample", both(c.lean.sample_seconds, c.kept.sample_seconds)},
            {"time_ratio", {{"lower", ratio.lower}, {"median", ratio.median}, {"upper", ratio.upper}}},
            {"prepare_seconds", both(c.lean.prepare_seconds, c.kept.prepare_seconds)},
            {"compile_seconds", both(c.lean.compile_seconds, c.kept.compile_seconds)},
            {"bytes", {{"lean", c.lean.bytes}, {"kept", c.kept.bytes}}},
            {"same_bits", c.same_bits}};
}

}  // namespace halflight::leftout
