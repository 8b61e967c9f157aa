// Where a path's samples of the sun lie (PathBuffers::sun_light).
#ifdef HALFLIGHT_REUSE
const uint kSunLightRows = 2u;
#else
const uint kSunLightRows = 1u;
#endif

// What belongs to PathState::pending.
uint own_sun_light(uint path) { return path * kSunLightRows; }
// What belongs to ReusePoint::pending.
uint given_sun_light(uint path) { return path * kSunLightRows + 1u; }
