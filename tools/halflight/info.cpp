#include <cstdio>
#include <nlohmann/json.hpp>

#include "engine/gpu/context.h"
#include "engine/io/gltf.h"
#include "tools/halflight/commands.h"
#include "tools/halflight/facts.h"
#include "tools/halflight/loading.h"

namespace halflight {
namespace {

using Json = nlohmann::ordered_json;

std::string scalar_text(const Json& value) {
    if (value.is_null()) return "none";
    if (value.is_string()) return one_line(value.get<std::string>());
    return value.is_number_float() ? fmt::format("{:.6g}", value.get<double>()) : value.dump();
}

/// One line: "a, b", or "name: x, type: y" of an object.
std::string flat_text(const Json& value) {
    if (!value.is_structured()) return scalar_text(value);
    std::string text;
    for (const auto& [key, item] : value.items())
        text += (text.empty() ? "" : ", ") + (value.is_object() ? key + " " : "") + flat_text(item);
    return text;
}

/// Indented "key value" lines for people; the JSON says the same for programs.
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

/// What, why, and what it would take.
void print_left_out(const Json& list) {
    fmt::print("left out with the default settings, and the bytes that it would take\n");
    for (const Json& l : list)
        fmt::print("  {:<30} {:>12}  {}\n", l["what"].get<std::string>(), l["bytes"].get<std::size_t>(),
                   l["fact"].get<std::string>());
}

}  // namespace

void run_info(const InfoArguments& a) {
    Json all = Json::object();
    if (a.device) all["devices"] = device_facts();
    if (a.scene) {
        const Console silent(true);  // the warnings are in the facts
        Scene scene = load_scene(*a.scene, a.allow_outside, silent);
        if (a.needs) set_environment(scene, a.environment, silent);
        GltfScene file(*a.scene, gltf_options(a.allow_outside));
        const Json motion = motion_facts(file, scene.report.warnings);
        all["file"] = a.scene->string();
        all["bytes"] = std::filesystem::file_size(*a.scene);
        all.update(scene_facts(scene));
        all.update(motion);
        if (a.needs) all["left_out"] = left_out_json(scene_left_out(scene));
    }
    if (a.json) {
        fmt::print("{}\n", all.dump(2));
        return;
    }
    if (a.device) print_devices(all["devices"]);
    const Json left_out = all.value("left_out", Json());
    all.erase("devices");
    all.erase("left_out");
    print_text(all, 0);
    if (a.needs) print_left_out(left_out);
}

}  // namespace halflight
