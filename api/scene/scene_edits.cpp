#include "api/halflight/scene_edits.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <deque>
#include <mutex>
#include <set>
#include <utility>

#include "api/halflight/object_names.h"
#include "api/scene/added_surfaces.h"
#include "api/scene/light_groups.h"
#include "api/scene/light_links.h"
#include "api/scene/node_edits.h"
#include "engine/core/error.h"
#include "engine/io/files.h"
#include "engine/io/ies.h"
#include "engine/scene/black_body.h"
#include "engine/scene/material_lobes.h"
#include "engine/scene/material_properties.h"

namespace halflight {
namespace {

/// Rotates a map: the direction at u is then seen at u + degrees / 360 (u grows to the right).
void turn(Image& map, double degrees) {
    if (map.width == 0) return;
    const double turns = degrees / 360 - std::floor(degrees / 360);
    const auto shift = std::llround(turns * map.width) % map.width * map.channels;
    if (shift == 0) return;
    for (int y = 0; y < map.height; ++y) {
        float* const row = map.at(0, y);
        float* const end = row + static_cast<std::ptrdiff_t>(map.width) * map.channels;
        std::rotate(row, end - shift, end);
    }
}

/// Returns the clay variant of a material. Emission and alpha are kept.
Material clay(const Material& of) {
    constexpr float kGrey = 0.5f;
    if (of.unlit) return of;
    Material clay;
    clay.name = of.name;
    clay.base_color = vec4(vec3(kGrey), of.base_color.a);
    if (of.alpha_mode != AlphaMode::opaque) clay.base_color_texture = of.base_color_texture;
    clay.metallic = 0;
    clay.emission = of.emission;
    clay.emission_texture = of.emission_texture;
    clay.alpha_mode = of.alpha_mode;
    clay.alpha_cutoff = of.alpha_cutoff;
    clay.double_sided = !is_one_sided(of);  // pages hold this flag, too
    return clay;
}

void check(const std::string& subject, const char* what, double value, const EditRange& range) {
    if (!(value >= range.lower && value <= range.upper))
        throw Error(subject, "{}: {} is outside [{}, {}]", what, value, range.lower, range.upper);
}

void check(const std::string& subject, const char* what, const dvec3& value, const EditRange& range) {
    for (int i = 0; i < 3; ++i) check(subject, what, value[i], range);
}

}  // namespace

LightColor color_of(const PunctualLight& light) {
    const float most = std::max({light.intensity.r, light.intensity.g, light.intensity.b});
    return {most > 0 ? light.intensity / most : vec3(1), most};
}

std::optional<dvec3> unit_direction(const dvec3& v) {
    const double most = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    if (!(most > 0) || !std::isfinite(most)) return std::nullopt;
    return glm::normalize(v / most);  // scaling keeps squares from vanishing or overflowing
}

namespace {

void check(const LightEdit& edit, const std::string& light) {
    check(light, "factor", edit.factor, kEditFactor);
    check(light, "color", dvec3(edit.color.value_or(vec3(1))), kEditColor);
    check(light, "position", edit.position.value_or(dvec3(0)), kEditPosition);
    check(light, "intensity", edit.intensity.value_or(0), kEditIntensity);
    if (edit.temperature) check(light, "temperature", *edit.temperature, kEditTemperature);
    check(light, "radius", edit.radius.value_or(0), kEditRadius);
    check(light, "angle", edit.angle.value_or(0), kEditAngle);
    check(light, "inner", edit.inner.value_or(0), kEditCone);
    check(light, "outer", edit.outer.value_or(0), kEditCone);
    for (int i = 0; i < 2; ++i) check(light, "size", edit.size.value_or(vec2(1))[i], kEditSize);
    if (edit.temperature && edit.color) throw Error(light, "has both a color and a temperature");
    if (edit.direction && !(std::abs(glm::length(*edit.direction) - 1) <= 1e-6))
        throw Error(light, "direction: is not of unit length");
}

/// Changes a light. `profile` is that of the edit; null: none. A light that is off stays off unless the edit has an
/// intensity.
void apply(const LightEdit& edit, PunctualLight& light, const LightProfile* profile = nullptr) {
    LightColor own = color_of(light);
    if (profile && own.intensity > 0) {
        own.intensity = profile->candela;
        light.intensity = own.intensity * own.color;
    }
    const float intensity = edit.intensity.value_or(own.intensity);
    if (edit.color)
        light.intensity = intensity * *edit.color;
    else if (edit.temperature)
        light.intensity = intensity * black_body_color(double{*edit.temperature});
    else if (edit.intensity)
        light.intensity = intensity * own.color;
    light.intensity *= edit.off ? 0 : edit.factor;
    light.position = edit.position.value_or(light.position);
    light.radius = edit.radius.value_or(light.radius);
    if (edit.angle) light.angle = glm::radians(*edit.angle);
    if (light.type == LightType::spot) {
        const auto cone = [](float degrees) { return std::min(glm::radians(degrees), float(kPi / 2)); };
        if (edit.inner) light.inner_cone = cone(*edit.inner);
        if (edit.outer) light.outer_cone = cone(*edit.outer);
    }
    if (edit.direction) {
        const vec3 before = std::exchange(light.direction, glm::normalize(vec3(*edit.direction)));
        turn_profile_axes(light, before);
    }
}

/// Changes properties of a material. Throws Error about `subject`.
void apply(const MaterialEdit& properties, Material& material, const std::string& subject) {
    for (const auto& [name, given] : properties) {
        if (name == kEmissionTemperature) {
            if (given.size() != 1) throw Error(subject, "{} takes 1 number, not {}", name, given.size());
            check(subject, "temperature of the emission", given[0], kEditTemperature);
            const vec3& e = material.emission;
            material.emission = std::max({e.r, e.g, e.b}) * black_body_color(double{given[0]});
            continue;
        }
        std::vector<float> values = given;
        if (name == "base_color" && values.size() == 3) values.push_back(material.base_color.a);
        set_property(material, name, values, subject);
    }
}

std::string subject_of(const Scene& scene, const std::string& source) {
    return source.empty() ? scene.name : fmt::format("{}: {}", source, scene.name);
}

/// Returns the subject of errors of an edit.
std::string where_of(const std::string& source, const Scene& scene, const std::string& subject) {
    return source.empty() ? subject : subject_of(scene, source);
}

/// Calls f(index, edit, subject) for each object that an edit names.
template <class Edit, class F>
void for_each_named(const std::vector<NamedEdit<Edit>>& edits, const NamedObjects& objects, const Scene& scene,
                    const std::string& subject, const F& f) {
    std::set<std::string_view> names;
    for (const NamedEdit<Edit>& named : edits) {
        const std::string where = where_of(named.source, scene, subject);
        if (!names.insert(named.name).second) throw Error(where, "{} '{}' is edited twice", objects.kind, named.name);
        for (const std::size_t index : find_objects(objects, named.name, where))
            f(index, named.edit, fmt::format("{}: {} {}", where, objects.kind, index));
    }
}

/// Throws Error unless an added lamp has what its kind needs, and no more.
void check(const AddedLamp& lamp, const std::string& subject) {
    constexpr std::string_view kNoName = "*?,";
    const auto is_control = [](unsigned char c) { return std::iscntrl(c) != 0; };
    if (lamp.name.find_first_not_of("0123456789") == std::string::npos ||
        lamp.name.find_first_of(kNoName) != std::string::npos || std::ranges::any_of(lamp.name, is_control))
        throw Error(subject, "'{}' cannot name a light: names are no numbers, and have no *, ? and commas", lamp.name);
    const LightEdit& e = lamp.edit;
    const bool sun = lamp.kind == LampKind::sun, spot = lamp.kind == LampKind::spot;
    const bool point = lamp.kind == LampKind::point, bulb = spot || point;
    if (!sun && !e.position) throw Error(subject, "a {} needs a position", name(lamp.kind));
    const std::pair<const char*, bool> kUnfit[] = {{"position", sun && e.position},
                                                   {"direction", point && e.direction && e.ies.empty()},
                                                   {"radius", !bulb && e.radius},
                                                   {"angle", !sun && e.angle},
                                                   {"inner", !spot && e.inner},
                                                   {"outer", !spot && e.outer},
                                                   {"size", !is_area(lamp.kind) && e.size},
                                                   {"profile", !bulb && !e.ies.empty()}};
    for (const auto& [key, given] : kUnfit)
        if (given) throw Error(subject, "a {} has no {}", name(lamp.kind), key);
}

/// Appends the lights that edits add. Throws Error for names that are taken.
void append_added(const SceneEdits& edits, Scene& scene, const std::string& subject) {
    std::vector<PunctualLight> lights;
    for (const AddedLamp* lamp : lamps_in_order(edits)) {
        const std::string where = where_of(lamp->source, scene, subject);
        if (std::ranges::count(edits.added_lights, lamp->name, &AddedLamp::name) > 1)
            throw Error(where, "light '{}' is added twice", lamp->name);
        if (std::ranges::find(scene.lights, lamp->name, &PunctualLight::name) != scene.lights.end())
            throw Error(where, "light '{0}' cannot be added: the scene has a light '{0}'", lamp->name);
        check(*lamp, fmt::format("{}: light '{}'", where, lamp->name));
        lights.push_back(plain_light(*lamp));
    }
    std::ranges::move(lights, std::back_inserter(scene.lights));
}

/// Calls f(index, edit, subject) for each light and edit, in the order in which they apply. The scene has the added
/// lights.
template <class F>
void for_each_light(const SceneEdits& edits, const Scene& scene, const std::string& subject, const F& f) {
    std::size_t index = scene.lights.size() - edits.added_lights.size();
    for (const AddedLamp* lamp : lamps_in_order(edits)) {
        const std::string where = where_of(lamp->source, scene, subject);
        f(index++, lamp->edit, fmt::format("{}: light '{}'", where, lamp->name));
        if (std::ranges::find(edits.lights, lamp->name, &NamedEdit<LightEdit>::name) != edits.lights.end())
            throw Error(where, "light '{}' has a further edit, whose values belong to the added light", lamp->name);
    }
    for_each_named(edits.lights, lights_of(scene), scene, subject, f);
}

/// Throws Error if an edit of a light names an emissive material, which users may take for a light.
void check_no_emission(const SceneEdits& edits, const Scene& scene, const std::string& subject) {
    for (const auto& [name, edit, source] : edits.lights) {
        if (!objects_named(lights_of(scene), name).empty()) continue;
        const auto named = std::ranges::find(scene.materials, name, &Material::name);
        if (named != scene.materials.end() && has_emission(*named))
            throw Error(where_of(source, scene, subject),
                        "'{0}' is an emissive material, not a light: use --material '{0}.emission=R,G,B' or "
                        "'{0}.emission_temperature=KELVIN'",
                        name);
    }
}

/// Returns the profile of a file. The last files are kept until they change, since the viewer applies edits again and
/// again. Thread-safe.
LightProfile kept_profile(const std::string& path) {
    constexpr std::size_t kMostKept = 8;
    struct Kept {
        VersionedFile file;
        LightProfile profile;
    };
    static std::mutex mutex;
    static std::deque<Kept> all;                 // the newest last
    const VersionedFile file = versioned(path);  // before it is read, so that later changes are found
    const std::scoped_lock lock(mutex);
    const auto found = std::ranges::find_if(
        all, [&](const Kept& kept) { return kept.file.path == file.path && kept.file.version == file.version; });
    if (found != all.end()) return found->profile;
    LightProfile profile = load_ies(path);
    std::erase_if(all, [&](const Kept& kept) { return kept.file.path == file.path; });
    if (all.size() == kMostKept) all.pop_front();
    all.push_back({file, profile});
    return profile;
}

/// Adds the profile of an edit to `profiles` unless the list or the scene has it already. The last `areas` lights of
/// the scene are surfaces.
void read_profile(const LightEdit& edit, const Scene& scene, std::size_t light, std::size_t areas,
                  const std::string& where, std::vector<LightProfile>& profiles) {
    if (edit.ies.empty()) return;
    const bool is_surface = light + areas >= scene.lights.size();
    if (is_surface || scene.lights[light].type == LightType::directional)
        throw Error(where, "ies: a {} has no profile", is_surface ? "surface" : "directional light");
    const bool known = std::ranges::find(profiles, edit.ies, &LightProfile::path) != profiles.end();
    if (known || profile_of_file(scene, edit.ies)) return;
    try {
        profiles.push_back(kept_profile(edit.ies));
    } catch (const Error& error) {
        throw Error(where, "ies: {}", error.what());
    }
}

/// Checks everything but nodes and hidden names. The scene has the added lights. Returns the profiles of edits that the
/// scene does not have yet.
std::vector<LightProfile> check_values(const SceneEdits& edits, const Scene& scene, const std::string& subject) {
    check(subject, "rotation of the environment", edits.environment_rotation, kEditRotation);
    check(subject, "intensity of the environment", edits.environment_intensity, kEditFactor);
    check(subject, "tint of the environment", dvec3(edits.environment_tint), kEditColor);
    check(subject, "factor of emission", edits.emission, kEditFactor);
    check(subject, "radius of the lamps", edits.lamp_radius.value_or(0), kEditRadius);
    check(subject, "angle of the suns", edits.sun_angle.value_or(0), kEditAngle);
    check(subject, "height of the ground", edits.ground_height.value_or(0), kEditPosition);
    check_no_emission(edits, scene, subject);
    std::vector<LightProfile> profiles;
    std::vector<PunctualLight> lights = scene.lights;
    const auto areas = static_cast<std::size_t>(
        std::ranges::count_if(edits.added_lights, [](const AddedLamp& lamp) { return is_area(lamp.kind); }));
    for_each_light(edits, scene, subject, [&](std::size_t index, const LightEdit& edit, const std::string& where) {
        check(edit, where);
        read_profile(edit, scene, index, areas, where, profiles);
        PunctualLight& light = lights[index];
        apply(edit, light);
        if (light.type == LightType::spot && (edit.inner || edit.outer) && !(light.inner_cone < light.outer_cone))
            throw Error(where, "inner: {} degrees is not less than outer, {} degrees", glm::degrees(light.inner_cone),
                        glm::degrees(light.outer_cone));
    });
    for_each_named(edits.materials, materials_of(scene), scene, subject,
                   [&](std::size_t index, const MaterialEdit& edit, const std::string& where) {
                       Material material = scene.materials[index];
                       apply(edit, material, where);
                   });
    for (const auto& [index, transform] : edits.transforms) {
        if (index >= scene.instances.size())
            throw Error(subject, "there is no instance {}; the scene has {}, numbered from 0", index,
                        scene.instances.size());
        if (!is_affine(transform))
            throw Error(subject, "instance {}: its transform is not finite, or not affine", index);
    }
    return profiles;
}

}  // namespace

const LightProfile* profile_of_file(const Scene& scene, const std::string& path) {
    const auto found = std::ranges::find(scene.light_profiles, path, &LightProfile::path);
    return found == scene.light_profiles.end() ? nullptr : &*found;
}

const char* name(LampKind kind) {
    constexpr std::array kNames = {"point", "spot", "sun", "rectangle", "disc"};
    return kNames.at(static_cast<std::size_t>(kind));
}

std::vector<const AddedLamp*> lamps_in_order(const SceneEdits& edits) {
    std::vector<const AddedLamp*> lamps;
    for (const AddedLamp& lamp : edits.added_lights) lamps.push_back(&lamp);
    std::ranges::stable_partition(lamps, [](const AddedLamp* lamp) { return !is_area(lamp->kind); });
    return lamps;
}

PunctualLight plain_light(const AddedLamp& lamp) {
    PunctualLight light;
    light.name = lamp.name;
    light.type = lamp.kind == LampKind::point ? LightType::point
                 : lamp.kind == LampKind::sun ? LightType::directional
                                              : LightType::spot;
    light.direction = {0, -1, 0};
    light.up = {0, 0, -1};
    return light;
}

vec2 size_of(const AddedLamp& lamp, const SceneEdits& edits) {
    vec2 size = lamp.edit.size.value_or(vec2(1));
    for (const auto& [name, edit, source] : edits.lights)
        if (edit.size && matches_pattern(name, lamp.name)) size = *edit.size;
    return size;
}

void check_edits(const SceneEdits& edits, const Scene& own, const SceneTree& tree, const std::string& source) {
    const std::string subject = subject_of(own, source);
    const auto check_all = [&](const Scene& scene) {
        check_values(edits, scene, subject);
        find_light_groups(edits, scene, tree, subject);
        find_light_links(edits, scene, tree, subject);
        move_objects(edits, scene, tree, subject);
    };
    if (edits.added_lights.empty()) return check_all(own);
    Scene scene;  // a copy without the contents of meshes and images
    scene.name = own.name;
    scene.lights = own.lights, scene.light_profiles = own.light_profiles;
    scene.materials = own.materials, scene.instances = own.instances;
    for (const Mesh& mesh : own.meshes) scene.meshes.emplace_back().name = mesh.name;
    append_added(edits, scene, subject);
    check_all(scene);
}

void check_edits(const SceneEdits& edits, const Scene& scene, const std::string& source) {
    check_edits(edits, scene, tree_of(scene), source);
}

void edit_materials(const SceneEdits& edits, Scene& scene, const std::string& source) {
    if (edits.straight_glass)  // edits may make solids of other materials
        for (Material& material : scene.materials) material.straight_shadows = true;
    for_each_named(edits.materials, materials_of(scene), scene, subject_of(scene, source),
                   [&](std::size_t index, const MaterialEdit& edit, const std::string& where) {
                       apply(edit, scene.materials[index], where);
                   });
}

namespace {

/// What is found before a scene changes.
struct Checked {
    std::vector<LightProfile> profiles;
    FoundLightGroups groups;
    FoundLightLinks links;
    MovedObjects moved;
};

/// Checks edits of a scene with the added lights, and gives its instances their groups, links and transforms. Throws
/// Error, and then leaves the scene unchanged.
Checked checked(const SceneEdits& edits, Scene& scene, const SceneTree& tree, const std::string& subject) {
    Checked all{check_values(edits, scene, subject),
                find_light_groups(edits, scene, tree, subject),
                find_light_links(edits, scene, tree, subject),
                {}};
    std::vector<Instance> unmoved = scene.instances;
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        Instance& instance = scene.instances[i];
        instance.light_group = all.groups.instances[i];
        instance.links = all.links.instances[i], instance.link_class = all.links.classes[i];
    }
    for (const auto& [index, transform] : edits.transforms) scene.instances[index].object_to_world = transform;
    try {
        all.moved = move_objects(edits, scene, tree, subject);
    } catch (...) {
        scene.instances = std::move(unmoved);
        throw;
    }
    return all;
}

}  // namespace

void apply(const SceneEdits& edits, Scene& scene, const SceneTree& tree, const std::string& source) {
    const std::string subject = subject_of(scene, source);
    const WorldBounds bounds = !edits.ground       ? WorldBounds()
                               : scene.rest_bounds ? *scene.rest_bounds
                                                   : world_bounds(scene);
    const std::size_t own_lights = scene.lights.size();
    append_added(edits, scene, subject);
    Checked all;
    try {
        all = checked(edits, scene, tree, subject);
    } catch (...) {
        scene.lights.resize(own_lights);
        throw;
    }
    auto& [profiles, groups, links, moved] = all;
    scene.lights = std::move(moved.lights);
    scene.instances = std::move(moved.instances);
    edit_materials(edits, scene, source);
    turn(scene.environment.map, edits.environment_rotation);
    scene.environment.color *= edits.environment_intensity * edits.environment_tint;
    if (edits.clay) std::ranges::transform(scene.materials, scene.materials.begin(), clay);
    for (Material& material : scene.materials) material.emission *= edits.emission;
    for (PunctualLight& sun : scene.lights) {
        if (!sun.of_environment) continue;
        sun.intensity *= edits.environment_intensity * edits.environment_tint;
        const double angle = edits.environment_rotation / 360 * 2 * kPi;  // about +Y, as the map turns
        const double c = std::cos(angle), s = std::sin(angle), x = double(sun.direction.x), z = double(sun.direction.z);
        if (angle != 0) sun.direction = glm::normalize(vec3(c * x - s * z, double(sun.direction.y), s * x + c * z));
    }
    const LightEdit sizes{.radius = edits.lamp_radius, .angle = edits.sun_angle};
    if (sizes != LightEdit())
        for (PunctualLight& light : scene.lights) apply(sizes, light);
    std::ranges::move(profiles, std::back_inserter(scene.light_profiles));
    std::vector<vec2> extents(scene.lights.size(), vec2(1));
    for_each_light(edits, scene, subject, [&](std::size_t index, const LightEdit& edit, const std::string&) {
        PunctualLight& light = scene.lights[index];
        if (edit.size) extents[index] = *edit.size;
        if (edit.ies.empty()) return apply(edit, light);
        const LightProfile* profile = profile_of_file(scene, edit.ies);
        light.type = LightType::point;  // without the cones of a spot
        light.profile = static_cast<int>(profile - scene.light_profiles.data());
        set_profile_axes(light, dmat3(light.right, light.up, -light.direction));
        apply(edit, light, profile);
    });
    for (const std::size_t i : moved.hidden_lights) scene.lights[i].intensity = vec3(0);
    if (!edits.each_light) set_light_groups(edits, groups, scene);
    set_light_links(links, scene);
    std::vector<AreaLamp> surfaces;
    std::size_t index = own_lights;
    for (const AddedLamp* lamp : lamps_in_order(edits)) {
        if (is_area(lamp->kind))
            surfaces.push_back({scene.lights[index], lamp->kind == LampKind::disc, extents[index]});
        ++index;
    }
    scene.lights.resize(scene.lights.size() - surfaces.size());
    add_area_lamps(surfaces, scene);
    if (edits.each_light) set_light_groups(separate_lights(scene, {}, subject), scene);
    if (!edits.ground) return;
    const std::size_t without = scene.instances.size();
    add_ground(scene, bounds, edits.ground_height);
    if (scene.instances.size() > without) scene.instances.back().link_class = links.ground;
}

void apply(const SceneEdits& edits, Scene& scene, const std::string& source) {
    apply(edits, scene, tree_of(scene), source);
}

}  // namespace halflight
