// Scenes: loading, cameras and edits.
#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <array>
#include <nlohmann/json.hpp>
#include <variant>

#include "api/python/bindings.h"
#include "api/scene/added_surfaces.h"
#include "api/scene/scene_names.h"
#include "engine/io/files.h"
#include "engine/scene/light_types.h"
#include "engine/scene/material_properties.h"
#include "engine/settings/settings_table.h"

namespace halflight::python {
namespace {

using Triple = std::array<double, 3>;
using Matrix = std::array<std::array<double, 4>, 4>;  // four rows
using Environment3 = std::variant<std::monostate, Triple, std::string, std::filesystem::path>;

dvec3 vec(const Triple& t) {
    return {t[0], t[1], t[2]};
}

template <class V>
Triple triple(const V& v) {
    return {double(v.x), double(v.y), double(v.z)};
}

std::optional<dvec3> vec(const std::optional<Triple>& t) {
    return t ? std::optional(vec(*t)) : std::nullopt;
}

EnvironmentChoice environment_of(const Environment3& e) {
    if (const auto* color = std::get_if<Triple>(&e))
        return parse_environment("environment", fmt::format("{},{},{}", (*color)[0], (*color)[1], (*color)[2]));
    if (const auto* name = std::get_if<std::string>(&e)) return parse_environment("environment", *name);
    if (const auto* map = std::get_if<std::filesystem::path>(&e)) return *map;
    return std::monostate();
}

std::shared_ptr<PyScene> load(const std::filesystem::path& path, const Environment3& environment,
                              const std::optional<std::string>& sky, const std::optional<std::string>& animation,
                              const std::optional<std::string>& fps, FrameNumber frame_offset, bool allow_outside,
                              bool strict, const std::optional<std::string>& variant, bool mip_levels,
                              std::optional<double> line_width, bool lamps,
                              const std::optional<std::filesystem::path>& settings, py::object log) {
    SceneChoice choice;
    CameraChoice camera;
    SavedSettings saved;
    if (settings) {
        saved = read_settings(*settings);
        take_settings(saved, *settings, choice, camera);
    }
    choice.scene = path;
    if (const EnvironmentChoice wanted = environment_of(environment); !std::holds_alternative<std::monostate>(wanted)) {
        if (sky) throw Error("sky", "cannot be given together with environment");
        choice.environment = wanted;
    }
    if (sky) choice.environment = parse_clear_sky("sky", *sky);
    if (animation) choice.animation = animation;
    if (fps) choice.frame_rate = parse_frame_rate("fps", *fps);
    choice.frame_offset = frame_offset;
    choice.allow_outside = allow_outside;
    choice.strict_scene = strict;
    if (variant) choice.variant = *variant;
    choice.mip_levels = mip_levels;
    choice.lamps = lamps;
    if (line_width && !(*line_width >= 0 && *line_width <= kLineWidth.upper))
        throw Error("line_width", "is not between 0 and {}", kLineWidth.upper);
    if (line_width) choice.line_width = *line_width;
    const Log sink = log_to(std::move(log));
    const Unlocked unlocked;
    return std::make_shared<PyScene>(PyScene{LoadedScene(std::move(choice), camera, sink), std::move(saved)});
}

/// Changes the edits by f(edits, scene), and then applies them.
template <class F>
void edit(PyScene& s, F f) {
    const Busy busy(s);
    SceneEdits edits = s.scene.edits();
    f(edits, s.scene.scene());
    s.scene.edit(std::move(edits));
}

template <class T>
std::vector<std::string> names_of(const std::vector<T>& things) {
    std::vector<std::string> names;
    for (const T& thing : things) names.push_back(thing.name);
    return names;
}

using Texts = std::map<std::string, std::string>;  // keys of an edit (api/halflight/edit_text.h) and their values

void edit_light(PyScene& s, const std::string& which, const Texts& values) {
    edit(s, [&](SceneEdits& edits, const Scene&) {
        LightEdit& light = light_edit(edits, which);
        for (const auto& [key, text] : values) set_key(light, fmt::format("light '{}'", which), key, text);
    });
}

void add_light(PyScene& s, const std::string& name, const std::string& kind, const Texts& values) {
    edit(s, [&](SceneEdits& edits, const Scene&) {
        const std::string subject = fmt::format("light '{}'", name);
        AddedLamp lamp{name, lamp_kind(subject, kind)};
        for (const auto& [key, text] : values) set_key(lamp.edit, subject, key, text);
        edits.added_lights.push_back(std::move(lamp));
    });
}

void remove_light(PyScene& s, const std::string& name) {
    edit(s, [&](SceneEdits& edits, const Scene& scene) {
        if (std::erase_if(edits.added_lights, [&](const AddedLamp& lamp) { return lamp.name == name; }) == 0)
            throw Error(scene.name, "there is no added light '{}'; edit_light(..., off=True) switches others off",
                        name);
    });
}

void edit_material(PyScene& s, const std::string& which, const Texts& values) {
    edit(s, [&](SceneEdits& edits, const Scene&) {
        MaterialEdit& material = material_edit(edits, which);
        for (const auto& [key, text] : values) set_key(material, fmt::format("material '{}'", which), key, text);
    });
}

/// No values restore the node's own transform.
void edit_node(PyScene& s, const std::string& which, const Texts& values) {
    edit(s, [&](SceneEdits& edits, const Scene&) {
        NodeEdit& node = node_edit(edits, which);
        if (values.empty()) node = {};
        for (const auto& [key, text] : values) set_key(node, fmt::format("node '{}'", which), key, text);
    });
}

void hide(PyScene& s, const std::vector<std::string>& names) {
    edit(s, [&](SceneEdits& edits, const Scene&) {
        for (const std::string& name : names) add_hidden(edits, "", name);
    });
}

void show(PyScene& s, const std::vector<std::string>& names) {
    edit(s, [&](SceneEdits& edits, const Scene& scene) {
        for (const std::string& name : names)
            if (std::erase(edits.hidden, ObjectName{name}) == 0) throw Error(scene.name, "'{}' is not hidden", name);
    });
}

/// names: in place of earlier ones.
void set_shadow_catchers(PyScene& s, const std::vector<std::string>& names) {
    edit(s, [&](SceneEdits& edits, const Scene&) {
        edits.catchers.clear();
        for (const std::string& name : names) add_catcher(edits, "", name);
    });
}

/// Replaces all light groups by these, or by one of each light.
void set_light_groups(PyScene& s, const std::vector<std::pair<std::string, std::vector<std::string>>>& groups,
                      bool each) {
    edit(s, [&](SceneEdits& edits, const Scene&) {
        edits.light_groups.clear(), edits.each_light = each;
        for (const auto& [name, lights] : groups) edits.light_groups.push_back({name, lights});
    });
}

using Links = std::vector<std::pair<std::string, std::vector<std::string>>>;

/// Replaces all links of lights, or of their shadows, by these.
void set_links(PyScene& s, std::vector<LightLink> SceneEdits::*which, const Links& links) {
    edit(s, [&](SceneEdits& edits, const Scene&) {
        (edits.*which).clear();
        for (const auto& [light, objects] : links) (edits.*which).push_back({light, objects});
    });
}

/// Returns the render settings of the settings file, by the names of keyword arguments.
Texts file_settings(const PyScene& s) {
    Texts texts;
    RenderSettings settings = s.saved.settings;
    settings.preview.temporal = false;  // single pictures have no earlier ones
    for (const std::string_view name : s.saved.given)
        if (const std::string text = setting(name).get(settings); !text.empty()) texts.emplace(name, text);
    if (s.saved.size)
        texts["width"] = std::to_string(s.saved.size->x), texts["height"] = std::to_string(s.saved.size->y);
    if (s.saved.moment) texts["frame"] = std::to_string(s.saved.moment->frame);
    return texts;
}

void save_settings(const PyScene& s, const std::filesystem::path& path) {
    const SceneChoice& choice = s.readable().choice();
    const CameraChoice& camera = s.readable().camera_choice();
    SavedSettings saved = s.saved;
    saved.camera = std::monostate();
    if (camera.camera) saved.camera = *camera.camera;
    if (camera.pose) saved.camera = *camera.pose;
    if (camera.look_from) {
        CameraPose pose;
        pose.from = *camera.look_from, pose.at = *camera.look_at, pose.up = camera.up;
        pose.vertical_fov = glm::radians(camera.vertical_fov);
        saved.camera = pose;
    }
    saved.variant = choice.variant;
    saved.line_width = choice.line_width;
    saved.environment = choice.environment;
    saved.light_azimuth = choice.light_azimuth;
    saved.edits = choice.edits;
    make_folder_of(path);
    write_settings(path, saved);
}

py::dict material(const PyScene& s, std::size_t index) {
    const Scene& scene = s.readable().scene();
    if (index >= scene.materials.size())
        throw Error(scene.name, "there is no material {}; the scene has {}, numbered from 0", index,
                    scene.materials.size());
    py::dict values;
    for (const MaterialProperty& p : material_properties()) {
        const vec4 v = value_of(scene.materials[index], p.field);
        const int count = component_count(p.field);
        if (count == 1) {
            values[p.name] = v[0];
        } else {
            py::tuple all(static_cast<std::size_t>(count));
            for (int i = 0; i < count; ++i) all[static_cast<std::size_t>(i)] = v[i];
            values[p.name] = all;
        }
    }
    return values;
}

py::dict light(const Scene& scene, const PunctualLight& l) {
    const bool plain = l.profile == kNone;
    const std::string profile = plain ? "" : scene.light_profiles[static_cast<std::size_t>(l.profile)].name;
    return py::dict(py::arg("name") = l.name, py::arg("type") = row_of(l.type).name,
                    py::arg("intensity") = triple(l.intensity), py::arg("position") = triple(l.position),
                    py::arg("direction") = triple(l.direction), py::arg("radius") = l.radius,
                    py::arg("angle") = glm::degrees(l.angle), py::arg("inner") = glm::degrees(l.inner_cone),
                    py::arg("outer") = glm::degrees(l.outer_cone), py::arg("profile") = profile);
}

/// Returns the transform of an instance with its edits; its own one if it is hidden.
Matrix transform(const PyScene& s, std::size_t index) {
    const Scene& scene = s.readable().scene();
    const std::vector<Instance>& all = s.readable().unedited_instances();
    if (index >= all.size())
        throw Error(scene.name, "there is no instance {}; the scene has {}, numbered from 0", index, all.size());
    // Edits keep the order, and hide all instances of a node or none.
    std::size_t place = 0;
    const auto is_shown = [&](std::size_t i) {
        return place < scene.instances.size() && scene.instances[place].node == all[i].node;
    };
    for (std::size_t i = 0; i < index; ++i) place += is_shown(i) ? 1 : 0;
    const Instance& instance = is_shown(index) ? scene.instances[place] : all[index];
    const dmat4 m = glm::transpose(instance.object_to_world);
    Matrix rows{};
    for (int r = 0; r < 4; ++r)
        for (int c = 0; c < 4; ++c) rows[std::size_t(r)][std::size_t(c)] = m[r][c];
    return rows;
}

void edit_transform(PyScene& s, std::size_t index, const std::optional<Matrix>& rows) {
    edit(s, [&](SceneEdits& edits, const Scene&) {
        if (!rows) return void(edits.transforms.erase(index));
        dmat4 m{1};
        for (int r = 0; r < 4; ++r)
            for (int c = 0; c < 4; ++c) m[c][r] = (*rows)[std::size_t(r)][std::size_t(c)];
        edits.transforms[index] = m;
    });
}

void edit_environment(PyScene& s, std::optional<double> rotation, std::optional<float> intensity,
                      const std::optional<Triple>& tint) {
    edit(s, [&](SceneEdits& edits, const Scene&) {
        if (rotation) edits.environment_rotation = *rotation;
        if (intensity) edits.environment_intensity = *intensity;
        if (tint) edits.environment_tint = vec3(vec(*tint));
    });
}

void set_camera(PyScene& s, const std::optional<std::string>& name, const std::optional<Triple>& look_from,
                const std::optional<Triple>& look_at, const Triple& up, double vfov) {
    const Busy busy(s);
    CameraChoice choice;
    choice.camera = name;
    choice.look_from = vec(look_from);
    choice.look_at = vec(look_at);
    choice.up = vec(up);
    choice.vertical_fov = vfov;
    s.scene.set_camera(choice);
}

}  // namespace

void bind_scene(py::module_& module) {
    module.def("load", &load);
    py::class_<PyScene, std::shared_ptr<PyScene>>(module, "Scene")
        .def_property_readonly("file", [](const PyScene& s) { return s.readable().choice().scene; })
        .def_property_readonly("variants", [](const PyScene& s) { return s.readable().variants(); })
        .def_property_readonly("cameras", [](const PyScene& s) { return names_of(s.readable().scene().cameras); })
        .def_property_readonly("materials", [](const PyScene& s) { return names_of(s.readable().scene().materials); })
        .def_property_readonly("instances",
                               [](const PyScene& s) { return names_of(s.readable().unedited_instances()); })
        .def_property_readonly("lights",
                               [](const PyScene& s) {
                                   py::list all;
                                   const Scene& scene = s.readable().scene();
                                   for (const PunctualLight& l : scene.lights) all.append(light(scene, l));
                                   for (const AreaLamp& lamp : area_lamps_of(scene)) {
                                       py::dict one = light(scene, lamp.light);
                                       one["type"] = name(lamp.disc ? LampKind::disc : LampKind::rectangle);
                                       one["size"] = std::make_pair(lamp.size.x, lamp.size.y);
                                       all.append(std::move(one));
                                   }
                                   return all;
                               })
        .def_property_readonly("bounds",
                               [](const PyScene& s) {
                                   const WorldBounds box = world_bounds(s.readable().scene());
                                   return std::make_pair(triple(box.lower), triple(box.upper));
                               })
        .def_property_readonly("frame_rate", [](const PyScene& s) { return text(s.readable().frame_rate()); })
        .def_property_readonly("camera", [](const PyScene& s) { return s.readable().chosen_camera().camera.name; })
        .def("set_camera", &set_camera)
        .def("material", &material)
        .def("transform", &transform)
        .def("edit_light", &edit_light)
        .def("add_light", &add_light)
        .def("remove_light", &remove_light)
        .def("edit_material", &edit_material)
        .def("edit_node", &edit_node)
        .def("hide", &hide)
        .def("show", &show)
        .def("set_shadow_catchers", &set_shadow_catchers)
        .def_property_readonly("shadow_catchers",
                               [](const PyScene& s) {
                                   std::vector<std::string> names;
                                   for (const ObjectName& c : s.readable().edits().catchers) names.push_back(c.name);
                                   return names;
                               })
        .def("set_ground",
             [](PyScene& s, bool on, std::optional<double> height) {
                 edit(s, [&](SceneEdits& edits, const Scene&) {
                     edits.ground = on;
                     edits.ground_height = on ? height : std::nullopt;
                 });
             })
        .def_property_readonly("ground", [](const PyScene& s) { return s.readable().edits().ground; })
        .def("set_light_groups", &set_light_groups)
        .def_property_readonly("light_groups", [](const PyScene& s) { return s.readable().scene().light_groups; })
        .def("set_light_links", [](PyScene& s, const Links& links) { set_links(s, &SceneEdits::light_links, links); })
        .def("set_shadow_links", [](PyScene& s, const Links& links) { set_links(s, &SceneEdits::shadow_links, links); })
        .def_property_readonly("hidden",
                               [](const PyScene& s) {
                                   std::vector<std::string> names;
                                   for (const ObjectName& h : s.readable().edits().hidden) names.push_back(h.name);
                                   return names;
                               })
        .def_property_readonly("nodes", [](const PyScene& s) { return names_of(s.readable().tree().nodes); })
        .def_property_readonly("settings", &file_settings)
        .def("save_settings", &save_settings)
        .def("edit_options",
             [](const PyScene& s) {
                 return option_lines(name_facts(s.readable().scene(), s.scene.tree(), s.scene.variants()));
             })
        .def("edit_transform", &edit_transform)
        .def("edit_environment", &edit_environment)
        .def("edit_emission",
             [](PyScene& s, float factor) { edit(s, [&](SceneEdits& e, const Scene&) { e.emission = factor; }); })
        .def("set_clay", [](PyScene& s, bool on) { edit(s, [&](SceneEdits& e, const Scene&) { e.clay = on; }); })
        .def("reset_edits", [](PyScene& s) { edit(s, [](SceneEdits& e, const Scene&) { e = {}; }); });
}

}  // namespace halflight::python
