// Lobes and kinds of transport that some material of the scene has. The compiler removes the code of all others.
const bool kDiffuse = HALFLIGHT_DIFFUSE != 0;
const bool kDiffuseTransmission = HALFLIGHT_DIFFUSE_TRANSMISSION != 0;
const bool kGlossy = HALFLIGHT_GLOSSY != 0;  // any of the following
const bool kTransmission = HALFLIGHT_TRANSMISSION != 0;
const bool kClearcoat = HALFLIGHT_CLEARCOAT != 0;
const bool kSheen = HALFLIGHT_SHEEN != 0;
const bool kAnisotropy = HALFLIGHT_ANISOTROPY != 0;
const bool kIridescence = HALFLIGHT_IRIDESCENCE != 0;
const bool kVolume = HALFLIGHT_VOLUME != 0;  // solids: transmission with a thickness
const bool kDispersion = HALFLIGHT_DISPERSION != 0;
