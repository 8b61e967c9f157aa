// Fixture of every test that uses OpenGL: a debug context on the software driver; a GL error fails the test. No
// context: the test fails, it is not skipped.
#pragma once

#include <gtest/gtest.h>

#include "engine/gpu/context.h"

namespace halflight {

class GpuTest : public ::testing::Test {
  protected:
    void TearDown() override { EXPECT_NO_THROW(context.check("GL errors in this test")); }

    gpu::Context context = gpu::Context::create({.device = "software", .debug = true});
};

}  // namespace halflight
