// Sends a ray through the glossy component of the first surface where that is picked.
#define COMPONENT_GLOSSY 1
#include "shaders/first_scatter.glsl"
