// Slots of the blocks, samplers and images of a program, by their names in the shader.
#pragma once

#include <epoxy/gl.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace halflight::gpu {

enum class SlotKind : std::uint8_t { storage_block, uniform_block, sampler, image };
const char* name(SlotKind kind);

struct Slot {
    std::string name;  // name of the block or uniform
    SlotKind kind;
    GLuint index;         // binding point or unit
    bool shared = false;  // true: a scene table, which is bound for all programs at once
};

/// Gives each active block, sampler and image of a linked program a slot, and returns the slots. Blocks and images are
/// numbered from 0, samplers from kUnitFree. Samplers of scene tables keep the unit that their layout names
/// (shaders/shared/texture_units.h). Throws Error that names program and resource for arrays of resources, and for
/// uniforms that Program can neither bind nor set.
std::vector<Slot> assign_slots(std::string_view name, GLuint program);

}  // namespace halflight::gpu
