// Requirements of programs, and the limits of drivers on them.
#pragma once

#include <epoxy/gl.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "engine/gpu/program_slots.h"

namespace halflight::gpu {

/// A quantity that a stage or program needs, and the driver's limit on it.
struct Requirement {
    std::string_view what;  // noun in the plural: "storage blocks"
    std::size_t needed = 0;
    std::size_t allowed = 0;
    std::string_view limit;  // the limit's name in OpenGL
};

/// Returns what the text of a stage declares: blocks, samplers, images and the size of a workgroup. Declarations that
/// the preprocessor leaves out count, too, so `needed` is an upper bound.
std::vector<Requirement> declared_requirements(GLenum stage, std::string_view text);

/// Returns what the slots of a linked program take. Drivers check the number of resources, but not their slots.
std::vector<Requirement> slot_requirements(const std::vector<Slot>& slots);

/// Returns "needs 9 storage blocks, the driver allows 8 (GL_MAX_...)" for the first requirement that is not met; "" if
/// all are met.
std::string unmet(const std::vector<Requirement>& requirements);

/// Limits on what a program gets when it runs.
struct RunLimits {
    std::array<std::uint32_t, 3> groups{};  // workgroups along x, y and z
    std::size_t storage_block_bytes = 0;
    std::size_t uniform_block_bytes = 0;
    double dispatch_seconds = 0;  // longest time of a dispatch (dispatch_pieces.h); 0: any
};
/// Returns the limits of the current context, which each thread asks once.
const RunLimits& run_limits();
/// Lets all threads ask again. A new context may have the handle of one that was destroyed.
void forget_run_limits();

}  // namespace halflight::gpu
