// States of paths, read as texels, which are faster than storage blocks on llvmpipe.
#include "shaders/shared/path_state.h"

uniform usamplerBuffer states;  // RGBA32UI, the four texels of each PathState

PathState load_state(uint path) {
    uvec4 a = texelFetch(states, int(4u * path));
    uvec4 b = texelFetch(states, int(4u * path + 1u));
    uvec4 c = texelFetch(states, int(4u * path + 2u));
    uvec4 d = texelFetch(states, int(4u * path + 3u));
    return PathState(uintBitsToFloat(a.xyz), uintBitsToFloat(a.w), uintBitsToFloat(b.xyz), b.w, uintBitsToFloat(c.xyz),
                     c.w, uintBitsToFloat(d.xyz), d.w);
}
