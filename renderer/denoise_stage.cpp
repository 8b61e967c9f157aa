#include "renderer/denoise_stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/core/image_tools.h"
#include "engine/core/stopwatch.h"
#include "engine/graph/compile.h"

namespace halflight {
namespace {

constexpr const char* kBias = "denoised: noise of reflected light filtered by non-local means";

/// Returns the circles of confusion (shaders/SHADING.md, Thin lens).
DenoiserBlur blur_of(const Camera& camera, const ivec2& picture) {
    const Lens& lens = camera.lens;
    if (!lens.blurs()) return DenoiserBlur(0);
    const double rows = picture.y / eyes_in_picture(camera.optics).y;
    const double radius = aperture_radius(camera, eye_aspect(camera.optics, picture));
    const double half = camera.orthographic ? camera.ortho_height / 2 : std::tan(camera.vertical_fov / 2);
    const double pixels = radius * rows / (2 * half), inverse = 1 / lens.focus.distance;
    return DenoiserBlur(camera.orthographic ? dvec3(pixels, 0, -pixels * inverse)
                                            : dvec3(pixels * inverse, -pixels, 0));
}

}  // namespace

DenoiseStage::DenoiseStage(gpu::ProgramCache& programs, const ivec2& size, std::optional<ViewProcessor> view,
                           bool transparent)
    : desc_{size.x, size.y, GL_RGBA32F}, view_(std::move(view)), executor_(programs), transparent_(transparent) {}

DenoiseStage::DenoiseStage(gpu::ProgramCache& programs, const RenderSettings& settings, const ColorConfig& colors,
                           const FrameNeeds& needs, const SceneNeeds& scene)
    : desc_{settings.width, settings.height, GL_RGBA32F}, executor_(programs) {
    executor_.measure(settings.measure);
    executor_.compile_ahead(true);
    transparent_ = settings.transparent;
    if (settings.want_view) view_ = colors.view(settings.view);
    const bool direct = needs.shadow || needs.continuation, indirect = needs.continuation && bounces_of(settings) > 1;
    present_ = {scene.diffuse && direct, scene.diffuse && indirect, scene.glossy && direct};
    chains_ = bool(needs.chains);
    filters_ = settings.denoise;
    if (filters_ && neighbour_frames(settings) == 0) own_.emplace(desc_, present_, chains_);
}

void DenoiseStage::begin(NoisyFrame* frame, const Camera& camera, const Band& band, const ivec2& shown) {
    has_halves_ = denoised_ = false;
    kept_ = frame;
    blur_ = blur_of(camera, band.whole());
    windows_ = denoiser_windows(camera.optics, band.whole(), {band.origin, band.origin + band.image});
    if (kept_) kept_->blur = blur_, kept_->windows = windows_, kept_->shown = shown;
    if (kept_ && !kept_->pixels) kept_->pixels.emplace(desc_, present_, chains_);
    executor_.reset_times();
}

void DenoiseStage::add_band(graph::Graph& graph, const Band& band, const Accumulated& sums, graph::TextureHandle beauty,
                            const SampleHalves& samples) {
    if (!kept_ && !own_) return;  // the frame stays noisy
    DenoiserTextures& textures = kept_ ? *kept_->pixels : *own_;
    const DenoiserPixels filled = add_denoiser_input(graph, band, sums, beauty, samples, textures.import_pixels(graph));
    for (const graph::TextureHandle h :
         {filled.mean, filled.guide, filled.reflectance, filled.diffuse_albedo, filled.glossy_albedo})
        graph.output(h);
    if (filled.glossy_guide) graph.output(filled.glossy_guide), graph.output(filled.glossy_reflectance);
    for (const LightHalves& light : filled.light)
        if (light.first) graph.output(light.first), graph.output(light.second);
    has_halves_ = has_halves_ || (samples.first > 0 && samples.first < samples.all);
}

std::optional<DenoiseStage::Made> DenoiseStage::make(
    std::span<const DenoiserWindow> windows,
    const std::function<Inputs(graph::Graph&, const DenoiserWindow&)>& inputs) {
    Made result{Image(desc_.width, desc_.height, 4), Image(desc_.width, desc_.height, 4)};
    for (const DenoiserWindow& window : windows) {
        graph::Graph graph;
        const Inputs of = inputs(graph, window);
        const DenoisedPicture made = add_denoiser(graph, of.pixels, of.neighbours);
        if (!made.weights) return std::nullopt;
        graph.output(made.picture), graph.output(made.weights);
        const graph::CompiledGraph compiled = graph::compile(graph);
        transient_bytes_ = compiled.slot_bytes;
        executor_.run(compiled);
        for (const auto& [texture, picture] :
             {std::pair(made.picture, &result.picture), std::pair(made.weights, &result.weights)}) {
            Image part(window.size.x + 2 * window.margin, window.size.y, 4);
            part.pixels = executor_.texture(texture).read_float();
            for (int y = 0; y < window.size.y; ++y)
                std::copy_n(part.at(window.margin, y), 4 * window.size.x,
                            picture->at(window.first.x, window.first.y + y));
        }
    }
    return result;
}

void DenoiseStage::apply(Film& film, bool complete) {
    if (kept_) kept_->has_halves = complete && has_halves_;
    if (kept_ || !filters_ || !complete || !has_halves_) return;
    std::optional<Made> made = make(windows_, [&](graph::Graph& graph, const DenoiserWindow& window) {
        return Inputs{add_lens_blur(graph, add_window(graph, own_->import_pixels(graph), window), blur_)};
    });
    denoised_ = made.has_value();
    if (!denoised_) return;
    film.replace_pictures(std::move(made->picture), view_ ? &*view_ : nullptr);
    if (film.wants({LayerSource::denoiser})) film.add_denoiser_weights(made->weights.pixels);
}

void DenoiseStage::fill_stats(RenderStats& stats) const {
    stats.gpu_bytes += (own_ ? own_->bytes() + transient_bytes_ : 0);
    stats.denoised = denoised_;
    if (denoised_) stats.biases.emplace_back(kBias);
    for (const graph::PassTime& t : executor_.times()) stats.passes.push_back({t.name, t.count, t.seconds});
}

void DenoiseStage::denoise(NoisyFrame& frame, std::span<const NearFrame> near, RenderResult& result) {
    const Stopwatch watch;
    executor_.reset_times();
    RenderStats& stats = result.stats;
    stats.gpu_bytes += frame.bytes();
    std::vector<const NearFrame*> used;
    for (const NearFrame& other : near) {
        stats.gpu_bytes += other.frame->bytes();
        if (other.frame->has_halves && frame.motion(other.offset) && other.frame->motion(-other.offset))
            used.push_back(&other);
    }
    const auto inputs = [&](graph::Graph& graph, const DenoiserWindow& window) {
        Inputs all{add_lens_blur(graph, add_window(graph, frame.pixels->import_pixels(graph), window), frame.blur)};
        for (const NearFrame* other : used) {
            DenoiserNeighbour neighbour{other->frame->pixels->import_pixels(graph),
                                        graph.import_texture("motion", *frame.motion(other->offset)),
                                        graph.import_texture("motion back", *other->frame->motion(-other->offset))};
            gpu::Texture *mirrored = frame.glossy_motion(other->offset),
                         *mirrored_back = other->frame->glossy_motion(-other->offset);
            if (mirrored && mirrored_back) {
                neighbour.glossy_motion = graph.import_texture("glossy motion", *mirrored);
                neighbour.glossy_motion_back = graph.import_texture("glossy motion back", *mirrored_back);
            }
            neighbour = add_window(graph, neighbour, window);
            neighbour.pixels = add_lens_blur(graph, neighbour.pixels, other->frame->blur);
            all.neighbours.push_back(neighbour);
        }
        return all;
    };
    std::optional<Made> made;
    if (frame.has_halves) made = make(frame.windows, inputs);
    const ivec2 size(result.beauty.width, result.beauty.height);
    if (made) result.beauty = part_of(made->picture, frame.shown, size);
    if (view_) result.view = view_->apply(transparent_ ? straight(result.beauty) : result.beauty);
    if (!made) return;
    const AovInfo& layer = *find_aov("denoiser");
    for (ExrLayer& own : result.aovs) {
        if (own.channels != layer.channel_names()) continue;
        own.image = rgb(part_of(made->weights, frame.shown, size));
    }
    stats.gpu_bytes += transient_bytes_;
    stats.denoised = true;
    const std::string over = near.empty() ? "" : fmt::format(", also over {} neighbouring frames", used.size());
    stats.biases.insert(stats.biases.begin(), kBias + over);
    for (const graph::PassTime& t : executor_.times()) stats.passes.push_back({t.name, t.count, t.seconds});
    stats.neighbours = {static_cast<int>(used.size()), 0, watch.seconds()};
    stats.render_seconds += watch.seconds();
}

}  // namespace halflight
