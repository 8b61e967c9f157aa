// Declares the fixture of every test that uses OpenGL.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <optional>

#include "engine/core/error.h"
#include "engine/gpu/context.h"
#include "engine/gpu/driver_needs.h"
#include "engine/gpu/release_driver.h"
#include "tests/support/test_device.h"

namespace halflight {

/// Creates a debug context on the device of the tests (test_device.h). It keeps linked programs in the folder that the
/// environment variable HALFLIGHT_TEST_PROGRAMS names, if any. Throws Error that names the device if there is none: the
/// test fails instead of being skipped.
inline gpu::Context test_context() {
    const std::string device = test::test_device();
    const char* const programs = std::getenv("HALFLIGHT_TEST_PROGRAMS");
    try {
        return gpu::Context::create({.device = device, .binaries_folder = programs ? programs : "", .debug = true});
    } catch (const Error& error) {
        throw Error("HALFLIGHT_TEST_DEVICE", "'{}' cannot be used: {}", device, error.what());
    }
}

/// Owner of the context that all tests of the process share. It exists from the first test that needs it to the end of
/// the last test.
class SharedContext : public testing::Environment {
  public:
    gpu::Context& get() {
        if (!context_) context_.emplace(test_context());
        return *context_;
    }
    void SetUp() override { gpu::prepare_process(); }
    void TearDown() override {
        context_.reset();
        gpu::release_driver();  // lets Mesa write its cache
    }

  private:
    std::optional<gpu::Context> context_;
};
inline SharedContext* const shared_context =
    static_cast<SharedContext*>(testing::AddGlobalTestEnvironment(new SharedContext));

/// Makes the shared context current, in its default state; a GL error fails the test.
class GpuTest : public testing::Test {
  protected:
    GpuTest() {
        context.make_current();
        gpu::default_state();
    }
    void TearDown() override { EXPECT_NO_THROW(context.check("GL errors in this test")); }

    gpu::Context& context = shared_context->get();
};

}  // namespace halflight
