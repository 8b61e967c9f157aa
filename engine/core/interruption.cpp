#include "engine/core/interruption.h"

#include <utility>

namespace halflight {
namespace {

thread_local const Interruptible* innermost = nullptr;

}  // namespace

Interruptible::Interruptible(std::function<void()> check)
    : check_(std::move(check)), outer_(std::exchange(innermost, this)) {}

Interruptible::~Interruptible() {
    innermost = outer_;
}

void interruption_point() {
    if (innermost) innermost->check_();
}

}  // namespace halflight
