// Edits of a scene as text, as command lines, settings files and scripts of the viewer have them:
//   light     NAME=KEY:VALUE,...        key=intensity:800,temperature:2700    key=off    key=0.5 (a factor)
//   new light NAME=kind:KIND,KEY:VALUE,...    fill=kind:spot,position:0,2,0,intensity:50
//   material  NAME.PROPERTY=VALUE       floor.roughness=0.3    wall.base_color=#8899cc
//   node      NAME=KEY:VALUE,...        crate=translate:1,0,0,rotate:0,45,0
//   group     NAME=LIGHT,...            key=sun,lamp*    each
// NamedEdit says what a NAME finds. Numbers of a value are separated by commas.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "api/halflight/scene_edits.h"

namespace halflight {

/// A row of a table of edits.
template <class Edit>
struct EditKey {
    const char* name;     // key in texts and in settings files
    const char* metavar;  // placeholder of the key's value in help texts; "": the key has no value
    const char* help;
    /// Sets the value. Throws Error about `subject` if the text is malformed or outside its range.
    void (*set)(Edit& edit, const std::string& subject, const std::string& text);
    std::string (*get)(const Edit& edit);  // returns the value, from which set() restores it exactly; "": none
};
std::span<const EditKey<LightEdit>> light_edit_keys();
std::span<const EditKey<NodeEdit>> node_edit_keys();

/// Sets the value of a key. Throws Error about `subject`, also for unknown keys.
void set_key(LightEdit& edit, const std::string& subject, std::string_view key, const std::string& text);
void set_key(NodeEdit& edit, const std::string& subject, std::string_view key, const std::string& text);
/// Sets a property. Throws Error about `subject` for unknown properties and values outside their ranges.
void set_key(MaterialEdit& edit, const std::string& subject, std::string_view property, const std::string& text);

/// Returns "KEY:VALUE,...", without keys that change nothing.
std::string text(const LightEdit& edit);
std::string text(const NodeEdit& edit);
/// Returns the value of a property.
std::string property_text(std::span<const float> values);

/// Returns the edit of a name, which is added if there is none. It is the last one of that name, or that of an added
/// light.
LightEdit& light_edit(SceneEdits& edits, const std::string& name);
/// Returns the edit that light_edit() gives; null if there is none yet.
const LightEdit* find_light_edit(const SceneEdits& edits, std::string_view name);
MaterialEdit& material_edit(SceneEdits& edits, const std::string& name);
NodeEdit& node_edit(SceneEdits& edits, const std::string& name);

/// Adds an edit in the form above. Keys that earlier edits of the same name have set, and this one does not, stay.
/// Throws Error about `source`, the option or the element of a file, which errors about the scene name later.
void add_light_edit(SceneEdits& edits, const std::string& source, const std::string& text);
/// Returns the kind of a name. Throws Error about the subject for other words.
LampKind lamp_kind(const std::string& subject, std::string_view text);
/// Adds a light, in the form above. Throws Error about the source for other texts; check_edits() finds names that are
/// taken, and values that the kind has not.
void add_new_light(SceneEdits& edits, const std::string& source, const std::string& text);
/// Returns SceneEdits::straight_glass for "straight" or "bent". Throws Error about the source for other words.
bool glass_shadows_of(const std::string& source, std::string_view text);
void add_material_edit(SceneEdits& edits, const std::string& source, const std::string& text);
void add_node_edit(SceneEdits& edits, const std::string& source, const std::string& text);
/// Hides nodes, meshes and lights.
void add_hidden(SceneEdits& edits, const std::string& source, const std::string& name);
/// Makes nodes and meshes shadow catchers.
void add_catcher(SceneEdits& edits, const std::string& source, const std::string& name);
/// Adds lights to a light group, in the form NAME=LIGHT,...; "each" separates all lights (SceneEdits::each_light).
/// Throws Error for other texts, and if named groups are given with "each".
void add_light_group(SceneEdits& edits, const std::string& source, const std::string& text);
/// Adds a link of the lights of a name, in the form NAME=OBJECT,... or NAME=-OBJECT,..., in place of an earlier one of
/// the same name. Throws Error for other texts.
void add_light_link(SceneEdits& edits, const std::string& source, const std::string& text);
void add_shadow_link(SceneEdits& edits, const std::string& source, const std::string& text);

}  // namespace halflight
