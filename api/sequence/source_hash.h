// The identity of the code that made a picture.
#pragma once

namespace halflight {

/// Returns a hash of the sources on which a picture depends, the versions of Embree and OpenColorIO, and the options of
/// the compiler that the user sets (source_hash.cmake). Builds with the same hash make the same pictures; others may
/// make other pictures.
const char* source_hash();

}  // namespace halflight
