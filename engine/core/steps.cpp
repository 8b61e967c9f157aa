#include "engine/core/steps.h"

#include <utility>

namespace halflight {
namespace {

thread_local StepWatch* innermost = nullptr;

}  // namespace

StepWatch::StepWatch(Begun begun) : begun_(std::move(begun)), outer_(std::exchange(innermost, this)) {}

StepWatch::~StepWatch() {
    innermost = outer_;
}

void begin_step(const char* what) {
    if (innermost) innermost->begun_(what, ++innermost->steps_);
}

}  // namespace halflight
