// Traces a ray of the diffuse component at first surfaces that select it.
#define COMPONENT_GLOSSY 0
#include "shaders/first_scatter.glsl"
