#include "tools/halflight/fingerprint.h"

#include <limits>

#include "engine/core/hash.h"
#include "engine/io/files.h"
#include "engine/io/png.h"
#include "engine/settings/settings_table.h"
#include "tools/halflight/frame_renderer.h"

namespace halflight {
namespace {

constexpr std::uint64_t kAnySize = std::numeric_limits<std::int64_t>::max();

class Fingerprint {
  public:
    /// Adds a text with its length, which separates it from its neighbours.
    Fingerprint& text(std::string_view value) {
        hash_.add(value.size());
        hash_.add_bytes(value.data(), value.size());
        return *this;
    }
    template <class... Args>
    Fingerprint& values(fmt::format_string<Args...> format, Args&&... args) {
        return text(fmt::format(format, std::forward<Args>(args)...));
    }
    Fingerprint& file(const std::filesystem::path& path) { return text(read_file(path, kAnySize)); }
    std::string hex() const { return fmt::format("{:016x}", hash_.value()); }

  private:
    Hash hash_;
};

template <class T>
std::string optional_text(const std::optional<T>& value) {
    return value ? fmt::format("{}", *value) : "none";
}

std::string point_text(const dvec3& p) {
    return fmt::format("{} {} {}", p.x, p.y, p.z);
}

void add_camera(Fingerprint& print, const RenderArguments& a, const ChosenCamera& chosen) {
    if (a.look_from) {
        print.text(point_text(*a.look_from)).text(point_text(*a.look_at)).text(point_text(a.up));
        print.values("{}", a.vertical_fov);
    } else if (a.pose) {
        const CameraPose& p = *a.pose;
        print.text("pose").text(point_text(p.from)).text(point_text(p.at)).text(point_text(p.up));
        print.values("{} {} {} {} {}", p.vertical_fov, p.orthographic, p.ortho_height, p.near_plane, p.far_plane);
    } else {
        print.text(optional_text(chosen.index));
    }
}

void add_environment(Fingerprint& print, const RenderArguments& a) {
    if (const auto* color = std::get_if<vec3>(&a.environment)) print.text(point_text(dvec3(*color)));
    if (const auto* map = std::get_if<std::filesystem::path>(&a.environment)) print.text("map").file(*map);
}

void add_edits(Fingerprint& print, const SceneEdits& edits) {
    if (edits == SceneEdits()) return;
    print.text("edits").values("{} {} {} {}", edits.environment_rotation, edits.environment_intensity, edits.emission,
                               edits.clay);
    print.text("tint").text(point_text(dvec3(edits.environment_tint)));
    for (const LightEdit& light : edits.lights) {
        print.values("light {}", light.factor);
        if (light.color) print.text(point_text(dvec3(*light.color)));
        if (light.position) print.text("at").text(point_text(*light.position));
        if (light.direction) print.text("towards").text(point_text(*light.direction));
    }
}

void add_color(Fingerprint& print, const RenderArguments& a, const ColorConfig& config) {
    print.text(a.working_space);
    for (const auto& file : config.files()) print.file(file);
    print.values("{} files", config.files().size());
}

void add_settings(Fingerprint& print, const RenderSettings& settings) {
    for (const Setting& setting : known_settings())
        if (setting.fingerprint) print.text(setting.name).text(setting.get(settings));
}

}  // namespace

std::string sequence_fingerprint(const RenderArguments& a, const RenderSettings& s, const AnimatedScene& scene,
                                 const ColorConfig& config) {
    Fingerprint print;
    print.text(HALFLIGHT_VERSION);
    for (const auto& file : scene.files()) print.file(file);
    print.values("{} {}", scene.playing().size(), fmt::join(scene.playing(), " "));
    print.values("{}/{} fps", scene.frame_rate().numerator, scene.frame_rate().denominator);
    add_camera(print, a, scene.chosen_camera());
    add_environment(print, a);
    add_edits(print, a.edits);
    add_color(print, a, config);
    add_settings(print, s);
    print.values("best effort {}", a.best_effort);
    // Frames then depend on the frames before them.
    if (s.preview.temporal) print.values("frames {}", fmt::join(a.frames, ","));
    print.values("shutter {}, {} times", a.shutter, shutter_count(a, s.samples));
    return print.hex();
}

std::string frame_fingerprint(const std::string& sequence, std::uint32_t frame) {
    return Fingerprint().text(sequence).values("{}", frame).hex();
}

FrameFile examine_frame(const std::filesystem::path& path, const std::string& fingerprint) {
    std::error_code none;
    if (!std::filesystem::is_regular_file(path, none)) return FrameFile::missing;
    std::string found;
    try {
        const std::string bytes = read_file(path, kAnySize);
        constexpr std::size_t kSignature = 8;  // bytes, of a .png; that of an .exr is shorter
        if (bytes.size() < kSignature || bytes.find_first_not_of('\0') == std::string::npos)
            return FrameFile::incomplete;
        if (is_exr(bytes)) {
            ExrFile exr = read_exr(path, {kMaxSide, kAnySize});
            found = exr.attributes.extra[kFingerprintName];
        } else if (is_png(bytes)) {
            read_png(path.string(), bytes, kMaxSide);
            found = text_of_png(bytes, kFingerprintName);
        }
    } catch (const Error&) {
        return FrameFile::incomplete;
    }
    return found == fingerprint ? FrameFile::whole : FrameFile::other;
}

}  // namespace halflight
