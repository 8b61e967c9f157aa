// The scene's materials, lights and environment. Kernels include this file before files of shaders/lib that need it.
//
// The defines of shader_defines() (engine/tables/shading_tables.h) tell which tables exist. A table that a kernel does
// not read costs nothing.
#include "shaders/shared/texture_units.h"

layout(binding = kUnitMaterials) uniform samplerBuffer scene_materials;
layout(binding = kUnitTextures) uniform usamplerBuffer scene_textures;
layout(binding = kUnitColorTexels) uniform samplerBuffer color_texels;
layout(binding = kUnitDataTexels) uniform samplerBuffer data_texels;
layout(binding = kUnitLights) uniform samplerBuffer scene_lights;
layout(binding = kUnitLightAlias) uniform samplerBuffer light_alias;
layout(binding = kUnitLightOfTriangle) uniform usamplerBuffer light_of_triangle;
layout(binding = kUnitEnvironment) uniform samplerBuffer environment_map;
layout(binding = kUnitEnvironmentWarp) uniform samplerBuffer environment_warp;
layout(binding = kUnitLightTree) uniform usamplerBuffer light_tree;
layout(binding = kUnitLightGroups) uniform usamplerBuffer light_groups;
layout(binding = kUnitLightLinks) uniform usamplerBuffer light_links;
layout(binding = kUnitAlbedo) uniform samplerBuffer albedo_table;
layout(binding = kUnitTileSlots) uniform usamplerBuffer tile_slots;
layout(binding = kUnitColorBanks) uniform samplerBuffer color_bank_1;
layout(binding = kUnitColorBanks + 1) uniform samplerBuffer color_bank_2;
layout(binding = kUnitColorBanks + 2) uniform samplerBuffer color_bank_3;
layout(binding = kUnitDataBanks) uniform samplerBuffer data_bank_1;
layout(binding = kUnitDataBanks + 1) uniform samplerBuffer data_bank_2;
layout(binding = kUnitDataBanks + 2) uniform samplerBuffer data_bank_3;
