#include "engine/core/interruption.h"

#include <utility>

namespace halflight {
namespace {

thread_local const Interruptible* innermost = nullptr;
thread_local std::uint64_t ended = 0;

}  // namespace

Interruptible::Interruptible(std::function<void()> check)
    : check_(std::move(check)), outer_(std::exchange(innermost, this)) {}

Interruptible::~Interruptible() {
    innermost = outer_;
}

void interruption_point() {
    if (!innermost) return;
    try {
        innermost->check_();
    } catch (...) {
        ++ended;
        throw;
    }
}

std::uint64_t interruptions() {
    return ended;
}

}  // namespace halflight
