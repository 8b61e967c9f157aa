// The selected object of a session: what is selected, its surfaces, its place, and its properties as edits show them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "api/halflight/object_names.h"
#include "api/scene/node_edits.h"
#include "engine/scene/light_types.h"
#include "tools/view/session.h"

namespace halflight::view {
namespace {

NamedObjects cameras_of(const Scene& scene) {
    NamedObjects cameras{"camera", {}};
    for (const Camera& camera : scene.cameras) cameras.names.emplace_back(camera.name);
    return cameras;
}

/// Returns a scene of one instance that hangs below a node; edits of nodes move it as they move the node.
Scene marker_at(const std::string& name, int node) {
    Scene scene;
    scene.name = name;
    scene.meshes.emplace_back();
    scene.instances.push_back({.name = {}, .mesh = 0, .object_to_world = dmat4(1), .node = node});
    return scene;
}

}  // namespace

const ObjectReferences& Session::references() const {
    update_lights();
    return references_;
}

const std::vector<PunctualLight>& Session::lights() const {
    update_lights();
    return lights_;
}

void Session::update_lights() const {
    std::vector<std::pair<std::string, LampKind>> lamps;
    for (const AddedLamp* lamp : lamps_in_order(edits)) lamps.emplace_back(lamp->name, lamp->kind);
    if (scene_of_lights_ == scene_ && lamps_of_lights_ == lamps) return;
    scene_of_lights_ = scene_, lamps_of_lights_ = std::move(lamps);
    lights_ = scene_->lights;
    for (const AddedLamp* lamp : lamps_in_order(edits)) lights_.push_back(plain_light(*lamp));
    references_.lights = references_to(lights_of(lights_));
}

const AddedLamp* Session::added_lamp(std::size_t light) const {
    const std::size_t own = scene_->lights.size();
    return light < own ? nullptr : lamps_in_order(edits).at(light - own);
}

void Session::find_references(bool other_scene) {
    const std::vector<std::string> before = references_.lights;
    update_lights();
    // Environments bring lights of other names; other names do not depend on poses.
    const bool same_names = references_.lights == before && references_.materials.size() == scene_->materials.size() &&
                            references_.meshes.size() == scene_->meshes.size() &&
                            references_.nodes.size() == tree_->nodes.size() &&
                            references_.cameras.size() == scene_->cameras.size();
    if (!other_scene && same_names) return;  // poses come often, and leave names unchanged
    references_ = {references_to(lights_of(lights_)), references_to(materials_of(*scene_)),
                   references_to(meshes_of(*scene_)), references_to(nodes_of(*tree_)),
                   references_to(cameras_of(*scene_))};
    const auto has = [](const std::vector<std::string>& all, const std::string& name) {
        return std::ranges::find(all, name) != all.end();
    };
    if (other_scene) return;
    const auto vanished = [&](const std::string& light) {
        return has(before, light) && !has(references_.lights, light);
    };
    // A name without a kind may be that of other objects.
    const auto vanished_of_any = [&](const std::string& name) {
        constexpr std::string_view kLight = "light:";
        if (name.starts_with(kLight)) return vanished(name.substr(kLight.size()));
        return vanished(name) && !has(references_.nodes, name) && !has(references_.meshes, name) &&
               !has(references_.materials, name);
    };
    std::erase_if(edits.lights, [&](const NamedEdit<LightEdit>& edit) { return vanished(edit.name); });
    std::erase_if(edits.hidden, [&](const ObjectName& hidden) { return vanished_of_any(hidden.name); });
    for (LightGroup& group : edits.light_groups) std::erase_if(group.lights, vanished_of_any);
    std::erase_if(edits.light_groups, [](const LightGroup& group) { return group.lights.empty(); });
    for (auto* const links : {&edits.light_links, &edits.shadow_links})
        std::erase_if(*links, [&](const LightLink& link) { return vanished_of_any(link.light); });
    EditKeys keys = arguments_.choice.keys;
    std::erase_if(keys.tracks, [&](const EditTrack& track) {
        return (track.of == EditTrack::Of::lights && vanished(track.name)) ||
               (track.of == EditTrack::Of::hide && vanished_of_any(track.name));
    });
    take_keys(std::move(keys));
    if (selection.kind == ObjectKind::light && selection.index >= references_.lights.size()) selection = {};
}

void Session::find_again(const ObjectReferences& before) {
    const auto moved = [](const std::vector<std::string>& from, const std::vector<std::string>& to,
                          std::size_t index) -> std::optional<std::size_t> {
        const auto found = index < from.size() ? std::ranges::find(to, from[index]) : to.end();
        return found == to.end() ? std::nullopt : std::optional(static_cast<std::size_t>(found - to.begin()));
    };
    for (std::optional<std::size_t>* const camera : {&scene_camera_, &first_camera_})
        if (*camera) *camera = moved(before.cameras, references_.cameras, **camera);
    if (scene_camera_) {
        take_lens(camera());
        pose_ = pose_of(camera(), glm::length(pose_.at - pose_.from));
    }
    if (first_camera_)
        first_pose_ = pose_of(timeline_.cameras[*first_camera_], glm::length(first_pose_.at - first_pose_.from));
    using List = std::vector<std::string> ObjectReferences::*;
    for (const auto& [kind, list] :
         std::initializer_list<std::pair<ObjectKind, List>>{{ObjectKind::node, &ObjectReferences::nodes},
                                                            {ObjectKind::mesh, &ObjectReferences::meshes},
                                                            {ObjectKind::light, &ObjectReferences::lights},
                                                            {ObjectKind::material, &ObjectReferences::materials},
                                                            {ObjectKind::camera, &ObjectReferences::cameras}}) {
        if (selection.kind != kind) continue;
        const auto index = moved(before.*list, references_.*list, selection.index);
        selection = index ? Selection{kind, *index} : Selection();
        return;
    }
}

Scene Session::edited_values(const std::string& copy) const {
    Scene values;
    values.name = scene_->name;
    values.lights = scene_->lights;
    values.light_profiles = scene_->light_profiles;
    values.materials = scene_->materials;
    const SceneEdits now = edits_now();
    SceneEdits part = now;
    part.clay = false;
    part.emission = 1;  // a factor on all materials, which is not part of any
    part.transforms.clear();
    part.hidden.clear();
    part.catchers.clear();
    part.ground = false;
    part.added_lights.clear();
    if (!copy.empty())
        std::erase_if(part.lights, [&](const NamedEdit<LightEdit>& edit) {
            return std::ranges::find(lights(), edit.name, &PunctualLight::name) == lights().end() &&
                   matches_pattern(edit.name, copy);
        });
    for (const AddedLamp* lamp : lamps_in_order(now)) {
        AddedLamp& light = part.added_lights.emplace_back(*lamp);
        if (!is_area(light.kind)) continue;
        light.kind = LampKind::spot;  // with the same position and direction; surfaces are no lights of a scene
        light.edit.size.reset();
    }
    const std::vector<bool> lit = movable_nodes(values, *tree_);  // nodes that move lights; others change no values
    try {
        std::erase_if(part.nodes, [&](const NamedEdit<NodeEdit>& edit) {
            const auto named = find_objects(nodes_of(*tree_), edit.name, "edit");
            return std::ranges::none_of(named, [&](std::size_t index) { return lit[index]; });
        });
        apply(part, values, *tree_);
    } catch (const Error&) {  // the picture shows the error
        values.lights = lights();
    }
    return values;
}

std::optional<AreaLamp> Session::area_lamp(std::size_t light) const {
    const AddedLamp* const lamp = added_lamp(light);
    if (!lamp || !is_area(lamp->kind)) return std::nullopt;
    const SceneEdits now = edits_now();
    const AddedLamp& shown = *lamps_in_order(now).at(light - scene_->lights.size());
    return AreaLamp{edited_values().lights.at(light), shown.kind == LampKind::disc, size_of(shown, now)};
}

std::vector<std::size_t> Session::selected_instances() const {
    std::vector<std::size_t> selected;
    const bool node_selected = selection.kind == ObjectKind::node;
    if (pages_ || (!node_selected && selection.kind != ObjectKind::mesh)) return selected;
    const std::vector<Instance>& all = picker().instances();
    for (std::size_t i = 0; i < all.size(); ++i)
        if (node_selected ? below(all[i].node, selection.index)
                          : static_cast<std::size_t>(all[i].mesh) == selection.index)
            selected.push_back(i);
    return selected;
}

std::vector<int> Session::meshes_of_node() const {
    std::vector<int> meshes;
    if (selection.kind != ObjectKind::node) return meshes;
    for (const Instance& instance : scene_->instances)
        if (below(instance.node, selection.index)) meshes.push_back(instance.mesh);
    return meshes;
}

WorldBounds Session::selected_bounds() const {
    const double least = 0.01 * diagonal_;  // half the size of objects that are points
    WorldBounds box;
    if (selection.kind == ObjectKind::light) {
        const PunctualLight light = edited_values().lights.at(selection.index);
        dvec3 radius(std::max(double{light.radius}, least));
        if (const auto lamp = area_lamp(selection.index)) radius = dvec3(0.5 * glm::length(dvec2(lamp->size)));
        if (row_of(light.type).has_position) box = {light.position - radius, light.position + radius};
    } else if (selection.kind == ObjectKind::camera) {
        const dvec3 place(timeline_.cameras.at(selection.index).camera_to_world[3]);
        box = {place - least, place + least};
    } else if (selection.kind == ObjectKind::material && !pages_) {
        const auto material = static_cast<std::uint32_t>(selection.index);
        std::vector<bool> shows_it;  // by mesh
        for (const Mesh& mesh : scene_->meshes)
            shows_it.push_back(std::ranges::find(mesh.triangle_material, material) != mesh.triangle_material.end());
        const std::vector<Instance>& all = picker().instances();
        for (std::size_t i = 0; i < all.size(); ++i)
            if (shows_it[static_cast<std::size_t>(all[i].mesh)]) box = united(box, picker().bounds(i));
    } else {
        for (const std::size_t i : selected_instances()) box = united(box, picker().bounds(i));
    }
    return box;
}

bool Session::below(int node, std::size_t top) const {
    for (; node != kNone; node = tree_->nodes[static_cast<std::size_t>(node)].parent)
        if (static_cast<std::size_t>(node) == top) return true;
    return false;
}

std::optional<dvec3> Session::centre(std::size_t node) const {
    if (centre_ && centre_->node == node) return centre_->centre;
    WorldBounds box;
    for (std::size_t i = 0; i < picker_->instances().size(); ++i)
        if (below(picker_->instances()[i].node, node)) box = united(box, picker_->bounds(i));
    centre_ = {node, box.empty() ? std::nullopt : std::optional(0.5 * box.lower + 0.5 * box.upper)};
    return centre_->centre;
}

void Session::select(const dvec2& point, const ivec2& size) {
    const auto picked = pick(point, size);
    const Ray ray = ray_through(camera(), point, size);
    double nearest = picked ? glm::distance(picked->position, ray.origin) : std::numeric_limits<double>::infinity();
    std::optional<std::size_t> lamp;
    for (std::size_t i = scene_->lights.size(); i < lights().size(); ++i) {
        const auto area = area_lamp(i);
        if (!area) continue;
        const dmat4 to_lamp = glm::inverse(transform_of(*area));
        const dvec3 from(to_lamp * dvec4(ray.origin, 1)), along(to_lamp * dvec4(ray.direction, 0));
        const double t = -from.z / along.z;
        const dvec2 at(from + t * along);
        const bool inside = area->disc ? glm::length(at) <= 0.5 : std::max(std::abs(at.x), std::abs(at.y)) <= 0.5;
        if (t > 0 && t < nearest && inside) lamp = i, nearest = t;
    }
    if (lamp) return void(selection = {ObjectKind::light, *lamp});
    const int node = picked ? picker().instances()[picked->instance].node : kNone;
    selection = node == kNone ? Selection() : Selection{ObjectKind::node, static_cast<std::size_t>(node)};
}

void Session::select(const std::string& name) {
    const std::tuple<const char*, ObjectKind, NamedObjects> kinds[] = {
        {"node:", ObjectKind::node, nodes_of(*tree_)},
        {"light:", ObjectKind::light, lights_of(lights())},
        {"mesh:", ObjectKind::mesh, meshes_of(*scene_)},
        {"material:", ObjectKind::material, materials_of(*scene_)},
        {"camera:", ObjectKind::camera, cameras_of(*scene_)}};
    for (const auto& [prefix, kind, objects] : kinds)
        if (name.starts_with(prefix)) {
            const std::string rest = name.substr(std::string_view(prefix).size());
            selection = {kind, find_objects(objects, rest, "select").front()};
            return;
        }
    if (name != "environment" && name != "none")
        throw Error(
            "select",
            "expects node:NAME, light:NAME, mesh:NAME, material:NAME, camera:NAME, environment or none, not '{}'",
            name);
    selection = {name == "none" ? ObjectKind::none : ObjectKind::environment, 0};
}

std::string Session::name_of(const Selection& object) const {
    const auto named = [&](const char* kind, const std::vector<std::string>& references) {
        return fmt::format("{} {}", kind, references.at(object.index));
    };
    switch (object.kind) {
        case ObjectKind::node:
            return named("node", references_.nodes);
        case ObjectKind::mesh:
            return named("mesh", references_.meshes);
        case ObjectKind::light:
            return named("light", references().lights);
        case ObjectKind::material:
            return named("material", references_.materials);
        case ObjectKind::camera:
            return named("camera", references_.cameras);
        case ObjectKind::environment:
            return "environment";
        case ObjectKind::none:
            break;
    }
    return "nothing";
}

NodeFrame Session::node_frame(std::size_t index) const {
    const dmat4& own_matrix = tree_->nodes[index].to_world;
    NodeFrame frame{dvec3(own_matrix[3]), dmat4(1), dvec3(own_matrix[3])};
    const auto middle = pivots_on_origin ? std::nullopt : centre(index);
    if (middle) frame.pivot = *middle;
    const std::vector<NamedEdit<NodeEdit>> nodes = edits_now().nodes;
    const auto own = std::ranges::find(nodes, references_.nodes[index], &NamedEdit<NodeEdit>::name);
    if (own != nodes.end() && own->edit.matrix) {
        frame.origin = frame.pivot = dvec3((*own->edit.matrix)[3]);
        const bool invertible = glm::determinant(own_matrix) != 0;
        if (middle && invertible)
            frame.pivot = dvec3(*own->edit.matrix * (glm::inverse(own_matrix) * dvec4(*middle, 1)));
        return frame;
    }
    const int parent = tree_->nodes[index].parent;
    if (parent == kNone || nodes.empty()) return frame;
    SceneEdits moves;
    moves.nodes = nodes;
    Scene marker = marker_at(scene_->name, parent);
    try {
        apply(moves, marker, SceneTree{tree_->nodes, {}, {}});
        frame.above = marker.instances[0].object_to_world;
    } catch (const Error&) {  // the picture shows the error
    }
    return frame;
}

}  // namespace halflight::view
