#include <cstring>
#include <numeric>
#include <vector>

#include "api/first_picture/default_camera.h"
#include "api/first_picture/default_light.h"
#include "engine/core/memory_ledger.h"
#include "engine/io/gltf/gltf.h"
#include "engine/tables/lights.h"
#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/targets.h"

namespace halflight::fuzz {
namespace {

std::string u32(std::size_t value) {
    const auto number = static_cast<std::uint32_t>(value);
    std::string bytes(4, '\0');
    std::memcpy(bytes.data(), &number, 4);
    return bytes;
}

/// Packs a .glb with consistent lengths, which random mutations would hardly ever produce.
std::string pack_glb(std::string_view json, std::string_view binary) {
    return "glTF" + u32(2) + u32(12 + 8 + json.size() + 8 + binary.size()) + u32(json.size()) + "JSON" +
           std::string(json) + u32(binary.size()) + std::string("BIN\0", 4) + std::string(binary);
}

/// Poses the file. A pose may be refused because of data that the rest pose ignores; otherwise it must be valid.
void pose(const std::filesystem::path& path, const GltfOptions& options) {
    GltfScene scene(path, options);
    check_errors("", [&] {
        std::vector<std::size_t> all(scene.animations().size());
        std::iota(all.begin(), all.end(), std::size_t{0});
        scene.surfaces_move(all);
        for (const double seconds : {0.0, 0.37, 1e9}) {
            const Scene posed = scene.at(seconds, all);
            if (posed.cameras.size() != scene.cameras_at(seconds, all).size()) throw Broken("cameras differ");
        }
    });
}

}  // namespace

void gltf(std::string_view input) {
    const std::size_t end = input.starts_with('{') ? input.find('\0') : std::string_view::npos;
    const std::string packed =
        end == std::string_view::npos ? std::string(input) : pack_glb(input.substr(0, end), input.substr(end + 1));
    const MemoryFile file(packed);
    GltfOptions options;
    options.max_image_side = 1024;  // small files can hold large pictures
    MemoryLedger::process().set_limit(kProgramBytes + (std::size_t{512} << 20));
    check_errors("", [&] {
        // Half of the files draw points and lines, unless these are too many: an accessor may have no data.
        constexpr std::size_t kMostBytes = std::size_t{1} << 26;
        options.line_width = packed.size() % 2 == 0 ? 0.1 : 0;
        if (GltfScene(file.path(), options).size().geometry_bytes > kMostBytes) options.line_width = 0;
        const Scene scene = load_gltf(file.path(), options);
        validate(scene);
        pose(file.path(), options);
        const TraceTables tables = build_trace_tables(scene, kFlattenLimit);
        const LightTables lights = build_lights(scene, tables);
        const rays::SceneProbe probe(scene);
        default_light(probe, {default_camera(probe, 1).camera});
        for (const vec3& position : tables.positions)
            if (!all_finite(position)) throw Broken("a position in the tables is not finite");
        for (const vec4& row : lights.rows)
            if (!all_finite(vec3(row))) throw Broken("a light is not finite");
    });
}

}  // namespace halflight::fuzz
