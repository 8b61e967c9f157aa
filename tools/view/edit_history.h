// Undo and redo: states of the session that Ctrl-S would save. Uses no window.
#pragma once

#include <optional>
#include <vector>

#include "api/halflight/settings_file.h"

namespace halflight::view {

/// The states before and after each edit. An edit ends when the user releases the mouse or the keyboard.
class EditHistory {
  public:
    /// Forgets all states; `now` counts as saved.
    void start(SavedSettings now);
    /// Records the state if it differs from the last one. busy: the edit goes on, so nothing is recorded yet. An edit
    /// that restores the state before the last step takes that step back, as a double click on a slider may, whose
    /// first click moves it.
    void record(const SavedSettings& now, bool busy);
    /// Takes an exposure that metering has found into the current state. Such an exposure is no edit.
    void meter(float stops);
    /// Returns the state to restore, which counts as the current one; none if there is nothing to undo or redo.
    std::optional<SavedSettings> undo();
    std::optional<SavedSettings> redo();
    bool can_undo() const { return !before_.empty(); }
    bool can_redo() const { return !after_.empty(); }
    void mark_saved(SavedSettings now) { saved_ = std::move(now); }
    /// Returns whether there are edits that have not been saved.
    bool unsaved() const { return !(current_ == saved_); }

  private:
    SavedSettings current_, saved_;
    std::vector<SavedSettings> before_, after_;  // states to undo and redo, the next one last
};

}  // namespace halflight::view
