#include "engine/core/steps.h"

#include <utility>

namespace halflight {
namespace {

thread_local StepWatch* innermost = nullptr;
thread_local WorkPart part;

}  // namespace

StepWatch::StepWatch(Begun begun) : begun_(std::move(begun)), outer_(std::exchange(innermost, this)) {}

StepWatch::~StepWatch() {
    innermost = outer_;
}

WorkPart current_part() {
    return part;
}

WorkParts::WorkParts(std::size_t count) : outer_(std::exchange(part, {0, static_cast<int>(count)})) {}

WorkParts::~WorkParts() {
    part = outer_;
}

void WorkParts::begin_next() {
    ++part.number;
}

void begin_step(const char* what) {
    if (innermost) innermost->begun_(what, ++innermost->steps_);
}

}  // namespace halflight
