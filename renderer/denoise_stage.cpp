#include "renderer/denoise_stage.h"

#include <utility>

#include "engine/graph/compile.h"

namespace halflight {

DenoiseStage::DenoiseStage(gpu::ProgramCache& programs, const RenderSettings& settings, const ColorConfig& colors,
                           const FrameNeeds& needs, const SceneNeeds& scene)
    : desc_{settings.width, settings.height, GL_RGBA32F},
      mean_("denoiser mean", desc_),
      guide_("denoiser guide", desc_),
      reflectance_("denoiser reflectance", desc_),
      diffuse_albedo_("denoiser diffuse albedo", desc_),
      glossy_albedo_("denoiser glossy albedo", desc_),
      executor_(programs) {
    executor_.measure(settings.measure);
    if (settings.want_view) view_ = colors.view(settings.view);
    const bool direct = needs.shadow || needs.continuation, indirect = needs.continuation && settings.bounces > 1;
    const bool present[] = {scene.diffuse && direct, scene.diffuse && indirect, scene.glossy && direct};
    for (const FilteredLight component : kFilteredLights) {
        const auto index = static_cast<std::size_t>(component);
        if (present[index]) light_[index].emplace(desc_);
    }
}

void DenoiseStage::begin() {
    has_halves_ = denoised_ = false;
    executor_.reset_times();
}

DenoiserPixels DenoiseStage::import_pixels(graph::Graph& graph) {
    const auto import = [&](gpu::Texture& texture) { return graph.import_texture(texture.name(), texture); };
    DenoiserPixels pixels{import(mean_), import(guide_), import(reflectance_), import(diffuse_albedo_),
                          import(glossy_albedo_)};
    for (std::size_t i = 0; i < light_.size(); ++i)
        if (light_[i]) pixels.light[i] = {import(light_[i]->first), import(light_[i]->second)};
    return pixels;
}

void DenoiseStage::add_band(graph::Graph& graph, const Band& band, const Accumulated& sums, graph::TextureHandle beauty,
                            const SampleHalves& samples) {
    const DenoiserPixels filled = add_denoiser_input(graph, band, sums, beauty, samples, import_pixels(graph));
    for (const graph::TextureHandle h :
         {filled.mean, filled.guide, filled.reflectance, filled.diffuse_albedo, filled.glossy_albedo})
        graph.output(h);
    for (const LightHalves& light : filled.light)
        if (light.first) graph.output(light.first), graph.output(light.second);
    has_halves_ = has_halves_ || (samples.first > 0 && samples.first < samples.all);
}

void DenoiseStage::apply(Film& film) {
    if (!has_halves_) return;
    graph::Graph graph;
    const DenoisedPicture made = add_denoiser(graph, import_pixels(graph));
    denoised_ = bool(made.weights);
    if (!denoised_) return;
    graph.output(made.picture), graph.output(made.weights);
    const graph::CompiledGraph compiled = graph::compile(graph);
    transient_bytes_ = compiled.slot_bytes;
    executor_.run(compiled);
    Image picture(desc_.width, desc_.height, 4);
    picture.pixels = executor_.texture(made.picture).read_float();
    film.replace_pictures(std::move(picture), view_ ? &*view_ : nullptr);
    if (film.wants({LayerSource::denoiser})) film.add_denoiser_weights(executor_.texture(made.weights).read_float());
}

void DenoiseStage::fill_stats(RenderStats& stats) const {
    const std::size_t each = gpu::texture_bytes(desc_);
    stats.gpu_bytes += 5 * each + transient_bytes_;
    for (const std::optional<Halves>& light : light_) stats.gpu_bytes += light ? 2 * each : 0;
    if (denoised_) stats.biases.emplace_back("denoised: noise of reflected light filtered by non-local means");
    for (const graph::PassTime& t : executor_.times()) stats.passes.push_back({t.name, t.count, t.seconds});
}

}  // namespace halflight
