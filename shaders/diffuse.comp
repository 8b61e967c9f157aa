// Traces a ray of the diffuse component at first surfaces that select it.
const bool kGlossyRays = false;
#include "shaders/first_scatter.glsl"
