// Chooses the device that tests render on.
#pragma once

#include <cstdlib>
#include <string>

namespace halflight::test {

/// Returns the argument for `halflight --device`: the value of HALFLIGHT_TEST_DEVICE, or "software" if it is not
/// set.
inline std::string test_device() {
    const char* device = std::getenv("HALFLIGHT_TEST_DEVICE");
    return device && *device ? device : "software";
}

}  // namespace halflight::test
