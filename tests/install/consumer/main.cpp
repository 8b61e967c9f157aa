// Loads a scene and renders it through the public headers: consumer SCENE OUTPUT.exr
#include <cstdio>

#include "engine/io/gltf/gltf.h"
#include "renderer/render.h"

int main(int argc, char** argv) {
    if (argc != 3) return 2;
    try {
        const halflight::Scene scene = halflight::load_gltf(argv[1]);
        halflight::gpu::Context context = halflight::gpu::Context::create();
        halflight::RenderSettings settings;
        settings.width = settings.height = 16;
        settings.samples = 1;
        settings.camera = scene.cameras.at(0);
        halflight::Renderer renderer(context, scene, halflight::ColorConfig::load(), settings);
        halflight::write_exr(argv[2], {{{"R", "G", "B", "A"}, renderer.render().beauty}}, {});
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "consumer: %s\n", error.what());
        return 1;
    }
}
