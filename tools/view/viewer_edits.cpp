// Edits of the scene: undo and redo, and the commands of scripts that edit.
#include <utility>

#include "api/halflight/edit_text.h"
#include "tools/view/viewer.h"

namespace halflight::view {

void Viewer::undo(bool again) {
    edit_history_.record(session_.document(), false);
    const auto state = again ? edit_history_.redo() : edit_history_.undo();
    if (!state) throw Error(again ? "redo" : "undo", "there is no edit");
    if (auto opening = session_.restore(*state)) start_opening(again ? "redoing" : "undoing", std::move(*opening));
}

bool Viewer::execute_edit(const Command& c) {
    const auto edit = [&](auto add) {
        SceneEdits edits = session_.edits;
        add(edits, c.name, c.words[0]);
        session_.edit(std::move(edits));
        return true;
    };
    if (c.name == "light" && c.numbers.empty()) return edit(add_light_edit);
    if (c.name == "material") return edit(add_material_edit);
    if (c.name == "node") return edit(add_node_edit);
    if (c.name == "hide") return edit(add_hidden);
    if (c.name == "show")
        return edit([](SceneEdits& edits, const std::string&, const std::string& name) {
            if (std::erase(edits.hidden, HiddenName{name}) == 0) throw Error(name, "is not hidden");
        });
    return false;
}

}  // namespace halflight::view
