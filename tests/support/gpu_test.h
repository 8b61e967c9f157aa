// Declares the fixture of every test that uses OpenGL.
#pragma once

#include <gtest/gtest.h>

#include "engine/core/error.h"
#include "engine/gpu/context.h"
#include "engine/gpu/release_driver.h"
#include "tests/support/test_device.h"

namespace halflight {

/// Creates a debug context on the device of the tests (test_device.h). Throws Error that names the device if there is
/// none: the test fails instead of being skipped.
inline gpu::Context test_context() {
    const std::string device = test::test_device();
    try {
        return gpu::Context::create({.device = device, .debug = true});
    } catch (const Error& error) {
        throw Error("HALFLIGHT_TEST_DEVICE", "'{}' cannot be used: {}", device, error.what());
    }
}

/// Ends zink when it is destroyed. Mesa 22.3 frees the batches of a context that ends. A later context of the process
/// has been seen to wait without end, in batch_usage_wait(), for a batch that was freed.
struct ZinkRelease {
    ZinkRelease() = default;
    ZinkRelease(const ZinkRelease&) = delete;
    ZinkRelease& operator=(const ZinkRelease&) = delete;
    ~ZinkRelease() {
        if (test::test_device() == "zink") gpu::release_driver();
    }
};

/// Owns a current context; a GL error fails the test.
class GpuTest : public ::testing::Test {
    const ZinkRelease release_;  // outlives the context

  protected:
    void TearDown() override { EXPECT_NO_THROW(context.check("GL errors in this test")); }

    gpu::Context context = test_context();
};

}  // namespace halflight
