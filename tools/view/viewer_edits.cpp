// Edits of the scene: undo and redo, the question before edits are lost, and the commands of scripts that edit.
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <utility>

#include "api/halflight/edit_text.h"
#include "tools/view/viewer.h"

namespace halflight::view {

void Viewer::undo(bool again) {
    edit_history_.record(session_.document(), false);
    const auto state = again ? edit_history_.redo() : edit_history_.undo();
    if (!state) throw Error(again ? "redo" : "undo", "there is no edit");
    restore(*state, again ? "redoing" : "undoing");
}

void Viewer::restore(const SavedSettings& state, const std::string& activity) {
    if (auto opening = session_.restore(state)) {
        restoring_ = true;
        start_opening(activity, std::move(*opening));
    }
}

void Viewer::revert() {
    const SavedSettings before = session_.document();
    edit_history_.record(before, false);
    SavedSettings state = before;
    state.edits = {};
    state.environment = {};
    state.variant.clear();
    if (state == before) return tell("The scene has no edits");
    restore(state, "reverting");
    tell("Edits of the scene removed; Ctrl+Z restores them");
}

void Viewer::undo_waiting() {
    if (reverts_ && !opening_.valid() && !next_change_) {
        reverts_ = false;
        revert();
    }
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
    if (opening_.valid() || next_change_) return;  // environment or variant change when it ends
    edit_history_.record(session_.document(), gizmo_.dragging() || ImGui::IsAnyItemActive());
    if (std::exchange(takes_settings_, false)) edit_history_.mark_saved(session_.document());
}

bool Viewer::may_lose_edits(const std::string& what, std::function<void()> f) {
    if (!takes_input() || std::exchange(discards_edits_, false)) return true;
    if (!opening_.valid()) edit_history_.record(session_.document(), false);
    if (!edit_history_.unsaved()) return true;
    if (!unsaved_prompt_.asking())
        unsaved_prompt_.ask(fmt::format("{} has edits that are not saved.\nSave them before {}?",
                                        session_.file().filename().string(), what),
                            session_.settings_file().filename().string(), std::move(f));
    return false;
}

void Viewer::ask_about_edits() {
    const UnsavedPrompt::Answer answer = unsaved_prompt_.declare();
    if (answer == UnsavedPrompt::Answer::save)
        attempt([&] {
            if (settings_changed()) {
                unsaved_prompt_.cancel();
                return file_prompt_.ask_to_replace(session_.settings_file());
            }
            writer_.finish();  // waits for earlier settings, which must not replace these
            saving_.clear();
            session_.save(picture_size_);
            session_.note_saved(session_.settings_file());
            edit_history_.mark_saved(session_.document());
            unsaved_prompt_.proceed();
        });
    if (answer == UnsavedPrompt::Answer::discard) {
        discards_edits_ = true;
        unsaved_prompt_.proceed();
    }
}

void Viewer::change_environment(const EnvironmentChoice& environment) {
    next_change_ = [this, environment] { start_opening("changing the environment", session_.lighting(environment)); };
}

void Viewer::change_variant(const std::string& variant) {
    next_change_ = [this, variant] { start_opening("loading the variant", session_.dressing(variant)); };
}

void Viewer::step_handles() {
    constexpr int kModes = 4;
    gizmo_.mode = static_cast<GizmoMode>((static_cast<int>(gizmo_.mode) + 1) % kModes);
    tell(fmt::format("Handles: {}{}", name(gizmo_.mode),
                     Gizmo::can_move(session_) ? "" : " (nothing is selected that they could move)"),
         "handles");
}

void Viewer::add_lamp(LampKind kind) {
    session_.add_lamp(kind, 0.5 * dvec2(picture_size_), picture_size_);
    last_kind_ = kind;
    if (gizmo_.mode == GizmoMode::none) gizmo_.mode = GizmoMode::move;
    section_ = "Light";
    tell(fmt::format("Added: {}", session_.name_of(session_.selection)));
}

void Viewer::duplicate_lamp() {
    session_.duplicate_lamp();
    tell(fmt::format("Added: {}", session_.name_of(session_.selection)));
}

void Viewer::hide_selected() {
    const Selection& object = session_.selection;
    if (object.kind == ObjectKind::none) return tell("Nothing is selected");
    const std::string name = session_.name_of(object);
    if (session_.remove_lamp()) return tell(fmt::format("Deleted: {}; Ctrl+Z brings it back", name));
    if (!can_be_hidden(object, session_)) return tell(fmt::format("{} cannot be hidden", session_.name_of(object)));
    const bool shown = HiddenObjects(session_).contains(object);
    set_shown(session_, object, shown);
    tell(fmt::format("{} {}", shown ? "Shown:" : "Hidden:", session_.name_of(object)));
}

bool Viewer::drag_handles(const WindowLayout& layout) {
    const dvec2 point = picture_point(layout, picture_size_, gui_.mouse());
    if (gizmo_.dragging()) {
        gizmo_.drag(session_, point);
        if (!ImGui::IsMouseDown(ImGuiMouseButton_Left)) gizmo_.end(session_);
        return true;
    }
    lit_handle_.reset();
    // Handles reach beyond the picture.
    const bool free = panels_shown_ && !ImGui::GetIO().WantCaptureMouse && layout.area.contains(gui_.mouse());
    if (!free || (ImGui::IsMouseDown(ImGuiMouseButton_Left) && !ImGui::IsMouseClicked(ImGuiMouseButton_Left)))
        return false;
    const double length = ObjectOverlay::handle_length(layout.picture, picture_size_, gui_.scale());
    lit_handle_ = Gizmo::axis_at(gizmo_.handles(session_, picture_size_, length), point,
                                 ObjectOverlay::handle_reach(layout.picture, picture_size_, gui_.scale()));
    if (!lit_handle_ || !ImGui::IsMouseClicked(ImGuiMouseButton_Left)) return false;
    gizmo_.begin(session_, picture_size_, length, *lit_handle_, point);
    return gizmo_.dragging();
}

void Viewer::select_clicked(const WindowLayout& layout) {
    constexpr float kStill = 4;  // pixels that the mouse may move during a click
    const ImGuiIO& io = ImGui::GetIO();
    const bool clicked = ImGui::IsMouseReleased(ImGuiMouseButton_Left) &&
                         io.MouseDragMaxDistanceSqr[ImGuiMouseButton_Left] <= kStill * kStill;
    const ImVec2& from = io.MouseClickedPos[ImGuiMouseButton_Left];
    if (!clicked || io.WantCaptureMouse || !panels_shown_ || !layout.picture.contains(dvec2(from.x, from.y))) return;
    const dvec2 point = picture_point(layout, picture_size_, gui_.mouse());
    const double reach = ObjectOverlay::handle_reach(layout.picture, picture_size_, gui_.scale());
    const bool marks = section_ == "Scene" || section_ == "Light";
    if (const auto light = marks ? ObjectOverlay::light_at(session_, picture_size_, point, reach) : std::nullopt)
        session_.selection = {ObjectKind::light, *light};
    else
        session_.select(point, picture_size_);
    tell(fmt::format("Selected: {}", session_.name_of(session_.selection)), "selection");
}

void Viewer::drag_handle(const dvec2& from, const dvec2& to) {
    const double length = ObjectOverlay::handle_length(layout().picture, picture_size_, 1);
    const auto axis = Gizmo::axis_at(gizmo_.handles(session_, picture_size_, length), from, length);
    if (!axis) throw Error("drag", "there is no handle at this pixel");
    gizmo_.begin(session_, picture_size_, length, *axis, from);
    gizmo_.drag(session_, to);
    gizmo_.end(session_);
}

bool Viewer::execute_edit(const Command& c) {
    const auto edit = [&](auto add) {
        SceneEdits edits = session_.edits;
        add(edits, c.name, c.words[0]);
        session_.edit(std::move(edits));
        return true;
    };
    if (c.name == "light" && c.numbers.empty()) return edit(add_light_edit);
    if (c.name == "add-light") return edit(add_new_light);
    if (c.name == "lamp") return add_lamp(lamp_kind(c.name, c.words[0])), true;
    if (c.name == "material") return edit(add_material_edit);
    if (c.name == "node") return edit(add_node_edit);
    if (c.name == "hide") return edit(add_hidden);
    if (c.name == "select") return session_.select(c.words[0]), true;
    if (c.name == "click") return session_.select(dvec2(c.numbers[0], c.numbers[1]), picture_size_), true;
    if (c.name == "search") {
        outliner_.search = {};
        std::ranges::copy_n(c.words[0].begin(), std::min<std::ptrdiff_t>(std::ssize(c.words[0]), 127),
                            outliner_.search.begin());
        return true;
    }
    if (c.name == "handles") return gizmo_.mode = gizmo_mode(c.words[0]), true;
    if (c.name == "drag") {
        drag_handle({c.numbers[0], c.numbers[1]}, {c.numbers[2], c.numbers[3]});
        return true;
    }
    if (c.name == "show")
        return edit([](SceneEdits& edits, const std::string&, const std::string& name) {
            if (std::erase(edits.hidden, ObjectName{name}) == 0) throw Error(name, "is not hidden");
        });
    return false;
}

}  // namespace halflight::view
