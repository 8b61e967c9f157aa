// The identity of the code that made a picture.
#pragma once

namespace halflight {

/// Returns a hash of the sources on which a picture depends (source_hash.cmake). Builds of the same sources have the
/// same hash on every machine; a build of other sources may make other pictures.
const char* source_hash();

}  // namespace halflight
