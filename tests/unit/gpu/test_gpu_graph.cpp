// Tests the render graph on the software driver.
#include <epoxy/gl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
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
            const gpu::Program& program = r.kernel({kAddOne});
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

TEST_F(GraphTest, HistoryOutlivesGraphsButNotAResizeOrACut) {
    bool fail = false;
    const auto run = [&](std::uint32_t count) {
        Graph graph;
        const auto history = graph.history_buffer("counter", {count * sizeof(std::uint32_t)});
        const BufferHandle now = add_step(graph, "count", history.previous, history.now);
        Pass last = graph.add_pass("last");
        last.read(now, storage_read);
        last.keep();
        last.execute([&](Resources&) {
            if (fail) throw Error("last", "on purpose");
        });
        graph.output(now);
        const CompiledGraph plan = compile(graph);
        executor.run(plan);
        executor.run(plan);
        Words values = executor.read<std::uint32_t>(now);
        values.resize(kCount);
        EXPECT_EQ(values, Words(kCount, values[0]));
        return values[0];
    };
    EXPECT_EQ(run(kCount), 2u) << "zeros first, then the run before";
    EXPECT_EQ(run(kCount), 4u);
    EXPECT_EQ(executor.history().bytes(), 2 * kCount * sizeof(std::uint32_t));
    executor.history().invalidate("camera cut");
    EXPECT_EQ(executor.history().last_reason(), "camera cut");
    EXPECT_EQ(run(kCount), 2u);
    fail = true;
    EXPECT_THROW(run(kCount), Error);
    fail = false;
    EXPECT_EQ(run(kCount), 4u) << "a failed run leaves history unchanged";
    EXPECT_EQ(run(2 * kCount), 2u);
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
    Words values;
    const BufferHandle seen = reader.carried_buffer("sum", {kCount * sizeof(std::uint32_t)});
    Pass look = reader.add_pass("look");
    look.read(seen, transfer_read);
    look.keep();
    look.execute([&](Resources& r) { values = r.buffer(seen).read<std::uint32_t>(); });
    executor.run(compile(reader));
    EXPECT_EQ(values, Words(kCount, 6));
    executor.run(plan);
    EXPECT_EQ(executor.read<std::uint32_t>(sum), Words(kCount, 8)) << "reading changes nothing";
    executor.history().invalidate("camera cut");
    executor.run(plan);
    EXPECT_EQ(executor.read<std::uint32_t>(sum), Words(kCount, 2));
    EXPECT_THROW(graph.history_buffer("sum", {16}), Error);
}

TEST_F(GraphTest, DrawingStartsFromTheDefaultState) {
    Graph graph;
    const TextureHandle created = graph.create_texture("color", {.width = 2, .height = 1});
    Pass draw = graph.add_pass("draw");
    const TextureHandle color = draw.write(created, color_attachment);
    const TextureHandle depth = draw.write(
        graph.create_texture("depth", {.width = 2, .height = 1, .format = GL_DEPTH_COMPONENT32F}), depth_attachment);
    draw.execute([=](Resources& r) {
        const gpu::Framebuffer& target = r.framebuffer({color}, depth);
        EXPECT_EQ(&target, &r.framebuffer({color}, depth)) << "made once";
        target.bind();
        target.clear_color(0, 0, 0, 0, 0);
        target.clear_depth(1);
        const gpu::Program& program = r.programs().graphics(
            {"corner",
             "void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4 - 1, 0.5, 1); }\n"},
            {"red", "out vec4 color;\nvoid main() { color = vec4(1, gl_FragCoord.xz, 1); }\n"});
        EXPECT_FALSE(glIsEnabled(GL_DEPTH_TEST));
        glEnable(GL_DEPTH_TEST);
        program.draw(GL_TRIANGLES, 3);
    });
    graph.output(color);
    const CompiledGraph plan = compile(graph);
    for (int run = 0; run < 2; ++run) {
        executor.run(plan);
        EXPECT_EQ(executor.texture(color).read_float(), (std::vector<float>{1, 0.5f, 0.75f, 1, 1, 1.5f, 0.75f, 1}));
    }
}

TEST_F(GraphTest, WrongPassesAreNamed) {
    gpu::Buffer source = ramp();
    const struct {
        const char *name, *message;
        std::function<void(Pass&, BufferHandle)> declare;
    } cases[] = {
        {"hollow", "has no execute function", [](Pass&, BufferHandle) {}},
        {"bare", "has declared no kernel", [](Pass& p, BufferHandle) { p.execute([](Resources& r) { r.kernel(); }); }},
        {"curious", "'ramp' without having declared it",
         [](Pass& p, BufferHandle ramp) { p.execute([=](Resources& r) { r.buffer(ramp); }); }},
        {"misspelt", "'ramp' to 'Inn', which add one does not declare",
         [](Pass& p, BufferHandle ramp) {
             p.read(ramp, storage_read, "Inn");
             p.execute([](Resources& r) { r.kernel({kAddOne}).dispatch(1); });
         }},
        {"wordy", "'ramp' to 'main', which add one does not declare", [](Pass& p, BufferHandle ramp) {
             p.read(ramp, storage_read, "main");
             p.execute([](Resources& r) { r.kernel({kAddOne}).dispatch(1); });
         }}};
    for (const auto& c : cases) {
        Graph graph;
        const BufferHandle imported = graph.import_buffer("ramp", source);
        Pass pass = graph.add_pass(c.name);
        pass.keep();
        c.declare(pass, imported);
        const std::string message = error_message([&] { executor.run(compile(graph)); });
        EXPECT_TRUE(message.starts_with(fmt::format("pass '{}': ", c.name)) && message.ends_with(c.message)) << message;
        EXPECT_EQ(executor.buffer(imported).id(), source.id()) << "an import can be read at any time";
    }
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
    EXPECT_NE(error_message([&] { executor.buffer(middle); }).find("'middle'"), std::string::npos);
    Graph empty;
    executor.run(compile(empty));
    EXPECT_THROW(executor.buffer(end), Error);
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
