#include "tools/view/events.h"

#include <algorithm>

namespace halflight::view {
namespace {

/// Returns whether a frame that has taken `taken` can take `next`, too.
bool fits(const std::vector<InputEvent>& taken, const InputEvent& next) {
    using Kind = InputEvent::Kind;
    const auto is = [&](Kind kind) { return [kind](const InputEvent& e) { return e.kind == kind; }; };
    const auto changes = [&](const InputEvent& e) { return e.kind == next.kind && e.code == next.code; };
    switch (next.kind) {
        case Kind::key:
            return std::ranges::none_of(taken, changes) && std::ranges::none_of(taken, is(Kind::button));
        case Kind::button:
            return std::ranges::none_of(taken, changes);
        case Kind::position:
            return std::ranges::none_of(taken, is(Kind::button));
        case Kind::focus:
            return taken.empty();  // losing the focus releases all keys
        case Kind::letter:
            return std::ranges::none_of(taken, is(Kind::button));
        case Kind::wheel:
            return true;
    }
    return true;
}

}  // namespace

std::vector<InputEvent> EventQueue::take() {
    std::vector<InputEvent> taken;
    while (!events_.empty() && fits(taken, events_.front())) {
        taken.push_back(events_.front());
        events_.pop_front();
        if (taken.back().kind == InputEvent::Kind::focus) break;
    }
    return taken;
}

}  // namespace halflight::view
