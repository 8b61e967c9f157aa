#include "api/halflight/edit_text.h"
#include "tools/cli/options.h"

namespace halflight {
namespace {

/// Returns " KEY: METAVAR, help." for all rows of a table.
template <class Edit>
std::string list_of(std::span<const EditKey<Edit>> keys) {
    std::string list;
    for (const EditKey<Edit>& key : keys)
        list += fmt::format(" {}: {}{}{}.", key.name, key.metavar, *key.metavar ? ", " : "", key.help);
    return list;
}

}  // namespace

void add_edit_options(Options& options, ViewArguments& a) {
    options.group("Edits");
    const auto edit = [&](const char* name, const char* metavar, const std::string& help, EditOption::Add add) {
        options.repeated(name, metavar, help, [&a, name, add](const std::string& option, const std::string& text) {
            parsed(
                [&](const std::string&, const std::string&) {
                    add(a.choice.edits, option, text);
                    return 0;
                },
                option, text);
            a.edit_options.push_back({name, add, text});
        });
    };
    // Options apply in this order, so that --light may name added lights.
    edit(
        "--add-light", "NAME=kind:KIND,KEY:VALUE,...",
        "adds a light that shines like those of the file. KIND is point, spot, sun, rectangle or disc; rectangles and "
        "discs shine to one side. All but a sun need a position. Keys are those of --light that suit the kind. A light "
        "without further keys is white, has an intensity of 1 and shines down",
        add_new_light);
    edit("--light", "NAME=KEY:VALUE,...",
         "edits lights. NAME is a name, a number from 0, or a pattern with * and ?; `halflight info SCENE --names` "
         "lists "
         "names. A number alone is a factor. Keys are these." +
             list_of(light_edit_keys()),
         add_light_edit);
    edit("--lamp-radius", "METRES",
         "radius of all points and spots, which makes their shadows soft; --light NAME=radius:METRES replaces it",
         [](SceneEdits& edits, const std::string& option, const std::string& text) {
             edits.lamp_radius = static_cast<float>(real(option, text, kEditRadius.lower, kEditRadius.upper));
         });
    edit("--sun-angle", "DEGREES",
         "diameter of all directional lights in the sky, 0.53 for the sun; --light NAME=angle:DEGREES replaces it",
         [](SceneEdits& edits, const std::string& option, const std::string& text) {
             edits.sun_angle = static_cast<float>(real(option, text, kEditAngle.lower, kEditAngle.upper));
         });
    edit(
        "--glass-shadows", "bent|straight",
        "straight lets light pass all clear solid glass without bending it, which is a bias; only cameras, mirrors and "
        "other glass show it bent. --material NAME.straight_shadows=0|1 replaces it",
        [](SceneEdits& edits, const std::string& option, const std::string& text) {
            edits.straight_glass = glass_shadows_of(option, text);
        });
    edit("--material", "NAME.PROPERTY=VALUE",
         "edits materials: --material floor.roughness=0.3, --material wall.base_color=#8899cc. docs/materials.md lists "
         "the "
         "properties. A value multiplies the texture of its property",
         add_material_edit);
    edit("--node", "NAME=KEY:VALUE,...",
         "moves nodes with everything below them. Keys are these." + list_of(node_edit_keys()), add_node_edit);
    edit("--hide", "NAME",
         "hides nodes with everything below them, meshes and lights of a name or pattern; node:NAME, mesh:NAME and "
         "light:NAME select a kind",
         add_hidden);
    options.flag(
        "--ground",
        [&a] {
            const auto add = [](SceneEdits& edits, const std::string&, const std::string&) { edits.ground = true; };
            add(a.choice.edits, "--ground", "");
            a.edit_options.push_back({"--ground", add, ""});
        },
        "adds a level floor below the scene, of which the camera sees only the shadows on it");
    edit("--ground-height", "METRES", "adds the floor of --ground at this height, not at the lowest point of the scene",
         [](SceneEdits& edits, const std::string& option, const std::string& text) {
             edits.ground = true;
             edits.ground_height = real(option, text, kEditPosition.lower, kEditPosition.upper);
         });
    edit("--shadow-catcher", "NAME",
         "makes nodes with everything below them and meshes of a name or pattern shadow catchers. The camera sees only "
         "the shadows on them, as alpha; node:NAME and mesh:NAME select a kind",
         add_catcher);
    edit("--light-group", "NAME=LIGHT,...|each",
         "adds the layer light_NAME to the .exr: the picture's light from some lights. LIGHT is the name or pattern of "
         "lights, emissive materials, nodes with everything below them, or environment; light:NAME, material:NAME and "
         "node:NAME select a kind. light_rest has all other lights. `each` makes a layer of each light",
         add_light_group);
    edit("--light-link", "LIGHT=OBJECT,...|LIGHT=-OBJECT,...",
         "limits the objects that lights light, which is a departure from physics: to these objects, or with - to all "
         "but these. LIGHT is a name as for --light-group, OBJECT one as for --shadow-catcher, or ground",
         add_light_link);
    edit("--shadow-link", "LIGHT=OBJECT,...|LIGHT=-OBJECT,...",
         "limits the objects that cast the shadows of lights, in the form of --light-link: light passes all others",
         add_shadow_link);
}

}  // namespace halflight
