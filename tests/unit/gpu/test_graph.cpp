// Tests the render graph without a GPU: declaration, culling, order, lifetimes, aliasing, barriers, history, dot.
#include <gtest/gtest.h>

#include <algorithm>

#include "engine/graph/compile.h"
#include "tests/support/error_message.h"

namespace halflight::graph {
namespace {

using enum Access;

using Names = std::vector<std::string>;

/// Returns the names of planned or culled passes.
Names names_of(const auto& passes) {
    Names names;
    for (const auto& pass : passes) names.push_back(pass.name);
    return names;
}

/// Expects an Error that begins with the place of the wrong use, and says what is wrong.
void expect_error(auto&& use, const std::string& place, const std::string& what) {
    const std::string message = error_message(use);
    EXPECT_TRUE(message.starts_with(place + ": ") && message.find(what) != std::string::npos)
        << place << ": ... " << what << ", not " << message;
}

/// Adds a pass that reads some buffers and writes a new one.
BufferHandle add(Graph& graph, const std::string& name, std::initializer_list<BufferHandle> reads,
                 std::size_t bytes = 1024) {
    Pass pass = graph.add_pass(name);
    for (const BufferHandle handle : reads) pass.read(handle, storage_read);
    return pass.write(graph.create_buffer(name + "'s", {bytes}), storage_write);
}

/// Adds a pass that writes a resource.
auto write(Graph& graph, const std::string& name, auto handle, Access access) {
    return graph.add_pass(name).write(handle, access);
}

/// Adds a pass that reads a resource and is kept.
void look(Graph& graph, const std::string& name, auto handle, Access access) {
    Pass pass = graph.add_pass(name);
    pass.read(handle, access);
    pass.keep();
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
    EXPECT_EQ(names_of(plan.passes), (Names{"a", "b", "c"}));
    EXPECT_EQ(names_of(plan.culled), (Names{"dead", "deader"}));
    EXPECT_NE(plan.culled[0].reason.find("'deader'"), std::string::npos);
}

TEST(GraphCulling, AnUpdateInPlaceNeedsThePreviousVersion) {
    Graph graph, kept;
    const BufferHandle updated = write(graph, "update", add(graph, "first", {}), storage_read_write);
    graph.output(write(graph, "overwrite", updated, storage_write));
    EXPECT_EQ(names_of(compile(graph).passes), (Names{"overwrite"})) << "storage_write loses what was there";
    kept.output(write(kept, "update", add(kept, "first", {}), storage_read_write));
    EXPECT_EQ(names_of(compile(kept).passes), (Names{"first", "update"}));
}

TEST(GraphCulling, AttachmentsKeepEarlierDraws) {
    Graph graph;
    const auto cleared = write(graph, "clear", graph.create_texture("t", {.width = 8, .height = 8}), color_attachment);
    graph.output(write(graph, "draw", cleared, color_attachment));
    EXPECT_EQ(names_of(compile(graph).passes), (Names{"clear", "draw"}));
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

TEST(GraphErrors, NamePassAndResource) {
    Graph graph, other;
    const BufferHandle old = add(graph, "old", {}), a = add(graph, "a", {}), theirs = add(other, "theirs", {});
    const BufferHandle empty = graph.create_buffer("empty", {64});
    const TextureHandle texture = graph.create_texture("t", {});
    Pass q = graph.add_pass("q");
    const BufferHandle now = q.write(old, storage_read_write);
    expect_error([&] { q.read(now, storage_read); }, "pass 'q'", "'old's', which it writes itself");
    expect_error([&] { (void)q.write(now, storage_write); }, "pass 'q'", "it has written it before");
    Pass p = graph.add_pass("p");
    p.read(a, storage_read);
    p.read(a, texture_read);
    expect_error([&] { (void)p.write(a, storage_write); }, "pass 'p'", "it reads it, too");
    expect_error([&] { p.read(old, storage_read); }, "pass 'p'", "'old's' as it was before pass 'q' wrote it");
    expect_error([&] { (void)p.write(old, storage_write); }, "pass 'p'", "'old's' as it was before pass 'q'");
    expect_error([&] { graph.output(old); }, "output", "'old's' as it was before pass 'q'");
    expect_error([&] { p.read(empty, storage_read); }, "pass 'p'", "reads 'empty', which nobody has written");
    expect_error([&] { (void)p.write(empty, storage_read_write); }, "pass 'p'", "nobody has written it before");
    expect_error([&] { graph.output(empty); }, "output", "nobody has written 'empty'");
    expect_error([&] { p.read(BufferHandle(), storage_read); }, "pass 'p'", "an empty handle");
    expect_error([&] { p.read(theirs, storage_read); }, "pass 'p'", "a handle of another graph (resource 0)");
    expect_error([&] { p.read(now, storage_write); }, "pass 'p'", "reads 'old's' by storage_write");
    expect_error([&] { (void)p.write(now, storage_read); }, "pass 'p'", "writes 'old's' by storage_read");
    expect_error([&] { (void)p.write(now, color_attachment); }, "pass 'p'", "by color_attachment: it is a buffer");
    expect_error([&] { (void)p.write(texture, storage_write); }, "pass 'p'", "by storage_write: it is a texture");
    expect_error([&] { p.read(now, transfer_read, "A"); }, "pass 'p'", "names 'old's' for shaders");
    expect_error([&] { p.read(now, texture_read, "a"); }, "pass 'p'", "without a texel format");
    const auto formatted = [&] { p.read(now, storage_read, {"A", GL_R32F}); };
    expect_error(formatted, "pass 'p'", "with a texel format");
    graph.output(now);
    expect_error([&] { (void)p.write(now, storage_write); }, "pass 'p'", "it is an output already");
    // A pass that is closed cannot make a cycle.
    expect_error([&] { q.read(a, storage_read); }, "pass 'q'", "declares a use after pass 'p' was added");
}

// --- Lifetimes and aliasing -----------------------------------------------------------------------------------------

TEST(GraphMemory, LifetimesSpanFirstToLastUse) {
    Graph graph;
    const BufferHandle a = add(graph, "a", {}), b = add(graph, "b", {a}), c = add(graph, "c", {b}),
                       d = add(graph, "d", {c, a});
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

TEST(GraphMemory, FreshResourcesHaveNoContentYet) {
    Graph graph;
    const BufferHandle a = write(graph, "first", graph.create_buffer("a", {64}), storage_write);
    look(graph, "third", write(graph, "second", a, storage_read_write), storage_read);
    const CompiledGraph plan = compile(graph);
    EXPECT_EQ(plan.passes.at(0).fresh, std::vector{a.resource});
    EXPECT_TRUE(plan.passes.at(1).fresh.empty());
    EXPECT_TRUE(plan.passes.at(2).fresh.empty());
}

// --- Barriers -------------------------------------------------------------------------------------------------------

/// Returns the barrier bits before the second pass, if the first writes a resource and the second uses it.
GLbitfield barriers_between(Graph& graph, auto created, Access first, Access second) {
    Pass one = graph.add_pass("one");
    const auto handle = one.write(created, first);
    one.keep();
    if (writes(second)) {
        Pass two = graph.add_pass("two");
        (void)two.write(handle, second);
        two.keep();
    } else {
        look(graph, "two", handle, second);
    }
    const CompiledGraph plan = compile(graph);
    EXPECT_EQ(plan.passes[0].barriers, 0u);
    return plan.passes[1].barriers;
}

TEST(GraphBarriers, FollowFromTheLaterAccess) {
    const auto buffer = [](Access first, Access second) {
        Graph graph;
        return barriers_between(graph, graph.create_buffer("r", {64}), first, second);
    };
    EXPECT_EQ(buffer(storage_write, storage_read), GL_SHADER_STORAGE_BARRIER_BIT);
    EXPECT_EQ(buffer(storage_write, storage_read_write), GL_SHADER_STORAGE_BARRIER_BIT);
    EXPECT_EQ(buffer(storage_write, texture_read), GL_TEXTURE_FETCH_BARRIER_BIT);
    EXPECT_EQ(buffer(storage_write, uniform_read), GL_UNIFORM_BARRIER_BIT);
    EXPECT_EQ(buffer(storage_write, indirect_read), GL_COMMAND_BARRIER_BIT);
    EXPECT_EQ(buffer(storage_write, transfer_read), GL_BUFFER_UPDATE_BARRIER_BIT);
    EXPECT_EQ(buffer(storage_write, storage_write), GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
    EXPECT_EQ(buffer(transfer_write, storage_read), 0u);
    const auto texture = [](Access first, Access second) {
        Graph graph;
        return barriers_between(graph, graph.create_texture("r", {}), first, second);
    };
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
    const BufferHandle a = write(graph, "fill", graph.create_buffer("a", {64}), transfer_write);
    graph.output(add(graph, "read", {a}));
    graph.output(write(graph, "overwrite", a, storage_write));
    const CompiledGraph plan = compile(graph, {.alias = false});
    EXPECT_EQ(plan.passes.back().name, "overwrite");
    EXPECT_NE(plan.passes.back().barriers & GL_SHADER_STORAGE_BARRIER_BIT, 0u);
}

TEST(GraphBarriers, ResourcesOfASlotWaitForEachOther) {
    Graph graph;
    const BufferHandle a = add(graph, "a", {});
    look(graph, "copy a", a, storage_read);
    const BufferHandle b = write(graph, "clear b", graph.create_buffer("b", {1024}), transfer_write);
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
    graph.output(add(graph, "use the past", {history.previous}));
    (void)write(graph, "write the present", history.now, storage_write);
    const CompiledGraph plan = compile(graph);
    EXPECT_EQ(names_of(plan.passes), (Names{"use the past", "write the present"}));
    for (const BufferHandle handle : {history.now, history.previous})
        EXPECT_EQ(plan.resources[handle.resource].slot, PlannedResource::kNoSlot);
    EXPECT_EQ(plan.transient_bytes, 1024u) << "only the result";
}

TEST(GraphHistory, WithoutAReaderItIsCulled) {
    Graph graph;
    (void)write(graph, "write", graph.history_texture("moments", {}).now, image_write);
    EXPECT_EQ(names_of(compile(graph).culled), (Names{"write"}));
}

TEST(GraphHistory, InvalidUses) {
    Graph graph;
    const auto history = graph.history_buffer("state", {256});
    expect_error([&] { graph.history_buffer("state", {256}); }, "history 'state'", "is declared twice");
    Pass p = graph.add_pass("p");
    expect_error([&] { p.read(history.now, storage_read); }, "pass 'p'", "reads 'state', which nobody has written");
    expect_error([&] { (void)p.write(history.previous, storage_write); }, "pass 'p'", "the past is only read");
    p.read(history.previous, storage_read);
    p.keep();
    expect_error([&] { compile(graph); }, "history 'state'", "is read but never written");
}

// --- Dot ------------------------------------------------------------------------------------------------------------

TEST(GraphDot, ShowsPassesResourcesSlotsAndCulledPasses) {
    Graph graph;
    const BufferHandle a = add(graph, "the \"first\"", {});
    add(graph, "left out", {a});
    graph.output(add(graph, "last", {a}));
    const std::string dot = to_dot(compile(graph));
    for (const char* piece : {"digraph", "0. the \\\"first\\\"", "1. last", "left out", "slot 1", "r0v1 -> pass1"})
        EXPECT_NE(dot.find(piece), std::string::npos) << piece << "\n" << dot;
    EXPECT_EQ(std::count(dot.begin(), dot.end(), '{'), std::count(dot.begin(), dot.end(), '}'));
}

}  // namespace
}  // namespace halflight::graph
