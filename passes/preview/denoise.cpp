#include "passes/preview/denoise.h"

#include <fmt/format.h>

namespace halflight {
namespace {

using graph::Access;

void dispatch(const gpu::Program& program, const gpu::TextureDesc& picture) {
    program.dispatch(static_cast<std::uint32_t>((picture.width + 7) / 8),
                     static_cast<std::uint32_t>((picture.height + 7) / 8));
}

graph::TextureHandle add_variance(graph::Graph& graph, const PreviewTexels& texels, graph::BufferHandle constants) {
    const gpu::TextureDesc desc = graph.desc(texels.light);
    graph::Pass pass = graph.add_pass("denoise variance");
    pass.read(constants, Access::uniform_read, "FrameBlock");
    pass.read(texels.light, Access::texture_read, "light");
    pass.read(texels.guide, Access::texture_read, "guide");
    pass.read(texels.place, Access::texture_read, "place");
    const graph::TextureHandle noisy =
        pass.write(graph.create_texture("noisy light", desc), Access::image_write, "noisy");
    pass.execute([=](graph::Resources& r) { dispatch(r.compute("shaders/denoise_variance.comp"), desc); });
    return noisy;
}

graph::TextureHandle add_level(graph::Graph& graph, graph::TextureHandle noisy, graph::TextureHandle guide, int stride,
                               graph::BufferHandle constants) {
    const gpu::TextureDesc desc = graph.desc(noisy);
    graph::Pass pass = graph.add_pass("denoise");
    pass.read(constants, Access::uniform_read, "FrameBlock");
    pass.read(noisy, Access::texture_read, "noisy");
    pass.read(guide, Access::texture_read, "guide");
    const graph::TextureHandle smoother = pass.write(
        graph.create_texture(fmt::format("light filtered by {}", stride), desc), Access::image_write, "smoother");
    pass.execute([=](graph::Resources& r) {
        const gpu::Program& program = r.compute("shaders/denoise.comp");
        program.set("stride", stride);
        dispatch(program, desc);
    });
    return smoother;
}

graph::TextureHandle add_despeckle(graph::Graph& graph, graph::TextureHandle light, graph::TextureHandle guide) {
    const gpu::TextureDesc desc = graph.desc(light);
    graph::Pass pass = graph.add_pass("despeckle");
    pass.read(light, Access::texture_read, "light");
    pass.read(guide, Access::texture_read, "guide");
    const graph::TextureHandle calm = pass.write(graph.create_texture("calm light", desc), Access::image_write, "calm");
    pass.execute([=](graph::Resources& r) { dispatch(r.compute("shaders/despeckle.comp"), desc); });
    return calm;
}

}  // namespace

graph::TextureHandle add_denoise(graph::Graph& graph, const PreviewTexels& texels,
                                 graph::BufferHandle frame_constants) {
    graph::TextureHandle light = add_variance(graph, texels, frame_constants);
    for (int level = 0; level < kDenoiseLevels; ++level)
        light = add_level(graph, light, texels.guide, 1 << level, frame_constants);
    return add_despeckle(graph, light, texels.guide);
}

}  // namespace halflight
