// Tests shader sources: includes, defines, and the places of messages.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <regex>

#include "engine/gpu/shader_source.h"
#include "tests/support/error_message.h"
#include "tests/unit/gpu/shader_folder.h"

namespace halflight::gpu {
namespace {

TEST(ShaderSource, EmbedsEveryFileOfTheFolder) {
    std::vector<std::string> expected;
    const std::filesystem::path root(HALFLIGHT_SOURCE_DIR);
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / "shaders")) {
        const std::string extension = entry.path().extension();
        if (entry.is_regular_file() && extension != ".md") {
            expected.push_back(entry.path().lexically_relative(root).generic_string());
        }
    }
    std::sort(expected.begin(), expected.end());
    const auto embedded = embedded_shaders();
    EXPECT_EQ(std::vector<std::string>(embedded.begin(), embedded.end()), expected);
}

TEST(ShaderSource, PutsVersionAndDefinesInFront) {
    Defines defines{{"B", "2"}, {"A", "first"}};
    defines.set("A", 1);
    const ExpandedSource out = expand({"own", "#version 450\nint a = A, b = B;\n"}, defines);
    EXPECT_EQ(out.text, "#version 450 core\n#define A 1\n#define B 2\nint a = A, b = B;\n");
}

TEST(ShaderSource, LeavesOutDefinesThatAreNotMentioned) {
    const Defines defines{{"FULL", "HALF * 2"}, {"HALF", "3"}, {"HAL", "1"}, {"LAST", "1"}, {"B", "1"}};
    const ExpandedSource out = expand({"own", "int a = FULL, B_C;\n#if defined(LAST)\n#endif"}, defines);
    EXPECT_EQ(out.text,
              "#version 450 core\n#define FULL HALF * 2\n#define HALF 3\n#define LAST 1\n"
              "int a = FULL, B_C;\n#if defined(LAST)\n#endif\n");
    ASSERT_EQ(out.lines.size(), 7u);
    EXPECT_EQ(out.lines[3].number, 1u);
    EXPECT_EQ(out.lines[5].number, 2u);
}

TEST(ShaderSource, MakesFeaturesZeroUnlessTheyAreDefined) {
    const ExpandedSource out = expand(
        {"own", "#define HALFLIGHT_C (HALFLIGHT_A || HALFLIGHT_B)\nint c = HALFLIGHT_C;\n"}, {{"HALFLIGHT_B", "1"}});
    EXPECT_EQ(out.text,
              "#version 450 core\n#define HALFLIGHT_B 1\n#define HALFLIGHT_A 0\n"
              "#define HALFLIGHT_C (HALFLIGHT_A || HALFLIGHT_B)\nint c = HALFLIGHT_C;\n");
}

TEST(ShaderSource, PutsVariablesInPlaceOfOptionalBlocks) {
    const ExpandedSource out =
        expand({"own", "int a;\nOPTIONAL(A && (B)) layout(std430) buffer Bs { uint n; vec4 b[]; };  // what\n"});
    EXPECT_EQ(out.text,
              "#version 450 core\nint a;\n#if (A && (B))\nlayout(std430) buffer Bs { uint n; vec4 b[]; };  // what\n"
              "#else\n uint n; vec4 b[1]; \n#endif\n");
    EXPECT_EQ(out.lines.back().number, 2u);
    const std::string message = error_message([] { expand({"own", "int a;\nOPTIONAL(A) uniform sampler2D s;\n"}); });
    EXPECT_EQ(message.substr(0, 5), "own:2") << message;
}

TEST(ShaderSource, IncludesOnceAndKnowsWhereLinesComeFrom) {
    const ShaderFolder folder;
    folder.add("lib/a.glsl", "int a;\n");
    folder.add("lib/b.glsl", "#include \"shaders/lib/a.glsl\"\nint b;\n");
    const ExpandedSource out =
        expand({"own", "  # include \"shaders/lib/b.glsl\"\n#include \"shaders/lib/a.glsl\"\nint c;"});
    EXPECT_EQ(out.files, (std::vector<std::string>{"own", "shaders/lib/b.glsl", "shaders/lib/a.glsl"}));
    EXPECT_EQ(out.text, "#version 450 core\nint a;\nint b;\nint c;\n");
    ASSERT_EQ(out.lines.size(), 4u);
    EXPECT_EQ(out.lines[1].file, 2u);
    EXPECT_EQ(out.lines[1].number, 1u);
    EXPECT_EQ(out.lines[2].file, 1u);
    EXPECT_EQ(out.lines[2].number, 2u);
    EXPECT_EQ(out.lines[3].file, 0u);
    EXPECT_EQ(out.lines[3].number, 3u);
}

TEST(ShaderSource, LeavesOutCommentsAndEmptyLines) {
    const ExpandedSource out = expand({"own", "// a\n\nint a;  // b\n  // c\n#define B \\\n\nint b;"});
    EXPECT_EQ(out.text, "#version 450 core\nint a;  // b\n#define B \\\n\nint b;\n");
    EXPECT_EQ(out.lines.back().number, 7u);
}

TEST(ShaderSource, IncludesAgainOnlyWhereAConditionMayHaveLeftOutAFile) {
    const ShaderFolder folder;
    folder.add("lib/a.glsl", "int a;\n");
    folder.add("lib/b.glsl", "#pragma once\n#include \"shaders/lib/a.glsl\"\nint b;\n");
    const std::string a = "#include \"shaders/lib/a.glsl\"\n", b = "#include \"shaders/lib/b.glsl\"\n";
    const auto times = [](const std::string& text, std::string_view what) {
        std::size_t count = 0;
        for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
        return count;
    };
    // In the same branch and those inside it, the file is there.
    const std::string inside = expand({"own", "#ifdef X\n" + b + a + "#if Y\n" + a + "#endif\n#endif\n"}).text;
    EXPECT_EQ(times(inside, "int a;"), 1u);
    // In another branch, and after both, it may not be there. What it includes comes with it.
    const std::string beside =
        expand({"own", "#ifdef X\n" + b + "#else\n" + a + "#endif\n" + b + a + b + "#ifdef Z\n" + a + "#endif\n"}).text;
    EXPECT_EQ(times(beside, "int a;"), 3u);
    EXPECT_EQ(times(beside, "int b;"), 2u);
    // A file that includes itself ends.
    folder.add("lib/loop.glsl", "#include \"shaders/lib/loop.glsl\"\nint loop;\n");
    EXPECT_EQ(times(expand("shaders/lib/loop.glsl").text, "int loop;"), 1u);
}

TEST(ShaderSource, LeavesOutWhatConstantsClose) {
    const std::string text =
        "const bool kA = HALFLIGHT_A != 0, kOther = true;\n"
        "const bool kB = HALFLIGHT_A != 0 && (HALFLIGHT_B > 1 || HALFLIGHT_C != 0);\n"
        "uniform float x;\n"
        "float one() { return 1.0; }\n"
        "float two() { return 2.0 * one(); }\n"
        "#define CALL(f) f()\n"
        "void main() {\n"
        "    if (kB) one();\n"
        "    else if (x > 0.0) two();\n"
        "    if (!kB) { x; return; }\n"
        "    if (x > 0.0 && HALFLIGHT_C != 0) two();\n"
        "    one();\n"
        "}\n";
    const auto left = [&](const Defines& defines) {
        const ExpandedSource out = expand({"own", text}, defines);
        EXPECT_EQ(std::ranges::count(out.text, '\n'), std::ssize(out.lines));
        return std::regex_replace(out.text.substr(out.text.find("uniform")), std::regex(R"(\s+)"), " ");
    };
    const std::string define = " #define CALL(f) f()", one = " float one() { return 1.0; }";
    EXPECT_EQ(left({}), "uniform float x;" + one + " float two() { return 2.0 * one(); }" + define +
                            " void main() { if (x > 0.0) two(); { x; return; } } ");
    EXPECT_EQ(left({{"HALFLIGHT_A", "1"}, {"HALFLIGHT_B", "2u"}}),
              "uniform float x;" + one + define + " void main() { one(); ; ; one(); } ");
}

TEST(ShaderSource, KeepsWhatItCannotJudge) {
    const std::string body =
        "const uint kRows = HALFLIGHT_A != 0 || HALFLIGHT_B != 0 ? 2u : 1u; const bool kA = HALFLIGHT_A != 0; "
        "void main() { if (kRows > 1u) return; if (false ^^ kA) return; "
        "switch (k) { case 0: if (kA) { return; } case 1: k = 2; } } ";
    const std::string text = expand({"own", body}, {{"HALFLIGHT_A", "1"}}).text;
    EXPECT_NE(text.find(body.substr(0, body.size() - 1)), std::string::npos) << text;
}

TEST(ShaderSource, MissingFilesAreNamedWithTheirLine) {
    EXPECT_TRUE(error_message([] { expand("shaders/nowhere.comp"); }).starts_with("shaders/nowhere.comp: "));
    const ShaderSource own("own", "\n#include \"shaders/lib/nowhere.glsl\"\n");
    const std::string message = error_message([&] { expand(own); });
    EXPECT_TRUE(message.starts_with("own:2: ") && message.ends_with("\"shaders/lib/nowhere.glsl\"")) << message;
}

TEST(ShaderSource, UnderstandsTheLogsOfTwoVendors) {
    ExpandedSource source;
    source.files = {"main", "shaders/lib/x.glsl"};
    source.lines = {{0, 1}, {0, 1}, {1, 12}};
    const struct {
        const char *log, *place, *what;
    } cases[] = {
        {"0:2(1): warning: hm\n0:3(5): error: `foo' undeclared\n", "shaders/lib/x.glsl:12", "error: `foo' undeclared"},
        {"0(3) : error C1008: undefined variable \"foo\"\n", "shaders/lib/x.glsl:12",
         "error C1008: undefined variable \"foo\""},
        {"out of registers", "main", "out of registers"},
        {"0:99(1): error: beyond", "main", "0:99(1): error: beyond"},
        {"", "main", ""}};
    for (const auto& c : cases) {
        const CompileMessage message = first_message(c.log, source);
        EXPECT_EQ(message.place, c.place) << c.log;
        EXPECT_EQ(message.what, c.what) << c.log;
    }
}

}  // namespace
}  // namespace halflight::gpu
