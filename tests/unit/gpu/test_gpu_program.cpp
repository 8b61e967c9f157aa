// Tests programs: their uniforms and resources, limits of the driver, errors, and their cache.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>

#include "engine/gpu/declarations.h"
#include "engine/gpu/program_cache.h"
#include "engine/gpu/program_limits.h"
#include "engine/gpu/texture.h"
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

TEST_F(ProgramTest, AMisspeltUniformIsAnErrorButAnUnusedOneIsNot) {
    const Program program = Program::compute({"double", kDouble}, {{"OFFSET", "1"}});
    EXPECT_NE(error_message([&] { program.set("facter", 1u); }).find("'facter'"), std::string::npos);
    const Program unused =
        Program::compute({"unused", "layout(local_size_x = 1) in;\nuniform float unused;\nvoid main() {}\n"});
    EXPECT_EQ(unused.uniform("unused"), -1);
    EXPECT_NO_THROW(unused.set("unused", 1.f));
}

TEST(Declarations, AreThoseOfUniformsAndResources) {
    const Declarations found = declarations(R"(#version 450 core
#define MACRO uniform float in_macro \
    uniform float in_macro_too;
// uniform float in_comment; \
   uniform float in_comment_too;
/* uniform float in_block_comment; */
layout(std430) readonly buffer Values { uint values[]; } instance;
layout(std140) uniform Frame { vec4 member; };
layout(std140) uniform;
#if 0
uniform usampler2D never;
#endif
layout(rgba32f) writeonly uniform image2D picture; uniform float a = 1, b[SIZE(c, d)] = {e, f};uniform vec2[2] g;
uniform layout(location = 3) readonly iimage2D h;
int function(float local) { buffered = uniformed; return 1; })");
    const std::pair<const char*, const char*> expected[] = {{"storage block", "Values"},
                                                            {"uniform block", "Frame"},
                                                            {"sampler", "never"},
                                                            {"image", "picture"},
                                                            {"image", "h"},
                                                            {"uniform", "a"},
                                                            {"uniform", "b"},
                                                            {"uniform", "g"}};
    EXPECT_EQ(found.size(), 2 * std::size(expected));
    for (const auto& [kind, name] : expected) {
        EXPECT_TRUE(found.contains(name)) << name;
        EXPECT_TRUE(found.contains(fmt::format("{} {}", kind, name))) << kind << ' ' << name;
    }
    EXPECT_TRUE(declarations("").empty());
    for (const char* cut : {"uniform", "uniform float", "uniform float a[", "buffer A {", "/*", "/*/ uniform int a;",
                            "#a", "layout(", "uniform layout("})
        EXPECT_LE(declarations(cut).size(), 2u) << cut;
}

/// Words of the source are no declarations, and neither are resources of other kinds.
TEST_F(ProgramTest, OnlyDeclaredNamesAreTaken) {
    const Program program = Program::compute({"words", R"(
layout(local_size_x = 1) in;
layout(std430) buffer Out { float result; };
layout(std430) readonly buffer Unused { float unused[]; };
uniform sampler2D unread;
uniform float unset;
#ifdef NEVER
uniform sampler2D other;
#endif
float function(float local) { return 2.0 * local; }  // a comment
void main() { result = function(1.0); })"});
    const Buffer buffer("buffer", sizeof(float));
    const Texture texture("texture", {.format = GL_R32F});
    EXPECT_NO_THROW(program.bind_storage("Unused", buffer));
    EXPECT_NO_THROW(program.bind_texture("unread", texture));
    EXPECT_NO_THROW(program.bind_texture("other", texture)) << "is declared in another branch";
    EXPECT_NO_THROW(program.set("unset", 1.f));
    for (const char* word : {"comment", "function", "local", "result", "unused", "main", "float", "unread", "unset"}) {
        EXPECT_NE(error_message([&] { program.bind_storage(word, buffer); }), "") << word;
        EXPECT_NE(error_message([&] { program.bind_image(word, texture); }), "") << word;
    }
    for (const char* word : {"comment", "function", "local", "result", "Out", "Unused", "unread"})
        EXPECT_NE(error_message([&] { program.set(word, 1.f); }), "") << word;
    for (const char* word : {"comment", "function", "local", "result", "unused", "NEVER"})
        EXPECT_FALSE(program.declares(word)) << word;
}

TEST_F(ProgramTest, ResourcesAreBoundByName) {
    const Program program = Program::compute({"names", R"(
layout(local_size_x = 1) in;
layout(std430) writeonly buffer Sum { float sum; };
layout(std430) readonly buffer Unused { float unused; };
layout(std140) uniform Ten { float ten; };
uniform sampler2D thousand;
void main() { sum = ten + texelFetch(thousand, ivec2(0), 0).x; }
)"});
    const Buffer ten = Buffer::from("ten", std::vector<float>(4, 10)), sum("sum", sizeof(float));
    Texture thousand("thousand", {.format = GL_R32F});
    thousand.upload(std::vector<float>{1000});
    program.bind_texture("thousand", thousand);
    program.bind_uniform("Ten", ten);
    program.bind_storage("Sum", sum);
    EXPECT_NO_THROW(program.bind_storage("Unused", ten));
    program.dispatch(1);
    EXPECT_EQ(sum.read<float>()[0], 1010.f);
    for (const char* wrong : {"Su", "thousand"})
        EXPECT_NE(error_message([&] { program.bind_storage(wrong, ten); }).find(wrong), std::string::npos);
    EXPECT_NE(error_message([&] { program.bind_texture("Ten", thousand); }).find("'Ten'"), std::string::npos);
}

TEST_F(ProgramTest, ResourcesThatNobodyBindsAreErrors) {
    const std::string head = "layout(local_size_x = 1) in;\nlayout(std430) buffer Out { float sum; };\n";
    const Buffer out("out", sizeof(float));
    const std::pair<const char*, const char*> resources[] = {
        {"layout(std430) buffer More { float more; };\nvoid main() { sum = more; }\n", "'More'"},
        {"layout(std140) uniform Ten { float ten; };\nvoid main() { sum = ten; }\n", "'Ten'"},
        {"uniform sampler2D s;\nvoid main() { sum = texelFetch(s, ivec2(0), 0).x; }\n", "'s'"},
        {"layout(r32f) uniform image2D i;\nvoid main() { sum = imageLoad(i, ivec2(0)).x; }\n", "'i'"}};
    const auto expect_error = [](const Program& program, const std::string& resource) {
        const std::string message = error_message([&] { program.dispatch(1); });
        EXPECT_TRUE(message.starts_with(program.name() + ": ") && message.ends_with(resource)) << message;
    };
    for (const auto& [text, resource] : resources) {
        const Program program = Program::compute({"kernel", head + text});
        program.bind_storage("Out", out);
        for (int turn = 0; turn < 2; ++turn) expect_error(program, resource);
    }
    const Program other = Program::compute({"other", head + "void main() { sum = 1; }\n"});
    expect_error(other, "'Out'");
    other.bind_storage("Out", out);
    EXPECT_NO_THROW(other.dispatch(1));
    EXPECT_NO_THROW(other.dispatch(1)) << "bindings hold until another program takes the slot";
    const Program third = Program::compute({"third", "layout(local_size_x = 1) in;\nvoid main() {}\n"});
    third.dispatch(1);
    EXPECT_NO_THROW(other.dispatch(1)) << "a program without resources takes no slot";
    const Program fourth = Program::compute({"fourth", head + "void main() { sum = 4; }\n"});
    fourth.bind_storage("Out", out);
    EXPECT_NO_THROW(fourth.dispatch(1));
    expect_error(other, "'Out'");
}

TEST_F(ProgramTest, ResourcesThatCannotBeBoundAreErrors) {
    const std::pair<const char*, const char*> cases[] = {
        {"uniform samplerCube s;\nvoid main() { sum = textureLod(s, vec3(1), 0).x; }\n", "'s'"},
        {"layout(r32f) uniform image1D i;\nvoid main() { sum = imageLoad(i, 0).x; }\n", "'i'"},
        {"uniform sampler2D s[2];\nvoid main() { sum = texelFetch(s[1], ivec2(0), 0).x; }\n", "'s[0]'"},
        {"layout(std430) buffer B { float b; } blocks[2];\nvoid main() { sum = blocks[1].b; }\n", "'B["},
        {"layout(std140) uniform U { mat2 m; double d; };\nvoid main() { sum = m[0].x + float(d); }\n", nullptr}};
    for (const auto& [text, named] : cases) {  // members of blocks may have any type
        const std::string kernel =
            std::string("layout(local_size_x = 1) in;\nlayout(std430) buffer Out { float sum; };\n");
        const std::string message = error_message([&] { Program::compute({"kernel", kernel + text}); });
        EXPECT_EQ(message.empty(), named == nullptr) << message;
        EXPECT_TRUE(!named || (message.starts_with("kernel: ") && message.find(named) != std::string::npos)) << message;
    }
}

TEST_F(ProgramTest, MoreThanTheDriverHasIsAnError) {
    const auto blocks = [](int count) {
        std::string text = "layout(local_size_x = 1) in;\n", sum;
        for (int i = 0; i < count; ++i) {
            text += fmt::format("layout(std430) buffer Block{0} {{ uint b{0}; }};\n", i);
            sum += fmt::format("++b{};", i);
        }
        return text + "void main() { " + sum + " }\n";
    };
    const auto invocations = [](int size) {
        return fmt::format("layout(local_size_x = {}) in;\nvoid main() {{}}\n", size);
    };
    const struct {
        GLenum limit;
        std::function<std::string(int)> kernel;
        const char* needs;
    } cases[] = {{GL_MAX_COMPUTE_SHADER_STORAGE_BLOCKS, blocks, "needs {} storage blocks, the driver allows {} "},
                 {GL_MAX_COMPUTE_WORK_GROUP_INVOCATIONS, invocations,
                  "needs {} invocations in a workgroup, the driver allows {} "}};
    for (const auto& c : cases) {
        GLint limit = 0;
        glGetIntegerv(c.limit, &limit);
        EXPECT_NO_THROW(Program::compute({"full", c.kernel(limit)}));
        const std::string message = error_message([&] { Program::compute({"crowded", c.kernel(limit + 1)}); });
        EXPECT_TRUE(message.starts_with("crowded:")) << message;
        EXPECT_NE(message.find(fmt::format(fmt::runtime(c.needs), limit + 1, limit)), std::string::npos) << message;
    }
}

/// Returns the numbers that the requirements need.
std::vector<std::size_t> needed(const std::vector<Requirement>& requirements) {
    std::vector<std::size_t> counts;
    for (const Requirement& r : requirements) counts.push_back(r.needed);
    return counts;
}

TEST_F(ProgramTest, DeclarationsAndSlotsAreCounted) {
    const std::string text =
        "layout(local_size_x = 8, local_size_y = 4) in;\nlayout(std430) readonly buffer A { uint a[]; };\n"
        "layout(std140) uniform B { vec4 b; };\nlayout(std140) uniform C { vec4 c; };\n"
        "uniform samplerBuffer d;\nuniform usampler2D e;\nuniform sampler3D f;\nuniform uint g;\n"
        "layout(rgba32f) writeonly uniform image2D h;\n";
    using Counts = std::vector<std::size_t>;
    EXPECT_EQ(needed(declared_requirements(GL_COMPUTE_SHADER, text)), (Counts{1, 2, 3, 1, 32}));
    EXPECT_EQ(needed(declared_requirements(GL_FRAGMENT_SHADER, text)), (Counts{1, 2, 3, 1}));
    EXPECT_EQ(needed(slot_requirements({})), (Counts{0, 0, 0, 0}));
    const std::vector<Slot> slots{{"a", SlotKind::storage_block, 2},
                                  {"b", SlotKind::sampler, 40},
                                  {"c", SlotKind::sampler, 3},
                                  {"d", SlotKind::image, 0}};
    EXPECT_EQ(needed(slot_requirements(slots)), (Counts{3, 0, 41, 1})) << "to the highest slot";
}

TEST(ProgramLimits, TheFirstUnmetRequirementIsNamed) {
    EXPECT_EQ(unmet({{"storage blocks", 8, 8, "GL_A"}, {"images", 0, 0, "GL_B"}}), "");
    EXPECT_TRUE(unmet({{"storage blocks", 8, 8, "GL_A"}, {"images", 9, 8, "GL_B"}, {"samplers", 2, 1, "GL_C"}})
                    .starts_with("needs 9 images"));
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
        EXPECT_TRUE(error_message([&] {
                        program.dispatch(groups[0], groups[1], groups[2]);
                    }).starts_with(fmt::format("double: needs {} workgroups along {}", groups[axis], "xyz"[axis])));
    }
    if (limits.storage_block_bytes > std::size_t{256} << 20) return;  // the buffer would take too much memory
    const Buffer large("large", limits.storage_block_bytes + 4);
    EXPECT_TRUE(error_message([&] {
                    program.bind_storage("Values", large);
                }).starts_with("double: storage block 'Values' gets buffer 'large'"));
}

TEST_F(ProgramTest, CompileErrorsNameFileAndLine) {
    const ShaderFolder folder;
    const auto message = [&](const char* header, const char* kernel) {
        folder.add("lib/bad.glsl", header);
        folder.add("kernel.comp",
                   std::string("layout(local_size_x = 1) in;\n#include \"shaders/lib/bad.glsl\"\n") + kernel);
        return error_message([] { Program::compute("shaders/kernel.comp"); });
    };
    const std::string included =
        message("float good() { return 1.0; }\n\nfloat bad() { return missing; }\n", "void main() { bad(); }\n");
    EXPECT_TRUE(included.starts_with("shaders/lib/bad.glsl:3: ")) << included;
    const std::string own = message("float bad() { return 1.0; }\n", "\nvoid main() { worse(); }\n");
    EXPECT_TRUE(own.starts_with("shaders/kernel.comp:4: ")) << own;
}

TEST_F(ProgramTest, LinkErrorsNameTheProgram) {
    const ShaderSource vertex("v", "out float a;\nvoid main() { a = 1; gl_Position = vec4(a); }\n");
    const ShaderSource fragment("f", "in vec3 a;\nout vec4 c;\nvoid main() { c = a.xyzz; }\n");
    const std::string message = error_message([&] { Program::graphics(vertex, fragment); });
    EXPECT_EQ(message.find("v + f: does not link: "), 0u) << message;
}

TEST_F(ProgramTest, TheCacheCompilesEachVariantOnce) {
    ProgramCache cache;
    const Program& one = cache.compute({"double", kDouble}, {{"OFFSET", "1"}});
    EXPECT_EQ(&cache.compute({"double", kDouble}, {{"OFFSET", "1"}}), &one);
    EXPECT_NE(&cache.compute({"double", kDouble}, {{"OFFSET", "2"}}), &one);
    EXPECT_NE(&cache.compute({"double", std::string(kDouble) + "\n"}, {{"OFFSET", "1"}}), &one);
    EXPECT_ANY_THROW(cache.compute({"broken", "nonsense"}));
    EXPECT_EQ(cache.count(), 3u);
    EXPECT_GT(cache.seconds(), 0.0);
}

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

}  // namespace
}  // namespace halflight::gpu
