// Layout of Accumulated::halves (passes/picture/accumulate.h).
#include "shaders/shared/denoise.h"
#include "shaders/shared/chain_records.h"

// Number of doubles per path.
#if HALFLIGHT_SPECULAR_CHAINS
const uint kHalfStride = kHalfSums + kChainSums;
#else
const uint kHalfStride = kHalfSums;
#endif
