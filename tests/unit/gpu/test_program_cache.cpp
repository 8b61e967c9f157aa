// Tests programs that are compiled ahead of time on a second thread: they equal those compiled at once, and nothing is
// left of those that nobody asked for.
#include "engine/gpu/program_cache.h"

#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "engine/gpu/driver_needs.h"
#include "tests/support/error_message.h"
#include "tests/support/gpu_test.h"
#include "tools/common/temporary_folder.h"

namespace halflight::gpu {
namespace {

constexpr const char* kAdd =
    "layout(local_size_x = 1) in;\nlayout(std430) writeonly buffer Out { uint result; };\n"
    "uniform usamplerBuffer one;\nuniform uint more;\n"
    "void main() { result = VALUE + more + texelFetch(one, 0).x; }\n";

class ProgramCacheTest : public GpuTest {
  protected:
    /// Returns a program that adds 1, `value` and its uniform `more`; `bound` counts the calls of its binding.
    ExpectedProgram expected(const std::string& value, std::atomic<int>& bound, const std::string& text = kAdd) const {
        return {{"add", text}, {{"VALUE", value + "u"}}, [&](const Program& program) {
                    EXPECT_NE(std::this_thread::get_id(), main_);
                    program.bind_texture("one", one_, GL_R32UI);
                    texture_ahead_ = one_.texture(GL_R32UI);
                    ++bound;
                }};
    }
    /// Returns the result of the program for that value.
    std::uint32_t run(ProgramCache& cache, const std::string& value) const {
        const Program& program = cache.compute({"add", kAdd}, {{"VALUE", value + "u"}});
        const Buffer out("out", sizeof(std::uint32_t));
        program.bind_storage("Out", out);
        program.bind_texture("one", one_, GL_R32UI);
        program.set("more", std::uint32_t{100});
        program.dispatch(1);
        return out.read<std::uint32_t>().front();
    }
    /// Waits until the second thread has compiled a program; fails if it has not within a minute.
    void wait_for(const std::string& value) const {
        const std::string text = program_text({{"add", kAdd}}, {{"VALUE", value + "u"}});
        for (int i = 0; can_compile_ahead() && !binaries_.has(text); ++i) {
            ASSERT_LT(i, 6000);
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
    }

    TemporaryFolder folder_;
    ProgramBinaries binaries_{folder_ / "programs", "driver"};
    mutable std::atomic<GLuint> texture_ahead_{0};  // texture of one_ on the other thread
    Buffer one_ = Buffer::from("one", std::vector<std::uint32_t>{1});
    std::thread::id main_ = std::this_thread::get_id();
};

TEST_F(ProgramCacheTest, ProgramsCompiledAheadGiveTheSameResults) {
    ProgramCache cache(&binaries_);
    std::atomic<int> bound{0};
    cache.compile_ahead({expected("2", bound), expected("3", bound), expected("4", bound), expected("2", bound)});
    wait_for("4");
    EXPECT_TRUE(!mesa_keeps_code() || mesa_cache_bytes() > 0) << "Mesa counts the bytes that it has written";
    EXPECT_EQ(run(cache, "3"), 104u);
    EXPECT_EQ(run(cache, "7"), 108u) << "was not expected";
    cache.end_ahead();
    EXPECT_EQ(run(cache, "2"), 103u) << "was compiled and dropped, or never";
    EXPECT_EQ(bound, can_compile_ahead() ? 3 : 0);
    EXPECT_EQ(cache.count(), 3u);
    EXPECT_NE(texture_ahead_, one_.texture(GL_R32UI)) << "Mesa does not count the references of two contexts";

    // A store that has the first program is taken for full.
    ProgramCache later(&binaries_);
    later.compile_ahead({expected("2", bound), expected("9", bound)});
    std::this_thread::sleep_for(std::chrono::milliseconds(200));  // in which the thread would compile
    later.end_ahead();
    EXPECT_EQ(bound, can_compile_ahead() ? 3 : 0);
    EXPECT_EQ(run(later, "9"), 110u);
}

TEST_F(ProgramCacheTest, ProgramsThatNobodyAsksForAreRemoved) {
    ProgramCache cache;
    run(cache, "2"), run(cache, "3");
    for (int i = 0; i < 8; ++i) {
        cache.end_period();
        run(cache, "3");
    }
    EXPECT_EQ(cache.count(), 2u) << "a few periods may pass";
    cache.end_period();
    EXPECT_EQ(cache.count(), 1u);
    EXPECT_EQ(run(cache, "2"), 103u);
    EXPECT_EQ(run(cache, "3"), 104u);
    cache.end_period();
    run(cache, "3");
    EXPECT_EQ(cache.reload(), 0u);
    EXPECT_EQ(cache.count(), 1u) << "programs of earlier periods may have other shaders by now";
}

TEST_F(ProgramCacheTest, ErrorsReachTheCaller) {
    ProgramCache cache(&binaries_);
    std::atomic<int> bound{0};
    cache.compile_ahead({expected("2", bound, "nonsense"), expected("3", bound)});
    wait_for("3");
    EXPECT_NE(error_message([&] {
                  cache.compute({"add", "nonsense"}, {{"VALUE", "2u"}});
              }).find("add:1"),
              std::string::npos);
    EXPECT_EQ(run(cache, "3"), 104u);
}

TEST_F(ProgramCacheTest, EndsWhileProgramsAreWaiting) {
    for (int turn = 0; turn < 3; ++turn) {
        ProgramCache cache(&binaries_);
        std::atomic<int> bound{0};
        std::vector<ExpectedProgram> programs;
        for (int i = 0; i < 50; ++i) programs.push_back(expected(std::to_string(100 * turn + 10 + i), bound));
        cache.compile_ahead(std::move(programs));
        if (turn > 0) {
            EXPECT_EQ(run(cache, std::to_string(100 * turn + 10)), 100u * turn + 111);
        }
    }  // the cache is destroyed
}

TEST_F(ProgramCacheTest, NothingIsCompiledAheadWithoutAStore) {
    ProgramCache cache;
    std::atomic<int> bound{0};
    cache.compile_ahead({expected("2", bound), expected("3", bound)});
    EXPECT_EQ(run(cache, "2"), 103u);
    cache.end_ahead();
    EXPECT_EQ(bound, 0);
}

}  // namespace
}  // namespace halflight::gpu
