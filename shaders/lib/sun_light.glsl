// Positions of a path's sun samples (PathBuffers::sun_light).
#if HALFLIGHT_REUSE || HALFLIGHT_RADIANCE_CACHE
const uint kSunLightRows = 2u;
#else
const uint kSunLightRows = 1u;
#endif

// Returns the row of PathState::pending.
uint own_sun_light(uint path) { return path * kSunLightRows; }
// Returns the row of ReusePoint::pending or CachePoint::pending.
uint given_sun_light(uint path) { return path * kSunLightRows + 1u; }
