// The scene's materials, lights and environment. Kernels include this file before files of shaders/lib that need it.
//
// The defines of shader_defines() (engine/tables/shading_tables.h) tell which tables exist. A table that a kernel does
// not read costs nothing.
#include "shaders/shared/texture_units.h"

layout(binding = UNIT_MATERIALS) uniform samplerBuffer scene_materials;
layout(binding = UNIT_TEXTURES) uniform usamplerBuffer scene_textures;
layout(binding = UNIT_COLOR_TEXELS) uniform samplerBuffer color_texels;
layout(binding = UNIT_DATA_TEXELS) uniform samplerBuffer data_texels;
layout(binding = UNIT_LIGHTS) uniform samplerBuffer scene_lights;
layout(binding = UNIT_LIGHT_ALIAS) uniform samplerBuffer light_alias;
layout(binding = UNIT_LIGHT_OF_TRIANGLE) uniform usamplerBuffer light_of_triangle;
layout(binding = UNIT_ENVIRONMENT) uniform samplerBuffer environment_map;
layout(binding = UNIT_ENVIRONMENT_WARP) uniform samplerBuffer environment_warp;
layout(binding = UNIT_LIGHT_TREE) uniform usamplerBuffer light_tree;
#if HALFLIGHT_LIGHT_GROUPS
layout(binding = UNIT_LIGHT_GROUPS) uniform usamplerBuffer light_groups;
#endif
layout(binding = UNIT_ALBEDO) uniform samplerBuffer albedo_table;
#if HALFLIGHT_TILED_TEXTURES
layout(binding = UNIT_TILE_SLOTS) uniform usamplerBuffer tile_slots;
#endif
#if HALFLIGHT_COLOR_BANK_1
layout(binding = UNIT_COLOR_BANKS) uniform samplerBuffer color_bank_1;
#endif
#if HALFLIGHT_COLOR_BANK_2
layout(binding = UNIT_COLOR_BANKS + 1) uniform samplerBuffer color_bank_2;
#endif
#if HALFLIGHT_COLOR_BANK_3
layout(binding = UNIT_COLOR_BANKS + 2) uniform samplerBuffer color_bank_3;
#endif
#if HALFLIGHT_DATA_BANK_1
layout(binding = UNIT_DATA_BANKS) uniform samplerBuffer data_bank_1;
#endif
#if HALFLIGHT_DATA_BANK_2
layout(binding = UNIT_DATA_BANKS + 1) uniform samplerBuffer data_bank_2;
#endif
#if HALFLIGHT_DATA_BANK_3
layout(binding = UNIT_DATA_BANKS + 2) uniform samplerBuffer data_bank_3;
#endif
