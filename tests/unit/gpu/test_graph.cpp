// Tests the render graph without a GPU: declaration, culling, order, lifetimes, aliasing, barriers, history, dot.
#include <gtest/gtest.h>

#include <algorithm>

#include "engine/graph/compile.h"
#include "tests/support/error_message.h"

namespace halflight::graph {
namespace {

using enum Access;

std::vector<std::string> order(const CompiledGraph& plan) {
    std::vector<std::string> names;
    for (const PlannedPass& pass : plan.passes) names.push_back(pass.name);
    return names;
}

std::vector<std::string> culled(const CompiledGraph& plan) {
    std::vector<std::string> names;
    for (const CulledPass& pass : plan.culled) names.push_back(pass.name);
    return names;
}

using Names = std::vector<std::string>;

/// Adds a pass that reads some buffers and writes a new one.
BufferHandle add(Graph& graph, const std::string& name, std::initializer_list<BufferHandle> reads,
                 std::size_t bytes = 1024) {
    Pass pass = graph.add_pass(name);
    for (const BufferHandle handle : reads) pass.read(handle, storage_read);
    return pass.write(graph.create_buffer(name + "'s", {bytes}), storage_write);
}

// --- Culling and order ----------------------------------------------------------------------------------------------

TEST(GraphCulling, KeepsPassesThatReachAnOutputInDeclaredOrder) {
    Graph graph;
    const BufferHandle a = add(graph, "a", {});
    const BufferHandle dead = add(graph, "dead", {a});
    const BufferHandle b = add(graph, "b", {a});
    add(graph, "deader", {dead, b});
    graph.output(add(graph, "c", {b}));
    const CompiledGraph plan = compile(graph);
    EXPECT_EQ(order(plan), (Names{"a", "b", "c"}));
    EXPECT_EQ(culled(plan), (Names{"dead", "deader"}));
    EXPECT_EQ(plan.culled[0].reason, "only culled passes read 'dead's': 'deader'");
    EXPECT_EQ(plan.culled[1].reason, "nothing reads 'deader's'");
}

TEST(GraphCulling, WithoutOutputsNothingRuns) {
    Graph graph;
    add(graph, "b", {add(graph, "a", {})});
    graph.add_pass("idle");
    const CompiledGraph plan = compile(graph);
    EXPECT_TRUE(plan.passes.empty());
    EXPECT_EQ(plan.culled.size(), 3u);
    EXPECT_EQ(plan.culled[2].reason, "writes nothing and is not kept");
    EXPECT_EQ(plan.transient_bytes, 0u);
}

TEST(GraphCulling, AKeptPassKeepsItsInputs) {
    Graph graph;
    const BufferHandle a = add(graph, "a", {});
    Pass report = graph.add_pass("report");
    report.read(a, transfer_read);
    report.keep();
    EXPECT_EQ(order(compile(graph)), (Names{"a", "report"}));
}

TEST(GraphCulling, AnUpdateInPlaceNeedsThePreviousVersion) {
    Graph graph;
    const BufferHandle first = add(graph, "first", {});
    Pass update = graph.add_pass("update");
    const BufferHandle second = update.write(first, storage_read_write);
    Pass overwrite = graph.add_pass("overwrite");
    const BufferHandle third = overwrite.write(second, storage_write);
    graph.output(third);
    const CompiledGraph plan = compile(graph);
    EXPECT_EQ(order(plan), (Names{"overwrite"})) << "storage_write loses what was there";

    Graph kept;
    const BufferHandle one = add(kept, "first", {});
    Pass keeping = kept.add_pass("update");
    kept.output(keeping.write(one, storage_read_write));
    EXPECT_EQ(order(compile(kept)), (Names{"first", "update"}));
}

TEST(GraphCulling, AttachmentsKeepEarlierDraws) {
    Graph graph;
    Pass clear = graph.add_pass("clear");
    const TextureHandle cleared = clear.write(graph.create_texture("t", {.width = 8, .height = 8}), color_attachment);
    Pass draw = graph.add_pass("draw");
    graph.output(draw.write(cleared, color_attachment));
    EXPECT_EQ(order(compile(graph)), (Names{"clear", "draw"}));
}

TEST(GraphCulling, OneNeededResultKeepsAPassAndAllItWrites) {
    Graph graph;
    Pass pass = graph.add_pass("two results");
    const BufferHandle wanted = pass.write(graph.create_buffer("wanted", {64}), storage_write);
    const BufferHandle other = pass.write(graph.create_buffer("other", {64}), storage_write);
    graph.output(wanted);
    const CompiledGraph plan = compile(graph);
    EXPECT_TRUE(plan.resources[other.resource].used) << "the kernel writes it, so it needs memory";
    EXPECT_NE(plan.resources[other.resource].slot, plan.resources[wanted.resource].slot);
}

// --- Wrong declarations ---------------------------------------------------------------------------------------------

TEST(GraphErrors, StaleHandlesNamePassResourceAndWriter) {
    Graph graph;
    const BufferHandle old = add(graph, "first", {});
    Pass second = graph.add_pass("second");
    (void)second.write(old, storage_read_write);
    Pass third = graph.add_pass("third");
    EXPECT_EQ(error_message([&] { third.read(old, storage_read); }),
              "pass 'third': uses 'first's' as it was before pass 'second' wrote it");
    EXPECT_EQ(error_message([&] { (void)third.write(old, storage_write); }),
              "pass 'third': uses 'first's' as it was before pass 'second' wrote it");
    EXPECT_EQ(error_message([&] { graph.output(old); }),
              "output: uses 'first's' as it was before pass 'second' wrote it");
}

TEST(GraphErrors, ReadingAnUnwrittenResource) {
    Graph graph;
    const BufferHandle empty = graph.create_buffer("empty", {64});
    Pass pass = graph.add_pass("reader");
    EXPECT_EQ(error_message([&] { pass.read(empty, storage_read); }),
              "pass 'reader': reads 'empty', which nobody has written");
    EXPECT_EQ(error_message([&] { (void)pass.write(empty, storage_read_write); }),
              "pass 'reader': writes 'empty' by storage_read_write: nobody has written it before");
    EXPECT_EQ(error_message([&] { graph.output(empty); }), "output: nobody has written 'empty'");
}

TEST(GraphErrors, AClosedPassCannotMakeACycle) {
    Graph graph;
    Pass first = graph.add_pass("first");
    const BufferHandle a = first.write(graph.create_buffer("a", {64}), storage_write);
    Pass second = graph.add_pass("second");
    second.read(a, storage_read);
    const BufferHandle b = second.write(graph.create_buffer("b", {64}), storage_write);
    EXPECT_EQ(error_message([&] { first.read(b, storage_read); }),
              "pass 'first': declares a use after pass 'second' was added");
}

TEST(GraphErrors, APassUsesAResourceWithOneAccess) {
    Graph graph;
    const BufferHandle a = add(graph, "a", {});
    Pass pass = graph.add_pass("p");
    pass.read(a, storage_read);
    pass.read(a, texture_read);
    EXPECT_NE(error_message([&] { (void)pass.write(a, storage_write); }).find("it reads it, too"), std::string::npos);
    Pass other = graph.add_pass("q");
    const BufferHandle b = other.write(a, storage_write);
    EXPECT_EQ(error_message([&] { other.read(b, storage_read); }), "pass 'q': reads 'a's', which it writes itself");
    EXPECT_NE(error_message([&] { (void)other.write(b, storage_write); }).find("it has written it before"),
              std::string::npos);
}

TEST(GraphErrors, AccessMustFitResource) {
    Graph graph;
    const BufferHandle buffer = add(graph, "a", {});
    const TextureHandle texture = graph.create_texture("t", {});
    Pass pass = graph.add_pass("p");
    EXPECT_EQ(error_message([&] { pass.read(buffer, storage_write); }), "pass 'p': reads 'a's' by storage_write");
    EXPECT_EQ(error_message([&] { (void)pass.write(buffer, storage_read); }),
              "pass 'p': writes 'a's' by storage_read: that is a way to read");
    EXPECT_EQ(error_message([&] { (void)pass.write(buffer, color_attachment); }),
              "pass 'p': writes 'a's' by color_attachment: it is a buffer");
    EXPECT_EQ(error_message([&] { (void)pass.write(texture, storage_write); }),
              "pass 'p': writes 't' by storage_write: it is a texture");
}

TEST(GraphErrors, ShaderNamesMustFitTheAccess) {
    Graph graph;
    const BufferHandle buffer = add(graph, "a", {});
    Pass pass = graph.add_pass("p");
    EXPECT_EQ(error_message([&] { pass.read(buffer, transfer_read, "A"); }),
              "pass 'p': names 'a's' for shaders, but uses it by transfer_read");
    EXPECT_EQ(error_message([&] { pass.read(buffer, texture_read, "a"); }),
              "pass 'p': reads 'a's' by texture_read without a texel format");
    EXPECT_EQ(error_message([&] {
                  pass.read(buffer, storage_read, {"A", GL_R32F});
              }),
              "pass 'p': reads 'a's' by storage_read with a texel format");
}

TEST(GraphErrors, InvalidHandles) {
    Graph graph, other;
    const BufferHandle theirs = add(other, "theirs", {});
    Pass pass = graph.add_pass("p");
    EXPECT_EQ(error_message([&] { pass.read(BufferHandle(), storage_read); }), "pass 'p': uses an empty handle");
    EXPECT_EQ(error_message([&] { pass.read(theirs, storage_read); }),
              "pass 'p': uses a handle of another graph (resource 0)");
}

TEST(GraphErrors, OutputsCannotBeOverwritten) {
    Graph graph;
    const BufferHandle a = add(graph, "a", {});
    graph.output(a);
    Pass pass = graph.add_pass("p");
    EXPECT_NE(error_message([&] { (void)pass.write(a, storage_write); }).find("it is an output already"),
              std::string::npos);
}

// --- Lifetimes and aliasing -----------------------------------------------------------------------------------------

TEST(GraphMemory, LifetimesSpanFirstToLastUse) {
    Graph graph;
    const BufferHandle a = add(graph, "a", {});
    const BufferHandle b = add(graph, "b", {a});
    const BufferHandle c = add(graph, "c", {b});
    const BufferHandle d = add(graph, "d", {c, a});
    graph.output(d);
    const CompiledGraph plan = compile(graph);
    EXPECT_EQ(plan.resources[a.resource].first, 0u);
    EXPECT_EQ(plan.resources[a.resource].last, 3u);
    EXPECT_EQ(plan.resources[b.resource].first, 1u);
    EXPECT_EQ(plan.resources[b.resource].last, 2u);
    EXPECT_EQ(plan.resources[d.resource].last, 4u) << "outputs live beyond the last pass";
}

TEST(GraphMemory, AChainNeedsTwoSlots) {
    Graph graph;
    BufferHandle last = add(graph, "0", {});
    for (int i = 1; i < 10; ++i) last = add(graph, std::to_string(i), {last});
    graph.output(last);
    const CompiledGraph plan = compile(graph);
    EXPECT_EQ(plan.slots.size(), 2u);
    EXPECT_EQ(plan.transient_bytes, 10u * 1024);
    EXPECT_EQ(plan.slot_bytes, 2u * 1024);
    const CompiledGraph apart = compile(graph, {.alias = false});
    EXPECT_EQ(apart.slots.size(), 10u);
    EXPECT_EQ(apart.slot_bytes, apart.transient_bytes);
}

TEST(GraphMemory, ResourcesOfASlotNeverOverlap) {
    Graph graph;
    std::vector<BufferHandle> handles{add(graph, "0", {}, 100)};
    std::uint32_t random = 1;
    const auto pick = [&](std::size_t n) {
        random = random * 1664525u + 1013904223u;
        return static_cast<std::size_t>(random >> 8) % n;
    };
    for (int i = 1; i < 60; ++i) {
        const BufferHandle one = handles[pick(handles.size())], two = handles[pick(handles.size())];
        handles.push_back(add(graph, std::to_string(i), {one, two}, 16 * (1 + pick(100))));
        if (pick(10) == 0) graph.output(handles.back());
    }
    graph.output(handles.back());
    const CompiledGraph plan = compile(graph);
    EXPECT_LT(plan.slot_bytes, plan.transient_bytes);
    EXPECT_GT(plan.slot_bytes, 0u);
    for (const Slot& slot : plan.slots) {
        for (std::size_t i = 0; i < slot.tenants.size(); ++i) {
            const PlannedResource& tenant = plan.resources[slot.tenants[i]];
            EXPECT_GE(slot.buffer.bytes, tenant.node.buffer.bytes);
            if (i == 0) continue;
            EXPECT_LT(plan.resources[slot.tenants[i - 1]].last, tenant.first);
        }
    }
}

TEST(GraphMemory, TheSmallestFittingSlotIsTaken) {
    Graph graph;
    const BufferHandle small = add(graph, "small", {}, 100);
    const BufferHandle large = add(graph, "large", {}, 1000);
    const BufferHandle sum = add(graph, "sum", {small, large}, 10);
    const BufferHandle fits_small = add(graph, "fits small", {sum}, 90);
    const BufferHandle grows = add(graph, "grows", {fits_small}, 2000);
    graph.output(add(graph, "end", {grows}, 10));
    const CompiledGraph plan = compile(graph);
    EXPECT_EQ(plan.resources[fits_small.resource].slot, plan.resources[small.resource].slot);
    EXPECT_EQ(plan.resources[grows.resource].slot, plan.resources[large.resource].slot);
    EXPECT_EQ(plan.slots[plan.resources[large.resource].slot].buffer.bytes, 2000u);
}

TEST(GraphMemory, TexturesShareOnlyWithEqualTextures) {
    Graph graph;
    const auto stage = [&](const char* name, TextureHandle source, gpu::TextureDesc desc) {
        Pass pass = graph.add_pass(name);
        if (source) pass.read(source, texture_read);
        return pass.write(graph.create_texture(name, desc), image_write);
    };
    const TextureHandle a = stage("a", {}, {.width = 64, .height = 64});
    const TextureHandle b = stage("b", a, {.width = 64, .height = 64});
    const TextureHandle half = stage("half", b, {.width = 64, .height = 64, .format = GL_RGBA16F});
    const TextureHandle again = stage("again", half, {.width = 64, .height = 64});
    graph.output(again);
    const CompiledGraph plan = compile(graph);
    EXPECT_EQ(plan.resources[again.resource].slot, plan.resources[a.resource].slot);
    EXPECT_EQ(plan.slots.size(), 3u);
    EXPECT_EQ(plan.slot_bytes, 64u * 64 * (16 + 16 + 8));
}

TEST(GraphMemory, PlansAreDeterministic) {
    const auto plan = [] {
        Graph graph;
        const BufferHandle a = add(graph, "a", {}, 10), b = add(graph, "b", {a}, 20);
        graph.output(add(graph, "c", {a, b}, 30));
        return to_dot(compile(graph));
    };
    EXPECT_EQ(plan(), plan());
}

TEST(GraphMemory, FreshResourcesHaveNoContentYet) {
    Graph graph;
    Pass first = graph.add_pass("first");
    const BufferHandle a = first.write(graph.create_buffer("a", {64}), storage_write);
    Pass second = graph.add_pass("second");
    const BufferHandle b = second.write(a, storage_read_write);
    Pass third = graph.add_pass("third");
    third.read(b, storage_read);
    third.keep();
    const CompiledGraph plan = compile(graph);
    EXPECT_EQ(plan.passes[0].fresh, std::vector{a.resource});
    EXPECT_TRUE(plan.passes[1].fresh.empty());
    EXPECT_TRUE(plan.passes[2].fresh.empty());
}

// --- Barriers -------------------------------------------------------------------------------------------------------

/// Returns the barrier bits before the second pass, if the first writes a resource and the second uses it.
template <class H>
GLbitfield barrier_between(Access first, Access second) {
    Graph graph;
    H handle;
    if constexpr (std::is_same_v<H, BufferHandle>) {
        handle = graph.create_buffer("r", {64});
    } else {
        handle = graph.create_texture("r", {});
    }
    Pass one = graph.add_pass("one");
    handle = one.write(handle, first);
    one.keep();
    Pass two = graph.add_pass("two");
    two.keep();
    if (writes(second)) {
        (void)two.write(handle, second);
    } else {
        two.read(handle, second);
    }
    const CompiledGraph plan = compile(graph);
    EXPECT_EQ(plan.passes[0].barriers, 0u);
    return plan.passes[1].barriers;
}

TEST(GraphBarriers, FollowFromTheLaterAccess) {
    const auto buffer = barrier_between<BufferHandle>;
    EXPECT_EQ(buffer(storage_write, storage_read), GL_SHADER_STORAGE_BARRIER_BIT);
    EXPECT_EQ(buffer(storage_write, storage_read_write), GL_SHADER_STORAGE_BARRIER_BIT);
    EXPECT_EQ(buffer(storage_write, texture_read), GL_TEXTURE_FETCH_BARRIER_BIT);
    EXPECT_EQ(buffer(storage_write, uniform_read), GL_UNIFORM_BARRIER_BIT);
    EXPECT_EQ(buffer(storage_write, indirect_read), GL_COMMAND_BARRIER_BIT);
    EXPECT_EQ(buffer(storage_write, transfer_read), GL_BUFFER_UPDATE_BARRIER_BIT);
    EXPECT_EQ(buffer(storage_write, storage_write), GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
    EXPECT_EQ(buffer(transfer_write, storage_read), 0u);
    const auto texture = barrier_between<TextureHandle>;
    EXPECT_EQ(texture(image_write, texture_read), GL_TEXTURE_FETCH_BARRIER_BIT);
    EXPECT_EQ(texture(image_write, image_read), GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
    EXPECT_EQ(texture(color_attachment, image_read), 0u);
    EXPECT_EQ(texture(image_write, color_attachment), GL_FRAMEBUFFER_BARRIER_BIT);
    EXPECT_EQ(texture(image_write, transfer_read), GL_TEXTURE_UPDATE_BARRIER_BIT | GL_FRAMEBUFFER_BARRIER_BIT);
    EXPECT_EQ(texture(color_attachment, texture_read), 0u);
    EXPECT_EQ(texture(color_attachment, color_attachment), 0u);
}

TEST(GraphBarriers, AreIssuedOnceBeforeTheFirstUse) {
    Graph graph;
    const BufferHandle a = add(graph, "a", {});
    const BufferHandle b = add(graph, "b", {a});
    const BufferHandle c = add(graph, "c", {a});
    graph.output(add(graph, "d", {b, c}));
    const CompiledGraph plan = compile(graph, {.alias = false});
    EXPECT_EQ(plan.passes[1].barriers, GL_SHADER_STORAGE_BARRIER_BIT);
    EXPECT_EQ(plan.passes[2].barriers, 0u) << "a's writes were waited for before b";
    EXPECT_EQ(plan.passes[3].barriers, GL_SHADER_STORAGE_BARRIER_BIT);
}

TEST(GraphBarriers, AWriterWaitsForEarlierReaders) {
    Graph graph;
    Pass fill = graph.add_pass("fill");
    const BufferHandle a = fill.write(graph.create_buffer("a", {64}), transfer_write);
    const BufferHandle b = add(graph, "read", {a});
    Pass overwrite = graph.add_pass("overwrite");
    graph.output(overwrite.write(a, storage_write));
    graph.output(b);
    const CompiledGraph plan = compile(graph, {.alias = false});
    EXPECT_EQ(plan.passes.back().name, "overwrite");
    EXPECT_NE(plan.passes.back().barriers & GL_SHADER_STORAGE_BARRIER_BIT, 0u);
}

TEST(GraphBarriers, ResourcesOfASlotWaitForEachOther) {
    Graph graph;
    const BufferHandle a = add(graph, "a", {});
    Pass copy = graph.add_pass("copy a");
    copy.read(a, storage_read);
    copy.keep();
    Pass clear = graph.add_pass("clear b");
    const BufferHandle b = clear.write(graph.create_buffer("b", {1024}), transfer_write);
    graph.output(b);
    const CompiledGraph plan = compile(graph);
    ASSERT_EQ(plan.resources[a.resource].slot, plan.resources[b.resource].slot);
    EXPECT_EQ(plan.passes[2].barriers, GL_BUFFER_UPDATE_BARRIER_BIT);
    EXPECT_EQ(compile(graph, {.alias = false}).passes[2].barriers, 0u);
}

// --- History --------------------------------------------------------------------------------------------------------

TEST(GraphHistory, AReaderOfThePreviousVersionKeepsTheWriterOfTheCurrentOne) {
    Graph graph;
    const auto history = graph.history_buffer("visibility", {256});
    const BufferHandle result = add(graph, "use the past", {history.previous});
    graph.output(result);
    Pass write = graph.add_pass("write the present");
    (void)write.write(history.now, storage_write);
    const CompiledGraph plan = compile(graph);
    EXPECT_EQ(order(plan), (Names{"use the past", "write the present"}));
    EXPECT_EQ(plan.resources[history.now.resource].slot, PlannedResource::kNoSlot);
    EXPECT_EQ(plan.resources[history.previous.resource].slot, PlannedResource::kNoSlot);
    EXPECT_EQ(plan.transient_bytes, 1024u) << "only the result";
}

TEST(GraphHistory, WithoutAReaderItIsCulled) {
    Graph graph;
    const auto history = graph.history_texture("moments", {});
    Pass pass = graph.add_pass("write");
    (void)pass.write(history.now, image_write);
    EXPECT_EQ(culled(compile(graph)), (Names{"write"}));
}

TEST(GraphHistory, InvalidUses) {
    Graph graph;
    const auto history = graph.history_buffer("state", {256});
    EXPECT_EQ(error_message([&] { graph.history_buffer("state", {256}); }), "history 'state': is declared twice");
    Pass pass = graph.add_pass("p");
    EXPECT_EQ(error_message([&] { pass.read(history.now, storage_read); }),
              "pass 'p': reads 'state', which nobody has written");
    EXPECT_NE(error_message([&] { (void)pass.write(history.previous, storage_write); }).find("the past is only read"),
              std::string::npos);
    pass.read(history.previous, storage_read);
    pass.keep();
    EXPECT_EQ(error_message([&] { compile(graph); }), "history 'state': is read but never written");
}

// --- Dot ------------------------------------------------------------------------------------------------------------

TEST(GraphDot, ShowsPassesResourcesSlotsAndCulledPasses) {
    Graph graph;
    const BufferHandle a = add(graph, "the \"first\"", {});
    add(graph, "left out", {a});
    graph.output(add(graph, "last", {a}));
    const std::string dot = to_dot(compile(graph));
    for (const char* piece :
         {"digraph", "0. the \\\"first\\\"", "1. last", "left out", "style=dashed", "nothing reads 'left out's'",
          "slot 0", "slot 1", "r0v1 -> pass1", "storage_read", "peripheries=2", "transients: 2.0 KiB"}) {
        EXPECT_NE(dot.find(piece), std::string::npos) << piece << "\n" << dot;
    }
    EXPECT_EQ(std::count(dot.begin(), dot.end(), '{'), std::count(dot.begin(), dot.end(), '}'));
}

}  // namespace
}  // namespace halflight::graph
