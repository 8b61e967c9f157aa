// Chooses the device that tests render on.
#pragma once

#include <cstdlib>
#include <string>

namespace halflight::test {

/// Returns the value of HALFLIGHT_TEST_DEVICE, which is what `halflight --device` takes; "software" where it is not
/// set.
inline std::string test_device() {
    const char* device = std::getenv("HALFLIGHT_TEST_DEVICE");
    return device && *device ? device : "software";
}

}  // namespace halflight::test
