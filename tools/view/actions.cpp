#include "tools/view/actions.h"

#include <algorithm>
#include <array>

namespace halflight::view {
namespace {

constexpr std::array kActions = {
    ActionRow{Action::open, Menu::file, "Open ...", "Ctrl+O", "opens a scene or an environment"},
    ActionRow{Action::save, Menu::file, "Save settings", "Ctrl+S", "saves the settings"},
    ActionRow{Action::save_as, Menu::file, "Save settings as ...", "Ctrl+Shift+S",
              "saves the settings in another file"},
    ActionRow{Action::screenshot, Menu::file, "Save .png", "P", "saves the picture as shown"},
    ActionRow{Action::exr, Menu::file, "Save .exr", "Ctrl+E", "saves the linear picture with the layer shown"},
    ActionRow{Action::picture_as, Menu::file, "Save picture as ...", "Ctrl+P",
              "saves the picture under a name: .png as shown, .exr linear, if wanted with all layers"},
    ActionRow{Action::quit, Menu::file, "Quit", "Ctrl+Q", "ends the viewer"},
    ActionRow{Action::undo, Menu::edit, "Undo", "Ctrl+Z", "takes back the last edit"},
    ActionRow{Action::redo, Menu::edit, "Redo", "Ctrl+Y, Ctrl+Shift+Z", "repeats the edit that was taken back last"},
    ActionRow{Action::revert, Menu::edit, "Revert to the scene", "Ctrl+Shift+R",
              "removes all edits of the scene, its environment and its variant"},
    ActionRow{Action::handles, Menu::edit, "Handles", "G",
              "steps through the handles of the selected object: move, rotate, scale, none"},
    ActionRow{Action::hide_object, Menu::edit, "Hide or delete", "Delete",
              "hides the selected object, or shows it again; deletes an added lamp"},
    ActionRow{Action::add_lamp, Menu::edit, "Add lamp", "Ctrl+L",
              "adds a lamp before the surface in the middle of the picture: of the kind that was added last"},
    ActionRow{Action::duplicate_lamp, Menu::edit, "Duplicate lamp", "Ctrl+D",
              "adds a copy of the selected lamp beside it"},
    ActionRow{Action::unselect, Menu::edit, "Select nothing", "Escape", "selects nothing"},
    ActionRow{Action::hide_panels, Menu::view, "Hide panels", "H", "hides or shows everything but the picture"},
    ActionRow{Action::larger_ui, Menu::view, "Larger text", "Ctrl++, Ctrl+=", "enlarges text and controls"},
    ActionRow{Action::smaller_ui, Menu::view, "Smaller text", "Ctrl+-", "reduces text and controls"},
    ActionRow{Action::brighter, Menu::view, "Brighter", "]", "raises the exposure by a quarter of a stop"},
    ActionRow{Action::darker, Menu::view, "Darker", "[", "lowers the exposure by a quarter of a stop"},
    ActionRow{Action::reset_exposure, Menu::view, "Exposure 0", "\\", "sets the exposure to 0"},
    ActionRow{Action::meter, Menu::view, "Meter", "M",
              "finds the exposure as --exposure auto does: pictures that need less than 3 stops get 0"},
    ActionRow{Action::next_layer, Menu::view, "Next layer", ".", "shows the next layer"},
    ActionRow{Action::previous_layer, Menu::view, "Previous layer", ",", "shows the previous layer"},
    ActionRow{Action::final_layer, Menu::view, "Final picture", "0", "shows the final picture"},
    ActionRow{Action::draw_region, Menu::view, "Draw region", "Ctrl+B",
              "gives further samples only to a region, which the next drag draws"},
    ActionRow{Action::whole_picture, Menu::view, "Whole picture", "Ctrl+Shift+B",
              "gives samples to the whole picture again"},
    ActionRow{Action::frame_selected, Menu::camera, "Frame selected", "F",
              "frames the selected object, or else the object under the mouse"},
    ActionRow{Action::frame_all, Menu::camera, "Frame all", "Home", "frames all objects"},
    ActionRow{Action::previous_view, Menu::camera, "Previous view", "Z", "takes back the last move of the camera"},
    ActionRow{Action::next_view, Menu::camera, "Next view", "X", "repeats the move that was taken back last"},
    ActionRow{Action::focus_lens, Menu::camera, "Focus lens", "L",
              "focuses the lens on the surface under the mouse: depth of field"},
    ActionRow{Action::reset_camera, Menu::camera, "Reset camera", "R",
              "returns to the camera that was chosen last, at first the one of the start"},
    ActionRow{Action::bookmark, Menu::camera, "Add bookmark", "B", "stores the view as a bookmark"},
    ActionRow{Action::recall, Menu::camera, "Recall bookmark", "1-9", "recalls a bookmark"},
    ActionRow{Action::play, Menu::camera, "Play", "Space", "plays the animation, or stops it"},
    ActionRow{Action::keep, Menu::compare, "Keep picture as B", "K", "keeps the picture for comparison"},
    ActionRow{Action::compare_file, Menu::compare, "Compare with a file ...", "Ctrl+Shift+K",
              "takes an .exr or a .png as the picture B"},
    ActionRow{Action::close_comparison, Menu::compare, "Close comparison", "Ctrl+K", "removes the picture B"},
    ActionRow{Action::shortcuts, Menu::help, "Shortcuts", "F1, ?", "shows mouse and keys"},
};

}  // namespace

const char* name(Menu menu) {
    switch (menu) {
        case Menu::file:
            return "File";
        case Menu::edit:
            return "Edit";
        case Menu::view:
            return "View";
        case Menu::camera:
            return "Camera";
        case Menu::compare:
            return "Compare";
        case Menu::help:
            return "Help";
    }
    return "";
}

std::span<const ActionRow> actions() {
    return kActions;
}

const ActionRow& row_of(Action action) {
    return *std::ranges::find(kActions, action, &ActionRow::action);
}

KeyPress key_press(std::string_view text) {
    const auto take = [&](std::string_view prefix) {
        const bool there = text.starts_with(prefix);
        if (there) text.remove_prefix(prefix.size());
        return there;
    };
    const bool ctrl = take("Ctrl+");
    const bool shift = ctrl && take("Shift+");
    return {std::string(text), ctrl, shift};
}

bool has_key(const ActionRow& row, const KeyPress& press) {
    constexpr std::string_view kNext = ", ";
    const std::string_view keys = row.keys;
    for (std::size_t from = 0; from < keys.size();) {
        const std::size_t to = std::min(keys.find(kNext, from), keys.size());
        const KeyPress own = key_press(keys.substr(from, to - from));
        const bool letter = own.key.size() == 1 && own.key[0] >= 'A' && own.key[0] <= 'Z';
        if (own.ctrl == press.ctrl && (!own.ctrl || !letter || own.shift == press.shift)) {
            if (own.key == press.key) return true;
            if (own.key == "1-9" && press.key.size() == 1 && press.key[0] >= '1' && press.key[0] <= '9') return true;
        }
        from = to + kNext.size();
    }
    return false;
}

const ActionRow* action_of(const KeyPress& press) {
    const auto found = std::ranges::find_if(kActions, [&](const ActionRow& row) { return has_key(row, press); });
    return found == kActions.end() ? nullptr : &*found;
}

}  // namespace halflight::view
