// Edits of a scene's lights, materials and transforms, which leave its file unchanged.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/scene.h"
#include "engine/scene/scene_tree.h"

namespace halflight {

/// Range of a number of an edit, inclusive.
struct EditRange {
    double lower, upper;
};
inline constexpr EditRange kLineWidth{1e-9, 1e9};          ///< diameter of points and lines, world units
inline constexpr EditRange kEditFactor{0, 1e9};            ///< factors of intensities and of emission
inline constexpr EditRange kEditColor{0, 1};               ///< channels of colours and tints, linear Rec.709
inline constexpr EditRange kEditPosition{-1e12, 1e12};     ///< coordinates of lights, metres
inline constexpr EditRange kEditRotation{-1e6, 1e6};       ///< degrees
inline constexpr EditRange kEditIntensity{0, 1e12};        ///< candela, lux or nits
inline constexpr EditRange kEditTemperature{1000, 40000};  ///< kelvin
inline constexpr EditRange kEditScale{-1e6, 1e6};          ///< factors of lengths, not 0
inline constexpr EditRange kEditRadius{0, 1e9};            ///< metres
inline constexpr EditRange kEditAngle{0, 179};             ///< degrees
inline constexpr EditRange kEditCone{0, 90};               ///< degrees
inline constexpr EditRange kEditSize{1e-6, 1e9};           ///< metres, of rectangles and discs

/// Edit of one light. Optional members replace the light's own value.
struct LightEdit {
    float factor = 1;                  // factor of the intensity, kEditFactor
    std::optional<vec3> color{};       // colour, kEditColor; white has the intensity of the light's largest channel
    std::optional<dvec3> position{};   // world position, kEditPosition; without effect on directional lights
    std::optional<dvec3> direction{};  // unit, direction in which light travels; without effect on point lights
    std::optional<float> intensity{};  // intensity of the largest channel, cd, lux or nits, kEditIntensity
    // Temperature of a black body, kelvin, kEditTemperature. Its colour (black_body_color()) replaces the light's own;
    // not together with `color`.
    std::optional<float> temperature{};
    std::optional<float> radius{};  // metres, kEditRadius: the ball that emits the light; not for directional lights
    std::optional<float> angle{};   // degrees, kEditAngle: diameter of the disc in the sky, of directional lights alone
    // Degrees from the direction to where the light of a spot begins to fall off, and to where it ends, kEditCone;
    // inner < outer.
    std::optional<float> inner{}, outer{};
    std::optional<vec2> size{};  // metres, kEditSize: width and height of a rectangle, twice the diameter of a disc
    // File of a light profile (IES LM-63), in place of the own distribution (empty); not for directional lights. The
    // intensity becomes the greatest of the file unless `intensity` is given; the colour stays.
    std::string ies{};
    bool off = false;
    bool operator==(const LightEdit&) const = default;
};

enum class LampKind : std::uint8_t { point, spot, sun, rectangle, disc };
/// Returns the name of a kind in edits: "point", "spot", "sun", "rectangle", "disc".
const char* name(LampKind kind);
/// Returns whether lamps of a kind are surfaces, which shine to one side.
constexpr bool is_area(LampKind kind) {
    return kind == LampKind::rectangle || kind == LampKind::disc;
}

/// A lamp that an edit adds. Before `edit` it is white, has an intensity of 1 and shines straight down. Members of
/// `edit` that do not suit its kind are not allowed.
struct AddedLamp {
    std::string name;  // unlike that of any other light, no number, without *, ? and commas
    LampKind kind = LampKind::point;
    LightEdit edit{};      // `position` is necessary, except for suns
    std::string source{};  // like NamedEdit::source
    bool operator==(const AddedLamp& other) const {
        return name == other.name && kind == other.kind && edit == other.edit;
    }
};

/// Edit of a node, of what hangs below it, and of the lights among them. Relative edits follow animations: the node is
/// scaled along the world's axes about its origin, then rotated about X, Y and Z, then moved.
struct NodeEdit {
    dvec3 translate{0};  // metres, kEditPosition
    dvec3 rotate{0};     // degrees, kEditRotation
    dvec3 scale{1};      // factors, kEditScale
    // Affine, invertible; replaces node to world before the other members. Animated scales of 0 go on to hide the node.
    std::optional<dmat4> matrix{};
    bool operator==(const NodeEdit&) const = default;
};

/// Properties of a material by name (engine/scene/material_properties.h: "roughness", "base_color"), one value for each
/// component. The alpha of "base_color" may be missing: it then stays. kEmissionTemperature comes after "emission".
using MaterialEdit = std::map<std::string, std::vector<float>>;
/// Sets the hue of the emission to that of a black body: one value in kelvin, kEditTemperature. The largest channel
/// stays.
inline constexpr const char* kEmissionTemperature = "emission_temperature";

/// An edit of objects by name. Digits are the place of an object in its list. Other names are exact names of one
/// object, or else patterns with * (any characters) and ? (one character) for all objects that match.
template <class Edit>
struct NamedEdit {
    std::string name;
    Edit edit{};
    std::string source{};  // option or file and element of the edit, for errors; empty: none
    bool operator==(const NamedEdit& other) const { return name == other.name && edit == other.edit; }
};

/// A name of objects of several kinds. It means all objects of that name or pattern, and nodes with everything below
/// them. A prefix selects a kind: "node:NAME", "mesh:NAME", "light:NAME"; numbers need one.
struct ObjectName {
    std::string name;
    std::string source{};  // like NamedEdit::source
    bool operator==(const ObjectName& other) const { return name == other.name; }
};

/// A group of lights, whose light gets a layer of its own.
struct LightGroup {
    std::string name;  // name of the group, which names the layer
    std::vector<std::string>
        lights;            // names, with a prefix or without (find_light_groups() in api/scene/light_groups.h)
    std::string source{};  // like NamedEdit::source
    bool operator==(const LightGroup& other) const { return name == other.name && lights == other.lights; }
};

/// The objects that lights of a name light, or those that cast their shadows.
struct LightLink {
    std::string light;  // name of lights, like those of a LightGroup
    // Names of nodes and meshes, like ObjectName; "-NAME" leaves objects out. Later names count more. The link starts
    // with all objects if the first name leaves some out, else with none. Not empty.
    std::vector<std::string> objects;
    std::string source{};  // like NamedEdit::source
    bool operator==(const LightLink& other) const { return light == other.light && objects == other.objects; }
};
inline constexpr std::size_t kMostLightGroups = 32;  ///< number of light groups, that of all other lights included

/// Edits of a list apply in their order. No name comes twice in a list.
struct SceneEdits {
    double environment_rotation = 0;  // degrees to the right, seen from inside, kEditRotation; rounded to whole texels
    float environment_intensity = 1;  // factor, kEditFactor
    vec3 environment_tint{1};         // factor by channel, kEditColor
    float emission = 1;               // factor of the emission of all surfaces, kEditFactor
    // Sizes of all points and spots (metres, kEditRadius) and of all directional lights (degrees, kEditAngle). Those of
    // `lights` replace them.
    std::optional<float> lamp_radius{}, sun_angle{};
    bool straight_glass = false;  // sets straight_shadows of all materials; `materials` replace it
    bool clay = false;            // gives every surface one rough grey without texture; lights stay
    // object_to_world by index into Scene::instances, affine, in place of animated transforms. An instance that an
    // animated scale of 0 hides may stay hidden.
    std::map<std::size_t, dmat4> transforms{};
    // Lamps behind the lights of the scene, with names of their own. `lights` names none of them alone: light_edit()
    // gives their own edit.
    std::vector<AddedLamp> added_lights{};
    std::vector<NamedEdit<LightEdit>> lights{};
    std::vector<NamedEdit<MaterialEdit>> materials{};  // they replace animated values at all times
    std::vector<NamedEdit<NodeEdit>> nodes{};
    std::vector<ObjectName> hidden{};
    std::vector<ObjectName> catchers{};  // surfaces of which the camera sees the shadows only; lights are no catchers
    // A level shadow catcher below the scene: at `ground_height` (metres, kEditPosition); none: at the lowest point of
    // the unedited surfaces at 0 s.
    bool ground = false;
    std::optional<double> ground_height{};
    std::vector<LightGroup> light_groups{};  // groups of lights; the first one that names a light has it
    bool each_light = false;                 // groups of one light each, in place of light_groups
    // Objects that lights light, and those that cast their shadows: departures from physics, which pictures name. A
    // light that several links name has the objects that are in all of them.
    std::vector<LightLink> light_links{}, shadow_links{};
    bool operator==(const SceneEdits&) const = default;
};

/// Colour and intensity (cd, lux or nits) of a light, whose product is PunctualLight::intensity.
struct LightColor {
    vec3 color;       // colour, largest channel 1; white if the light is off
    float intensity;  // >= 0
};
LightColor color_of(const PunctualLight& light);

/// Returns the lamps that edits add, in the order in which edits find them: surfaces come last.
std::vector<const AddedLamp*> lamps_in_order(const SceneEdits& edits);
/// Returns a lamp before its own edit. Surfaces are spots, which have a position and a direction, too.
PunctualLight plain_light(const AddedLamp& lamp);
/// Returns the size of a lamp that is a surface, after all edits of lights that name it.
vec2 size_of(const AddedLamp& lamp, const SceneEdits& edits);

/// Returns the profile that LightEdit::ies names; null if no edit has added it.
const LightProfile* profile_of_file(const Scene& scene, const std::string& path);

/// Returns v scaled to length 1; none if v is zero or not finite.
std::optional<dvec3> unit_direction(const dvec3& v);

/// Returns whether edits move or hide surfaces, which scenes in pages cannot follow.
bool change_surfaces(const SceneEdits& edits);
/// Returns the part of the edits that moves or hides surfaces.
SceneEdits surface_edits(const SceneEdits& edits);

/// Returns the nodes of a scene without a file: one for each instance and light, by name.
SceneTree tree_of(const Scene& scene);

/// Checks whether edits suit a scene. Throws Error for unknown and ambiguous names, unknown indices and properties,
/// values outside their ranges, light profiles that cannot be read, directions that are not unit, and transforms that
/// are not affine. The error names `source` (the file of the edits; empty: none), the scene, and the light, material,
/// node or instance.
void check_edits(const SceneEdits& edits, const Scene& scene, const SceneTree& tree, const std::string& source = {});
/// Checks edits of a scene without a file.
void check_edits(const SceneEdits& edits, const Scene& scene, const std::string& source = {});

/// Applies the edits of materials alone, but for the emission and clay of all. Throws Error as check_edits() does.
void edit_materials(const SceneEdits& edits, Scene& scene, const std::string& source = {});

/// Applies edits to a scene that has none yet. `tree` has the nodes of the scene in its pose. Throws Error as
/// check_edits() does, and then leaves the scene unchanged.
void apply(const SceneEdits& edits, Scene& scene, const SceneTree& tree, const std::string& source = {});
/// Applies edits to a scene without a file.
void apply(const SceneEdits& edits, Scene& scene, const std::string& source = {});

}  // namespace halflight
