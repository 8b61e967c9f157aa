#include <algorithm>
#include <cmath>
#include <functional>

#include "engine/core/error.h"
#include "engine/scene/geometry.h"
#include "engine/scene/light_types.h"
#include "engine/scene/material_properties.h"
#include "engine/scene/scene.h"

namespace halflight {
namespace {

// Tolerance for the square of a unit length. Normalising in float32 leaves a few roundings, and so does a rotation in
// double of values from float32.
constexpr double kUnitTolerance = 16 * double(std::numeric_limits<float>::epsilon());

/// An element of a list. Messages such as "meshes[3].normals[7]" are built only when needed.
struct Element {
    const char* list;
    std::size_t index;
    std::string at(const char* field) const { return fmt::format("{}[{}].{}", list, index, field); }
    std::string at(const char* field, std::size_t i) const {
        return fmt::format("{}[{}].{}[{}]", list, index, field, i);
    }
};

bool in_unit_range(float x) {
    return x >= 0 && x <= 1;
}

bool non_negative(const vec3& v) {
    return all_finite(v) && glm::all(glm::greaterThanEqual(v, vec3(0)));
}

bool is_unit(const dvec3& v) {
    return std::abs(glm::dot(v, v) - 1) <= kUnitTolerance;
}

bool is_finite(const dmat4& m) {
    for (int i = 0; i < 16; ++i) {
        if (!std::isfinite(m[i / 4][i % 4])) return false;
    }
    return true;
}

void check(const TextureImage& image, const Element& e) {
    if (image.width < 1 || image.height < 1) throw Error(e.at("width"), "an image has at least one texel");
    if (image.tiles && image.rgba.empty()) return;
    const std::size_t expected = 4 * static_cast<std::size_t>(image.pitch()) * static_cast<std::size_t>(image.height);
    if (image.rgba.size() != expected) throw Error(e.at("rgba"), "{} bytes, expected {}", image.rgba.size(), expected);
}

void check(const TextureRef& t, const std::string& subject, std::size_t images) {
    if (t.image == kNone) return;
    if (t.image < 0 || static_cast<std::size_t>(t.image) >= images)
        throw Error(subject, "image {} does not exist, there are {}", t.image, images);
    if (t.uv_set < 0 || t.uv_set > 1) throw Error(subject, "uv set {} is neither 0 nor 1", t.uv_set);
    for (int column = 0; column < 3; ++column) {
        if (!std::isfinite(t.uv_transform[column].x) || !std::isfinite(t.uv_transform[column].y))
            throw Error(subject, "uv transform is not finite");
    }
}

void check(const Material& m, const Element& e, std::size_t images) {
    for (const MaterialTexture& texture : material_textures()) check(m.*texture.field, e.at(texture.name), images);
    for (const MaterialProperty& property : material_properties()) {
        const std::string why = range_error(property, value_of(m, property.field));
        if (!why.empty()) throw Error(e.at(property.name), why);
    }
}

template <class T>
void check_length(const std::vector<T>& values, const Mesh& mesh, const Element& e, const char* name, bool required) {
    if (values.size() == mesh.positions.size() || (values.empty() && !required)) return;
    throw Error(e.at(name), "{} values for {} vertices", values.size(), mesh.positions.size());
}

void check(const Mesh& mesh, const Element& e, std::size_t materials) {
    check_length(mesh.normals, mesh, e, "normals", true);
    check_length(mesh.tangents, mesh, e, "tangents", false);
    check_length(mesh.uvs[0], mesh, e, "uvs[0]", false);
    check_length(mesh.uvs[1], mesh, e, "uvs[1]", false);
    check_length(mesh.colors, mesh, e, "colors", false);
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        if (!all_finite(mesh.positions[i])) throw Error(e.at("positions", i), "not finite");
        if (!is_unit(mesh.normals[i])) throw Error(e.at("normals", i), "not of unit length");
    }
    for (std::size_t i = 0; i < mesh.tangents.size(); ++i) {
        const vec4& t = mesh.tangents[i];
        if (!is_unit(vec3(t)) || std::abs(t.w) != 1) throw Error(e.at("tangents", i), "not unit, or w is not 1 or -1");
    }
    for (int set = 0; set < 2; ++set) {
        for (std::size_t i = 0; i < mesh.uvs[set].size(); ++i) {
            if (!all_finite(vec3(mesh.uvs[set][i], 0)))
                throw Error(e.at(set == 0 ? "uvs[0]" : "uvs[1]", i), "not finite");
        }
    }
    for (std::size_t i = 0; i < mesh.colors.size(); ++i) {
        const vec4& c = mesh.colors[i];
        if (!(in_unit_range(c.r) && in_unit_range(c.g) && in_unit_range(c.b) && in_unit_range(c.a)))
            throw Error(e.at("colors", i), "outside [0, 1]");
    }
    if (mesh.triangle_material.size() != mesh.triangles.size())
        throw Error(e.at("triangle_material"), "{} values for {} triangles", mesh.triangle_material.size(),
                    mesh.triangles.size());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const uvec3& t = mesh.triangles[i];
        if (std::max({t.x, t.y, t.z}) >= mesh.positions.size())
            throw Error(e.at("triangles", i), "vertex {} does not exist, there are {}", std::max({t.x, t.y, t.z}),
                        mesh.positions.size());
        if (area_vector(mesh, t) == dvec3(0)) throw Error(e.at("triangles", i), "has no area");
        if (mesh.triangle_material[i] >= materials)
            throw Error(e.at("triangle_material", i), "material {} does not exist, there are {}",
                        mesh.triangle_material[i], materials);
    }
}

void check(const Instance& instance, const Element& e, std::size_t meshes) {
    if (instance.mesh < 0 || static_cast<std::size_t>(instance.mesh) >= meshes)
        throw Error(e.at("mesh"), "mesh {} does not exist, there are {}", instance.mesh, meshes);
    if (!is_affine(instance.object_to_world)) throw Error(e.at("object_to_world"), "not finite, or not affine");
}

void check(const LightProfile& profile, const Element& e) {
    const auto ascends = [](const std::vector<float>& angles, float most) {
        return angles.front() >= 0 && angles.back() <= most &&
               std::ranges::adjacent_find(angles, std::greater_equal()) == angles.end();
    };
    const std::vector<float>&vertical = profile.vertical, &horizontal = profile.horizontal;
    if (vertical.size() < 2 || !ascends(vertical, static_cast<float>(kPi)))
        throw Error(e.at("vertical"), "not two or more ascending angles from 0 to pi");
    const bool turns = !horizontal.empty() && horizontal.front() == 0 &&
                       horizontal.back() == (horizontal.size() > 1 ? static_cast<float>(2 * kPi) : 0);
    if (!turns || !ascends(horizontal, static_cast<float>(2 * kPi)))
        throw Error(e.at("horizontal"), "neither 0 nor ascending angles from 0 to 2 pi");
    if (profile.shares.size() != vertical.size() * horizontal.size())
        throw Error(e.at("shares"), "{} values for {} x {} angles", profile.shares.size(), vertical.size(),
                    horizontal.size());
    if (!std::ranges::all_of(profile.shares, in_unit_range)) throw Error(e.at("shares"), "outside [0, 1]");
}

void check(const PunctualLight& light, const Element& e, std::size_t profiles) {
    if (light.profile != kNone) {
        if (light.profile < 0 || static_cast<std::size_t>(light.profile) >= profiles)
            throw Error(e.at("profile"), "profile {} does not exist, there are {}", light.profile, profiles);
        if (light.type != LightType::point) throw Error(e.at("profile"), "only points have one");
        const dmat3 axes(light.right, light.up, light.direction);
        for (int i = 0; i < 3; ++i)
            if (!is_unit(axes[i]) || std::abs(glm::dot(axes[i], axes[(i + 1) % 3])) > kUnitTolerance)
                throw Error(e.at("right"), "its axes are not orthonormal");
    }
    if (!non_negative(light.intensity)) throw Error(e.at("intensity"), "negative or not finite");
    for (int axis = 0; axis < 3; ++axis) {
        if (!std::isfinite(light.position[axis])) throw Error(e.at("position"), "not finite");
    }
    if (!is_unit(light.direction)) throw Error(e.at("direction"), "not of unit length");
    for (const LightProperty& property : light_properties())
        if (const std::string why = range_error(property.range, light.*property.field); !why.empty())
            throw Error(e.at(property.name), why);
    if (light.inner_cone >= light.outer_cone) throw Error(e.at("outer_cone"), "not greater than the inner cone");
}

void check(const Camera& camera, const Element& e) {
    const dmat4& m = camera.camera_to_world;
    bool orthonormal = is_affine(m);
    for (int i = 0; i < 3; ++i) {
        orthonormal = orthonormal && is_unit(m[i]) && std::abs(glm::dot(m[i], m[(i + 1) % 3])) <= kUnitTolerance;
    }
    if (!orthonormal) throw Error(e.at("camera_to_world"), "not orthonormal");
    if (!camera.orthographic && !(camera.vertical_fov > 0 && camera.vertical_fov < kPi))
        throw Error(e.at("vertical_fov"), "{} is outside (0, pi)", camera.vertical_fov);
    if (camera.orthographic && !(camera.ortho_height > 0 && std::isfinite(camera.ortho_height)))
        throw Error(e.at("ortho_height"), "{} is not positive and finite", camera.ortho_height);
    for (const double x : {camera.aspect, camera.near_plane, camera.far_plane}) {
        if (!(x >= 0 && std::isfinite(x))) throw Error(e.at("aspect"), "aspect and planes are finite and not negative");
    }
    if (camera.far_plane != 0 && camera.far_plane <= camera.near_plane)
        throw Error(e.at("far_plane"), "not beyond the near plane");
    if (const std::string problem = lens_problem(camera); !problem.empty()) throw Error(e.at("lens"), problem);
    if (const std::string problem = optics_problem(camera); !problem.empty()) throw Error(e.at("optics"), problem);
}

void check(const Environment& environment) {
    if (!non_negative(environment.color)) throw Error("environment.color", "negative or not finite");
    const Image& map = environment.map;
    if (map.pixels.empty()) return;
    if (map.channels != 3 || map.width < 1 || map.height < 1 ||
        map.pixels.size() != 3 * static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height))
        throw Error("environment.map", "not three channels of width x height");
    for (const float x : map.pixels) {
        if (!(x >= 0 && std::isfinite(x))) throw Error("environment.map", "negative or not finite");
    }
}

}  // namespace

bool is_affine(const dmat4& m) {
    return is_finite(m) && m[0].w == 0 && m[1].w == 0 && m[2].w == 0 && m[3].w == 1;
}

void validate(const Scene& scene) {
    const auto each = [](const char* list, const auto& elements, auto... counts) {
        for (std::size_t i = 0; i < elements.size(); ++i) check(elements[i], Element{list, i}, counts...);
    };
    each("images", scene.images);
    each("materials", scene.materials, scene.images.size());
    each("meshes", scene.meshes, scene.materials.size());
    each("instances", scene.instances, scene.meshes.size());
    each("light_profiles", scene.light_profiles);
    each("lights", scene.lights, scene.light_profiles.size());
    each("cameras", scene.cameras);
    check(scene.environment);
}

void validate(const Mesh& mesh, std::size_t index, std::size_t materials) {
    check(mesh, Element{"meshes", index}, materials);
}

}  // namespace halflight
