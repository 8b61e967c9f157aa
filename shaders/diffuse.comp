// Sends a ray through the diffuse component of the first surface where that is picked.
#define COMPONENT_GLOSSY 0
#include "shaders/first_scatter.glsl"
