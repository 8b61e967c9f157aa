#include "tools/measure/converge/external.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "engine/core/error.h"
#include "engine/core/process.h"
#include "engine/core/stopwatch.h"
#include "engine/io/exr.h"
#include "tools/common/temporary_folder.h"

namespace halflight::converge {
namespace {

bool takes(const External& external, const std::string& placeholder) {
    return external.command.find("{" + placeholder + "}") != std::string::npos;
}

/// Replaces placeholders by their values; names in braces that are no placeholder stay as they are.
std::string filled(const std::string& argument, const std::map<std::string, std::string>& values) {
    std::string out;
    for (std::size_t at = 0; at < argument.size();) {
        const std::size_t end = argument[at] == '{' ? argument.find('}', at) : std::string::npos;
        const auto found = end == std::string::npos ? values.end() : values.find(argument.substr(at + 1, end - at - 1));
        out += found == values.end() ? std::string(1, argument[at]) : found->second;
        at = found == values.end() ? at + 1 : end + 1;
    }
    return out;
}

/// Returns the times that a renderer has printed about itself; `time` replaces missing ones.
Seconds printed_times(const std::string& output, Seconds time) {
    std::istringstream lines(output);
    for (std::string line; std::getline(lines, line);) {
        const auto json = nlohmann::json::parse(line, nullptr, false);
        if (!json.is_object()) continue;
        const auto take = [&](const char* key, double& value) {
            if (json.contains(key) && json[key].is_number() && json[key] > 0) value = json[key];
        };
        take("seconds", time.wall);
        take("cpu_seconds", time.cpu);
    }
    return time;
}

/// Returns the values of the camera's placeholders. Throws Error if the command cannot describe the camera.
std::map<std::string, std::string> camera_values(const External& external, const Camera& camera) {
    const bool posed = takes(external, "look-from") && takes(external, "look-at");
    if (camera.name.empty() && !posed)
        throw Error(external.name, "its command lacks {look-from} or {look-at}, and the camera has no name");
    if (posed && camera.orthographic)
        throw Error(external.name, "its command has {look-from}, and the camera is orthographic");
    for (const std::string& argument : split_command(external.command))
        if (argument.starts_with("{camera}") && camera.name.starts_with('-'))
            throw Error(external.name, "would take the camera's name '{}' for an option; write --camera={{camera}}",
                        camera.name);
    if (camera.optics.traced()) throw Error(external.name, "its command cannot describe a {}", text(camera.optics));
    if (camera.lens.blurs()) throw Error(external.name, "its command cannot describe the camera's lens");
    const auto text = [](const dvec3& v) { return fmt::format("{},{},{}", v.x + 0.0, v.y + 0.0, v.z + 0.0); };  // no -0
    const dmat4& m = camera.camera_to_world;
    const dvec3 right(m[0]), up(m[1]), back(m[2]), from(m[3]);
    constexpr double kLevel = 1e-6;  // sine of the largest roll that counts as level
    if (posed && !takes(external, "up") && (std::abs(right.y) > kLevel || up.y < 0))
        throw Error(external.name, "its command lacks {up}, and the camera is rolled");
    return {{"camera", camera.name},
            {"look-from", text(from)},
            {"look-at", text(from - back)},
            {"up", text(up)},
            {"vfov", fmt::format("{}", glm::degrees(camera.vertical_fov))}};
}

class ExternalPainter final : public Painter {
  public:
    ExternalPainter(const External& external, const ExternalScene& scene, const View& view)
        : external_(external), view_(view), values_(camera_values(external, view.camera)) {
        if (!takes(external, "environment") && !scene.environment.black())
            throw Error(external.name, "its command lacks {environment}, and the scene has one");
        const std::filesystem::path environment = folder_ / "environment.exr";
        Image map = scene.environment.map;
        if (map.pixels.empty()) {
            map = Image(2, 1, 3);
            for (std::size_t i = 0; i < map.pixels.size(); ++i)
                map.pixels[i] = scene.environment.color[static_cast<glm::length_t>(i % 3)];
        }
        write_exr(environment, {{{"R", "G", "B"}, std::move(map)}}, {});
        values_.insert({{"scene", std::filesystem::absolute(scene.file).string()},
                        {"environment", environment.string()},
                        {"output", output_.string()},
                        {"width", std::to_string(view.width)},
                        {"height", std::to_string(view.height)},
                        {"bounces", std::to_string(view.bounces)},
                        {"bounces-1", std::to_string(std::max(view.bounces - 1, 0))},
                        {"threads", std::to_string(std::max(std::thread::hardware_concurrency(), 1u))}});
    }

    Painted paint(const Budget& budget, std::uint32_t seed, const Pulse& pulse) override {
        values_["samples"] = std::to_string(budget.samples);
        values_["seed"] = std::to_string(seed);
        std::error_code none;
        std::filesystem::remove(output_, none);
        std::vector<std::string> arguments = split_command(external_.command);
        for (std::string& argument : arguments) argument = filled(argument, values_);
        const Spool out, err;
        const Stopwatch watch;
        const ProcessEnd end = start(arguments, {.output = out.descriptor(), .errors = err.descriptor()})->wait(pulse);
        const Seconds time{watch.seconds(), end.cpu_seconds};
        const std::string printed = out.text(), complaint = last_line(err.text());
        const std::string words = complaint.empty() ? last_line(printed) : complaint;
        const std::string quote = words.empty() ? "" : fmt::format("; it says: {}", words);
        if (end.signal) throw Error(external_.name, "was ended by signal {}{}", end.signal, quote);
        if (end.status != 0) throw Error(external_.name, "exit status {}{}", end.status, quote);
        if (!std::filesystem::exists(output_)) throw Error(external_.name, "has written no picture{}", quote);
        Painted painted{{}, printed_times(printed, time)};
        painted.picture.samples = budget.samples;
        try {
            const ExrFile file = read_exr(output_, limits_of_renders());
            if (!same_space(file.attributes.chromaticities.value_or(kRec709), kRec709))
                throw Error(output_.string(), "is not in linear Rec.709");
            painted.picture.beauty = file.whole(output_.string(), {"R", "G", "B"});
        } catch (const Error& error) {
            throw Error(external_.name, "its picture cannot be used: {}{}", error.what(), quote);
        }
        Image& beauty = painted.picture.beauty;
        if (beauty.width != view_.width || beauty.height != view_.height)
            throw Error(external_.name, "its picture has {}x{} pixels instead of {}x{}", beauty.width, beauty.height,
                        view_.width, view_.height);
        for (float& value : beauty.pixels) {
            if (std::isfinite(value)) continue;
            value = 0;
            ++painted.picture.non_finite;
        }
        return painted;
    }

    std::vector<PassTime> passes(const Budget&, std::uint32_t, const Pulse&) override { return {}; }
    Seconds preparation() const override { return {}; }

  private:
    std::unique_ptr<Process> start(const std::vector<std::string>& arguments, const ProcessOptions& options) const {
        try {
            return std::make_unique<Process>(arguments, options);
        } catch (const Error& error) {
            throw Error(external_.name, "{}", error.what());
        }
    }

    External external_;
    View view_;
    TemporaryFolder folder_;
    std::filesystem::path output_ = folder_ / "picture.exr";
    std::map<std::string, std::string> values_;  // keyed by placeholder
};

}  // namespace

void check_external(const External& external) {
    if (split_command(external.command).empty()) throw Error(external.name, "its command is empty");
    for (const char* needed : {"output", "samples", "seed"})
        if (!takes(external, needed)) throw Error(external.name, "its command lacks {{{}}}", needed);
}

std::unique_ptr<Painter> external_painter(const External& external, const ExternalScene& scene, const View& view) {
    check_external(external);
    return std::make_unique<ExternalPainter>(external, scene, view);
}

}  // namespace halflight::converge
