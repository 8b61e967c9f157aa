// Edits of the scene: undo and redo, the question before edits are lost, and the commands of scripts that edit.
#include <imgui.h>

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

void Viewer::undo_waiting() {
    while (undos_waiting_ != 0 && !opening_.valid()) {
        const bool again = undos_waiting_ < 0;
        undos_waiting_ += again ? 1 : -1;
        edit_history_.record(session_.document(), false);
        if (again ? !edit_history_.can_redo() : !edit_history_.can_undo()) {
            tell(again ? "There is no edit to repeat" : "There is no edit to take back");
            continue;
        }
        undo(again);
        tell(again ? "Edit repeated" : "Edit taken back");
    }
}

void Viewer::record_edits() {
    // An opening changes environment or variant when it ends.
    edit_history_.record(session_.document(), opening_.valid() || ImGui::IsAnyItemActive());
}

bool Viewer::may_lose_edits(const std::string& what, std::function<void()> f) {
    if (!takes_input() || std::exchange(discards_edits_, false)) return true;
    if (!opening_.valid()) edit_history_.record(session_.document(), false);
    if (!edit_history_.unsaved()) return true;
    if (!unsaved_prompt_.asking()) unsaved_prompt_.ask(what, std::move(f));
    return false;
}

void Viewer::ask_about_edits() {
    const UnsavedPrompt::Answer answer = unsaved_prompt_.declare();
    if (answer == UnsavedPrompt::Answer::save)
        attempt([&] {
            write_settings(session_.settings_file(), session_.saved(picture_size_));
            edit_history_.mark_saved(session_.document());
            unsaved_prompt_.proceed();
        });
    if (answer == UnsavedPrompt::Answer::discard) {
        discards_edits_ = true;
        unsaved_prompt_.proceed();
    }
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
