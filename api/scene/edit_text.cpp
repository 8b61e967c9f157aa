#include "api/halflight/edit_text.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <utility>

#include "api/halflight/environment_choice.h"
#include "api/scene/light_groups.h"
#include "api/scene/node_edits.h"
#include "engine/core/error.h"
#include "engine/core/names.h"
#include "engine/core/suggestion.h"
#include "engine/scene/material_properties.h"

namespace halflight {
namespace {

/// Adds a name to a list that does not have it.
void add_once(std::vector<ObjectName>& names, ObjectName name) {
    if (std::ranges::find(names, name) == names.end()) names.push_back(std::move(name));
}

/// Returns whether text is a name, with the prefix of a kind or without.
bool is_name(const std::string& text) {
    constexpr std::string_view kNoNames[] = {"", "node:", "mesh:", "light:", "material:"};
    return std::ranges::find(kNoNames, text) == std::end(kNoNames);
}

/// Parses numbers that are separated by commas. Throws Error about `subject` unless all of the text is numbers.
template <class T>
std::vector<T> numbers(const std::string& subject, const std::string& text) {
    std::vector<T> values;
    for (const std::string& part : split_names(text)) {
        const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), values.emplace_back());
        if (error != std::errc() || end != part.data() + part.size() || !std::isfinite(values.back()))
            throw Error(subject, "expects numbers, not '{}'", text);
    }
    return values;
}

template <class T>
std::string joined(const T* values, int count) {
    return fmt::format("{}", fmt::join(values, values + count, ","));
}

void check_range(const std::string& subject, double value, const EditRange& range) {
    if (!(value >= range.lower && value <= range.upper))
        throw Error(subject, "expects numbers from {} to {}, not {}", range.lower, range.upper, value);
}

template <class T>
T number(const std::string& subject, const std::string& text, const EditRange& range) {
    const auto values = numbers<T>(subject, text);
    if (values.size() != 1) throw Error(subject, "expects one number, not '{}'", text);
    check_range(subject, double(values[0]), range);
    return values[0];
}

template <class V>
V triple(const std::string& subject, const std::string& text, const EditRange& range) {
    const auto values = numbers<typename V::value_type>(subject, text);
    if (values.size() != 3) throw Error(subject, "expects three numbers, not '{}'", text);
    for (const auto value : values) check_range(subject, double(value), range);
    return {values[0], values[1], values[2]};
}

/// Returns whether a text is a colour that is not a list of numbers: "#8899cc", "orange".
bool names_color(const std::string& text) {
    return !text.empty() && (text[0] == '#' || std::isalpha(static_cast<unsigned char>(text[0])));
}

vec3 named_color(const std::string& subject, const std::string& text) {
    if (const auto color = color_of_text(text)) return *color;
    throw Error(subject, "expects R,G,B, #rrggbb or the name of a colour, not '{}'", text);
}

template <class V>
std::string joined(const V& v) {
    return joined(&v[0], V::length());
}

vec2 size_of(const std::string& subject, const std::vector<float>& values) {
    if (values.size() > 2) throw Error(subject, "expects one number or two, not {}", values.size());
    for (const float value : values) check_range(subject, double{value}, kEditSize);
    return {values.front(), values.back()};
}

using L = LightEdit;
constexpr std::array kLightKeys = {
    EditKey<L>{"factor", "X", "factor of the intensity",
               [](L& e, const std::string& s, const std::string& t) { e.factor = number<float>(s, t, kEditFactor); },
               [](const L& e) { return e.factor == 1 ? "" : fmt::format("{}", e.factor); }},
    EditKey<L>{
        "intensity", "X",
        "intensity in place of the light's own: candela, lux of a directional light, nits of a surface",
        [](L& e, const std::string& s, const std::string& t) { e.intensity = number<float>(s, t, kEditIntensity); },
        [](const L& e) { return e.intensity ? fmt::format("{}", *e.intensity) : ""; }},
    EditKey<L>{"color", "R,G,B", "colour, linear Rec.709 from 0 to 1, #rrggbb or a name such as orange",
               [](L& e, const std::string& s, const std::string& t) {
                   e.color = names_color(t) ? named_color(s, t) : triple<vec3>(s, t, kEditColor);
                   e.temperature.reset();
               },
               [](const L& e) { return e.color ? joined(*e.color) : ""; }},
    EditKey<L>{"temperature", "KELVIN", "colour of a black body, 1000 to 40000: 2700 is a warm lamp, 6500 daylight",
               [](L& e, const std::string& s, const std::string& t) {
                   e.temperature = number<float>(s, t, kEditTemperature);
                   e.color.reset();
               },
               [](const L& e) { return e.temperature ? fmt::format("{}", *e.temperature) : ""; }},
    EditKey<L>{
        "position", "X,Y,Z", "position in world space, metres",
        [](L& e, const std::string& s, const std::string& t) { e.position = triple<dvec3>(s, t, kEditPosition); },
        [](const L& e) { return e.position ? joined(*e.position) : ""; }},
    EditKey<L>{"direction", "X,Y,Z", "direction in which the light travels, of any length",
               [](L& e, const std::string& s, const std::string& t) {
                   e.direction = unit_direction(triple<dvec3>(s, t, kEditPosition));
                   if (!e.direction) throw Error(s, "'{}' is no direction", t);
               },
               [](const L& e) { return e.direction ? joined(*e.direction) : ""; }},
    EditKey<L>{"radius", "X", "radius of a point or spot, metres: light comes from a ball, and shadows are soft",
               [](L& e, const std::string& s, const std::string& t) { e.radius = number<float>(s, t, kEditRadius); },
               [](const L& e) { return e.radius ? fmt::format("{}", *e.radius) : ""; }},
    EditKey<L>{"angle", "X", "diameter of a directional light in the sky, degrees: 0.53 is the sun",
               [](L& e, const std::string& s, const std::string& t) { e.angle = number<float>(s, t, kEditAngle); },
               [](const L& e) { return e.angle ? fmt::format("{}", *e.angle) : ""; }},
    EditKey<L>{"inner", "X", "angle at which the light of a spot begins to fall off, degrees from its direction",
               [](L& e, const std::string& s, const std::string& t) { e.inner = number<float>(s, t, kEditCone); },
               [](const L& e) { return e.inner ? fmt::format("{}", *e.inner) : ""; }},
    EditKey<L>{"outer", "X", "angle at which the light of a spot ends, degrees from its direction, more than inner",
               [](L& e, const std::string& s, const std::string& t) { e.outer = number<float>(s, t, kEditCone); },
               [](const L& e) { return e.outer ? fmt::format("{}", *e.outer) : ""; }},
    EditKey<L>{"size", "S or X,Y", "width and height of a rectangle, or the diameter of a disc, that is added, metres",
               [](L& e, const std::string& s, const std::string& t) { e.size = size_of(s, numbers<float>(s, t)); },
               [](const L& e) { return e.size ? joined(*e.size) : ""; }},
    EditKey<L>{"ies", "FILE", "light profile of a point or spot, an IES LM-63 file: intensity by direction, candela",
               [](L& e, const std::string& s, const std::string& t) {
                   if (t.empty() || t.find('\0') != std::string::npos) throw Error(s, "expects a file");
                   e.ies = t;
               },
               [](const L& e) { return e.ies; }},
    EditKey<L>{"off", "", "switches the light off", [](L& e, const std::string&, const std::string&) { e.off = true; },
               [](const L& e) { return e.off ? std::string("true") : ""; }},
    EditKey<L>{"on", "", "switches it on again", [](L& e, const std::string&, const std::string&) { e.off = false; },
               [](const L&) { return std::string(); }},
};

using N = NodeEdit;
constexpr std::array kNodeKeys = {
    EditKey<N>{
        "translate", "X,Y,Z", "moves along the world's axes, metres",
        [](N& e, const std::string& s, const std::string& t) { e.translate = triple<dvec3>(s, t, kEditPosition); },
        [](const N& e) { return e.translate == dvec3(0) ? "" : joined(e.translate); }},
    EditKey<N>{"rotate", "X,Y,Z", "turns about the world's X, then Y, then Z axis, degrees",
               [](N& e, const std::string& s, const std::string& t) { e.rotate = triple<dvec3>(s, t, kEditRotation); },
               [](const N& e) { return e.rotate == dvec3(0) ? "" : joined(e.rotate); }},
    EditKey<N>{"scale", "S or X,Y,Z", "factors along the world's axes, before rotation",
               [](N& e, const std::string& s, const std::string& t) {
                   const bool all = t.find(',') == std::string::npos;
                   e.scale = all ? dvec3(number<double>(s, t, kEditScale)) : triple<dvec3>(s, t, kEditScale);
               },
               [](const N& e) { return e.scale == dvec3(1) ? "" : joined(e.scale); }},
    EditKey<N>{"matrix", "12 or 16 numbers", "rows of the matrix from the node to the world, in place of its own",
               [](N& e, const std::string& s, const std::string& t) {
                   const auto values = numbers<double>(s, t);
                   if (values.size() != 12 && values.size() != 16)
                       throw Error(s, "expects 12 or 16 numbers, not {}", values.size());
                   dmat4 m(1);
                   for (std::size_t i = 0; i < values.size(); ++i) m[int(i % 4)][int(i / 4)] = values[i];
                   e.matrix = m;
               },
               [](const N& e) {
                   if (!e.matrix) return std::string();
                   const dmat4 rows = glm::transpose(*e.matrix);
                   return joined(&rows[0][0], 12);
               }},
};

template <class Edit>
void set_among(std::span<const EditKey<Edit>> keys, Edit& edit, const std::string& subject, std::string_view key,
               const std::string& text) {
    const auto row = std::ranges::find_if(keys, [&](const auto& k) { return k.name == key; });
    if (row == keys.end()) {
        std::vector<std::string> names;
        for (const auto& k : keys) names.emplace_back(k.name);
        throw Error(subject, "'{}' is none of {}{}", key, fmt::join(names, ", "), did_you_mean(key, names));
    }
    row->set(edit, fmt::format("{}: {}", subject, row->name), text);
}

template <class Edit>
std::string text_of(std::span<const EditKey<Edit>> keys, const Edit& edit) {
    std::vector<std::string> parts;
    for (const auto& key : keys) {
        const std::string value = key.get(edit);
        if (!value.empty()) parts.push_back(*key.metavar ? fmt::format("{}:{}", key.name, value) : key.name);
    }
    return fmt::format("{}", fmt::join(parts, ","));
}

/// Splits "KEY:VALUE,..." into keys and values. A part that starts with a letter is a key; others belong to the value
/// before them, or to an empty key.
std::vector<std::pair<std::string, std::string>> split_keys(const std::string& text) {
    std::vector<std::pair<std::string, std::string>> pairs;
    for (const std::string& part : split_names(text)) {
        const std::size_t colon = part.find(':');
        if (!part.empty() && std::isalpha(static_cast<unsigned char>(part[0])))
            pairs.emplace_back(part.substr(0, colon), colon == std::string::npos ? "" : part.substr(colon + 1));
        else if (pairs.empty())
            pairs.emplace_back("", part);
        else
            pairs.back().second += "," + part;
    }
    return pairs;
}

/// Splits "NAME=REST" at the last equals sign. Throws Error about `source` if there is no name.
std::pair<std::string, std::string> split_name(const std::string& source, const std::string& text, const char* form) {
    const std::size_t equals = text.rfind('=');
    if (equals == std::string::npos || equals == 0) throw Error(source, "expects {}, not '{}'", form, text);
    return {text.substr(0, equals), text.substr(equals + 1)};
}

/// Returns the edit of a name, which is added if there is none. `source` names its option, and may be empty.
template <class Edit>
Edit& find_or_add(std::vector<NamedEdit<Edit>>& edits, const std::string& name, const std::string& source = {}) {
    const auto known = std::ranges::find(edits, name, &NamedEdit<Edit>::name);
    if (known == edits.end()) {
        NamedEdit<Edit>& added = edits.emplace_back();
        added.name = name, added.source = source;
        return added.edit;
    }
    std::rotate(known, known + 1, edits.end());  // edits apply in order
    if (!source.empty()) edits.back().source = source;
    return edits.back().edit;
}

/// Returns the edit of a light, that of an added one included.
LightEdit& find_or_add_light(SceneEdits& edits, const std::string& name, const std::string& source = {}) {
    const auto added = std::ranges::find(edits.added_lights, name, &AddedLamp::name);
    return added == edits.added_lights.end() ? find_or_add(edits.lights, name, source) : added->edit;
}

void add_link(std::vector<LightLink>& links, const std::string& source, const std::string& text) {
    constexpr const char* kForm = "LIGHT=OBJECT,... or LIGHT=-OBJECT,...";
    const auto [light, rest] = split_name(source, text, kForm);
    const std::vector<std::string> objects = split_names(rest);
    const auto names_object = [](const std::string& name) { return is_name(name.substr(name.starts_with('-'))); };
    if (!is_name(light) || objects.empty() || !std::ranges::all_of(objects, names_object))
        throw Error(source, "expects {}, not '{}'", kForm, text);
    std::erase_if(links, [&, &light = light](const LightLink& link) { return link.light == light; });
    links.push_back({light, objects, source});
}

}  // namespace

std::span<const EditKey<LightEdit>> light_edit_keys() {
    return kLightKeys;
}

std::span<const EditKey<NodeEdit>> node_edit_keys() {
    return kNodeKeys;
}

void set_key(LightEdit& edit, const std::string& subject, std::string_view key, const std::string& text) {
    set_among(light_edit_keys(), edit, subject, key, text);
}

void set_key(NodeEdit& edit, const std::string& subject, std::string_view key, const std::string& text) {
    set_among(node_edit_keys(), edit, subject, key, text);
    check_values(edit, subject);
}

void set_key(MaterialEdit& edit, const std::string& subject, std::string_view property, const std::string& text) {
    std::vector<float> values;
    const auto known = std::ranges::find(material_properties(), property, &MaterialProperty::name);
    const bool one_number = known != material_properties().end() && component_count(known->field) == 1;
    if (names_color(text) && !one_number) {
        const vec3 color = named_color(fmt::format("{}: {}", subject, property), text);
        values = {color.r, color.g, color.b};
    } else {
        values = numbers<float>(fmt::format("{}: {}", subject, property), text);
    }
    if (property == kEmissionTemperature) {
        edit[std::string(property)] = {number<float>(fmt::format("{}: {}", subject, property), text, kEditTemperature)};
        return;
    }
    Material scratch;
    const bool lacks_alpha = property == "base_color" && values.size() == 3;
    const std::vector<float> checked = lacks_alpha ? std::vector<float>{values[0], values[1], values[2], 1} : values;
    set_property(scratch, property, checked, subject);
    edit[std::string(property)] = std::move(values);
}

std::string text(const LightEdit& edit) {
    return text_of(light_edit_keys(), edit);
}

std::string text(const NodeEdit& edit) {
    return text_of(node_edit_keys(), edit);
}

std::string property_text(std::span<const float> values) {
    return fmt::format("{}", fmt::join(values, ","));
}

LightEdit& light_edit(SceneEdits& edits, const std::string& name) {
    return find_or_add_light(edits, name);
}

const LightEdit* find_light_edit(const SceneEdits& edits, std::string_view name) {
    const auto added = std::ranges::find(edits.added_lights, name, &AddedLamp::name);
    if (added != edits.added_lights.end()) return &added->edit;
    const auto named = std::ranges::find(edits.lights, name, &NamedEdit<LightEdit>::name);
    return named == edits.lights.end() ? nullptr : &named->edit;
}

MaterialEdit& material_edit(SceneEdits& edits, const std::string& name) {
    return find_or_add(edits.materials, name);
}

NodeEdit& node_edit(SceneEdits& edits, const std::string& name) {
    return find_or_add(edits.nodes, name);
}

void add_light_edit(SceneEdits& edits, const std::string& source, const std::string& text) {
    const auto [name, rest] = split_name(source, text, "NAME=KEY:VALUE,... or NAME=off");
    const std::string subject = fmt::format("{}: {}", source, name);
    LightEdit parsed = find_or_add_light(edits, name, source);
    for (const auto& [key, value] : split_keys(rest)) set_key(parsed, subject, key.empty() ? "factor" : key, value);
    light_edit(edits, name) = parsed;
}

LampKind lamp_kind(const std::string& subject, std::string_view text) {
    std::vector<std::string> names;
    for (const LampKind kind : {LampKind::point, LampKind::spot, LampKind::sun, LampKind::rectangle, LampKind::disc}) {
        names.emplace_back(name(kind));
        if (names.back() == text) return kind;
    }
    throw Error(subject, "kind: '{}' is none of {}{}", text, fmt::join(names, ", "), did_you_mean(text, names));
}

void add_new_light(SceneEdits& edits, const std::string& source, const std::string& text) {
    constexpr const char* kForm = "NAME=kind:KIND,KEY:VALUE,...";
    const auto [name, rest] = split_name(source, text, kForm);
    const std::string subject = fmt::format("{}: {}", source, name);
    AddedLamp lamp;
    lamp.name = name, lamp.source = source;
    bool has_kind = false;
    for (const auto& [key, value] : split_keys(rest)) {
        if (key != "kind")
            set_key(lamp.edit, subject, key, value);
        else if (std::exchange(has_kind, true))
            throw Error(subject, "has two kinds");
        else
            lamp.kind = lamp_kind(subject, value);
    }
    if (!has_kind) throw Error(source, "expects {}, not '{}'", kForm, text);
    edits.added_lights.push_back(std::move(lamp));
}

bool glass_shadows_of(const std::string& source, std::string_view text) {
    if (text != "bent" && text != "straight") throw Error(source, "'{}' is neither bent nor straight", text);
    return text == "straight";
}

void add_material_edit(SceneEdits& edits, const std::string& source, const std::string& text) {
    constexpr const char* kForm = "NAME.PROPERTY=VALUE";
    const auto [place, value] = split_name(source, text, kForm);
    const std::size_t dot = place.rfind('.');
    if (dot == std::string::npos || dot == 0) throw Error(source, "expects {}, not '{}'", kForm, text);
    const std::string name = place.substr(0, dot);
    MaterialEdit parsed = find_or_add(edits.materials, name, source);
    set_key(parsed, fmt::format("{}: {}", source, name), place.substr(dot + 1), value);
    material_edit(edits, name) = std::move(parsed);
}

void add_node_edit(SceneEdits& edits, const std::string& source, const std::string& text) {
    const auto [name, rest] = split_name(source, text, "NAME=KEY:VALUE,...");
    const std::string subject = fmt::format("{}: {}", source, name);
    NodeEdit parsed = find_or_add(edits.nodes, name, source);
    for (const auto& [key, value] : split_keys(rest)) set_key(parsed, subject, key, value);
    node_edit(edits, name) = parsed;
}

void add_hidden(SceneEdits& edits, const std::string& source, const std::string& name) {
    if (!is_name(name)) throw Error(source, "expects the name of a node, a mesh or a light");
    add_once(edits.hidden, {name, source});
}

void add_catcher(SceneEdits& edits, const std::string& source, const std::string& name) {
    if (!is_name(name)) throw Error(source, "expects the name of a node or a mesh");
    add_once(edits.catchers, {name, source});
}

void add_light_group(SceneEdits& edits, const std::string& source, const std::string& text) {
    if (text == "each" ? !edits.light_groups.empty() : edits.each_light)
        throw Error(source, "'each' makes a group of every light, and cannot be given with named groups");
    if (text == "each") {
        edits.each_light = true;
        return;
    }
    const std::size_t equals = text.find('=');
    const std::string name = text.substr(0, equals);
    const std::vector<std::string> lights =
        equals == std::string::npos ? std::vector<std::string>() : split_names(text.substr(equals + 1));
    if (lights.empty() || !std::ranges::all_of(lights, is_name))
        throw Error(source, "expects NAME=LIGHT,... or each, not '{}'", text);
    check_light_group_name(name, source);
    const auto known = std::ranges::find(edits.light_groups, name, &LightGroup::name);
    LightGroup& group =
        known == edits.light_groups.end() ? edits.light_groups.emplace_back(LightGroup{name, {}, {}}) : *known;
    group.lights.insert(group.lights.end(), lights.begin(), lights.end());
    group.source = source;
}

void add_light_link(SceneEdits& edits, const std::string& source, const std::string& text) {
    add_link(edits.light_links, source, text);
}

void add_shadow_link(SceneEdits& edits, const std::string& source, const std::string& text) {
    add_link(edits.shadow_links, source, text);
}

}  // namespace halflight
