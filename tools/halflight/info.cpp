#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>

#include "api/halflight/camera.h"
#include "api/halflight/loaded_scene.h"
#include "api/scene/blocked_light.h"
#include "api/scene/facts.h"
#include "api/scene/scene_names.h"
#include "engine/gpu/context.h"
#include "engine/gpu/driver_needs.h"
#include "engine/gpu/program_binaries.h"
#include "engine/io/gltf/gltf.h"
#include "engine/io/gltf/parts.h"
#include "engine/paging/page_file.h"
#include "shaders/shared/bvh_nodes.h"
#include "tools/cli/console.h"
#include "tools/cli/signals.h"
#include "tools/halflight/commands.h"
#include "tools/halflight/render_parts.h"
#include "tools/measure/leftout/measure.h"

namespace halflight {
namespace {

using Json = nlohmann::ordered_json;

constexpr leftout::Settings kTimed{.width = 160, .height = 90, .samples = 2, .turns = 5};

std::string scalar_text(const Json& value) {
    if (value.is_null()) return "none";
    if (value.is_string()) return one_line(value.get<std::string>());
    return value.is_number_float() ? fmt::format("{:.6g}", value.get<double>()) : value.dump();
}

/// Returns one line: "a, b" for a list, "name x, type y" for an object.
std::string flat_text(const Json& value) {
    if (!value.is_structured()) return scalar_text(value);
    std::string text;
    for (const auto& [key, item] : value.items())
        text += (text.empty() ? "" : ", ") + (value.is_object() ? key + " " : "") + flat_text(item);
    return text;
}

/// Prints indented "key value" lines for people; programs use the JSON.
void print_text(const Json& value, int indent) {
    constexpr int kKeyWidth = 32;
    constexpr std::size_t kLineWidth = 80;
    const auto line = [&](const std::string& key, const std::string& text) {
        fmt::print("{:{}}{:<{}} {}\n", "", indent, key, kKeyWidth - indent, text);
    };
    for (const auto& [key, item] : value.items()) {
        const std::string text = flat_text(item);
        if (item.is_structured() && item.empty()) {
            line(key, "none");
        } else if (item.is_object()) {
            fmt::print("{:{}}{}\n", "", indent, key);
            print_text(item, indent + 2);
        } else if (item.is_array() && (item[0].is_object() || text.size() > kLineWidth)) {
            for (std::size_t i = 0; i < item.size(); ++i) line(fmt::format("{} {}", key, i), flat_text(item[i]));
        } else {
            line(key, text);
        }
    }
}

Json device_facts() {
    Json attempts = Json::array();
    for (const gpu::DeviceAttempt& attempt : gpu::Context::probe())
        attempts.push_back({{"name", attempt.name}, {"taken", attempt.taken}, {"reason", attempt.reason}});
    return attempts;
}

void print_devices(const Json& attempts) {
    for (std::size_t i = 0; i < attempts.size(); ++i)
        fmt::print("{} {} {}: {}\n", attempts[i]["taken"].get<bool>() ? "*" : " ", i, scalar_text(attempts[i]["name"]),
                   scalar_text(attempts[i]["reason"]));
}

void print_left_out_head(bool timed) {
    fmt::print("left out with the default settings, and the bytes saved");
    if (timed)
        fmt::print(
            "; time of a sample of {} x {} pixels with the part over that without it, median [quartiles] of {} turns",
            kTimed.width, kTimed.height, kTimed.turns);
    fmt::print(". --keep refuses items marked *, which would change the picture\n");
}

/// Prints a part, the bytes that it would take, and the reason why it is left out.
void print_left_out(const Json& l) {
    std::string time;
    if (l.contains("time")) {
        time = "  -                   ";
        if (!l["time"].is_null()) {
            const Json& ratio = l["time"]["time_ratio"];
            time = fmt::format("  {:.3f} [{:.3f}, {:.3f}]", ratio["median"].get<double>(), ratio["lower"].get<double>(),
                               ratio["upper"].get<double>());
        }
    }
    const std::string what = l["what"].get<std::string>() + (l["can_be_kept"].get<bool>() ? "" : " *");
    fmt::print("  {:<30} {:>12}{}  {}\n", what, l["bytes"].get<std::size_t>(), time, l["fact"].get<std::string>());
    std::fflush(stdout);
}

/// Measures small samples with and without an item that is left out.
class Timer {
  public:
    /// Returns the measurement of an item; null if it cannot be kept.
    Json time(const Scene& scene, const std::string& item) {
        const auto stop_point = [&] {
            if (const int signal = stop_signal()) throw Interrupted(signal, scene.name, "interrupted");
        };
        const leftout::Comparison c = leftout::compare(context_, scene, colors_, Kept({item}), kTimed, stop_point);
        return c.added().empty() ? Json() : leftout::to_json(c);
    }

  private:
    gpu::Context context_ = gpu::Context::create({.device = "", .binaries_folder = gpu::default_binaries_folder()});
    ColorConfig colors_ = ColorConfig::load();
};

/// Returns the items left out. In text mode, rows are printed one by one, since measuring takes a while.
Json left_out_facts(const InfoArguments& a, const Scene& scene, const TraceTables& tables) {
    Json list = left_out_json(scene_left_out(scene, tables));
    std::optional<Timer> timer;
    if (a.time) timer.emplace();
    if (!a.json) print_left_out_head(a.time);
    for (Json& l : list) {
        if (timer) l["time"] = timer->time(scene, l["what"].get<std::string>());
        if (!a.json) print_left_out(l);
    }
    return list;
}

/// Returns the facts of the edited scene, with the light that the picture would have. own: the scene's environment.
Json facts_of(const InfoArguments& a, Scene& scene, Environment own, const TraceTables& tables, bool moves) {
    CameraChoice choice = a.picture.view;
    const bool named = std::ranges::find(scene.cameras, "all", &Camera::name) != scene.cameras.end();
    if (choice.camera == "all" && !named) choice.camera.reset();  // `render` makes a picture of each camera
    RenderSettings settings =
        make_settings(a.picture, with_lens(choose_camera(scene, choice).camera, a.picture.settings.view.camera.lens));
    request_light_groups(settings, scene);
    const PictureUse use{.png = a.png, .exr_tile = a.picture.output.exr.tile};
    const MemoryEstimate memory = scene_memory(scene, tables, moves, settings, use);
    if (!a.needs && std::holds_alternative<std::monostate>(a.picture.choice.environment)) {
        scene.environment = std::move(own);
        std::erase_if(scene.lights, &PunctualLight::of_environment);
        scene.environment.color *=
            a.picture.choice.edits.environment_intensity * a.picture.choice.edits.environment_tint;
    }
    return scene_facts(scene, tables, settings, memory);
}

/// Reads the scene as it will be rendered, and returns the facts of its file.
Json file_facts(const InfoArguments& a, Scene& scene, TraceTables& tables) {
    GltfScene file(*a.scene, gltf_options(a.picture.choice));
    SceneSize size = file.size();
    tile_textures({&file, 1}, size, 0);
    check_fits(size, *a.scene);
    scene = file.at_rest();
    const SceneTree tree = file.tree_at(0, {});
    const Environment own = scene.environment;
    set_environment(scene, a.picture.choice.environment, Log(),
                    {.lamps = a.picture.choice.lamps,
                     .straight_glass = a.picture.choice.edits.straight_glass});  // the facts contain its warnings
    apply(a.picture.choice.edits, scene, tree, a.picture.choice.edits_source);
    tables = build_trace_tables(scene, kFlattenLimit);
    std::ranges::move(blocked_lights(rays::LazyProbe(scene), scene, scene.cameras),
                      std::back_inserter(scene.report.warnings));
    const Json motion = motion_facts(file, scene.report.warnings);
    Json facts{{"file", a.scene->string()}, {"bytes", std::filesystem::file_size(*a.scene)}};
    facts.update(facts_of(a, scene, own, tables, !motion.at("animations").empty()));
    facts.update(motion);
    facts["variants"] = file.variants();
    if (a.names) facts["names"] = name_facts(scene, tree, file.variants());
    return facts;
}

/// Returns the facts of a list of files, as their headers tell them.
Json list_facts(const InfoArguments& a) {
    std::vector<GltfScene> parts = open_files(*a.scene, gltf_options(a.picture.choice));
    const SceneSize size = size_of_parts(parts);
    std::uintmax_t bytes = 0;
    std::size_t files = 0;
    for (const GltfScene& part : parts) {
        files += part.files().size();
        for (const VersionedFile& file : part.files()) bytes += std::filesystem::file_size(file.path);
    }
    return {{"file", a.scene->string()},
            {"bytes", bytes},
            {"scenes", parts.size()},
            {"files", files},
            {"triangles_with_instances", size.drawn},
            {"texture_bytes", size.texture_bytes},
            {"texture_bytes_beyond_8_bits", size.deep_bytes},
            {"largest_mesh_bytes", size.largest_mesh}};
}

/// Returns the facts of a page file.
Json page_facts(const std::filesystem::path& path, bool check) {
    const paging::PageFile file(path);
    if (check)
        file.check([&] {
            if (const int signal = stop_signal()) throw Interrupted(signal, path.string(), "interrupted");
        });
    const paging::PageIndex& index = file.index();
    const paging::PageFileSizes sizes = file.sizes();
    std::size_t pairs = 0, nodes = 0, vertices = 0, filled = 0;
    for (const paging::PageIndex::Size& page : index.pages) {
        pairs += page.pairs, nodes += page.nodes, vertices += page.vertices;
        filled += paging::bytes_in_slot(page);
    }
    const std::size_t slots = index.pages.size() * index.limits.bytes;
    const auto each = [&](std::uint64_t bytes) {
        return static_cast<double>(bytes) / std::max<double>(index.triangles, 1);
    };
    const auto list = [](const auto& v) { return Json::array({v.x, v.y, v.z}); };
    Json facts{
        {"file", path.string()},        {"bytes", sizes.file},        {"page_file_version", paging::kPageFileVersion},
        {"triangles", index.triangles}, {"vertices", index.vertices}, {"meshes", index.ranges.size()},
        {"origin", list(index.origin)}};
    if (!index.bounds.empty()) facts["bounds"] = {list(index.bounds.lower), list(index.bounds.upper)};
    facts.update(
        Json{{"slivers", index.slivers},
             {"texels_per_vertex", index.vertex_texels},
             {"pages", index.pages.size()},
             {"subtrees", index.roots.size()},
             {"pairs", pairs},
             {"nodes", nodes},
             {"vertices_of_pages", vertices},
             {"slot_bytes", index.limits.bytes},
             {"filled_share_of_slots", static_cast<double>(filled) / std::max<double>(static_cast<double>(slots), 1)},
             {"part_bytes", {{"pages", sizes.pages}, {"tables", sizes.tables}, {"index", sizes.index}}},
             {"bytes_per_triangle",
              {{"pages", each(sizes.pages)}, {"tables", each(sizes.tables)}, {"loaded_pages", each(slots)}}}});
    if (check) facts["all_parts_are_whole"] = true;
    return facts;
}

}  // namespace

void run_info(const InfoArguments& a) {
    if (a.device || a.time) gpu::prepare_process();
    Json all = Json::object(), facts = Json::object();
    Scene scene;
    TraceTables tables;
    const bool list = a.scene && is_part_list(*a.scene);
    const bool paged = a.scene && !list && paging::is_page_file(*a.scene);
    if ((list || paged) && a.names) throw Error(a.scene->string(), "is no glTF scene: --names describes single files");
    if (list && a.needs) throw Error(a.scene->string(), "is a list of files: --needs describes single files");
    if (paged && a.needs) throw Error(a.scene->string(), "is a page file: --needs describes glTF scenes");
    if (a.check && !paged) throw Error(a.scene->string(), "is no page file: --check tests page files");
    if (a.device) all["devices"] = device_facts();
    if (a.scene) facts = list ? list_facts(a) : paged ? page_facts(*a.scene, a.check) : file_facts(a, scene, tables);
    if (!a.json) {
        if (a.device) print_devices(all["devices"]);
        if (a.names)
            fmt::print("{}", option_lines(facts.at("names")));
        else
            print_text(facts, 0);
    }
    if (a.needs) facts["left_out"] = left_out_facts(a, scene, tables);
    all.update(facts);
    if (a.json) fmt::print("{}\n", all.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
    if (a.device && std::ranges::none_of(all["devices"], [](const Json& d) { return d["taken"].get<bool>(); }))
        throw Error("GPU", "no device works{}", all["devices"].empty() ? "; EGL lists none" : "");
}

}  // namespace halflight
