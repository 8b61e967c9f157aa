// Undo and redo of camera moves. Uses no window.
#pragma once

#include <optional>
#include <vector>

#include "tools/view/session.h"

namespace halflight::view {

/// The views before and after each move of the camera. Moves that follow each other closely count as one.
class ViewHistory {
  public:
    void start(const View& now);  ///< Forgets all views.
    /// Records the view at a time, seconds. busy: the move goes on, because a button or a key is held.
    void record(const View& now, double time, bool busy);
    void settle(const View& now);  ///< Ends a move at once.
    /// Returns the view to restore, which counts as the current one; none if there is none. now: the view that is
    /// shown.
    std::optional<View> back(const View& now);
    std::optional<View> forward(const View& now);
    bool can_go_back(const View& now) const { return !before_.empty() || !(now == current_); }
    bool can_go_forward(const View& now) const { return !after_.empty() && now == current_; }

  private:
    View current_{};
    View seen_{};                       // last view that was recorded or restored
    double changed_ = 0;                // time at which it changed, seconds
    bool busy_ = false;                 // the last record() was busy
    std::vector<View> before_, after_;  // views to restore, the next one last
};

}  // namespace halflight::view
