// Layout of Accumulated::halves (passes/picture/accumulate.h).
#include "shaders/shared/denoise.h"
#include "shaders/shared/chain_records.h"

const bool kSpecularChains = HALFLIGHT_SPECULAR_CHAINS != 0;
const uint kHalfStride = kHalfSums + (kSpecularChains ? kChainSums : 0u);  // number of doubles per path
