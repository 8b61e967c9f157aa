#include "renderer/denoise_stage.h"

#include <fmt/format.h>

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

DenoiseStage::DenoiseStage(gpu::ProgramCache& programs, const RenderSettings& settings, const ColorConfig& colors,
                           const FrameNeeds& needs, const SceneNeeds& scene)
    : desc_{settings.width, settings.height, GL_RGBA32F}, executor_(programs) {
    executor_.measure(settings.measure);
    transparent_ = settings.transparent;
    if (settings.want_view) view_ = colors.view(settings.view);
    const bool direct = needs.shadow || needs.continuation, indirect = needs.continuation && bounces_of(settings) > 1;
    present_ = {scene.diffuse && direct, scene.diffuse && indirect, scene.glossy && direct};
    chains_ = bool(needs.chains);
    if (neighbour_frames(settings) == 0) own_.emplace(desc_, present_, chains_);
}

void DenoiseStage::begin(NoisyFrame* frame, const Camera& camera, const ivec2& whole) {
    has_halves_ = denoised_ = false;
    kept_ = frame;
    blur_ = blur_of(camera, whole);
    if (kept_) kept_->blur = blur_;
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

std::optional<DenoiseStage::Made> DenoiseStage::make(graph::Graph& graph, const DenoiserPixels& pixels,
                                                     std::span<const DenoiserNeighbour> neighbours) {
    const DenoisedPicture made = add_denoiser(graph, pixels, neighbours);
    if (!made.weights) return std::nullopt;
    graph.output(made.picture), graph.output(made.weights);
    const graph::CompiledGraph compiled = graph::compile(graph);
    transient_bytes_ = compiled.slot_bytes;
    executor_.run(compiled);
    Made result{Image(desc_.width, desc_.height, 4), executor_.texture(made.weights).read_float()};
    result.picture.pixels = executor_.texture(made.picture).read_float();
    return result;
}

void DenoiseStage::apply(Film& film, bool complete) {
    if (kept_) kept_->has_halves = complete && has_halves_;
    if (kept_ || !complete || !has_halves_) return;
    graph::Graph graph;
    std::optional<Made> made = make(graph, add_lens_blur(graph, own_->import_pixels(graph), blur_), {});
    denoised_ = made.has_value();
    if (!denoised_) return;
    film.replace_pictures(std::move(made->picture), view_ ? &*view_ : nullptr);
    if (film.wants({LayerSource::denoiser})) film.add_denoiser_weights(made->weights);
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
    graph::Graph graph;
    std::vector<DenoiserNeighbour> neighbours;
    RenderStats& stats = result.stats;
    stats.gpu_bytes += frame.bytes();
    for (const NearFrame& other : near) {
        stats.gpu_bytes += other.frame->bytes();
        gpu::Texture *there = frame.motion(other.offset), *back = other.frame->motion(-other.offset);
        if (!other.frame->has_halves || !there || !back) continue;
        neighbours.push_back({add_lens_blur(graph, other.frame->pixels->import_pixels(graph), other.frame->blur),
                              graph.import_texture("motion", *there), graph.import_texture("motion back", *back)});
        gpu::Texture *mirrored = frame.glossy_motion(other.offset),
                     *mirrored_back = other.frame->glossy_motion(-other.offset);
        if (!mirrored || !mirrored_back) continue;
        neighbours.back().glossy_motion = graph.import_texture("glossy motion", *mirrored);
        neighbours.back().glossy_motion_back = graph.import_texture("glossy motion back", *mirrored_back);
    }
    std::optional<Made> made;
    if (frame.has_halves)
        made = make(graph, add_lens_blur(graph, frame.pixels->import_pixels(graph), frame.blur), neighbours);
    if (!made) return;
    result.beauty = std::move(made->picture);
    if (view_) result.view = view_->apply(transparent_ ? straight(result.beauty) : result.beauty);
    const AovInfo& layer = *find_aov("denoiser");
    for (ExrLayer& own : result.aovs) {
        if (own.channels != layer.channel_names()) continue;
        Image weights(desc_.width, desc_.height, 4);
        weights.pixels = std::move(made->weights);
        own.image = rgb(weights);
    }
    stats.gpu_bytes += transient_bytes_;
    stats.denoised = true;
    stats.biases.insert(stats.biases.begin(),
                        fmt::format("{}, also over {} neighbouring frames", kBias, neighbours.size()));
    for (const graph::PassTime& t : executor_.times()) stats.passes.push_back({t.name, t.count, t.seconds});
    stats.neighbours = {static_cast<int>(neighbours.size()), 0, watch.seconds()};
    stats.render_seconds += watch.seconds();
}

}  // namespace halflight
