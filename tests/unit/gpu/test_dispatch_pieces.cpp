// Tests dispatches in pieces, and what a lost context says.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "engine/gpu/dispatch_pieces.h"
#include "engine/gpu/program.h"
#include "engine/gpu/program_limits.h"
#include "tests/support/environment_variable.h"
#include "tests/support/error_message.h"
#include "tests/support/gpu_test.h"

namespace halflight::gpu {
namespace {

using DispatchTest = GpuTest;

constexpr const char* kVariable = "HALFLIGHT_DISPATCH_MS";

/// Sets the limit during its lifetime, and provides a context that heeds it.
struct LimitedDispatches {
    explicit LimitedDispatches(const char* milliseconds) : variable(kVariable, milliseconds) {}
    test::EnvironmentVariable variable;
    gpu::Context context = test_context();
};

TEST(DispatchPieces, CoverEveryWorkgroupOnce) {
    for (const GroupCounts& counts : {GroupCounts{1, 1, 1}, {17, 1, 1}, {5, 4, 3}, {3, 1, 7}, {0, 4, 1}}) {
        for (const std::uint64_t most : {1, 2, 5, 7, 20, 1000}) {
            std::vector<int> started(counts[0] * counts[1] * counts[2]);
            for_each_piece(
                counts, [&] { return most; },
                [&](const GroupCounts& first, const GroupCounts& piece) {
                    EXPECT_LE(std::uint64_t{piece[0]} * piece[1] * piece[2], most);
                    for (std::uint32_t z = first[2]; z < first[2] + piece[2]; ++z)
                        for (std::uint32_t y = first[1]; y < first[1] + piece[1]; ++y)
                            for (std::uint32_t x = first[0]; x < first[0] + piece[0]; ++x)
                                ++started.at((z * counts[1] + y) * counts[0] + x);
                });
            EXPECT_EQ(std::ranges::count(started, 1), std::ssize(started)) << counts[0] << " by pieces of " << most;
        }
    }
}

/// Workgroups of 1 us to 1 s each. The first piece has no history, so that it may take longer.
TEST(DispatchPieces, StayBelowTheLimitOnceTimed) {
    for (const double each : {1e-6, 1e-4, 1e-3, 0.02}) {
        PieceSize size(0.05);
        double cost = each;
        for (int i = 0; i < 200; ++i) {
            if (i == 100) cost = 3 * each;  // the scene became harder
            const double seconds = static_cast<double>(size.groups()) * cost;
            const bool timed = size.timed();
            // A size holds until it is timed again, within 17 pieces.
            const bool judged = (i > 0 && i < 100) || i > 117;
            EXPECT_LE(judged ? seconds : 0, std::max(0.05, cost)) << each << " piece " << i;
            if (timed)
                size.add(size.groups(), seconds);
            else
                size.add_untimed();
        }
        EXPECT_GE(static_cast<double>(size.groups()) * cost, std::min(0.0125, 0.5 * cost))
            << "pieces are not too small";
        EXPECT_FALSE(size.timed() && size.takes_all_of(1));
    }
}

/// Each dispatch takes 0.1 ms to start and 1 us for each workgroup. Small ones come in between.
TEST(DispatchPieces, SmallDispatchesDoNotShrinkThePieces) {
    PieceSize size(0.05);
    const auto run = [&](std::uint64_t groups) { size.add(groups, 1e-4 + 1e-6 * static_cast<double>(groups)); };
    for (int i = 0; i < 10; ++i) run(size.groups());
    const std::uint64_t large = size.groups();
    EXPECT_GE(large, 20'000u);
    for (int i = 0; i < 100; ++i) run(1 + static_cast<std::uint64_t>(i) % 7);
    EXPECT_EQ(size.groups(), large);
    EXPECT_FALSE(size.timed());
    EXPECT_TRUE(size.takes_all_of(large));
    EXPECT_FALSE(size.takes_all_of(large + 1));
    size.add(1, 0.2);
    EXPECT_EQ(size.groups(), 1u) << "a slow one counts";
}

TEST(DispatchPieces, SoftwareHasNoLimit) {
    const test::EnvironmentVariable variable(kVariable, std::nullopt);
    EXPECT_EQ(dispatch_limit("llvmpipe (LLVM 15.0.6, 256 bits)"), 0);
    EXPECT_EQ(dispatch_limit("NVIDIA H100/PCIe"), 0.05);
    variable.set("2.5");
    EXPECT_EQ(dispatch_limit("llvmpipe"), 0.0025);
    for (const char* wrong : {"", "fast", "5 ms", "-1", "nan", "inf"}) {
        variable.set(wrong);
        EXPECT_TRUE(error_message([] { dispatch_limit("llvmpipe"); }).starts_with(kVariable)) << wrong;
    }
}

TEST_F(DispatchTest, PiecesKnowTheirPlaceInTheDispatch) {
    const ShaderSource places{"places",
                              "layout(local_size_x = 2, local_size_y = 3) in;\n"
                              "layout(std430) buffer Places { uvec4 places[]; };\n"
                              "void main() {\n"
                              "    uvec3 size = gl_NumWorkGroups * gl_WorkGroupSize;\n"
                              "    uvec3 at = gl_GlobalInvocationID;\n"
                              "    uint group = (gl_WorkGroupID.z * gl_NumWorkGroups.y + gl_WorkGroupID.y) * "
                              "gl_NumWorkGroups.x + gl_WorkGroupID.x;\n"
                              "    places[(at.z * size.y + at.y) * size.x + at.x] += uvec4(at, group + 1u);\n"
                              "}\n"};
    constexpr GroupCounts kCounts{20, 3, 2};
    constexpr std::uint32_t kGroups = 20 * 3 * 2, kInvocations = 6 * kGroups;
    const auto run = [&](bool indirect) {
        const Program program = Program::compute(places);
        const Buffer result("places", kInvocations * sizeof(uvec4));
        const Buffer counts = Buffer::from("counts", std::vector<std::uint32_t>{9, 20, 3, 2});
        for (int i = 0; i < 30; ++i) {  // the first dispatches are in pieces of changing sizes, later ones are whole
            program.bind_storage("Places", result);
            if (indirect)
                program.dispatch_indirect(counts, kGroups, sizeof(std::uint32_t));
            else
                program.dispatch(kCounts[0], kCounts[1], kCounts[2]);
            glMemoryBarrier(GL_ALL_BARRIER_BITS);
        }
        EXPECT_EQ(program.text().find("halflight_first_group") != std::string::npos, run_limits().dispatch_seconds > 0);
        return result.read<uvec4>();
    };
    const std::vector<uvec4> expected = run(false);
    EXPECT_EQ(expected.back(), 30u * uvec4(39, 8, 1, kGroups));
    for (const char* const milliseconds : {"0.000001", "1000"}) {
        LimitedDispatches limited(milliseconds);
        EXPECT_TRUE(run(false) == expected) << milliseconds;
        EXPECT_TRUE(run(true) == expected) << milliseconds;
        EXPECT_NO_THROW(limited.context.check("pieces"));
    }
    context.make_current();
}

TEST_F(DispatchTest, LinesOfErrorsStayWhereTheyAreInPieces) {
    const LimitedDispatches limited("1");
    EXPECT_TRUE(
        error_message([] {
            Program::compute({"own", "layout(local_size_x = 1) in;\nvoid main() { uint a = gl_WorkGroupID.x + b; }\n"});
        }).starts_with("own:2: "));
    context.make_current();
}

GLenum GLAPIENTRY lost() {
    return GL_GUILTY_CONTEXT_RESET;
}

/// Drivers cannot be asked to lose a context, so the test answers in place of glGetGraphicsResetStatus().
TEST_F(DispatchTest, ALostContextIsNamed) {
    const auto real = epoxy_glGetGraphicsResetStatus;
    epoxy_glGetGraphicsResetStatus = lost;
    const std::string message = error_message([&] { context.check("rendering"); });
    const std::string compiling = error_message([] {
        Program::compute({"own", "layout(local_size_x = 1) in;\nvoid main() { a; }\n"});
    });
    epoxy_glGetGraphicsResetStatus = real;
    EXPECT_TRUE(message.starts_with("rendering: the driver has reset the GPU")) << message;
    EXPECT_TRUE(compiling.starts_with("own: the driver has reset the GPU")) << compiling;
    EXPECT_NO_THROW(context.check("after the test"));
}

}  // namespace
}  // namespace halflight::gpu
