// Sampler, make_sampler, sample_1d, sample_2d, sample_1d_bits: Owen-scrambled Sobol points.
#include "shaders/shared/sobol.h"
