#include "engine/scene/material_properties.h"

#include <algorithm>

#include "engine/core/error.h"
#include "engine/core/suggestion.h"
#include "shaders/shared/surface_rows.h"

namespace halflight {
namespace {

using M = Material;

int lobe_rows(const MaterialNeeds& needs, int MaterialLobe::*rows) {
    int sum = 0;
    for (const MaterialLobe& lobe : material_lobes()) sum += needs.*lobe.need ? lobe.*rows : 0;
    return sum;
}

}  // namespace

int material_rows() {
    static const int rows = [] {
        int last = kNone;
        for (const MaterialProperty& property : material_properties()) last = std::max(last, property.packing.row);
        for (const MaterialTexture& texture : material_textures()) last = std::max(last, texture.packing.row);
        return last + 1;
    }();
    return rows;
}

int record_rows(const MaterialNeeds& needs) {
    return shared::kLeastSurfaceRows + lobe_rows(needs, &MaterialLobe::record_rows);
}

int layer_rows(const MaterialNeeds& needs) {
    return 2 + lobe_rows(needs, &MaterialLobe::layer_rows);  // normal and horizon belong to the base
}

int component_count(const MaterialField& field) {
    return std::holds_alternative<vec3 M::*>(field) ? 3 : std::holds_alternative<vec4 M::*>(field) ? 4 : 1;
}

vec4 value_of(const Material& material, const MaterialField& field) {
    return std::visit(
        [&]<class T>(T M::*member) {
            const T& value = material.*member;
            if constexpr (std::is_same_v<T, vec3>)
                return vec4(value, 0);
            else if constexpr (std::is_same_v<T, vec4>)
                return value;
            else
                return vec4(static_cast<float>(value), 0, 0, 0);
        },
        field);
}

void set_value(Material& material, const MaterialField& field, const vec4& value) {
    std::visit(
        [&]<class T>(T M::*member) {
            if constexpr (std::is_same_v<T, bool>)
                material.*member = value.x != 0;
            else if constexpr (std::is_same_v<T, float>)
                material.*member = value.x;
            else
                material.*member = T(value);
        },
        field);
}

vec4 packed_value(const Material& material, const MaterialProperty& property) {
    if (material.unlit && property.scales_lobe) return vec4(0);
    return property.packed ? property.packed(material) : value_of(material, property.field);
}

std::string range_error(const MaterialProperty& property, const vec4& value) {
    for (int i = 0; i < component_count(property.field); ++i)
        if (std::string why = range_error(property.range, value[i]); !why.empty()) return why;
    return {};
}

void set_property(Material& material, std::string_view name, std::span<const float> values, std::string_view subject) {
    const auto found = std::ranges::find(material_properties(), name, &MaterialProperty::name);
    if (found == material_properties().end()) {
        std::vector<std::string> names;
        for (const MaterialProperty& property : material_properties()) names.emplace_back(property.name);
        throw Error(subject, "materials have no property '{}'{}", name, did_you_mean(name, names));
    }
    const auto count = static_cast<std::size_t>(component_count(found->field));
    if (values.size() != count) throw Error(subject, "{} takes {} numbers, not {}", name, count, values.size());
    vec4 value(0);
    for (std::size_t i = 0; i < count; ++i) value[static_cast<int>(i)] = values[i];
    if (const std::string why = range_error(*found, value); !why.empty()) throw Error(subject, "{}: {}", name, why);
    set_value(material, found->field, value);
}

void complete(MaterialNeeds& needs) {
    for (const MaterialTexture& texture : material_textures())
        if (needs.*texture.need && texture.implies) needs.*texture.implies = true;
    for (const MaterialLobe& lobe : material_lobes())
        if (needs.*lobe.need && lobe.implies) needs.*lobe.implies = true;
}

}  // namespace halflight
