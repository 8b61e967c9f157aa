// Tests programs and the structs shared by C++ and GLSL.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "engine/gpu/framebuffer.h"
#include "engine/gpu/program_cache.h"
#include "engine/gpu/program_limits.h"
#include "shaders/shared/rays.h"
#include "tests/support/error_message.h"
#include "tests/support/gpu_test.h"
#include "tests/unit/gpu/shader_folder.h"

namespace halflight::gpu {
namespace {

using ProgramTest = GpuTest;

const char* const kDouble = R"(
layout(local_size_x = 64) in;
layout(std430) buffer Values { uint values[]; };
uniform uint factor;
void main() {
    if (gl_GlobalInvocationID.x < values.length()) values[gl_GlobalInvocationID.x] *= factor + OFFSET;
})";

TEST_F(ProgramTest, AKernelRuns) {
    const Program program = Program::compute({"double", kDouble}, {{"OFFSET", "1"}});
    const Buffer values = Buffer::from("values", std::vector{1u, 2u, 3u});
    program.bind_storage("Values", values);
    program.set("factor", 2u);
    program.dispatch(1);
    EXPECT_EQ(values.read<std::uint32_t>(), (std::vector{3u, 6u, 9u}));
}

TEST_F(ProgramTest, WorkgroupsCanComeFromABuffer) {
    const Program program = Program::compute({"double", kDouble}, {{"OFFSET", "0"}});
    const Buffer values = Buffer::from("values", std::vector<std::uint32_t>(200, 1));
    const Buffer arguments = Buffer::from("arguments", std::vector{9u, 2u, 1u, 1u});
    program.bind_storage("Values", values);
    program.set("factor", 5u);
    program.dispatch_indirect(arguments, 2, 4);
    std::vector<std::uint32_t> expected(200, 1);
    std::fill_n(expected.begin(), 128, 5u);
    EXPECT_EQ(values.read<std::uint32_t>(), expected);
}

TEST_F(ProgramTest, UniformsOfEveryType) {
    const Program program = Program::compute({"uniforms", R"(
layout(local_size_x = 1) in;
layout(std430) buffer Out { float sum; };
uniform bool b; uniform int i; uniform uint u; uniform float f;
uniform vec2 v2; uniform vec3 v3; uniform vec4 v4; uniform ivec2 i2; uniform ivec3 i3; uniform ivec4 i4;
uniform uvec2 u2; uniform uvec3 u3; uniform uvec4 u4; uniform mat3 m3; uniform mat4 m4;
struct Nested { float x; }; uniform Nested nested[2];
void main() {
    sum = float(b) + i + u + f + dot(v2, vec2(1)) + dot(v3, vec3(1)) + dot(v4, vec4(1)) + i2.y + i3.z + i4.w + u2.y +
          u3.z + u4.w + m3[2][1] + m4[3][2] + nested[1].x;
})"});
    const Buffer out("out", 4);
    program.bind_storage("Out", out);
    mat3 m3(0);
    mat4 m4(0);
    m3[2][1] = 4096;
    m4[3][2] = 8192;
    program.set("b", true);
    program.set("i", -1);
    program.set("u", 2u);
    program.set("f", 0.25f);
    program.set("v2", vec2(1, 3));
    program.set("v3", vec3(1, 2, 5));
    program.set("v4", vec4(1, 2, 3, 10));
    program.set("i2", ivec2(0, 32));
    program.set("i3", ivec3(0, 0, 64));
    program.set("i4", ivec4(0, 0, 0, 128));
    program.set("u2", uvec2(0, 256));
    program.set("u3", uvec3(0, 0, 512));
    program.set("u4", uvec4(0, 0, 0, 1024));
    program.set("m3", m3);
    program.set("m4", m4);
    program.set("nested[1].x", 16384.f);
    program.dispatch(1);
    EXPECT_EQ(out.read<float>()[0], 2 + 0.25f + 4 + 8 + 16 + 32 + 64 + 128 + 256 + 512 + 1024 + 4096 + 8192 + 16384);
}

TEST_F(ProgramTest, AMisspeltUniformIsAnErrorButAnUnusedOneIsNot) {
    const Program program = Program::compute({"double", kDouble}, {{"OFFSET", "1"}});
    EXPECT_EQ(error_message([&] { program.set("facter", 1u); }), "double: has no uniform 'facter'");
    const Program unused =
        Program::compute({"unused", "layout(local_size_x = 1) in;\nuniform float unused;\nvoid main() {}\n"});
    EXPECT_EQ(unused.uniform("unused"), -1);
    EXPECT_NO_THROW(unused.set("unused", 1.f));
}

TEST_F(ProgramTest, ResourcesAreBoundByName) {
    const Program program = Program::compute({"names", R"(
layout(local_size_x = 1) in;
layout(std430) writeonly buffer Sum { float sum; };
layout(std430) readonly buffer One { float one; };
layout(std140) uniform Ten { float ten; };
layout(std140) uniform Twenty { float twenty; };
layout(std430) readonly buffer Unused { float unused; };
uniform samplerBuffer hundred;
uniform sampler2D thousand;
layout(rgba32f) writeonly uniform image2D copy;
layout(rgba32f) writeonly uniform image2D twice;
void main() {
    sum = one + ten + twenty + texelFetch(hundred, 0).x + texelFetch(thousand, ivec2(0), 0).x;
    imageStore(copy, ivec2(0), vec4(one));
    imageStore(twice, ivec2(0), vec4(2 * one));
})"});
    const auto number = [](const char* name, float value) { return Buffer::from(name, std::vector<float>(4, value)); };
    const Buffer one = number("one", 1), ten = number("ten", 10), twenty = number("twenty", 20),
                 hundred = number("hundred", 100), sum("sum", sizeof(float));
    Texture thousand("thousand", {.format = GL_R32F});
    thousand.upload(std::vector<float>{1000});
    const Texture copy("copy", {}), twice("twice", {});
    program.bind_texture("thousand", thousand);
    program.bind_texture("hundred", hundred, GL_R32F);
    program.bind_image("twice", twice);
    program.bind_image("copy", copy);
    program.bind_uniform("Twenty", twenty);
    program.bind_uniform("Ten", ten);
    program.bind_storage("One", one);
    program.bind_storage("Sum", sum);
    EXPECT_NO_THROW(program.bind_storage("Unused", one));
    program.dispatch(1);
    EXPECT_EQ(sum.read<float>()[0], 1131.f);
    EXPECT_EQ(copy.read_float()[0], 1.f);
    EXPECT_EQ(twice.read_float()[0], 2.f);
    EXPECT_EQ(error_message([&] { program.bind_storage("Su", one); }),
              "names: has no storage block 'Su' to bind 'one' to");
    EXPECT_EQ(error_message([&] { program.bind_storage("hundred", one); }),
              "names: has no storage block 'hundred' to bind 'one' to");
    EXPECT_EQ(error_message([&] { program.bind_texture("Ten", thousand); }),
              "names: has no sampler 'Ten' to bind 'thousand' to");
}

TEST_F(ProgramTest, ResourcesThatNobodyBindsAreErrors) {
    const std::string head = "layout(local_size_x = 1) in;\nlayout(std430) buffer Out { float sum; };\n";
    const Buffer out("out", sizeof(float));
    const std::pair<const char*, const char*> resources[] = {
        {"layout(std430) buffer More { float more; };\nvoid main() { sum = more; }\n", "storage block 'More'"},
        {"layout(std140) uniform Ten { float ten; };\nvoid main() { sum = ten; }\n", "uniform block 'Ten'"},
        {"uniform sampler2D s;\nvoid main() { sum = texelFetch(s, ivec2(0), 0).x; }\n", "sampler 's'"},
        {"layout(r32f) uniform image2D i;\nvoid main() { sum = imageLoad(i, ivec2(0)).x; }\n", "image 'i'"}};
    const Program other = Program::compute({"other", head + "void main() { sum = 1; }\n"});
    for (const auto& [text, resource] : resources) {
        const Program program = Program::compute({"kernel", head + text});
        const auto run = [&] {
            program.bind_storage("Out", out);
            program.dispatch(1);
        };
        const std::string message = fmt::format("kernel: runs with nothing bound to {}", resource);
        EXPECT_EQ(error_message(run), message);
        EXPECT_EQ(error_message(run), message) << "again";
    }
    const auto run = [&] { other.dispatch(1); };
    EXPECT_EQ(error_message(run), "other: runs with nothing bound to storage block 'Out'");
    other.bind_storage("Out", out);
    EXPECT_NO_THROW(run());
    EXPECT_NO_THROW(run()) << "bindings hold until another program takes the slot";
    const Program third = Program::compute({"third", "layout(local_size_x = 1) in;\nvoid main() {}\n"});
    third.dispatch(1);
    EXPECT_NO_THROW(run()) << "a program without resources takes no slot";
    const Program fourth = Program::compute({"fourth", head + "void main() { sum = 4; }\n"});
    other.bind_storage("Out", out);
    fourth.bind_storage("Out", out);
    EXPECT_NO_THROW(fourth.dispatch(1));
    EXPECT_EQ(error_message(run), "other: runs with nothing bound to storage block 'Out'");
}

TEST_F(ProgramTest, ResourcesThatCannotBeBoundAreErrors) {
    const auto message = [](const std::string& text) {
        return error_message([&] {
            Program::compute(
                {"kernel", "layout(local_size_x = 1) in;\nlayout(std430) buffer Out { float sum; };\n" + text});
        });
    };
    EXPECT_EQ(message("uniform samplerCube s;\nvoid main() { sum = textureLod(s, vec3(1), 0).x; }\n"),
              "kernel: uniform 's' has a type that can neither be bound nor set");
    EXPECT_EQ(message("layout(r32f) uniform image1D i;\nvoid main() { sum = imageLoad(i, 0).x; }\n"),
              "kernel: uniform 'i' has a type that can neither be bound nor set");
    EXPECT_EQ(message("uniform sampler2D s[2];\nvoid main() { sum = texelFetch(s[1], ivec2(0), 0).x; }\n"),
              "kernel: sampler 's[0]' is part of an array, which cannot be bound");
    EXPECT_EQ(
        message("layout(std430) buffer B { float b; } blocks[2];\nvoid main() { sum = blocks[1].b; }\n").substr(0, 25),
        "kernel: storage block 'B[");
    EXPECT_EQ(message("layout(std140) uniform U { mat2 m; double d; };\nvoid main() { sum = m[0].x + float(d); }\n"),
              "")
        << "members of blocks may have any type";
}

TEST_F(ProgramTest, MoreStorageBlocksThanTheDriverHasAreAnError) {
    GLint limit = 0;
    glGetIntegerv(GL_MAX_COMPUTE_SHADER_STORAGE_BLOCKS, &limit);
    const auto kernel = [](int blocks) {
        std::string text = "layout(local_size_x = 1) in;\n", sum;
        for (int i = 0; i < blocks; ++i) {
            text += fmt::format("layout(std430) buffer Block{0} {{ uint b{0}; }};\n", i);
            sum += fmt::format("++b{};", i);
        }
        return text + "void main() { " + sum + " }\n";
    };
    EXPECT_NO_THROW(Program::compute({"full", kernel(limit)}));
    const std::string message = error_message([&] { Program::compute({"crowded", kernel(limit + 1)}); });
    EXPECT_TRUE(message.starts_with("crowded: does not link: ")) << message;
    EXPECT_TRUE(message.ends_with(fmt::format(
        " (a stage needs {} storage blocks, the driver allows {} (GL_MAX_*_SHADER_STORAGE_BLOCKS))", limit + 1, limit)))
        << message;
}

TEST_F(ProgramTest, MoreInvocationsThanTheDriverHasAreAnError) {
    GLint limit = 0;
    glGetIntegerv(GL_MAX_COMPUTE_WORK_GROUP_INVOCATIONS, &limit);
    const auto kernel = [](int size) { return fmt::format("layout(local_size_x = {}) in;\nvoid main() {{}}\n", size); };
    EXPECT_NO_THROW(Program::compute({"full", kernel(limit)}));
    const std::string message = error_message([&] { Program::compute({"crowded", kernel(limit + 1)}); });
    EXPECT_TRUE(message.starts_with("crowded:")) << message;
    EXPECT_TRUE(
        message.ends_with(fmt::format(" (a stage needs {} invocations in a workgroup, the driver allows {} "
                                      "(GL_MAX_COMPUTE_WORK_GROUP_INVOCATIONS))",
                                      limit + 1, limit)))
        << message;
}

TEST_F(ProgramTest, DeclarationsAreCounted) {
    const auto needed = [](GLenum stage, const std::string& text) {
        std::vector<std::size_t> counts;
        for (const Requirement& r : declared_requirements(stage, text)) counts.push_back(r.needed);
        return counts;
    };
    const std::string text =
        "layout(local_size_x = 8, local_size_y = 4) in;\nlayout(std430) readonly buffer A { uint a[]; };\n"
        "layout(std140) uniform B { vec4 b; };\nlayout(std140) uniform C { vec4 c; };\n"
        "uniform samplerBuffer d;\nuniform usampler2D e;\nuniform sampler3D f;\nuniform uint g;\n"
        "layout(rgba32f) writeonly uniform image2D h;\n";
    EXPECT_EQ(needed(GL_COMPUTE_SHADER, text), (std::vector<std::size_t>{1, 2, 3, 1, 32}));
    EXPECT_EQ(needed(GL_FRAGMENT_SHADER, text), (std::vector<std::size_t>{1, 2, 3, 1}));
}

TEST(ProgramLimits, TheFirstUnmetRequirementIsNamed) {
    EXPECT_EQ(unmet({{"storage blocks", 8, 8, "GL_A"}, {"images", 0, 0, "GL_B"}}), "");
    EXPECT_EQ(unmet({{"storage blocks", 8, 8, "GL_A"}, {"images", 9, 8, "GL_B"}, {"samplers", 2, 1, "GL_C"}}),
              "needs 9 images, the driver allows 8 (GL_B)");
}

TEST_F(ProgramTest, SlotsCountToTheHighestOne) {
    const auto needed = [](const std::vector<Slot>& slots) {
        std::vector<std::size_t> counts;
        for (const Requirement& r : slot_requirements(slots)) counts.push_back(r.needed);
        return counts;
    };
    EXPECT_EQ(needed({}), (std::vector<std::size_t>{0, 0, 0, 0}));
    EXPECT_EQ(needed({{"a", SlotKind::storage_block, 2},
                      {"b", SlotKind::sampler, 40},
                      {"c", SlotKind::sampler, 3},
                      {"d", SlotKind::image, 0}}),
              (std::vector<std::size_t>{3, 0, 41, 1}));
}

TEST_F(ProgramTest, BlocksAndDispatchesBeyondTheDriversLimitsAreErrors) {
    const RunLimits limits = run_limits();
    const Program program = Program::compute({"double", kDouble}, {{"OFFSET", "1"}});
    const Buffer values = Buffer::from("values", std::vector{1u});
    program.bind_storage("Values", values);
    for (const std::size_t axis : {0u, 1u, 2u}) {
        std::array<std::uint32_t, 3> groups{1, 1, 1};
        groups[axis] = limits.groups[axis] + 1;
        if (groups[axis] == 0) continue;  // every count is allowed
        EXPECT_EQ(error_message([&] { program.dispatch(groups[0], groups[1], groups[2]); }),
                  fmt::format("double: needs {} workgroups along {}, the driver allows {} "
                              "(GL_MAX_COMPUTE_WORK_GROUP_COUNT)",
                              groups[axis], "xyz"[axis], limits.groups[axis]));
    }
    if (limits.storage_block_bytes > std::size_t{256} << 20) return;  // takes too much memory
    const Buffer large("large", limits.storage_block_bytes + 4);
    EXPECT_EQ(error_message([&] { program.bind_storage("Values", large); }),
              fmt::format("double: storage block 'Values' gets buffer 'large' of {} bytes, the driver allows {}",
                          limits.storage_block_bytes + 4, limits.storage_block_bytes));
}

TEST_F(ProgramTest, CompileErrorsNameFileAndLine) {
    const ShaderFolder folder;
    folder.add("lib/bad.glsl", "float good() { return 1.0; }\n\nfloat bad() { return missing; }\n");
    folder.add("kernel.comp",
               "layout(local_size_x = 1) in;\n#include \"shaders/lib/bad.glsl\"\nvoid main() { bad(); }\n");
    const std::string message = error_message([] { Program::compute("shaders/kernel.comp"); });
    EXPECT_EQ(message.find("shaders/lib/bad.glsl:3: "), 0u) << message;
    EXPECT_NE(message.find("missing"), std::string::npos) << message;
    folder.add("lib/bad.glsl", "float bad() { return 1.0; }\n");
    folder.add("kernel.comp",
               "layout(local_size_x = 1) in;\n#include \"shaders/lib/bad.glsl\"\n\nvoid main() { worse(); }\n");
    const std::string own = error_message([] { Program::compute("shaders/kernel.comp"); });
    EXPECT_EQ(own.find("shaders/kernel.comp:4: "), 0u) << own;
}

// An include that the preprocessor skips must not hide later ones, and no file may be included twice.
TEST_F(ProgramTest, IncludesUnderConditions) {
    const ShaderFolder folder;
    folder.add("lib/deep.glsl", "const uint kDeep = 3u;\n");
    folder.add("lib/one.glsl", "#include \"shaders/lib/deep.glsl\"\nuint one() { return kDeep - 2u; }\n");
    folder.add("lib/self.glsl", "#ifndef SELF\n#define SELF\n#include \"shaders/lib/self.glsl\"\n#endif\n");
    const std::string text =
        "#ifdef FIRST\n#include \"shaders/lib/one.glsl\"\n#endif\n"
        "#include \"shaders/lib/self.glsl\"\n"
        "#ifdef SECOND\n#include \"shaders/lib/one.glsl\"\n#endif\n"
        "#ifndef LAST\n#include \"shaders/lib/one.glsl\"\n#include \"shaders/lib/deep.glsl\"\n#endif\n"
        "#include \"shaders/lib/one.glsl\"\n"
        "layout(local_size_x = 1) in;\n"
        "layout(std430) buffer Out { uint result; };\n"
        "void main() { result = one() + kDeep; }\n";
    for (int mask = 0; mask < 8; ++mask) {
        Defines defines;
        const char* names[] = {"FIRST", "SECOND", "LAST"};
        for (int i = 0; i < 3; ++i)
            if ((mask >> i & 1) != 0) defines.set(names[i]);
        const Program program = Program::compute({"conditions", text}, defines);
        const Buffer result("result", sizeof(std::uint32_t));
        program.bind_storage("Out", result);
        program.dispatch(1);
        EXPECT_EQ(result.read<std::uint32_t>().front(), 4u) << mask;
    }
    // Errors still name the file and line of their source.
    folder.add("lib/bad.glsl", "\nuint bad( { }\n");
    EXPECT_TRUE(error_message([] {
                    Program::compute({"conditions",
                                      "#ifdef NEVER\n#include \"shaders/lib/bad.glsl\"\n#endif\n"
                                      "#include \"shaders/lib/bad.glsl\"\nvoid main() {}\n"});
                }).starts_with("shaders/lib/bad.glsl:2: "));
}

TEST_F(ProgramTest, LinkErrorsNameTheProgram) {
    const ShaderSource vertex("v", "out float a;\nvoid main() { a = 1; gl_Position = vec4(a); }\n");
    const ShaderSource fragment("f", "in vec3 a;\nout vec4 c;\nvoid main() { c = a.xyzz; }\n");
    const std::string message = error_message([&] { Program::graphics(vertex, fragment); });
    EXPECT_EQ(message.find("v + f: does not link: "), 0u) << message;
}

TEST_F(ProgramTest, DrawsWithoutAttributes) {
    const Program program = Program::graphics(
        {"corner", "void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0, 1); }\n"},
        {"constant", "out vec4 color;\nvoid main() { color = vec4(gl_FragCoord.x, 2, 3, 4); }\n"});
    const Texture color("color", {.width = 3, .height = 2});
    const std::array<const Texture*, 1> colors{&color};
    const Framebuffer framebuffer("target", colors);
    framebuffer.bind();
    program.draw(GL_TRIANGLES, 3);
    EXPECT_EQ(color.read_float(), (std::vector<float>{0.5f, 2, 3, 4, 1.5f, 2, 3, 4, 2.5f, 2, 3, 4,  //
                                                      0.5f, 2, 3, 4, 1.5f, 2, 3, 4, 2.5f, 2, 3, 4}));
}

TEST_F(ProgramTest, TheCacheCompilesEachVariantOnce) {
    ProgramCache cache;
    const Program& one = cache.compute({"double", kDouble}, {{"OFFSET", "1"}});
    EXPECT_EQ(&cache.compute({"double", kDouble}, {{"OFFSET", "1"}}), &one);
    const Program& two = cache.compute({"double", kDouble}, {{"OFFSET", "2"}});
    EXPECT_NE(&two, &one);
    EXPECT_NE(&cache.compute({"double", std::string(kDouble) + "\n"}, {{"OFFSET", "1"}}), &one);
    EXPECT_EQ(cache.count(), 3u);
    EXPECT_GT(cache.seconds(), 0.0);
    EXPECT_ANY_THROW(cache.compute({"broken", "nonsense"}));
    EXPECT_EQ(cache.count(), 3u);
}

// --- Shared structs -------------------------------------------------------------------------------------------------

TEST(ShaderWatch, DetectsChangedFiles) {
    EXPECT_FALSE(ShaderWatch().watching());
    const ShaderFolder folder;
    folder.add("a.comp", "one");
    ShaderWatch watch;
    EXPECT_TRUE(watch.watching());
    EXPECT_FALSE(watch.changed());
    folder.add("a.comp", "other");
    EXPECT_TRUE(watch.changed());
    EXPECT_FALSE(watch.changed());
    folder.add("lib/b.glsl", "");
    EXPECT_TRUE(watch.changed());
    folder.remove("a.comp");
    EXPECT_TRUE(watch.changed());
    EXPECT_FALSE(watch.changed());
}

TEST_F(ProgramTest, TheCacheReloadsChangedPrograms) {
    const ShaderFolder folder;
    const auto kernel = [](const char* value) {
        return std::string(
                   "#include \"shaders/lib/value.glsl\"\nlayout(local_size_x = 1) in;\n"
                   "layout(std430) buffer Out { uint value; };\nuniform uint more;\n"
                   "void main() { value = from_file() + more + ") +
               value + "; }\n";
    };
    folder.add("lib/value.glsl", "uint from_file() { return 1u; }\n");
    folder.add("a.comp", kernel("10u"));
    folder.add("b.comp", kernel("20u"));
    ProgramCache cache;
    const Program& a = cache.compute("shaders/a.comp");
    const Program& b = cache.compute("shaders/b.comp");
    Buffer out("out", sizeof(std::uint32_t));
    const auto values = [&] {
        std::array<std::uint32_t, 2> result;
        for (const Program* program : {&a, &b}) {
            program->bind_storage("Out", out);
            program->set("more", 100u);
            program->dispatch(1);
            glMemoryBarrier(GL_ALL_BARRIER_BITS);
            result[program == &b] = out.read<std::uint32_t>().at(0);
        }
        return result;
    };
    EXPECT_EQ(values(), (std::array{111u, 121u}));
    EXPECT_EQ(cache.reload(), 0u);
    folder.add("b.comp", kernel("30u"));
    EXPECT_EQ(cache.reload(), 1u);
    EXPECT_EQ(values(), (std::array{111u, 131u}));
    folder.add("lib/value.glsl", "uint from_file() { return 2u; }\n");
    EXPECT_EQ(cache.reload(), 2u);
    EXPECT_EQ(values(), (std::array{112u, 132u}));
    // One of the two does not compile, so neither is replaced.
    folder.add("a.comp", kernel("11u"));
    folder.add("b.comp", kernel("nothing"));
    const std::string message = error_message([&] { cache.reload(); });
    EXPECT_TRUE(message.starts_with("shaders/b.comp:5: ")) << message;
    EXPECT_EQ(values(), (std::array{112u, 132u}));
    folder.add("b.comp", kernel("31u"));
    EXPECT_EQ(cache.reload(), 2u);
    EXPECT_EQ(values(), (std::array{113u, 133u}));
    EXPECT_EQ(&cache.compute("shaders/a.comp"), &a);
    EXPECT_EQ(cache.count(), 2u);
}

TEST_F(ProgramTest, EverySharedHeaderIsGlsl) {
    for (const std::string_view name : embedded_shaders()) {
        if (!name.starts_with("shaders/shared/")) continue;
        const std::string text =
            "#include \"" + std::string(name) + "\"\nlayout(local_size_x = 1) in;\nvoid main() {}\n";
        EXPECT_NO_THROW(Program::compute({std::string(name), text}));
    }
}

TEST_F(ProgramTest, GlslWritesWhatCppReads) {
    const Program program = Program::compute({"layout", R"(
#include "shaders/shared/rays.h"
layout(local_size_x = 1) in;
layout(std430) buffer Rays { Ray rays[]; };
layout(std430) buffer Hits { Hit hits[]; };
layout(std430) buffer Headers { ListHeader header; };
void main() {
    for (uint i = 0; i < 2; ++i) {
        rays[i] = Ray(vec3(1, 2, 3) + i, 4 + i, vec3(5, 6, 7) + i, 8 + i);
        hits[i] = Hit(1 + i, 2 + i, 3 + i, kMiss - i, 5 + i);
    }
    header = ListHeader(1, 2, 3, 4);
})"});
    const Buffer rays("rays", 2 * sizeof(shared::Ray)), hits("hits", 2 * sizeof(shared::Hit));
    const Buffer header("header", sizeof(shared::ListHeader));
    program.bind_storage("Rays", rays);
    program.bind_storage("Hits", hits);
    program.bind_storage("Headers", header);
    program.dispatch(1);
    const shared::Ray ray = rays.read<shared::Ray>()[1];
    EXPECT_EQ(ray.origin, vec3(2, 3, 4));
    EXPECT_EQ(ray.t_min, 5.f);
    EXPECT_EQ(ray.direction, vec3(6, 7, 8));
    EXPECT_EQ(ray.t_max, 9.f);
    const shared::Hit hit = hits.read<shared::Hit>()[1];
    EXPECT_EQ(hit.t, 2.f);
    EXPECT_EQ(hit.u, 3.f);
    EXPECT_EQ(hit.v, 4.f);
    EXPECT_EQ(hit.triangle, shared::kMiss - 1);
    EXPECT_EQ(hit.instance, 6u);
    const shared::ListHeader list = header.read<shared::ListHeader>()[0];
    EXPECT_EQ(list.groups_x, 1u);
    EXPECT_EQ(list.count, 4u);
}

}  // namespace
}  // namespace halflight::gpu
