// Where a path's samples of the sun lie (PathBuffers::sun_light).
#if defined(HALFLIGHT_REUSE) || defined(HALFLIGHT_RADIANCE_CACHE)
const uint kSunLightRows = 2u;
#else
const uint kSunLightRows = 1u;
#endif

// What belongs to PathState::pending.
uint own_sun_light(uint path) { return path * kSunLightRows; }
// What belongs to ReusePoint::pending or CachePoint::pending.
uint given_sun_light(uint path) { return path * kSunLightRows + 1u; }
