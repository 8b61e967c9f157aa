// Tests that the viewer's render thread reloads shaders that change in the folder of HALFLIGHT_SHADERS.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "tests/pass/renderer/render_threads.h"
#include "tests/support/process.h"

namespace halflight::view {
namespace {

using test::expect_includes;

class ShaderReload : public RenderThreadTest {
  protected:
    /// Sets the environment before any thread exists that might read it; this requires a program of its own.
    static void SetUpTestSuite() {
        folder = new TemporaryFolder;
        setenv("HALFLIGHT_SHADERS", folder->path.c_str(), 1);
    }
    static void TearDownTestSuite() {
        delete folder;
        folder = nullptr;
    }
    void SetUp() override {
        std::filesystem::copy(
            std::filesystem::path(HALFLIGHT_SOURCE_DIR) / "shaders", folder->path,
            std::filesystem::copy_options::recursive | std::filesystem::copy_options::overwrite_existing);
    }

    static std::string read(const std::string& name) { return test::read_text(*folder / name); }
    /// Replaces a file atomically.
    void write(const std::string& name, const std::string& text) const {
        test::write_text(drafts / name, text);
        std::filesystem::rename(drafts / name, *folder / name);
    }

    TemporaryFolder drafts;
    static TemporaryFolder* folder;
};
TemporaryFolder* ShaderReload::folder = nullptr;

TEST_F(ShaderReload, ReloadsChangedShaders) {
    RecordingThread thread;
    const auto plain = expect_rendered(thread, request(), 2);
    const std::uint64_t number = plain->request;

    // The idle thread renders the picture anew, with twice the light.
    const std::string name = "accumulate.comp", good = read(name);
    const std::string from = "vec3 emission = guarded(s.point.emission, kCountGBuffer);";
    const std::size_t at = good.find(from);
    ASSERT_NE(at, std::string::npos);
    const auto edited = [&](const std::string& to) { return std::string(good).replace(at, from.size(), to); };
    write(name, edited("vec3 emission = 2.0 * guarded(s.point.emission, kCountGBuffer);"));
    const auto brighter = [&] {
        const auto& last = thread.pictures.back();
        return last->divisor == 1 && last->result.stats.samples == 2 &&
               !same_bits(last->result.beauty, plain->result.beauty);
    };
    ASSERT_TRUE(thread.until(brighter));
    EXPECT_GE(thread->status().reloads, 1u);
    const auto bright = thread.pictures.back();

    // A shader with errors is reported, and the old program stays in use.
    write(name, edited("vec3 emission = nonsense;"));
    ASSERT_TRUE(thread.until([&] { return !thread->status().shader_error.empty(); }));
    const std::string error = thread->status().shader_error;
    EXPECT_TRUE(error.starts_with("shaders/accumulate.comp:")) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos);
    EXPECT_EQ(thread->picture(), bright);
    thread->limit(3);
    ASSERT_TRUE(thread.until_samples(number, 3)) << "rendering continues";
    EXPECT_NE(thread->status().shader_error, "");

    // The shader is repaired while the thread is rendering.
    thread->limit(1 << 24);
    write(name, good);
    ASSERT_TRUE(thread.until([&] { return thread->status().shader_error.empty(); }));
    EXPECT_GE(thread->status().reloads, 2u);
    Request moved = request();
    moved.bounces = 2;
    expect_rendered(thread, moved, 2);
}

TEST_F(ShaderReload, AShaderThatWasBrokenAtTheStartCanBeRepaired) {
    const RenderResult plain = expected(request(), 1);
    const std::string good = read("accumulate.comp");
    write("accumulate.comp", good + "nonsense;\n");
    RecordingThread thread;
    const std::uint64_t number = thread->show(request());
    ASSERT_TRUE(thread.until([&] { return thread->status().failed == number; }));
    EXPECT_TRUE(thread->status().error.starts_with("shaders/accumulate.comp:")) << thread->status().error;
    write("accumulate.comp", good);
    ASSERT_TRUE(thread.until_samples(number, 1));
    expect_includes(thread.pictures.back()->result, plain);
    EXPECT_EQ(thread->status().error, "");
}

}  // namespace
}  // namespace halflight::view
