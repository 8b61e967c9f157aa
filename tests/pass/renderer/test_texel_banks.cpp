// Tests texel pools of several banks: pictures are those of one bank.
#include <gtest/gtest.h>

#include <bit>

#include "engine/core/error.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/error_message.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

using TexelBanks = GpuTest;

/// Each step halves the banks, so that the same texels are in other banks.
TEST_F(TexelBanks, ChangeNoPicture) {
    const Scene scene = textured_scene();
    const RenderSettings settings = all_settings(scene, 48, 32, 2);
    const ColorConfig colors = ColorConfig::load();
    const auto banked = [&](unsigned shift) {
        PreparedScene prepared(context, scene, {.bank_shift = shift});
        return Renderer(prepared, colors, settings).render();
    };
    const ShadingTables tables = build_shading_tables(scene, build_trace_tables(scene, kFlattenLimit));
    const std::size_t most = std::max(tables.color_texels.size(), tables.data_texels.size());
    const auto one = static_cast<unsigned>(std::bit_width(most - 1));  // one bank holds 2^one texels
    const RenderResult expected = banked(shared::kMostBankShift);
    for (const unsigned shift : {one, one - 1, one - 2}) {
        SCOPED_TRACE(shift);
        expect_same(banked(shift), expected);
    }
    EXPECT_NE(error_message([&] { banked(one - 3); }).find("4 texture buffers of the driver end at"),
              std::string::npos);
}

}  // namespace
}  // namespace halflight::test
