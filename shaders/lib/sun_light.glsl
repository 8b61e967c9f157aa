// The sun that is sampled apart from other lights, and positions of a path's sun samples (PathBuffers::sun_light).
const bool kSun = HALFLIGHT_SUN != 0;
const uint kSunLightRows = HALFLIGHT_REUSE != 0 || HALFLIGHT_RADIANCE_CACHE != 0 ? 2u : 1u;

// Returns the row of PathState::pending.
uint own_sun_light(uint path) { return path * kSunLightRows; }
// Returns the row of ReusePoint::pending or CachePoint::pending.
uint given_sun_light(uint path) { return path * kSunLightRows + 1u; }
