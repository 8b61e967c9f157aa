// Scenes: loading, cameras and edits.
#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <array>
#include <variant>

#include "api/python/bindings.h"
#include "engine/scene/light_types.h"
#include "engine/scene/material_properties.h"

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
    if (const auto* color = std::get_if<Triple>(&e)) return vec3(vec(*color));
    if (const auto* name = std::get_if<std::string>(&e)) return parse_environment("environment", *name);
    if (const auto* map = std::get_if<std::filesystem::path>(&e)) return *map;
    return std::monostate();
}

std::shared_ptr<PyScene> load(const std::filesystem::path& path, const Environment3& environment,
                              const std::optional<std::string>& sky, const std::optional<std::string>& animation,
                              const std::optional<std::string>& fps, bool allow_outside, bool strict,
                              const std::optional<std::string>& variant, bool mip_levels, double line_width,
                              py::object log) {
    SceneChoice choice;
    choice.scene = path;
    choice.environment = environment_of(environment);
    if (sky && !std::holds_alternative<std::monostate>(choice.environment))
        throw Error("sky", "cannot be given together with environment");
    if (sky) choice.environment = parse_clear_sky("sky", *sky);
    choice.animation = animation;
    if (fps) choice.frame_rate = parse_frame_rate("fps", *fps);
    choice.allow_outside = allow_outside;
    choice.strict_textures = strict;
    choice.variant = variant.value_or("");
    choice.mip_levels = mip_levels;
    if (!(line_width >= 0 && line_width <= kLineWidth.upper))
        throw Error("line_width", "is not between 0 and {}", kLineWidth.upper);
    choice.line_width = line_width;
    const Log sink = log_to(std::move(log));
    const py::gil_scoped_release released;
    return std::make_shared<PyScene>(PyScene{LoadedScene(std::move(choice), {}, sink)});
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

void edit_light(PyScene& s, std::size_t index, std::optional<float> factor, const std::optional<Triple>& color,
                const std::optional<Triple>& position, const std::optional<Triple>& direction) {
    edit(s, [&](SceneEdits& edits, const Scene& scene) {
        if (index >= scene.lights.size())
            throw Error(scene.name, "there is no light {}; the scene has {}, numbered from 0", index,
                        scene.lights.size());
        if (edits.lights.size() <= index) edits.lights.resize(index + 1);
        LightEdit& light = edits.lights[index];
        if (factor) light.factor = *factor;
        if (color) light.color = vec3(vec(*color));
        if (position) light.position = vec(*position);
        if (!direction) return;
        light.direction = unit_direction(vec(*direction));
        if (!light.direction) throw Error("light", "the direction has no length");
    });
}

py::dict material(const PyScene& s, std::size_t index) {
    const Scene& scene = s.scene.scene();
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

py::dict light(const PunctualLight& l) {
    return py::dict(py::arg("name") = l.name, py::arg("type") = row_of(l.type).name,
                    py::arg("intensity") = triple(l.intensity), py::arg("position") = triple(l.position),
                    py::arg("direction") = triple(l.direction));
}

Matrix transform(const PyScene& s, std::size_t index) {
    const Scene& scene = s.scene.scene();
    if (index >= scene.instances.size())
        throw Error(scene.name, "there is no instance {}; the scene has {}, numbered from 0", index,
                    scene.instances.size());
    const dmat4 m = glm::transpose(scene.instances[index].object_to_world);
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
        .def_property_readonly("file", [](const PyScene& s) { return s.scene.choice().scene; })
        .def_property_readonly("variants", [](const PyScene& s) { return s.scene.variants(); })
        .def_property_readonly("cameras", [](const PyScene& s) { return names_of(s.scene.scene().cameras); })
        .def_property_readonly("materials", [](const PyScene& s) { return names_of(s.scene.scene().materials); })
        .def_property_readonly("instances", [](const PyScene& s) { return names_of(s.scene.scene().instances); })
        .def_property_readonly("lights",
                               [](const PyScene& s) {
                                   py::list all;
                                   for (const PunctualLight& l : s.scene.scene().lights) all.append(light(l));
                                   return all;
                               })
        .def_property_readonly("bounds",
                               [](const PyScene& s) {
                                   const WorldBounds box = world_bounds(s.scene.scene());
                                   return std::make_pair(triple(box.lower), triple(box.upper));
                               })
        .def_property_readonly("frame_rate", [](const PyScene& s) { return text(s.scene.frame_rate()); })
        .def_property_readonly("camera", [](const PyScene& s) { return s.scene.chosen_camera().camera.name; })
        .def("set_camera", &set_camera)
        .def("material", &material)
        .def("transform", &transform)
        .def("edit_light", &edit_light)
        .def("edit_material",
             [](PyScene& s, std::size_t index, const std::map<std::string, std::vector<float>>& values) {
                 edit(s, [&](SceneEdits& edits, const Scene&) {
                     for (const auto& [name, components] : values) edits.materials[index][name] = components;
                 });
             })
        .def("edit_transform", &edit_transform)
        .def("edit_environment", &edit_environment)
        .def("edit_emission",
             [](PyScene& s, float factor) { edit(s, [&](SceneEdits& e, const Scene&) { e.emission = factor; }); })
        .def("set_clay", [](PyScene& s, bool on) { edit(s, [&](SceneEdits& e, const Scene&) { e.clay = on; }); })
        .def("reset_edits", [](PyScene& s) { edit(s, [](SceneEdits& e, const Scene&) { e = {}; }); });
}

}  // namespace halflight::python
