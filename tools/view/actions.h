// The table of actions with a key. The menu, the shortcut sheet, scripts and docs/viewer.md follow it.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace halflight::view {

enum class Action {
    open,
    save,
    save_as,
    screenshot,
    picture_as,
    exr,
    quit,
    undo,
    redo,
    revert,
    hide_panels,
    larger_ui,
    smaller_ui,
    brighter,
    darker,
    reset_exposure,
    meter,
    next_layer,
    previous_layer,
    final_layer,
    draw_region,
    whole_picture,
    handles,
    hide_object,
    add_lamp,
    duplicate_lamp,
    unselect,
    frame_selected,
    frame_all,
    previous_view,
    next_view,
    focus_lens,
    reset_camera,
    bookmark,
    recall,
    play,
    keep,
    compare_file,
    close_comparison,
    shortcuts,
};

/// Menu of an action; the order is that of the menu bar.
enum class Menu { file, edit, view, camera, compare, help };
const char* name(Menu menu);

struct ActionRow {
    Action action;
    Menu menu;
    const char* label;  // text of the menu
    const char* keys;   // keys, separated by ", ": "Ctrl+S", "Ctrl+Shift+Z", "P", "F1", "?"
    const char* help;   // effect, in one phrase
};

/// Returns all rows, in the order of the menus.
std::span<const ActionRow> actions();
const ActionRow& row_of(Action action);

/// A key that was pressed.
struct KeyPress {
    std::string key;  // name of the key: "S", "F1", "Space", or the letter that was typed, such as "?"
    bool ctrl = false;
    bool shift = false;  // matters for letters with Ctrl only: signs depend on the keyboard's layout
};
/// Returns whether an action has this key. "1-9" stands for all digits from 1 on.
bool has_key(const ActionRow& row, const KeyPress& press);
/// Returns the row of a key; null for none.
const ActionRow* action_of(const KeyPress& press);
/// Parses "Ctrl+Shift+Z", "Ctrl+S" or "S".
KeyPress key_press(std::string_view text);

}  // namespace halflight::view
