// Fixture of tests that render the shiny Cornell box.
#pragma once

#include "tests/pass/picture/pixels.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {

class CornellTest : public GpuTest {
  protected:
    const Scene cornell = shiny_cornell();
    PreparedScene prepared_cornell{context, cornell};
    ColorConfig colors = ColorConfig::load();
};

}  // namespace halflight::test
