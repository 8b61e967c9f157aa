// Traces a ray of the glossy component at first surfaces that select it.
#define COMPONENT_GLOSSY 1
#include "shaders/first_scatter.glsl"
