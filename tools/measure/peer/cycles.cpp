#include "tools/measure/peer/cycles.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/io/exr.h"

namespace halflight::peer {

CyclesRun render_with_cycles(const std::filesystem::path& scene, const CyclesSettings& s) {
    const std::filesystem::path output =
        std::filesystem::temp_directory_path() / fmt::format("halflight-peer-{}.exr", getpid());
    const std::string command = fmt::format(
        "{}blender -b --factory-startup -P '{}/tools/cycles_materials.py' -P '{}' -- '{}' '{}' --spp {} --size {}x{} "
        "--bounces {} "
        "--seed {} --threads 2 {} 2>/dev/null",
        s.imported_metals ? "HALFLIGHT_IMPORTED_METALS=1 " : "", HALFLIGHT_SOURCE_DIR, s.script.string(),
        scene.string(), output.string(), s.samples, s.width, s.height, std::max(s.reflections - 1, 0), s.seed,
        s.camera.empty() ? "" : fmt::format("--camera '{}'", s.camera));
    const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
    if (!pipe) throw Error("blender", "cannot be started");
    CyclesRun run;
    std::array<char, 4096> line;
    while (std::fgets(line.data(), line.size(), pipe.get())) {
        const auto json = nlohmann::json::parse(line.data(), nullptr, false);
        if (json.is_object() && json.contains("seconds")) run.seconds = json["seconds"];
    }
    if (run.seconds == 0) throw Error("blender", "did not render {} by {}", scene.string(), s.script.string());
    run.image = read_exr(output).image({"R", "G", "B"});
    std::filesystem::remove(output);
    return run;
}

}  // namespace halflight::peer
