// halflight-scenes: writes the scenes of this project. Equal arguments give equal bytes.
#include <cstdio>
#include <filesystem>
#include <string>

#include "engine/core/error.h"
#include "tools/common/tool_main.h"
#include "tools/scenes/airliner.h"
#include "tools/scenes/city.h"
#include "tools/scenes/hall.h"
#include "tools/scenes/path.h"
#include "tools/scenes/power_plants.h"
#include "tools/scenes/scenes.h"

namespace {

using namespace halflight;

int run(int argc, char** argv) {
    CLI::App app("Writes the scenes of this project as .glb files.", "halflight-scenes");
    app.require_subcommand(1);
    std::string output;
    const auto command = [&](const char* name, const char* what) {
        CLI::App* sub = app.add_subcommand(name, what);
        sub->add_option("OUT", output, "file to write, .glb")->required();
        return sub;
    };
    bool metal = false;
    CLI::App* cornell = command("cornell", "The Cornell box");
    cornell->add_flag("--metal", metal, "make both blocks metal");
    double albedo = 0;
    CLI::App* furnace = command("furnace", "A white furnace: radiance 1 everywhere");
    furnace->add_option("--albedo", albedo, "albedo of the enclosure, which emits 1 - albedo")
        ->check(CLI::Range(0.0, 0.99));
    CLI::App* atrium = command("atrium", "A courtyard under sun and sky");
    CLI::App* still_life = command("still-life", "Glossy objects on a table");
    CLI::App* room = command("room", "A room lit through one small window");
    CLI::App* lamps = command("lamps", "Three lamps before a wall");
    int lights = 1000;
    std::uint64_t hall_triangles = 0;
    CLI::App* emitters = command("emitters", "A hall with many small lamps");
    emitters->add_option("--lights", lights, "number of lamps, of two triangles each")
        ->check(CLI::Range(1, 10'000'000))
        ->capture_default_str();
    emitters
        ->add_option("--triangles", hall_triangles,
                     "number of triangles of the hall (default: 10 000 besides lamps and walls)")
        ->check(CLI::Range(1LL, 1'000'000'000LL));
    std::uint64_t eel_triangles = 10'000;
    CLI::App* eel = command("eel", "A skinned mesh of any size that swims");
    eel->add_option("--triangles", eel_triangles, "approximate number of triangles")
        ->check(CLI::Range(100LL, 100'000'000LL))
        ->capture_default_str();
    scenes::SceneOptions options;
    std::uint64_t part_mib = options.part_bytes >> 20;
    const auto scalable = [&](const char* name, const char* what) {
        CLI::App* sub = command(name, what);
        sub->add_option("--triangles", options.triangles,
                        "number of triangles; instances count as often as they are used")
            ->check(CLI::Range(1LL, 1'000'000'000LL))
            ->capture_default_str();
        CLI::Option* flatten =
            sub->add_flag("--flatten", options.flatten, "write unique geometry instead of shared meshes");
        CLI::Option* parts = sub->add_flag("--parts", options.parts,
                                           "flatten into several files OUT.000.glb, ... and the list OUT.parts.json");
        sub->add_flag("--gpu-instancing", options.gpu_instancing,
                      "use EXT_mesh_gpu_instancing instead of a node for each instance")
            ->excludes(flatten)
            ->excludes(parts);
        sub->add_option("--part-size", part_mib, "largest size of a part in MiB")
            ->needs(parts)
            ->check(CLI::Range(16, 4095))
            ->capture_default_str();
        return sub;
    };
    CLI::App* airliner = scalable("airliner", "An airliner of any size: cabin, structure, systems, wings, engines");
    CLI::App* city = scalable("city", "A procedural city of any size");
    CLI::App* plants = scalable("powerplants", "Sixteen power plants of any size: boilers, pipes, girders, ducts");

    scenes::HallOptions maps;
    CLI::App* hall = command("hall", "A hall with any number of textures");
    hall->add_option("--textures", maps.textures, "number of textures, three for each material")
        ->check(CLI::Range(1, 10'000))
        ->capture_default_str();
    hall->add_option("--texture-size", maps.texture_size, "texels along the edges of a texture")
        ->check(CLI::Range(1, 16384))
        ->capture_default_str();

    std::string flown;
    scenes::PathOptions flight;
    CLI::App* path = app.add_subcommand("path", "A scene with one more camera, path, moved by an animation");
    path->add_option("SCENE", flown, "scene to copy, .glb")->required();
    path->add_option("OUT", output, "file to write, .glb")->required();
    path->add_option("--camera", flight.camera, "camera of the scene at the middle of the arc (default: the first)");
    path->add_option("--frames", flight.frames, "number of frames")
        ->check(CLI::Range(2, 100'000))
        ->capture_default_str();
    path->add_option("--fps", flight.fps, "frames per second")->check(CLI::Range(0.001, 1e6))->capture_default_str();
    path->add_option("--degrees", flight.degrees, "angle of the arc in degrees")
        ->check(CLI::Range(0.0, 360.0))
        ->capture_default_str();

    const auto write = [&](const scenes::Document& document) {
        document.write(output);
        std::printf("%s: %llu triangles\n", output.c_str(), static_cast<unsigned long long>(document.triangles()));
    };
    return tool_main(app, argc, argv, [&] {
        if (std::filesystem::path(output).extension() != ".glb") throw Error(output, "is not the name of a .glb");
        if (*cornell) write(scenes::cornell(metal));
        if (*furnace) write(scenes::furnace(albedo));
        if (*atrium) write(scenes::atrium_scene());
        if (*still_life) write(scenes::still_life());
        if (*room) write(scenes::room());
        if (*lamps) write(scenes::lamps());
        if (*emitters) write(scenes::emitters(lights, hall_triangles));
        if (*hall) {
            const std::uint64_t triangles = scenes::write_hall(output, maps);
            std::printf("%s: %llu triangles\n", output.c_str(), static_cast<unsigned long long>(triangles));
        }
        if (*eel) write(scenes::eel(eel_triangles));
        if (*path) {
            scenes::write_camera_path(flown, output, flight);
            std::printf("%s: %d frames\n", output.c_str(), flight.frames);
        }
        options.part_bytes = part_mib << 20;
        options.flatten = options.flatten || options.parts;
        const auto write_scalable = [&](const CLI::App* chosen, auto writer) {
            if (!*chosen) return;
            const std::uint64_t triangles = writer(output, options);
            std::filesystem::path made = output;
            if (options.parts) made.replace_extension(".parts.json");
            std::printf("%s: %llu triangles\n", made.c_str(), static_cast<unsigned long long>(triangles));
        };
        write_scalable(airliner, scenes::write_airliner);
        write_scalable(city, scenes::write_city);
        write_scalable(plants, scenes::write_power_plants);
        return 0;
    });
}

}  // namespace

int main(int argc, char** argv) {
    return run(argc, argv);
}
