// Tests the GL context, buffers, textures and framebuffers.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <thread>

#include "engine/core/math.h"
#include "engine/gpu/buffer.h"
#include "engine/gpu/context.h"
#include "engine/gpu/driver_needs.h"
#include "engine/gpu/framebuffer.h"
#include "engine/gpu/texture.h"
#include "tests/support/environment_variable.h"
#include "tests/support/error_message.h"
#include "tests/support/gpu_test.h"
#include "tests/unit/io/file_size_limit.h"
#include "tools/common/temporary_folder.h"

namespace halflight::gpu {
namespace {

int taken(const std::vector<DeviceAttempt>& attempts) {
    return static_cast<int>(std::count_if(attempts.begin(), attempts.end(), [](const auto& a) { return a.taken; }));
}

// --- Context --------------------------------------------------------------------------------------------------------

TEST(Context, IsChosenAutomaticallyWithAReason) {
    const Context context = Context::create();
    EXPECT_EQ(taken(context.attempts()), 1);
    for (const DeviceAttempt& attempt : context.attempts()) {
        EXPECT_FALSE(attempt.name.empty());
        EXPECT_FALSE(attempt.reason.empty()) << attempt.name;
    }
    EXPECT_FALSE(context.renderer().empty());
    EXPECT_NE(context.version().find("4."), std::string::npos);
    const Limits& limits = context.limits();  // at least those that OpenGL 4.5 demands
    EXPECT_GE(limits.texture_buffer_texels, 65536u);
    EXPECT_GE(limits.storage_block_bytes, std::size_t{1} << 27);
    EXPECT_GE(limits.uniform_block_bytes, 16384u);
    EXPECT_GE(limits.texture_size, 16384);
    EXPECT_GE(limits.texture_3d_size, 2048);
    EXPECT_GE(limits.texture_units, 16);
    EXPECT_GE(limits.storage_blocks, 8);
    EXPECT_GE(limits.workgroup_count, 65535);
    EXPECT_GE(limits.color_attachments, 8);
}

TEST(Context, CanBeChosenByIndexAndByName) {
    const auto attempts = Context::probe({.device = "software"});
    const auto chosen = std::ranges::find_if(attempts, &DeviceAttempt::taken);
    ASSERT_NE(chosen, attempts.end());
    const auto index = static_cast<std::size_t>(chosen - attempts.begin());
    const auto by_index = Context::probe({.device = std::to_string(index)});
    EXPECT_TRUE(by_index[index].taken);
    EXPECT_EQ(taken(by_index), 1);
    EXPECT_EQ(taken(Context::probe({.device = "LLVMPIPE"})), 1);
}

TEST(Context, AnInvalidDeviceIsAnErrorOfOneLine) {
    for (const char* device : {"no such device", "4711"}) {
        const std::string message = error_message([&] { Context::create({.device = device}); });
        EXPECT_NE(message.find(device), std::string::npos) << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        const auto attempts = Context::probe({.device = device});
        EXPECT_EQ(taken(attempts), 0);
        EXPECT_FALSE(attempts.empty());
    }
}

// A library does not change the environment of its process, so such drivers are refused.
TEST(DriverNeeds, DriversThatTheEnvironmentSpoilsAreRefused) {
    const char *const zink = "zink (llvmpipe (LLVM 15.0.6, 256 bits))", *const mesa = "4.5 (Core Profile) Mesa 22.3.6";
    const TemporaryFolder folder;
    const test::EnvironmentVariable cache("MESA_SHADER_CACHE_DIR", folder.path.string()),
        disabled("MESA_SHADER_CACHE_DISABLE", {}), also_disabled("MESA_GLSL_CACHE_DISABLE", {});
    using Value = std::pair<std::optional<std::string>, bool>;
    for (const auto& [value, good] : {Value("0", true), Value({}, false), Value("1", false)}) {
        const test::EnvironmentVariable inlined("ZINK_INLINE_UNIFORMS", value);
        EXPECT_EQ(reason_against_driver(zink, mesa).empty(), good) << value.value_or("not set");
        EXPECT_EQ(reason_against_driver("zink (NVIDIA H200)", mesa), "") << "runs on a GPU";
    }
    const test::FileSizeLimit full(1000);
    EXPECT_EQ(reason_against_driver("llvmpipe", mesa), "") << "has no index";
    for (const char* const kind :
         {"mesa_shader_cache_db", "mesa_shader_cache"}) {  // kinds of caches: the first one in Mesa 24 and 25
        const std::filesystem::path cache_folder = folder.path / kind;
        std::filesystem::create_directory(cache_folder);
        std::ofstream(cache_folder / "index").flush();
        EXPECT_NE(reason_against_driver("llvmpipe", mesa).find(cache_folder.string() + " has no space"),
                  std::string::npos);
        if (kind != std::string_view("mesa_shader_cache")) std::filesystem::remove(cache_folder / "index");
    }
    EXPECT_EQ(reason_against_driver("NVIDIA H200", "4.5.0 NVIDIA 550.54"), "") << "has no such cache";
    disabled.set("true");
    EXPECT_EQ(reason_against_driver("llvmpipe", mesa), "");
    disabled.set({});
    const test::EnvironmentVariable other_kind("MESA_DISK_CACHE_DATABASE", "true"),
        one_kind("MESA_DISK_CACHE_MULTI_FILE", {});
    prepare_process();
    EXPECT_EQ(reason_against_driver("llvmpipe", mesa), "") << "programs switch the cache off";
    EXPECT_STREQ(std::getenv("MESA_DISK_CACHE_MULTI_FILE"), "true");
    EXPECT_EQ(std::getenv("MESA_DISK_CACHE_DATABASE"), nullptr);
}

TEST(Context, SeveralMayExist) {
    Context first = Context::create({.device = "", .debug = true});
    {
        const Context second = Context::create();
        const Buffer buffer("second's", 4);
    }
    first.make_current();
    const Buffer buffer = Buffer::from("first's", std::vector{7u});
    EXPECT_EQ(buffer.read<std::uint32_t>(), std::vector{7u});
    Context moved = std::move(first);
    EXPECT_NO_THROW(moved.check("after the other one"));
}

TEST(Context, CountsErrorsAndKeepsTheFirstText) {
    for (const bool debug : {true, false}) {  // without debug output, glGetError() finds them
        Context context = Context::create({.device = "software", .debug = debug});
        EXPECT_TRUE(context.software()) << context.renderer();
        EXPECT_NO_THROW(context.check("nothing yet"));
        glEnable(GL_TEXTURE_BUFFER_DATA_STORE_BINDING);
        if (debug) glBindTextureUnit(0, 123456);
        EXPECT_TRUE(!debug || context.error_count() == 2);
        const std::string message = error_message([&] { context.check("frame 3"); });
        EXPECT_TRUE(message.starts_with("frame 3: GL_INVALID_ENUM")) << message;
        EXPECT_EQ(message.find("and 1 more") != std::string::npos, debug) << message;
        EXPECT_NO_THROW(context.check("reported once"));
        EXPECT_EQ(context.error_count(), debug ? 2u : 1u);
    }
    EXPECT_TRUE(is_software_renderer("softpipe"));
    EXPECT_FALSE(is_software_renderer("NVIDIA H200/PCIe/SSE2"));
}

// --- Buffers --------------------------------------------------------------------------------------------------------

using BufferTest = GpuTest;

TEST_F(BufferTest, RoundTrip) {
    std::vector<std::uint32_t> values(1001);
    std::iota(values.begin(), values.end(), 5u);
    Buffer buffer = Buffer::from("values", values);
    EXPECT_EQ(buffer.bytes(), 4004u);
    EXPECT_EQ(buffer.name(), "values");
    EXPECT_EQ(buffer.read<std::uint32_t>(), values);
    EXPECT_EQ(buffer.read<std::uint32_t>(1000), std::vector{1005u});
    EXPECT_EQ(buffer.read<std::uint32_t>(2, 3), (std::vector{7u, 8u, 9u}));
    buffer.write(std::span<const std::uint32_t>(values).first(2), 10);
    EXPECT_EQ(buffer.read<std::uint32_t>(9, 4), (std::vector{14u, 5u, 6u, 17u}));
    buffer.fill(0xffffffffu);
    EXPECT_EQ(buffer.read<std::uint32_t>(1000), std::vector{0xffffffffu});
    buffer.clear();
    EXPECT_EQ(buffer.read<std::uint32_t>(), std::vector<std::uint32_t>(1001, 0));
}

TEST_F(BufferTest, StartsAsZeros) {
    const Buffer buffer("zeros", 37);
    EXPECT_EQ(buffer.read<std::uint8_t>(), std::vector<std::uint8_t>(37, 0));
}

TEST_F(BufferTest, WritesComeAfterClears) {
    for (const std::size_t words : {16384u, 16448u, 65536u, 1u << 20}) {  // NVIDIA: above 64 KiB
        std::vector<std::uint32_t> values(words);
        std::iota(values.begin(), values.end(), 1u);
        Buffer buffer("b", words * sizeof(std::uint32_t));  // clears it, too
        buffer.write(std::span<const std::uint32_t>(values));
        EXPECT_EQ(buffer.read<std::uint32_t>(), values) << words;
        std::ranges::reverse(values);
        buffer.fill(~0u);
        buffer.write(std::span<const std::uint32_t>(values));
        EXPECT_EQ(buffer.read<std::uint32_t>(), values) << words;
    }
}

TEST_F(BufferTest, OddSizesKeepTheirLastBytes) {
    std::vector<std::uint8_t> bytes(19);
    std::iota(bytes.begin(), bytes.end(), std::uint8_t{1});
    EXPECT_EQ(Buffer::from("odd", bytes).read<std::uint8_t>(), bytes);
}

TEST_F(BufferTest, AnEmptyOneCanBeBound) {
    const Buffer buffer = Buffer::from("empty", std::vector<vec4>());
    EXPECT_EQ(buffer.bytes(), 0u);
    EXPECT_TRUE(buffer.read<vec4>().empty());
    buffer.bind_storage(0);
    buffer.bind_uniform(0);
    buffer.bind_texture(3, GL_RGBA32F);
    EXPECT_NO_THROW(context.check("binding an empty buffer"));
}

TEST_F(BufferTest, SizesShareThePropertiesThatLlvmpipeCompilesFor) {
    for (const std::size_t bytes : {0u, 16u, 48u, 256u, 4096u, 65536u, 65600u, 131072u, 1000000u, 1048576u}) {
        const Buffer zeros("zeros", bytes), made = Buffer::from("made", std::vector<char>(bytes, 1));
        for (const Buffer* b : {&zeros, &made}) {
            GLint64 size = 0;
            glGetNamedBufferParameteri64v(b->id(), GL_BUFFER_SIZE, &size);
            EXPECT_NE(size & (size - 1), 0) << bytes << ": a power of two";
            EXPECT_NE(size & 0xff00, 0) << bytes << ": no last mip level";
            EXPECT_EQ(b->bytes(), bytes);
        }
        GLint view = 0;
        glGetTextureLevelParameteriv(made.texture(GL_R32UI), 0, GL_TEXTURE_BUFFER_SIZE, &view);
        EXPECT_EQ(static_cast<std::size_t>(view), std::max<std::size_t>(bytes, 16)) << "shaders count lights by it";
    }
}

TEST_F(BufferTest, HasOneViewPerFormat) {
    Buffer buffer("viewed", 64);
    const GLuint floats = buffer.texture(GL_RGBA32F);
    EXPECT_EQ(buffer.texture(GL_RGBA32F), floats);
    EXPECT_NE(buffer.texture(GL_R32UI), floats);
    const Buffer moved = std::move(buffer);
    EXPECT_EQ(moved.texture(GL_RGBA32F), floats);
}

TEST_F(BufferTest, AViewBeyondTheDriversLimitIsAnErrorNamingTheBuffer) {
    const std::size_t limit = context.limits().texture_buffer_texels;
    if (limit > std::size_t{1} << 28) GTEST_SKIP() << "a limit of " << limit << " texels takes too much memory";
    const Buffer buffer("texels", limit + 4);
    const std::string message = error_message([&] { buffer.bind_texture(0, GL_R8); });
    EXPECT_NE(message.find("'texels'"), std::string::npos) << message;
    EXPECT_NO_THROW(buffer.bind_texture(0, GL_R32UI));
}

TEST_F(BufferTest, TooLargeIsAnErrorNamingTheBuffer) {
    const std::string message = error_message([] { Buffer("whale", std::size_t{1} << 50); });
    EXPECT_EQ(message.find("buffer 'whale': "), 0u) << message;
    EXPECT_ANY_THROW(context.check("the driver reports it, too"));
}

// --- Textures -------------------------------------------------------------------------------------------------------

using TextureTest = GpuTest;

TEST_F(TextureTest, FloatRoundTripInEveryShape) {
    const std::array descs{
        TextureDesc{.width = 5, .format = GL_R32F, .target = GL_TEXTURE_1D},
        TextureDesc{.width = 3, .height = 2, .format = GL_RGBA32F},
        TextureDesc{.width = 3, .height = 5, .format = GL_RGB32F},
        TextureDesc{.width = 1000, .height = 1100, .format = GL_RGBA32F},  // read in two parts
        TextureDesc{.width = 2, .height = 3, .format = GL_RG32F, .depth = 4, .target = GL_TEXTURE_3D}};
    for (const TextureDesc& desc : descs) {
        Texture texture("floats", desc);
        const std::size_t count = texture_bytes(desc) / 4;
        EXPECT_EQ(texture.read_float(), std::vector<float>(count, 0.f));
        std::vector<float> values(count);
        std::iota(values.begin(), values.end(), -1.5f);
        texture.upload(values);
        EXPECT_EQ(texture.read_float(), values);
    }
}

TEST_F(TextureTest, BadSizesAndFormatsAreErrors) {
    const TextureDesc wrong[] = {{.width = 0}, {.width = 1 << 20}, {.width = 2, .height = 2, .depth = 2}};
    for (const TextureDesc& bad : wrong)
        EXPECT_NE(error_message([&] { Texture("t", bad); }).find("'t'"), std::string::npos);
    for (const GLenum format : {GL_RGB9_E5, GL_RGBA}) EXPECT_THROW(format_info(format), Error);
    EXPECT_EQ(texture_bytes({.width = 1920, .height = 1080, .format = GL_RGBA16F}), 1920u * 1080 * 8);
}

// --- Framebuffers ---------------------------------------------------------------------------------------------------

using FramebufferTest = GpuTest;

TEST_F(FramebufferTest, SizesMustAgree) {
    const Texture a("a", {.width = 4, .height = 2}), b("b", {.width = 2, .height = 4});
    const std::array<const Texture*, 2> colors{&a, &b};
    const std::string message = error_message([&] { Framebuffer("target", colors); });
    EXPECT_TRUE(message.starts_with("framebuffer 'target': texture 'b'")) << message;
}

TEST_F(FramebufferTest, WhatCannotBeDrawnToIsAnError) {
    const Texture depth("depth", {.width = 4, .height = 2, .format = GL_DEPTH_COMPONENT32F});
    const std::array<const Texture*, 1> colors{&depth};
    EXPECT_ANY_THROW(Framebuffer("target", colors));
    EXPECT_ANY_THROW(Framebuffer("nothing", {}));
}

TEST_F(FramebufferTest, TimesIncludeTheWork) {
    EXPECT_GE(timed([] { std::this_thread::sleep_for(std::chrono::milliseconds(10)); }), 0.01);
}

}  // namespace
}  // namespace halflight::gpu
