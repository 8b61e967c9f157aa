// The list of all objects of a scene with a search text, and their visibility. Uses no window.
#pragma once

#include <array>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tools/view/session.h"

namespace halflight::view {

/// The list of objects, as the search text leaves it.
class Outliner {
  public:
    struct Row {
        Selection object;
        int depth = 0;      // nodes above
        std::string label;  // name, or kind and number
    };
    std::array<char, 128> search{};  // text of the search field, zero-terminated
    std::array<bool, 8> folded{};    // kinds, by ObjectKind, whose rows the user has folded
    Selection scrolled_to{};         // object to which the list has been scrolled
    Selection inspected{};           // object whose properties have been scrolled into view
    Selection lit{};                 // object whose light the section Light has opened
    std::array<char, 128> listed{};  // search text of the rows that the list has shown last

    /// Returns the rows of the session's scene whose labels contain the search text, without regard to case. The rows
    /// of a kind stand next to each other.
    const std::vector<Row>& rows(const Session& session);

  private:
    std::string searched_;
    std::vector<std::string> lights_;     // references of the lights of `rows_`
    std::shared_ptr<const Scene> scene_;  // scene and nodes of `rows_`
    std::shared_ptr<const SceneTree> tree_;
    std::vector<Row> rows_;
};

/// Objects that edits hide: by name, or, for lights, by switching them off. Objects below a hidden node are not listed.
class HiddenObjects {
  public:
    explicit HiddenObjects(const Session& session);
    bool contains(const Selection& object) const { return all_.contains({object.kind, object.index}); }

  private:
    std::set<std::pair<ObjectKind, std::size_t>> all_;
};

/// Returns whether edits can hide an object of this kind in the session's scene.
bool can_be_hidden(const Selection& object, const Session& session);
/// Shows or hides an object. A name that hides several objects is replaced by names that hide the others.
void set_shown(Session& session, const Selection& object, bool shown);

/// Removes edits by name that change nothing.
void remove_empty(SceneEdits& edits);

}  // namespace halflight::view
