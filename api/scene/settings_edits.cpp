#include "api/scene/settings_edits.h"

#include <algorithm>
#include <utility>

#include "api/halflight/edit_text.h"
#include "api/scene/node_edits.h"
#include "engine/core/names.h"

namespace halflight::settings {

namespace fs = std::filesystem;

fs::path read_path(const Element& e, const fs::path& folder) {
    const std::string name = e.text();
    if (name.empty() || name.find('\0') != std::string::npos) e.fail("is no name of a file");
    return folder / name;
}

Json path_json(const fs::path& path, const fs::path& folder) {
    std::error_code none;
    const fs::path near = fs::proximate(path, folder.empty() ? fs::path(".") : folder, none);
    Json json = (none ? fs::absolute(path) : near).string();
    try {
        json.dump();
    } catch (const Json::type_error&) {
        throw Error(path.string(), "cannot be saved as a setting: its name is not UTF-8, as JSON needs");
    }
    return json;
}

namespace {

/// Reads the members of an edit of a light, beside which there may be others.
LightEdit read_light_members(const Element& e, const fs::path& folder, std::set<std::string> others = {}) {
    LightEdit light;
    others.insert({"factor", "intensity", "color", "temperature", "position", "direction", "radius", "angle", "inner",
                   "outer", "size", "ies", "off"});
    e.check_keys(others);
    const auto single = [](const EditRange& range, auto& target) {
        return [&](const Element& v) { target = static_cast<float>(v.number(range)); };
    };
    with(e, "factor", single(kEditFactor, light.factor));
    with(e, "intensity", single(kEditIntensity, light.intensity));
    with(e, "temperature", single(kEditTemperature, light.temperature));
    with(e, "radius", single(kEditRadius, light.radius));
    with(e, "angle", single(kEditAngle, light.angle));
    with(e, "inner", single(kEditCone, light.inner));
    with(e, "outer", single(kEditCone, light.outer));
    with(e, "size", [&](const Element& v) {
        const std::vector<Element> sides = v.is_list() ? v.items() : std::vector<Element>{v};
        if (sides.empty() || sides.size() > 2) v.fail("is no number and no list of two");
        light.size = {sides.front().number(kEditSize), sides.back().number(kEditSize)};
    });
    with(e, "ies", [&](const Element& v) { light.ies = read_path(v, folder).string(); });
    with(e, "off", [&](const Element& v) { light.off = v.truth(); });
    with(e, "color", [&](const Element& v) {
        if (light.temperature) e.fail("has both 'color' and 'temperature'");
        if (v.is_string()) return set_key(light, e.where(), "color", v.text());
        light.color = vec3(v.triple(kEditColor));
    });
    with(e, "position", [&](const Element& v) { light.position = v.triple(kEditPosition); });
    with(e, "direction", [&](const Element& v) {
        light.direction = unit_direction(v.triple(kEditPosition));
        if (!light.direction) v.fail("is no direction");
    });
    return light;
}

/// Reads an edit of a light: a factor alone, or an object with further members.
LightEdit read_light(const Element& e, const fs::path& folder) {
    return e.is_object() ? read_light_members(e, folder) : LightEdit{static_cast<float>(e.number(kEditFactor))};
}

Json light_json(const LightEdit& light, const fs::path& folder, Json json = Json::object()) {
    if (json.empty() && LightEdit{light.factor} == light) return light.factor;
    if (light.factor != 1) json["factor"] = short_number(light.factor);
    if (light.intensity) json["intensity"] = short_number(*light.intensity);
    if (light.temperature) json["temperature"] = short_number(*light.temperature);
    if (light.radius) json["radius"] = short_number(*light.radius);
    if (light.angle) json["angle"] = short_number(*light.angle);
    if (light.inner) json["inner"] = short_number(*light.inner);
    if (light.outer) json["outer"] = short_number(*light.outer);
    if (light.size) json["size"] = {short_number(light.size->x), short_number(light.size->y)};
    if (!light.ies.empty()) json["ies"] = path_json(light.ies, folder);
    if (light.off) json["off"] = true;
    if (light.color) json["color"] = list(*light.color);
    if (light.position) json["position"] = list(*light.position);
    if (light.direction) json["direction"] = list(*light.direction);
    return json;
}

/// Reads properties of a material by the name of each: a number, a list of numbers, or a colour as text.
MaterialEdit read_material(const Element& e) {
    MaterialEdit properties;
    for (const auto& [name, value] : e.members()) {
        std::vector<float> values;
        if (value.is_list())
            for (const Element& one : value.items()) values.push_back(static_cast<float>(one.number()));
        else if (!value.is_string())
            values.push_back(static_cast<float>(value.number()));
        set_key(properties, e.where(), name, value.is_string() ? value.text() : property_text(values));
    }
    return properties;
}

Json material_json(const MaterialEdit& properties) {
    Json json = Json::object();
    for (const auto& [name, values] : properties) {
        Json all = Json::array();
        for (const float value : values) all.push_back(short_number(value));
        json[name] = values.size() == 1 ? all[0] : all;
    }
    return json;
}

/// Reads an affine matrix: its rows, of which the last may be missing, or their 12 or 16 numbers.
dmat4 read_transform(const Element& e) {
    constexpr double kMost = std::numeric_limits<double>::max();
    std::vector<Element> numbers;
    for (const Element& item : e.items()) {
        const std::vector<Element> row = item.is_list() ? item.items() : std::vector<Element>{item};
        if (item.is_list() && row.size() != 4) e.fail("has a row that is no list of four numbers");
        for (const Element& number : row) numbers.push_back(number);
    }
    if (numbers.size() != 12 && numbers.size() != 16) e.fail("has {} numbers; 12 or 16 are expected", numbers.size());
    dmat4 m{1};
    for (std::size_t i = 0; i < numbers.size(); ++i) m[int(i % 4)][int(i / 4)] = numbers[i].number(-kMost, kMost);
    if (!is_affine(m)) e.fail("is not affine");
    return m;
}

Json transform_json(const dmat4& m) {
    Json rows = Json::array();
    for (int r = 0; r < 4; ++r) rows.push_back({m[0][r], m[1][r], m[2][r], m[3][r]});
    return rows;
}

NodeEdit read_node(const Element& e) {
    e.check_keys({"translate", "rotate", "scale", "matrix"});
    NodeEdit node;
    with(e, "translate", [&](const Element& v) { node.translate = v.triple(kEditPosition); });
    with(e, "rotate", [&](const Element& v) { node.rotate = v.triple(kEditRotation); });
    with(e, "scale",
         [&](const Element& v) { node.scale = v.is_list() ? v.triple(kEditScale) : dvec3(v.number(kEditScale)); });
    with(e, "matrix", [&](const Element& v) { node.matrix = read_transform(v); });
    check_values(node, e.where());
    return node;
}

Json node_json(const NodeEdit& node) {
    Json json = Json::object();
    if (node.translate != dvec3(0)) json["translate"] = list(node.translate);
    if (node.rotate != dvec3(0)) json["rotate"] = list(node.rotate);
    if (node.scale != dvec3(1)) json["scale"] = list(node.scale);
    if (node.matrix) json["matrix"] = transform_json(*node.matrix);
    return json;
}

/// Reads edits of lights: an object by name, or the list of earlier versions, whose places become names.
void read_lights(const Element& e, const fs::path& folder, SceneEdits& edits) {
    if (e.is_object()) {
        for (const auto& [key, one] : e.members()) edits.lights.push_back({key, read_light(one, folder), e.where()});
        return;
    }
    const auto items = e.items();
    for (std::size_t i = 0; i < items.size(); ++i)
        if (const LightEdit light = read_light(items[i], folder); light != LightEdit())
            edits.lights.push_back({std::to_string(i), light, e.where()});
}

Json lights_json(const SceneEdits& edits, const fs::path& folder) {
    Json json = Json::object();
    for (const auto& [name, edit, source] : edits.lights) json[name] = light_json(edit, folder);
    return json;
}

Json materials_json(const SceneEdits& edits) {
    Json json = Json::object();
    for (const auto& [name, properties, source] : edits.materials) json[name] = material_json(properties);
    return json;
}

/// Reads links: lists of objects by the name of lights.
std::vector<LightLink> read_links(const Element& e) {
    std::vector<LightLink> links;
    for (const auto& [light, objects] : e.members()) {
        LightLink& link = links.emplace_back(LightLink{light, {}, e.where()});
        for (const Element& object : objects.items()) link.objects.push_back(object.text());
    }
    return links;
}

}  // namespace

namespace {

using Of = EditTrack::Of;
constexpr Of kOfNames[] = {Of::lights, Of::materials, Of::nodes}, kOfKeys[] = {Of::environment, Of::camera};
constexpr const char* kOfScene[] = {"emission", "lamp_radius", "sun_angle"};

/// Returns a value of a key as the text that options have.
std::string value_text(const Element& e) {
    constexpr double kMost = std::numeric_limits<double>::max();
    if (e.is_string()) return e.text();
    if (e.is_number()) return fmt::format("{}", e.number(-kMost, kMost));
    if (!e.is_list()) return e.truth() ? "true" : "false";
    std::string text;
    for (const Element& item : e.items()) text += (text.empty() ? "" : ",") + value_text(item);
    return text;
}

Json value_json(const std::string& text) {
    if (text == "true" || text == "false") return text == "true";
    Json values = Json::array();
    for (const std::string& part : split_names(text)) {
        double number = 0;
        const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), number);
        if (error != std::errc() || end != part.data() + part.size()) return text;
        values.push_back(number);
    }
    return values.size() == 1 ? values[0] : values;
}

/// Reads the values of a track by frame.
void read_track(const Element& e, EditTrack track, EditKeys& keys) {
    track.source = e.where();
    for (const auto& [name, value] : e.members()) {
        if (name == "step") {
            track.step = value.truth();
            continue;
        }
        EditTrack::Key key;
        const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), key.frame);
        if (error != std::errc() || end != name.data() + name.size() ||
            !(key.frame >= kLeastFrame && key.frame <= kMostFrame))
            e.fail("'{}' is no frame", name);
        if (!track.keys.empty() && key.frame <= track.keys.back().frame)
            e.fail("frame {} comes after frame {}; frames ascend", name, track.keys.back().frame);
        key.value = checked_value(track.of, track.key, value_text(value), value.where());
        const bool is_name = track.of == EditTrack::Of::camera && track.key == "camera";
        if (!is_name && !track.keys.empty() &&
            std::ranges::count(key.value, ',') != std::ranges::count(track.keys[0].value, ','))
            e.fail("frame {} has another count of numbers than the first one", name);
        track.keys.push_back(std::move(key));
    }
    if (track.keys.empty()) e.fail("has no frame");
    keys.tracks.push_back(std::move(track));
}

Json track_json(const EditTrack& track) {
    Json json = Json::object();
    if (track.step) json["step"] = true;
    for (const EditTrack::Key& key : track.keys) json[fmt::format("{}", key.frame)] = value_json(key.value);
    return json;
}

}  // namespace

void read_keys(const Element& e, EditKeys& keys) {
    std::set<std::string> known{name(Of::hide)};
    for (const Of of : kOfNames) known.insert(name(of));
    for (const Of of : kOfKeys) known.insert(name(of));
    known.insert(std::begin(kOfScene), std::end(kOfScene));
    e.check_keys(known);
    for (const char* key : kOfScene)
        with(e, key, [&](const Element& v) { read_track(v, {.of = Of::scene, .key = key}, keys); });
    for (const Of of : kOfKeys)
        with(e, name(of), [&](const Element& v) {
            for (const auto& [key, track] : v.members()) read_track(track, {.of = of, .key = key}, keys);
        });
    for (const Of of : kOfNames)
        with(e, name(of), [&](const Element& v) {
            for (const auto& [object, values] : v.members())
                for (const auto& [key, track] : values.members())
                    read_track(track, {.of = of, .name = object, .key = key}, keys);
        });
    with(e, name(Of::hide), [&](const Element& v) {
        for (const auto& [object, track] : v.members()) read_track(track, {.of = Of::hide, .name = object}, keys);
    });
}

Json keys_json(const EditKeys& keys) {
    Json json = Json::object();
    for (const EditTrack& track : keys.tracks) {
        if (track.of == Of::scene)
            json[track.key] = track_json(track);
        else if (track.of == Of::hide)
            json[name(track.of)][track.name] = track_json(track);
        else if (track.name.empty())
            json[name(track.of)][track.key] = track_json(track);
        else
            json[name(track.of)][track.name][track.key] = track_json(track);
    }
    return json;
}

void read_edits(const Element& file, const fs::path& folder, SceneEdits& edits) {
    with(file, "emission", [&](const Element& v) { edits.emission = static_cast<float>(v.number(kEditFactor)); });
    with(file, "lamp_radius", [&](const Element& v) { edits.lamp_radius = static_cast<float>(v.number(kEditRadius)); });
    with(file, "sun_angle", [&](const Element& v) { edits.sun_angle = static_cast<float>(v.number(kEditAngle)); });
    with(file, "glass_shadows",
         [&](const Element& v) { edits.straight_glass = glass_shadows_of(v.where(), v.text()); });
    with(file, "added_lights", [&](const Element& v) {
        for (const auto& [name, one] : v.members()) {
            if (!one.is_object() || !one.find("kind")) one.fail("has no 'kind'");
            const LampKind kind = lamp_kind(one.where(), one.find("kind")->text());
            edits.added_lights.push_back({name, kind, read_light_members(one, folder, {"kind"}), v.where()});
        }
    });
    with(file, "lights", [&](const Element& v) { read_lights(v, folder, edits); });
    with(file, "clay", [&](const Element& v) { edits.clay = v.truth(); });
    with(file, "materials", [&](const Element& v) {
        for (const auto& [key, one] : v.members()) edits.materials.push_back({key, read_material(one), v.where()});
    });
    with(file, "transforms", [&](const Element& v) {
        for (const auto& [index, one] : v.indexed()) edits.transforms[index] = read_transform(one);
    });
    with(file, "nodes", [&](const Element& v) {
        for (const auto& [key, one] : v.members()) edits.nodes.push_back({key, read_node(one), v.where()});
    });
    with(file, "hide", [&](const Element& v) {
        for (const Element& one : v.items()) add_hidden(edits, one.where(), one.text());
    });
    with(file, "shadow_catchers", [&](const Element& v) {
        for (const Element& one : v.items()) add_catcher(edits, one.where(), one.text());
    });
    with(file, "ground", [&](const Element& v) {
        edits.ground = v.is_number() || v.truth();
        if (v.is_number()) edits.ground_height = v.number(kEditPosition);
    });
    with(file, "light_groups", [&](const Element& v) {
        if (v.is_string()) {
            if (v.text() != "each") v.fail("is neither an object nor \"each\"");
            edits.each_light = true;
            return;
        }
        for (const auto& [key, one] : v.members()) {
            LightGroup& group = edits.light_groups.emplace_back(LightGroup{key, {}, v.where()});
            for (const Element& light : one.items()) group.lights.push_back(light.text());
        }
    });
    with(file, "light_links", [&](const Element& v) { edits.light_links = read_links(v); });
    with(file, "shadow_links", [&](const Element& v) { edits.shadow_links = read_links(v); });
}

void write_edits(const SceneEdits& edits, const fs::path& folder, Json& json) {
    json["emission"] = short_number(edits.emission);
    if (edits.lamp_radius) json["lamp_radius"] = short_number(*edits.lamp_radius);
    if (edits.sun_angle) json["sun_angle"] = short_number(*edits.sun_angle);
    if (edits.straight_glass) json["glass_shadows"] = "straight";
    for (const auto& [lamp, kind, edit, source] : edits.added_lights)
        json["added_lights"][lamp] = light_json(edit, folder, {{"kind", name(kind)}});
    json["lights"] = lights_json(edits, folder);
    json["clay"] = edits.clay;
    if (Json materials = materials_json(edits); !materials.empty()) json["materials"] = std::move(materials);
    for (const auto& [index, m] : edits.transforms) json["transforms"][std::to_string(index)] = transform_json(m);
    for (const auto& [name, edit, source] : edits.nodes) json["nodes"][name] = node_json(edit);
    for (const auto& [name, source] : edits.hidden) json["hide"].push_back(name);
    for (const auto& [name, source] : edits.catchers) json["shadow_catchers"].push_back(name);
    if (edits.ground) json["ground"] = edits.ground_height ? Json(*edits.ground_height) : Json(true);
    if (edits.each_light) json["light_groups"] = "each";
    for (const auto& [name, lights, source] : edits.light_groups) json["light_groups"][name] = lights;
    for (const auto& [light, objects, source] : edits.light_links) json["light_links"][light] = objects;
    for (const auto& [light, objects, source] : edits.shadow_links) json["shadow_links"][light] = objects;
}

}  // namespace halflight::settings
