#include "tools/view/outliner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <utility>

#include "api/halflight/edit_text.h"
#include "api/halflight/object_names.h"
#include "engine/core/one_line.h"

namespace halflight::view {
namespace {

std::string lower(std::string text) {
    std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return text;
}

std::string label_of(const std::string& name, const char* kind, std::size_t index) {
    return name.empty() ? fmt::format("{} {}", kind, index) : one_line(name);
}

/// Appends the nodes of the scene, each before its children.
void add_nodes(const SceneTree& tree, std::vector<Outliner::Row>& rows) {
    std::vector<std::vector<std::size_t>> children(tree.nodes.size());
    std::vector<std::pair<std::size_t, int>> todo;
    for (std::size_t i = tree.nodes.size(); i-- > 0;) {
        const SceneNode& node = tree.nodes[i];
        if (!node.in_scene) continue;
        if (node.parent == kNone)
            todo.emplace_back(i, 0);
        else
            children[static_cast<std::size_t>(node.parent)].push_back(i);
    }
    while (!todo.empty()) {
        const auto [i, depth] = todo.back();
        todo.pop_back();
        rows.push_back({{ObjectKind::node, i}, depth, label_of(tree.nodes[i].name, "node", i)});
        for (const std::size_t child : children[i]) todo.emplace_back(child, depth + 1);
    }
}

template <class T>
void add_objects(const std::vector<T>& objects, ObjectKind kind, const char* name, std::vector<Outliner::Row>& rows) {
    for (std::size_t i = 0; i < objects.size(); ++i) rows.push_back({{kind, i}, 0, label_of(objects[i].name, name, i)});
}

struct HidingKind {
    const char* prefix;
    ObjectKind kind;
    NamedObjects objects;
    const std::vector<std::string>& references;
};

/// Returns the kinds of objects that names can hide.
std::vector<HidingKind> hiding_kinds(const Session& s) {
    return {{"node:", ObjectKind::node, nodes_of(s.tree()), s.references().nodes},
            {"mesh:", ObjectKind::mesh, meshes_of(s.scene()), s.references().meshes},
            {"light:", ObjectKind::light, lights_of(s.lights()), s.references().lights}};
}

/// Returns what a name hides; nothing if it finds nothing, which the picture reports.
std::vector<Selection> hidden_by(const std::string& name, const std::vector<HidingKind>& kinds) {
    std::vector<Selection> all;
    for (const HidingKind& k : kinds) {
        std::vector<std::size_t> found;
        if (name.starts_with(k.prefix)) {
            const std::string rest = name.substr(std::string_view(k.prefix).size());
            found = objects_named(k.objects, rest);
            const bool number = !rest.empty() && rest.size() < 10 &&
                                std::ranges::all_of(rest, [](unsigned char c) { return std::isdigit(c) != 0; });
            if (found.empty() && number && std::stoul(rest) < k.objects.names.size()) found = {std::stoul(rest)};
        } else {
            found = objects_named(k.objects, name);
        }
        for (const std::size_t i : found) all.push_back({k.kind, i});
    }
    return all;
}

/// Returns the lights that the name of an edit means; none if it finds nothing.
std::vector<std::size_t> lights_named(const std::string& name, const Session& s) {
    try {
        return find_objects(lights_of(s.lights()), name, "");
    } catch (const Error&) {
        return {};
    }
}

/// Switches a light on or off. An edit that switches off several lights is divided.
void switch_light(Session& s, std::size_t index, bool on) {
    SceneEdits& edits = s.edits;
    const auto& references = s.references().lights;
    if (!on) {
        light_edit(edits, references[index]).off = true;
        return;
    }
    if (s.added_lamp(index)) light_edit(edits, references[index]).off = false;
    std::vector<std::size_t> others;  // lights that stay off
    for (NamedEdit<LightEdit>& named : edits.lights) {
        const std::vector<std::size_t> found = lights_named(named.name, s);
        if (!named.edit.off || std::ranges::find(found, index) == found.end()) continue;
        named.edit.off = false;
        others.insert(others.end(), found.begin(), found.end());
    }
    for (const std::size_t i : others)
        if (i != index) light_edit(edits, references[i]).off = true;
    remove_empty(edits);
}

}  // namespace

const std::vector<Outliner::Row>& Outliner::rows(const Session& session) {
    const std::string wanted = lower(search.data());
    const std::vector<std::string>& lights = session.references().lights;
    if (wanted == searched_ && scene_ == session.shared_scene() && tree_ == session.shared_tree() && lights_ == lights)
        return rows_;
    lights_ = lights;
    searched_ = wanted;
    scene_ = session.shared_scene();
    tree_ = session.shared_tree();
    rows_.clear();
    rows_.push_back({{ObjectKind::environment, 0}, 0, "environment"});
    add_objects(session.lights(), ObjectKind::light, "light", rows_);
    add_objects(scene_->cameras, ObjectKind::camera, "camera", rows_);
    add_nodes(*tree_, rows_);
    add_objects(scene_->materials, ObjectKind::material, "material", rows_);
    add_objects(scene_->meshes, ObjectKind::mesh, "mesh", rows_);
    std::erase_if(rows_, [&](const Row& row) { return lower(row.label).find(wanted) == std::string::npos; });
    return rows_;
}

HiddenObjects::HiddenObjects(const Session& session) {
    const SceneEdits& edits = session.edits;
    if (!edits.hidden.empty()) {
        const std::vector<HidingKind> kinds = hiding_kinds(session);
        for (const ObjectName& hidden : edits.hidden)
            for (const Selection& object : hidden_by(hidden.name, kinds)) all_.emplace(object.kind, object.index);
    }
    for (const NamedEdit<LightEdit>& named : edits.lights)
        if (named.edit.off)
            for (const std::size_t i : lights_named(named.name, session)) all_.emplace(ObjectKind::light, i);
    for (std::size_t i = session.scene().lights.size(); i < session.lights().size(); ++i)
        if (session.added_lamp(i)->edit.off) all_.emplace(ObjectKind::light, i);
}

bool can_be_hidden(const Selection& object, const Session& session) {
    const bool surface = object.kind == ObjectKind::node || object.kind == ObjectKind::mesh;
    return object.kind == ObjectKind::light || (surface && !session.in_pages());
}

void set_shown(Session& session, const Selection& object, bool shown) {
    SceneEdits& edits = session.edits;
    if (object.kind == ObjectKind::light) switch_light(session, object.index, shown);
    const std::vector<HidingKind> kinds = hiding_kinds(session);
    const auto reference = [&](const Selection& one) {
        const HidingKind& k = *std::ranges::find(kinds, one.kind, &HidingKind::kind);
        return k.prefix + k.references[one.index];
    };
    if (!shown) {
        if (object.kind != ObjectKind::light) add_hidden(edits, "", reference(object));
        return;
    }
    std::vector<ObjectName> names;
    for (const ObjectName& hidden : edits.hidden) {
        const std::vector<Selection> found = hidden_by(hidden.name, kinds);
        if (std::ranges::find(found, object) == found.end()) {
            names.push_back(hidden);
            continue;
        }
        for (const Selection& other : found)
            if (other != object) names.push_back({reference(other)});
    }
    edits.hidden.clear();
    for (const ObjectName& name : names)
        if (std::ranges::find(edits.hidden, name) == edits.hidden.end()) edits.hidden.push_back(name);
}

void remove_empty(SceneEdits& edits) {
    std::erase_if(edits.lights, [](const auto& named) { return named.edit == LightEdit(); });
    std::erase_if(edits.materials, [](const auto& named) { return named.edit.empty(); });
    std::erase_if(edits.nodes, [](const auto& named) { return named.edit == NodeEdit(); });
}

}  // namespace halflight::view
