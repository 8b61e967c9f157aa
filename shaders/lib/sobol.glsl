// Owen-scrambled Sobol points: Sampler, make_sampler, sample_1d, sample_2d, sample_1d_bits.
#include "shaders/shared/sobol.h"
