#include "engine/core/steps.h"

#include <utility>

namespace halflight {
namespace {

thread_local StepWatch* innermost = nullptr;
thread_local WorkPart part;

}  // namespace

StepWatch::StepWatch(Begun begun, std::function<void()> ended)
    : begun_(std::move(begun)), ended_(std::move(ended)), outer_(std::exchange(innermost, this)) {}

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

void end_step() {
    if (innermost && innermost->ended_) innermost->ended_();
}

}  // namespace halflight
