#include "api/sequence/fingerprint.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

#include "api/halflight/camera.h"
#include "api/halflight/edit_text.h"
#include "api/halflight/picture_file.h"
#include "api/sequence/source_hash.h"
#include "engine/core/error.h"
#include "engine/core/hash.h"
#include "engine/core/key_text.h"
#include "engine/core/memory_ledger.h"
#include "engine/io/files.h"
#include "engine/io/jpeg.h"
#include "engine/io/png.h"
#include "engine/paging/moving_pages.h"
#include "engine/paging/pages.h"
#include "engine/settings/settings_table.h"
#include "engine/settings/visibility.h"
#include "engine/tables/tables.h"

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
    /// Adds the content of a file, like a text. Files may be larger than memory. Throws Error if the file has
    /// changed since its version was noted, because pictures show what was read then.
    Fingerprint& file(const VersionedFile& file) {
        constexpr std::uint64_t kPiece = std::uint64_t{1} << 20;  // bytes
        const ByteSource source(file.path);
        if (source.versioned().version != file.version)
            throw Error(file.path.string(), "has changed since it was loaded");
        hash_.add(source.size());
        std::string buffer;
        for (std::uint64_t at = 0; at < source.size(); at += kPiece) {
            const std::string_view piece = source.read(at, std::min(kPiece, source.size() - at), buffer);
            hash_.add_bytes(piece.data(), piece.size());
        }
        return *this;
    }
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

void add_camera(Fingerprint& print, const CameraChoice& a, const ChosenCamera& chosen) {
    if (a.look_from) {
        print.text(point_text(*a.look_from)).text(point_text(*a.look_at)).text(point_text(a.up));
        print.values("{}", a.vertical_fov);
    } else if (a.pose) {
        const CameraPose& p = *a.pose;
        print.text("pose").text(point_text(p.from)).text(point_text(p.at)).text(point_text(p.up));
        print.values("{} {} {} {} {}", p.vertical_fov, p.orthographic, p.ortho_height, p.near_plane, p.far_plane);
    } else {
        print.text(optional_text(chosen.index));
        for (int column = 0; column < 4 && !chosen.index; ++column)  // a default camera
            print.text(point_text(dvec3(chosen.camera.camera_to_world[column])));
    }
    if (a.override_fov && !a.look_from) print.values("vfov {}", *a.override_fov);
    if (a.turntable > 0) print.values("turntable {}", a.turntable);
}

void add_environment(Fingerprint& print, const LoadedScene& scene) {
    const SceneChoice& a = scene.choice();
    if (const auto* color = std::get_if<vec3>(&a.environment)) print.text(point_text(dvec3(*color)));
    for (const PunctualLight& light : scene.scene().lights)
        if (light.of_environment && light.type == LightType::point)
            print.text("lamp").text(point_text(light.position)).text(point_text(dvec3(light.intensity)));
    if (std::holds_alternative<std::filesystem::path>(a.environment)) print.text("map").file(scene.environment_file());
    if (const auto* preset = std::get_if<SkyPreset>(&a.environment)) print.text("preset").text(name(*preset));
    if (a.light_azimuth) print.values("azimuth {}", *a.light_azimuth);
    if (const auto* sky = std::get_if<ClearSky>(&a.environment)) print.text("sky").text(text(*sky));
}

/// Adds what a profile has read from its file, which may have changed since.
void add_profile(Fingerprint& print, const LightProfile& profile) {
    print.values("profile {}", profile.candela);
    for (const auto* numbers : {&profile.vertical, &profile.horizontal, &profile.shares})
        print.text({reinterpret_cast<const char*>(numbers->data()), numbers->size() * sizeof(float)});
}

/// Adds the edits. Those of one number or word stand there as they are; `add` adds a key with the hash of others.
template <class Add>
void add_edits(KeyText& keys, const LoadedScene& scene, Add add) {
    const SceneEdits& edits = scene.edits();
    const auto number = [&](const char* key, auto value) { keys.add(key, fmt::format("{}", value)); };
    if (edits.environment_rotation != 0) number("env-rotation", edits.environment_rotation);
    if (edits.environment_intensity != 1) number("env-intensity", edits.environment_intensity);
    if (edits.environment_tint != vec3(1)) keys.add("env-tint", point_text(dvec3(edits.environment_tint)));
    if (edits.emission != 1) number("emission", edits.emission);
    if (edits.lamp_radius) number("lamp-radius", *edits.lamp_radius);
    if (edits.sun_angle) number("sun-angle", *edits.sun_angle);
    if (edits.straight_glass) keys.add("glass-shadows", "straight");
    if (edits.clay) keys.add("clay", "yes");
    add("edits of instances", [&](Fingerprint& print) {
        for (const auto& [index, transform] : edits.transforms) {
            print.values("instance {}", index);
            for (int column = 0; column < 4; ++column) print.text(point_text(dvec3(transform[column])));
        }
    });
    const auto add_light = [&](Fingerprint& print, const std::string& name, const LightEdit& edit) {
        LightEdit plain = edit;
        plain.ies.clear();  // a file may have another name elsewhere
        print.text(name).text(text(plain));
        if (edit.ies.empty()) return;
        if (const LightProfile* profile = profile_of_file(scene.scene(), edit.ies)) add_profile(print, *profile);
    };
    add("added lights", [&](Fingerprint& print) {
        for (const AddedLamp& lamp : edits.added_lights)
            add_light(print.text(name(lamp.kind)), lamp.name, lamp.edit);
    });
    add("edits of lights", [&](Fingerprint& print) {
        for (const auto& [name, edit, source] : edits.lights) add_light(print, name, edit);
    });
    add("edits of materials", [&](Fingerprint& print) {
        for (const auto& [name, edit, source] : edits.materials)
            for (const auto& [property, values] : edit) print.text(name).text(property).text(property_text(values));
    });
    add("edits of nodes", [&](Fingerprint& print) {
        for (const auto& [name, edit, source] : edits.nodes) print.text(name).text(text(edit));
    });
    add("hidden objects", [&](Fingerprint& print) {
        for (const auto& [name, source] : edits.hidden) print.text(name);
    });
    add("shadow catchers", [&](Fingerprint& print) {
        for (const auto& [name, source] : edits.catchers) print.text(name);
    });
    if (edits.ground) keys.add("ground", edits.ground_height ? fmt::format("{}", *edits.ground_height) : "lowest");
    add("light groups", [&](Fingerprint& print) {
        if (edits.each_light) print.text("each light");
        for (const auto& [name, lights, source] : edits.light_groups) {
            print.text("light group").text(name);
            for (const std::string& light : lights) print.text("of").text(light);
        }
    });
    const auto add_links = [&](const char* key, const std::vector<LightLink>& links) {
        add(key, [&](Fingerprint& print) {
            for (const auto& [light, objects, source] : links) {
                print.text("link").text(light);
                for (const std::string& object : objects) print.text("of").text(object);
            }
        });
    };
    add_links("light links", edits.light_links);
    add_links("shadow links", edits.shadow_links);
}

/// Returns whether a setting applies to the sums of a picture, which are there without it.
bool is_late(const Setting& setting) {
    constexpr std::string_view kLate[] = {"denoise", "keep-noisy", "denoise-frames", "denoise-error"};
    return setting.group == "Colour" || std::ranges::find(kLate, setting.name) != std::end(kLate);
}

/// Adds the settings that are not as usual.
void add_settings(KeyText& keys, const RenderSettings& settings, bool (*takes)(const Setting& setting)) {
    RenderSettings with_effect = settings;
    with_effect.optics = effective(settings.optics);
    if (settings.denoise) with_effect.keep_noisy = false;  // the picture is the same
    const RenderSettings usual;
    for (const Setting& setting : known_settings()) {
        if (!setting.fingerprint || !takes(setting)) continue;
        if (const std::string value = setting.get(with_effect); value != setting.get(usual))
            keys.add(setting.name, value);
    }
}

/// Adds a hash of the values that settings have as usual, which texts leave out. Other sources may have others.
void add_defaults(KeyText& keys) {
    Fingerprint print;
    const RenderSettings usual;
    for (const Setting& setting : known_settings())
        if (setting.fingerprint) print.text(setting.name).text(setting.get(usual));
    const OutputOptions output;
    print.values("{} {}", static_cast<int>(output.tiff), static_cast<int>(output.aov_names));
    keys.add("defaults", print.hex());
}

/// Adds the settings of the view, and the colour config.
void add_view(KeyText& keys, const RenderSettings& settings, const ColorConfig& config) {
    add_settings(keys, settings, [](const Setting& s) { return s.group == "Colour"; });
    // Environment variables may choose the view, and change what it does.
    const ViewProcessor view = config.view(settings.view);
    Fingerprint print;
    print.text(view.display()).text(view.view()).text(view.look()).text(view.cache_id());
    for (const auto& file : config.files()) print.file(file);
    print.values("{} files", config.files().size());
    keys.add("color config and view", print.hex());
}

void add_linear_space(KeyText& keys, const LinearSpace& space) {
    Fingerprint print;
    print.text(space.name);
    for (int column = 0; column < 3; ++column) print.text(point_text(dvec3(space.from_rec709[column])));
    keys.add("working space", print.hex());
}

/// Adds the layout of .exr files, as far as it is not the usual one: zip in lines of one part.
void add_layout(KeyText& keys, const ExrLayout& layout) {
    if (layout.compression != ExrCompression::zip) keys.add("exr-compression", name(layout.compression));
    if (layout.parts) keys.add("exr-parts", "yes");
    if (layout.tile > 0) keys.add("exr-tiles", std::to_string(layout.tile));
}

/// Returns whether several instances have one mesh, which a scene in memory then may not merge.
bool shares_meshes(const Scene& scene) {
    std::vector<bool> used(scene.meshes.size(), false);
    for (const Instance& instance : scene.instances) {
        const auto mesh = static_cast<std::size_t>(instance.mesh);
        if (used[mesh]) return true;
        used[mesh] = true;
    }
    return false;
}

/// Returns whether a scene from pages has the bits of the same scene in memory, as far as that is proven
/// (docs/page-files.md): no animation of the file can change a surface or a material, no triangle of its hierarchy in
/// memory is split, all meshes are merged in memory, all emissive triangles are lights, and camera rays are traced.
bool equals_memory(const LoadedScene& scene, const RenderSettings& s) {
    constexpr std::uint64_t kLeast = std::uint64_t{1} << 20, kLights = std::uint64_t{1} << 24;
    const std::uint64_t triangles = scene.pages()->index().triangles;
    if (scene.surfaces_move() || scene.drives_materials()) return false;
    // Pages leave out what an animation can move, also if it does not play.
    const auto moves = [&](const Instance& instance) { return paging::is_moving(scene.scene(), instance); };
    if (std::ranges::any_of(scene.scene().instances, moves)) return false;
    const std::uint64_t most = shares_meshes(scene.scene()) ? kFlattenLimit : kLights;
    if (triangles < kLeast || triangles > most) return false;
    const Camera& camera = scene.chosen_camera().camera;
    const bool lens = camera.lens.blurs() || s.view.camera.lens.blurs();
    return resolved(s.primary, triangles, ivec2(s.width, s.height),
                    shown_by_tracing(s.optics, lens, has_overscan(s))) == PrimaryVisibility::traced;
}

/// Adds the program's sources, the scene with its edits, and the settings that decide the sums.
void add_sums(KeyText& keys, const LoadedScene& scene, const RenderSettings& settings) {
    keys.add("sources", source_hash());
    add_defaults(keys);
    const auto add = [&](const char* key, const auto& fill) {
        Fingerprint print;
        fill(print);
        if (print.hex() != Fingerprint().hex()) keys.add(key, print.hex());
    };
    // Page files hold times of other files. What they hold of the scene follows from its own files.
    std::span<const VersionedFile> files = scene.files();
    if (scene.pages()) files = files.first(files.size() - 1);
    add("scene", [&](Fingerprint& print) {
        for (const auto& file : files) print.file(file);
    });
    if (scene.pages() && !equals_memory(scene, settings)) keys.add("pages", "yes");
    if (!scene.playing().empty()) keys.add("animation", fmt::format("{}", fmt::join(scene.playing(), " ")));
    keys.add("fps", fmt::format("{}/{}", scene.frame_rate().numerator, scene.frame_rate().denominator));
    if (scene.choice().frame_offset != 0) keys.add("frame-offset", fmt::format("{}", scene.choice().frame_offset));
    if (!scene.choice().variant.empty()) keys.add("variant", scene.choice().variant);
    if (scene.choice().line_width > 0) keys.add("line-width", fmt::format("{}", scene.choice().line_width));
    add("camera", [&](Fingerprint& print) { add_camera(print, scene.camera_choice(), scene.chosen_camera()); });
    add("environment", [&](Fingerprint& print) { add_environment(print, scene); });
    add_edits(keys, scene, add);
    // The pilot, the exposure and default cameras follow from the scene at 0 s. Frames have their own values
    // (EditPrints).
    add("edits at 0 s", [&](Fingerprint& print) {
        const double frame = static_cast<double>(scene.choice().frame_offset);
        const std::string values = values_text(scene.keys(), scene.edits(), frame, frame);
        if (!values.empty()) print.text(values);
    });
    add_settings(keys, settings, [](const Setting& s) { return !is_late(s); });
    if (has_halves(settings)) keys.add("halves", "yes");  // a pilot may choose other techniques for them
}

}  // namespace

std::string sums_fingerprint(const LoadedScene& scene, const RenderSettings& settings, const Shutter& shutter) {
    KeyText keys;
    add_sums(keys, scene, settings);
    if (shutter.open > 0)
        keys.add("shutter", fmt::format("{} {} {}", shutter.open, name(shutter.position), shutter.ramp))
            .add("shutter-times", std::to_string(shutter_times(shutter, scene, settings, settings.samples)));
    return keys.text();
}

SequencePrints sequence_prints(const std::string& sums, const RenderSettings& settings, const ColorConfig& config,
                               const OutputOptions& output, const std::vector<FrameNumber>& frames) {
    KeyText picture(sums);
    add_settings(picture, settings, [](const Setting& s) { return is_late(s) && s.group != "Colour"; });
    if (output.best_effort) picture.add("best-effort", "yes");
    if (output.tiff != OutputOptions().tiff) picture.add("tiff-type", std::to_string(static_cast<int>(output.tiff)));
    // Frames depend on the frames before them if temporal accumulation is on.
    if (settings.preview.temporal) picture.add("frames", fmt::format("{}", fmt::join(frames, ",")));
    SequencePrints prints;
    KeyText linear = picture;
    add_linear_space(linear, working_space(config, output.working_space));
    add_layout(linear, output.exr);
    if (output.aov_names != AovNames::halflight)
        linear.add("aov-names", std::to_string(static_cast<int>(output.aov_names)));
    prints.linear = linear.text();
    if (!settings.want_view) return prints;
    KeyText view = picture;
    add_view(view, settings, config);
    view.add("jpeg-quality", std::to_string(output.jpeg_quality))
        .add("png-bits", std::to_string(png_bits(output, config.view(settings.view).encoding())));
    prints.view = view.text();
    return prints;
}

namespace {

/// Returns the fingerprint of fingerprint_text(); empty for other texts.
std::string fingerprint_of_text(const std::string& text) {
    const std::string start = fmt::format("{}: ", kFingerprintName);
    return text.starts_with(start) ? text.substr(start.size()) : "";
}

}  // namespace

std::string frame_fingerprint(const std::string& sequence, FrameNumber frame, const std::string& edits) {
    return with_edits(KeyText(sequence).add("frame", fmt::format("{}", frame)).text(), edits);
}

EditPrints::EditPrints(const LoadedScene& scene, const RenderSettings& settings, const Shutter& shutter)
    : keys_(scene.keys()),
      base_(scene.edits()),
      previous_(std::ranges::find(settings.aovs, "motion") != settings.aovs.end()) {
    const ShutterPosition at = shutter.position;
    before_ = shutter.open * (at == ShutterPosition::start ? 0 : at == ShutterPosition::centre ? 0.5 : 1);
    after_ = shutter.open - before_;
}

namespace {

std::string edit_key(int offset) {
    return fmt::format("edits{:+}", offset);
}

}  // namespace

std::string EditPrints::text(FrameNumber frame, int reach) const {
    KeyText text;
    for (int offset = -reach; offset <= reach && !keys_.empty(); ++offset) {
        const double own = static_cast<double>(frame + offset);
        std::string values;
        const auto add = [&](const char* part, double first, double last) {
            if (const std::string more = values_text(keys_, base_, first, last); !more.empty()) values += part + more;
        };
        add("", own - before_, own + after_);
        if (before_ + after_ > 0) add("own\n", own, own);
        if (previous_) add("previous\n", own - 1, own - 1);
        // A frame whose values are those of the edits without keys has none.
        if (!values.empty()) text.add(edit_key(offset), fmt::format("{:016x}", hash_of(values)));
    }
    return text.text();
}

std::string with_edits(const std::string& sums, const std::string& edits) {
    return edits.empty() ? sums : sums + ";" + edits;
}

std::string edit_of(const std::string& sums, int offset) {
    return value_of(sums, edit_key(offset));
}

std::string edits_of(const std::string& sums, int reach) {
    KeyText text;
    for (int offset = -reach; offset <= reach; ++offset)
        if (const std::string value = edit_of(sums, offset); !value.empty()) text.add(edit_key(offset), value);
    return text.text();
}

std::string without_edits(const std::string& sums) {
    return sums.substr(0, std::min(sums.find(";edits+"), sums.find(";edits-")));
}

std::string fingerprint_text(const std::string& fingerprint) {
    return fingerprint.empty() ? "" : fmt::format("{}: {}", kFingerprintName, fingerprint);
}

std::string fingerprint_of_exr(const std::string& fingerprint, int width, int height, std::size_t channels) {
    return fmt::format("{}, {} x {} x {}", fingerprint, width, height, channels);
}

std::string fingerprint_of(ExrFile& exr) {
    const std::string found = exr.attributes.extra[kFingerprintName];
    const std::string own = found.substr(0, found.rfind(", "));
    return found == fingerprint_of_exr(own, exr.width, exr.height, exr.channels.size()) ? own : found;
}

// First bytes of .exr, .png, .jpg and .tif files.
constexpr std::string_view kStarts[] = {
    "\x76\x2f\x31\x01", "\x89PNG\r\n\x1a\n", "\xff\xd8\xff", {"II*\0", 4}, {"MM\0*", 4}};

FrameFile examine_frame(const std::filesystem::path& path, const std::string& fingerprint,
                        std::span<const std::string> accepted, std::string* why) {
    std::error_code none;
    if (!std::filesystem::is_regular_file(path, none)) return FrameFile::missing;
    std::string found;
    try {
        const std::string bytes = read_file(path, kAnySize);
        const bool cut = std::ranges::any_of(kStarts, [&](std::string_view start) { return start.starts_with(bytes); });
        if (cut || bytes.find_first_not_of('\0') == std::string::npos) return FrameFile::incomplete;
        if (is_exr(bytes)) {
            ExrFile exr = read_exr(path, {kMaxSide, kAnySize});
            found = fingerprint_of(exr);
        } else if (is_png(bytes)) {
            read_png(path.string(), bytes, kMaxSide);
            found = text_of_png(bytes, kFingerprintName);
        } else if (is_jpeg(bytes)) {
            TextureImage decoded;
            read_jpeg(path.string(), bytes, kMaxSide, decoded);
            found = fingerprint_of_text(comment_of_jpeg(bytes));
        } else if (is_tiff(bytes)) {
            found = fingerprint_of_text(read_tiff(path.string(), bytes, kMaxSide).description);
        }
    } catch (const BudgetError&) {
        throw;  // a lack of memory says nothing about the file
    } catch (const Error&) {
        return FrameFile::incomplete;
    }
    if (same_keys(found, fingerprint, source_hash(), accepted)) return FrameFile::whole;
    if (why) *why = differences(found, fingerprint);
    return FrameFile::other;
}

}  // namespace halflight
