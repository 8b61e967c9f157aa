#include "passes/preview/denoise.h"

#include <fmt/format.h>

#include "shaders/shared/bindings.h"

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
    pass.read(constants, Access::uniform_read);
    for (const graph::TextureHandle handle : {texels.light, texels.guide, texels.place})
        pass.read(handle, Access::texture_read);
    const graph::TextureHandle noisy = pass.write(graph.create_texture("noisy light", desc), Access::image_write);
    pass.execute([=](graph::Resources& r) {
        r.buffer(constants).bind_uniform(BLOCK_FRAME);
        GLuint unit = 0;
        for (const graph::TextureHandle handle : {texels.light, texels.guide, texels.place})
            r.texture(handle).bind(unit++);
        r.texture(noisy).bind_image(0, GL_WRITE_ONLY);
        dispatch(r.programs().compute("shaders/denoise_variance.comp"), desc);
    });
    return noisy;
}

graph::TextureHandle add_level(graph::Graph& graph, graph::TextureHandle noisy, graph::TextureHandle guide, int stride,
                               graph::BufferHandle constants) {
    const gpu::TextureDesc desc = graph.desc(noisy);
    graph::Pass pass = graph.add_pass("denoise");
    pass.read(constants, Access::uniform_read);
    pass.read(noisy, Access::texture_read);
    pass.read(guide, Access::texture_read);
    const graph::TextureHandle smoother =
        pass.write(graph.create_texture(fmt::format("light filtered by {}", stride), desc), Access::image_write);
    pass.execute([=](graph::Resources& r) {
        r.buffer(constants).bind_uniform(BLOCK_FRAME);
        r.texture(noisy).bind(0);
        r.texture(guide).bind(1);
        r.texture(smoother).bind_image(0, GL_WRITE_ONLY);
        const gpu::Program& program = r.programs().compute("shaders/denoise.comp");
        program.set("stride", stride);
        dispatch(program, desc);
    });
    return smoother;
}

graph::TextureHandle add_despeckle(graph::Graph& graph, graph::TextureHandle light, graph::TextureHandle guide) {
    const gpu::TextureDesc desc = graph.desc(light);
    graph::Pass pass = graph.add_pass("despeckle");
    pass.read(light, Access::texture_read);
    pass.read(guide, Access::texture_read);
    const graph::TextureHandle calm = pass.write(graph.create_texture("calm light", desc), Access::image_write);
    pass.execute([=](graph::Resources& r) {
        r.texture(light).bind(0);
        r.texture(guide).bind(1);
        r.texture(calm).bind_image(0, GL_WRITE_ONLY);
        dispatch(r.programs().compute("shaders/despeckle.comp"), desc);
    });
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
