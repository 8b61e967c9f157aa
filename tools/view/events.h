// Input events of the window, kept in order until frames take them.
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "engine/core/math.h"

namespace halflight::view {

struct InputEvent {
    enum class Kind : std::uint8_t { key, letter, button, wheel, position, focus };
    Kind kind = Kind::key;
    int code = 0;              // number of the key or button, as in GLFW
    bool down = false;         // whether key or button is pressed, and for the first time; focus: the window has it
    int modifiers = 0;         // modifier keys held, bits as in GLFW
    char symbol = 0;           // keys: sign on the key in the user's layout, letters in upper case; 0: none
    std::uint32_t letter = 0;  // letters: code point
    dvec2 value{0};            // wheel: movement, notches; position: pixels of the framebuffer
    double time = 0;           // time of the event on the clock of clock.h, seconds
};

/// Queue of events that a GUI takes in, frame by frame. A GUI that samples the state of keys and buttons once a frame
/// would miss a key that is pressed and released between two frames.
class EventQueue {
  public:
    void add(const InputEvent& event) { events_.push_back(event); }
    bool empty() const { return events_.empty(); }
    /// Removes and returns the events of the next frame, oldest first. In them each key and button changes at most
    /// once. After a button has changed, the pointer does not move, and no key or letter comes: a click decides where
    /// letters go. Further events stay for the frames after.
    std::vector<InputEvent> take();

  private:
    std::deque<InputEvent> events_;
};

}  // namespace halflight::view
