#include "api/sequence/develop.h"

#include "engine/core/image_tools.h"
#include "engine/gpu/texture.h"
#include "engine/graph/compile.h"
#include "engine/graph/execute.h"

namespace halflight {

bool holds_bits(const RenderSettings& settings, const OutputOptions& output, const ColorConfig& colors) {
    return !settings.half_color && !is_lossy(output.exr.compression) &&
           working_space(colors, output.working_space).from_rec709 == mat3(1);
}

Developer::Developer(gpu::Context& context, const ColorConfig& colors, const RenderSettings& settings,
                     const OutputOptions& output)
    : settings_(settings),
      to_rec709_(glm::inverse(dmat3(working_space(colors, output.working_space).from_rec709))),
      programs_(context.binaries()) {
    if (settings.want_view) view_ = colors.view(settings.view), kernel_.emplace(*view_);
}

/// replaced: the denoiser, or a preview mode, has replaced the picture. The processor then makes the view, and else the
/// device.
Image Developer::view_of(const Image& beauty, bool replaced) {
    if (replaced) return view_->apply(settings_.transparent ? straight(beauty) : beauty);
    gpu::Texture texture("picture", {beauty.width, beauty.height, GL_RGBA32F});
    texture.upload(std::span<const float>(beauty.pixels));
    graph::Graph graph;
    const graph::TextureHandle view =
        add_view(graph, graph.import_texture("picture", texture), *kernel_, settings_.transparent);
    graph.output(view);
    graph::Executor executor(programs_);
    executor.run(graph::compile(graph));
    Image image(beauty.width, beauty.height, 4);
    image.pixels = executor.texture(view).read_float();
    return image;
}

RenderResult Developer::develop(const std::filesystem::path& path) {
    ExrFile exr = read_exr(path, limits_of_renders());
    RenderResult result;
    const bool views = settings_.optics.stereo == Stereo::views;
    for (const char* prefix : {"", "right."}) {
        if (*prefix && !views) continue;
        std::vector<std::string> names;
        for (const char* channel : {"R", "G", "B", "A"}) names.push_back(std::string(prefix) + channel);
        Image eye = exr.image(names);
        result.beauty.width = eye.width, result.beauty.channels = 4;
        result.beauty.height += eye.height;
        result.beauty.pixels.insert(result.beauty.pixels.end(), eye.pixels.begin(), eye.pixels.end());
    }
    if (to_rec709_ != mat3(1)) {
        for (std::size_t i = 0; i + 4 <= result.beauty.pixels.size(); i += 4) {
            float* const pixel = &result.beauty.pixels[i];
            const vec3 color = to_rec709_ * vec3(pixel[0], pixel[1], pixel[2]);
            for (int c = 0; c < 3; ++c) pixel[c] = color[c];
        }
    }
    const std::string& bias = exr.attributes.extra["bias"];
    const auto has = [&](const char* text) { return bias.find(text) != std::string::npos; };
    const bool replaced = has("denoised: ") || has("preview: noise") || has("preview: light of earlier");
    if (view_) result.view = view_of(result.beauty, replaced);
    return result;
}

}  // namespace halflight
