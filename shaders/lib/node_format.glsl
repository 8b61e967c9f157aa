// Format of the hierarchies (shaders/shared/bvh_nodes.h). Nodes are on a grid, unless one of the first two is true.
const bool kFloatNodes = HALFLIGHT_NODES_FLOAT != 0;
const bool kPageNodes = HALFLIGHT_NODES_PAGE != 0;
const bool kTwoLevel = HALFLIGHT_TWO_LEVEL != 0;  // there is a hierarchy over instances
