// Traces a ray of the glossy component at first surfaces that select it.
const bool kGlossyRays = true;
#include "shaders/first_scatter.glsl"
