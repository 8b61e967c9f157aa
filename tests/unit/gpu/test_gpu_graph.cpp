// Tests the render graph on the software driver.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "engine/core/error.h"
#include "engine/gpu/program_cache.h"
#include "engine/graph/execute.h"
#include "tests/support/error_message.h"
#include "tests/support/gpu_test.h"
#include "tools/common/temporary_folder.h"

namespace halflight::graph {
namespace {

using enum Access;
using Words = std::vector<std::uint32_t>;

constexpr std::uint32_t kCount = 256;

const gpu::ShaderSource kAddOne("add one", R"(
layout(local_size_x = 64) in;
layout(std430) readonly buffer In { uint source[]; };
layout(std430) writeonly buffer Out { uint target[]; };
uniform uint step;
void main() { target[gl_GlobalInvocationID.x] = source[gl_GlobalInvocationID.x] + step; }
)");

constexpr const char* kAdd = R"(
layout(local_size_x = 64) in;
uniform usamplerBuffer from;
layout(std430) writeonly buffer To { uint target[]; };
void main() { target[gl_GlobalInvocationID.x] = texelFetch(from, int(gl_GlobalInvocationID.x)).x + ADDED; }
)";

class GraphTest : public GpuTest {
  protected:
    /// Adds a pass: target[i] = source[i] + step.
    static BufferHandle add_step(Graph& graph, const std::string& name, BufferHandle source, BufferHandle target,
                                 std::uint32_t step = 1) {
        Pass pass = graph.add_pass(name);
        pass.read(source, storage_read, "In");
        target = pass.write(target, storage_write, "Out");
        pass.execute([=](Resources& r) {
            const gpu::Program& program = r.compute(kAddOne);
            program.set("step", step);
            program.dispatch(kCount / 64);
        });
        return target;
    }
    static BufferHandle fresh(Graph& graph, const std::string& name, std::uint32_t count = kCount) {
        return graph.create_buffer(name, {count * sizeof(std::uint32_t)});
    }
    gpu::Buffer ramp() const {
        Words values(kCount);
        std::iota(values.begin(), values.end(), 0u);
        return gpu::Buffer::from("ramp", values);
    }
    static Words ramp_from(std::uint32_t first) {
        Words values(kCount);
        std::iota(values.begin(), values.end(), first);
        return values;
    }

    gpu::ProgramCache programs;
    Executor executor{programs};
};

TEST_F(GraphTest, AChainOfKernelsIsTheSameWithAndWithoutAliasing) {
    gpu::Buffer source = ramp();
    Graph graph;
    BufferHandle last = graph.import_buffer("ramp", source);
    std::vector<BufferHandle> outputs;
    for (std::uint32_t i = 0; i < 12; ++i) {
        last = add_step(graph, std::to_string(i), last, fresh(graph, std::to_string(i), kCount + 64 * (i % 3)), i);
        if (i % 5 == 0) outputs.push_back(last);
    }
    outputs.push_back(last);
    for (const BufferHandle output : outputs) graph.output(output);
    executor.poison(true);
    for (const bool alias : {true, false, true}) {
        executor.run(compile(graph, {.alias = alias}));
        EXPECT_EQ(executor.read<std::uint32_t>(outputs[0]), ramp_from(0)) << alias;
        Words after_five = executor.read<std::uint32_t>(outputs[1]);
        after_five.resize(kCount);
        EXPECT_EQ(after_five, ramp_from(15)) << alias;
        Words end = executor.read<std::uint32_t>(last);
        EXPECT_EQ(end.size(), kCount + 128u) << "the size it was declared with, whatever its slot has";
        end.resize(kCount);
        EXPECT_EQ(end, ramp_from(66)) << alias;
    }
}

TEST_F(GraphTest, DeclaredKernelsRunWithAndWithoutCompilingAhead) {
    const TemporaryFolder folder;
    const gpu::ProgramBinaries binaries(folder / "programs", "driver");
    gpu::Buffer source = ramp();
    for (const bool ahead : {true, false}) {
        gpu::ProgramCache cache(&binaries);
        Executor both(cache);
        both.compile_ahead(ahead);
        Graph graph;
        BufferHandle last = graph.import_buffer("ramp", source);
        bool stops = true;
        for (std::uint32_t i = 1; i <= 3; ++i) {
            Pass pass = graph.add_pass("add");
            pass.read(last, texture_read, {"from", GL_R32UI});
            last = pass.write(fresh(graph, std::to_string(i)), storage_write, "To");
            pass.kernel({{"add", kAdd}, {{"ADDED", std::to_string(i) + "u"}}, {}});
            pass.execute([&stops, i](Resources& r) {
                if (i == 2 && stops) throw Error("test", "is stopped");
                r.kernel().dispatch(kCount / 64);
            });
        }
        graph.output(last);
        const CompiledGraph plan = compile(graph);
        EXPECT_EQ(error_message([&] { both.run(plan); }), "test: is stopped");
        stops = false;
        both.run(plan);
        EXPECT_EQ(both.read<std::uint32_t>(last), ramp_from(6)) << ahead;
    }
}

TEST_F(GraphTest, PassesWithoutAKernelAreNamed) {
    Graph graph;
    Pass pass = graph.add_pass("bare");
    const BufferHandle out = pass.write(fresh(graph, "out"), storage_write);
    pass.execute([](Resources& r) { r.kernel(); });
    graph.output(out);
    EXPECT_EQ(error_message([&] { executor.run(compile(graph)); }), "pass 'bare': has declared no kernel");
}

TEST_F(GraphTest, OneCompiledGraphRunsManyTimes) {
    gpu::Buffer state = ramp();
    Graph graph;
    const BufferHandle imported = graph.import_buffer("state", state);
    const BufferHandle next = add_step(graph, "step", imported, fresh(graph, "next"));
    Pass copy = graph.add_pass("back");
    copy.read(next, transfer_read);
    const BufferHandle back = copy.write(imported, transfer_write);
    copy.execute([=](Resources& r) {
        glCopyNamedBufferSubData(r.buffer(next).id(), r.buffer(back).id(), 0, 0, kCount * sizeof(std::uint32_t));
    });
    graph.output(back);
    const CompiledGraph plan = compile(graph);
    for (int i = 0; i < 300; ++i) executor.run(plan);
    EXPECT_EQ(state.read<std::uint32_t>(), ramp_from(300));
    EXPECT_EQ(programs.count(), 1u);
}

TEST_F(GraphTest, HistoryCarriesStateOverRuns) {
    Graph graph;
    const auto history = graph.history_buffer("counter", {kCount * sizeof(std::uint32_t)});
    const BufferHandle now = add_step(graph, "count", history.previous, history.now);
    graph.output(now);
    const CompiledGraph plan = compile(graph);
    for (std::uint32_t run = 1; run <= 3; ++run) {
        executor.run(plan);
        EXPECT_EQ(executor.read<std::uint32_t>(now), Words(kCount, run)) << "zeros first, then the run before";
    }
    EXPECT_EQ(executor.history().bytes(), 2 * kCount * sizeof(std::uint32_t));
    executor.history().invalidate("camera cut");
    EXPECT_EQ(executor.history().last_reason(), "camera cut");
    executor.run(plan);
    EXPECT_EQ(executor.read<std::uint32_t>(now), Words(kCount, 1));
    executor.run(plan);
    EXPECT_EQ(executor.read<std::uint32_t>(now), Words(kCount, 2));
}

TEST_F(GraphTest, CarriedBufferIsUpdatedInPlace) {
    Graph graph;
    const BufferHandle before = graph.carried_buffer("sum", {kCount * sizeof(std::uint32_t)});
    Pass add = graph.add_pass("add two");
    const BufferHandle sum = add.write(before, storage_read_write);
    add.execute([=](Resources& r) {
        gpu::Buffer& buffer = r.buffer(sum);
        Words values = buffer.read<std::uint32_t>();
        for (std::uint32_t& v : values) v += 2;
        buffer.write(std::span<const std::uint32_t>(values));
    });
    graph.output(sum);
    const CompiledGraph plan = compile(graph);
    executor.poison(true);
    for (std::uint32_t run = 1; run <= 3; ++run) {
        executor.run(plan);
        EXPECT_EQ(executor.read<std::uint32_t>(sum), Words(kCount, 2 * run));
    }
    EXPECT_EQ(executor.history().bytes(), kCount * sizeof(std::uint32_t)) << "one buffer, not two";
    // A second graph only reads the buffer.
    Graph reader;
    const BufferHandle seen = reader.carried_buffer("sum", {kCount * sizeof(std::uint32_t)});
    Words values;
    Pass look = reader.add_pass("look");
    look.read(seen, transfer_read);
    look.keep();
    look.execute([&](Resources& r) { values = r.buffer(seen).read<std::uint32_t>(); });
    const CompiledGraph reading = compile(reader);
    executor.run(reading);
    EXPECT_EQ(values, Words(kCount, 6));
    executor.run(plan);
    EXPECT_EQ(executor.read<std::uint32_t>(sum), Words(kCount, 8)) << "reading changes nothing";
    executor.history().invalidate("camera cut");
    executor.run(plan);
    EXPECT_EQ(executor.read<std::uint32_t>(sum), Words(kCount, 2));
    EXPECT_THROW(graph.history_buffer("sum", {16}), Error);
}

TEST_F(GraphTest, HistoryOutlivesAGraphButNotAResize) {
    const auto run = [&](std::uint32_t count) {
        Graph graph;
        const auto history = graph.history_buffer("counter", {count * sizeof(std::uint32_t)});
        const BufferHandle now = add_step(graph, "count", history.previous, history.now);
        graph.output(now);
        executor.run(compile(graph));
        return executor.read<std::uint32_t>(now)[0];
    };
    EXPECT_EQ(run(kCount), 1u);
    EXPECT_EQ(run(kCount), 2u);
    EXPECT_EQ(run(2 * kCount), 1u);
    EXPECT_EQ(run(2 * kCount), 2u);
}

TEST_F(GraphTest, AFailedRunLeavesHistoryUnchanged) {
    bool fail = false;
    Graph graph;
    const auto history = graph.history_buffer("counter", {kCount * sizeof(std::uint32_t)});
    const BufferHandle now = add_step(graph, "count", history.previous, history.now);
    Pass pass = graph.add_pass("fails");
    pass.read(now, storage_read);
    pass.keep();
    pass.execute([&](Resources&) {
        if (fail) throw Error("pass 'fails'", "on purpose");
    });
    graph.output(now);
    const CompiledGraph plan = compile(graph);
    executor.run(plan);
    fail = true;
    EXPECT_EQ(error_message([&] { executor.run(plan); }), "pass 'fails': on purpose");
    fail = false;
    executor.run(plan);
    EXPECT_EQ(executor.read<std::uint32_t>(now), Words(kCount, 2));
}

TEST_F(GraphTest, TextureHistorySwaps) {
    Graph graph;
    const auto history = graph.history_texture("t", {.width = 2, .height = 1, .format = GL_R32F});
    float seen = -1, value = 1;
    Pass pass = graph.add_pass("p");
    pass.read(history.previous, transfer_read);
    const TextureHandle now = pass.write(history.now, transfer_write);
    pass.execute([&, now](Resources& r) {
        seen = r.texture(history.previous).read_float()[1];
        r.texture(now).clear(value);
    });
    graph.output(now);
    const CompiledGraph plan = compile(graph);
    executor.run(plan);
    EXPECT_EQ(seen, 0.f);
    value = 2;
    executor.run(plan);
    EXPECT_EQ(seen, 1.f);
    EXPECT_EQ(executor.texture(now).read_float(), (std::vector<float>{2, 2}));
}

TEST_F(GraphTest, DrawsIntoTransients) {
    Graph graph;
    const gpu::TextureDesc desc{.width = 8, .height = 4};
    Pass draw = graph.add_pass("draw");
    const TextureHandle color = draw.write(graph.create_texture("color", desc), color_attachment);
    const TextureHandle depth = draw.write(
        graph.create_texture("depth", {.width = 8, .height = 4, .format = GL_DEPTH_COMPONENT32F}), depth_attachment);
    draw.execute([=](Resources& r) {
        const gpu::Framebuffer& target = r.framebuffer({color}, depth);
        EXPECT_EQ(&target, &r.framebuffer({color}, depth)) << "made once";
        target.bind();
        target.clear_color(0, 0, 0, 0, 0);
        target.clear_depth(1);
        const gpu::Program& program = r.programs().graphics(
            {"corner",
             "void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4 - 1, 0.5, 1); }\n"},
            {"red", "out vec4 color;\nvoid main() { color = vec4(1, 0, 0, 1); }\n"});
        EXPECT_FALSE(glIsEnabled(GL_DEPTH_TEST)) << "passes that draw start from the default state";
        glEnable(GL_DEPTH_TEST);
        program.draw(GL_TRIANGLES, 3);
    });
    Pass copy = graph.add_pass("copy");
    copy.read(color, texture_read, "color");
    copy.read(depth, texture_read, "depth");
    const TextureHandle result = copy.write(graph.create_texture("result", desc), image_write, "result");
    copy.execute([=](Resources& r) {
        const gpu::Program& program = r.compute({"copy", R"(
layout(local_size_x = 8, local_size_y = 4) in;
uniform sampler2D color;
uniform sampler2D depth;
layout(rgba32f) writeonly uniform image2D result;
void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    imageStore(result, p, texelFetch(color, p, 0) + vec4(0, texelFetch(depth, p, 0).r, 0, 0));
})"});
        program.dispatch(1);
    });
    graph.output(result);
    const CompiledGraph plan = compile(graph);
    for (int run = 0; run < 2; ++run) {
        executor.run(plan);
        const std::vector<float> pixels = executor.texture(result).read_float();
        for (std::size_t i = 0; i < pixels.size(); i += 4) {
            ASSERT_EQ(pixels[i], 1.f);
            ASSERT_EQ(pixels[i + 1], 0.75f);
        }
    }
}

TEST_F(GraphTest, AShaderNameThatTheProgramLacksIsAnErrorOfPassAndResource) {
    gpu::Buffer source = ramp();
    Graph graph;
    Pass pass = graph.add_pass("misspelt");
    pass.read(graph.import_buffer("ramp", source), storage_read, "Inn");
    pass.keep();
    pass.execute([](Resources& r) { r.compute(kAddOne).dispatch(1); });
    EXPECT_EQ(error_message([&] { executor.run(compile(graph)); }),
              "pass 'misspelt': binds 'ramp' to 'Inn', which add one does not declare");
}

TEST_F(GraphTest, PoisonRevealsUnwrittenValues) {
    Graph graph;
    Pass idle = graph.add_pass("writes nothing");
    const BufferHandle buffer = idle.write(fresh(graph, "b"), storage_write);
    const TextureHandle texture = idle.write(graph.create_texture("t", {.width = 2, .height = 1}), image_write);
    idle.execute([](Resources&) {});
    graph.output(buffer);
    graph.output(texture);
    executor.poison(true);
    executor.run(compile(graph));
    EXPECT_EQ(executor.read<std::uint32_t>(buffer), Words(kCount, 0xffffffffu));
    for (const float value : executor.texture(texture).read_float()) EXPECT_TRUE(std::isnan(value));
}

TEST_F(GraphTest, UndeclaredUsesAreErrors) {
    Graph graph;
    gpu::Buffer source = ramp();
    const BufferHandle undeclared = graph.import_buffer("secret", source);
    Pass pass = graph.add_pass("curious");
    pass.keep();
    pass.execute([=](Resources& r) { r.buffer(undeclared); });
    EXPECT_EQ(error_message([&] { executor.run(compile(graph)); }),
              "pass 'curious': uses 'secret' without having declared it");
    EXPECT_EQ(executor.buffer(undeclared).id(), source.id()) << "an import can be read at any time";
}

TEST_F(GraphTest, OnlyOutputsOfTheLastGraphCanBeRead) {
    gpu::Buffer source = ramp();
    Graph graph;
    const BufferHandle imported = graph.import_buffer("ramp", source);
    const BufferHandle middle = add_step(graph, "one", imported, fresh(graph, "middle"));
    const BufferHandle end = add_step(graph, "two", middle, fresh(graph, "end"));
    graph.output(end);
    EXPECT_ANY_THROW(executor.buffer(end)) << "nothing ran";
    executor.run(compile(graph));
    EXPECT_NO_THROW(executor.buffer(end));
    EXPECT_EQ(error_message([&] { executor.buffer(middle); }), "output: 'middle' is not an output");
    Graph empty;
    executor.run(compile(empty));
    EXPECT_EQ(error_message([&] { executor.buffer(end); }), "output: is not of the graph that ran last");
}

TEST_F(GraphTest, APassWithoutFunctionIsAnError) {
    Graph graph;
    graph.add_pass("hollow").keep();
    EXPECT_EQ(error_message([&] { executor.run(compile(graph)); }), "pass 'hollow': has no execute function");
}

TEST_F(GraphTest, TimesAddUpByName) {
    gpu::Buffer source = ramp();
    Graph graph;
    const BufferHandle imported = graph.import_buffer("ramp", source);
    const BufferHandle a = add_step(graph, "step", imported, fresh(graph, "a"));
    const BufferHandle b = add_step(graph, "step", a, fresh(graph, "b"));
    graph.output(add_step(graph, "end", b, fresh(graph, "c")));
    const CompiledGraph plan = compile(graph);
    executor.run(plan);
    EXPECT_TRUE(executor.times().empty()) << "off at first";
    executor.measure(true);
    for (int i = 0; i < 3; ++i) executor.run(plan);
    ASSERT_EQ(executor.times().size(), 2u);
    EXPECT_EQ(executor.times()[0].name, "step");
    EXPECT_EQ(executor.times()[0].count, 6u);
    EXPECT_GT(executor.times()[0].seconds, 0.0);
    EXPECT_EQ(executor.times()[1].count, 3u);
    executor.reset_times();
    EXPECT_TRUE(executor.times().empty());
}

}  // namespace
}  // namespace halflight::graph
