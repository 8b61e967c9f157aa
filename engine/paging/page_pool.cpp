#include "engine/paging/page_pool.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <bit>
#include <tuple>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/stopwatch.h"
#include "engine/rays/bvh.h"
#include "engine/rays/packed_bvh.h"
#include "engine/rays/page_node.h"
#include "shaders/shared/bindings.h"
#include "shaders/shared/bvh.h"

namespace halflight::paging {
namespace {

using shared::kBvhIndexMask;
using shared::kBvhPageTexels;
using shared::kBvhPairTexels;
using shared::kBvhTag;

std::uint32_t missing(std::uint32_t root) {
    return kBvhTag | shared::kBvhLeaf | (root + 1);
}

/// Returns whether a reference is a leaf of pairs below `pairs`.
bool is_leaf_within(std::uint32_t reference, std::size_t pairs) {
    const std::uint32_t count = (reference >> shared::kBvhCountShift) & 7u;
    return shared::is_leaf(reference) && count > 0 && (reference & kBvhIndexMask) + std::size_t{count} <= pairs;
}

/// Throws Error where a page does not fit into a slot or leads out of it.
void check(std::uint32_t page, const LoadedPage& loaded, const PageLimits& limits) {
    const Page& content = loaded.page;
    const std::size_t nodes = content.nodes.size() / kBvhPageTexels, pairs = content.pairs.size() / kBvhPairTexels;
    if (nodes > limits.nodes || pairs > limits.pairs || loaded.rows.triangles.size() > limits.alpha_tested)
        throw Error("pages", "page {} is larger than the limits of the scene", page);
    for (std::size_t node = 0; node < nodes; ++node) {
        for (int k = 0; k < 4; ++k) {
            const std::uint32_t reference = content.nodes[node * kBvhPageTexels + kBvhPageTexels - 1][k];
            if (reference == shared::kBvhNoChild) continue;
            const std::uint32_t index = reference & kBvhIndexMask;
            // Nodes follow their parents, so a damaged file cannot make kernels go in circles.
            const bool valid =
                shared::is_inner_node(reference) ? index > node && index < nodes : is_leaf_within(reference, pairs);
            if (!valid) throw Error("pages", "page {} has a node that leads out of it", page);
        }
    }
}

/// Returns the table rows of alpha-tested triangles in a slot.
std::uint32_t alpha_rows(const PageIndex& index) {
    return index.alpha ? index.limits.alpha_tested : 0;
}

std::uint32_t slots_for(const PageIndex& index, std::size_t top_nodes, std::size_t bytes) {
    const std::size_t nodes = index.limits.nodes, pairs = index.limits.pairs;
    const std::size_t attributes = std::size_t{3} * alpha_rows(index) * index.vertex_texels;
    const std::size_t slot = PagePool::slot_bytes(index);
    GLint texels = 0;
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &texels);
    const std::size_t most_nodes =
        std::min(static_cast<std::size_t>(texels) / kBvhPageTexels, std::size_t{kBvhIndexMask});
    const std::size_t most_pairs =
        std::min(static_cast<std::size_t>(texels) / kBvhPairTexels, std::size_t{kBvhIndexMask});
    const std::size_t most_attributes = static_cast<std::size_t>(texels) / std::max<std::size_t>(attributes, 1);
    const std::size_t room =
        most_nodes > top_nodes ? std::min({(most_nodes - top_nodes) / nodes, most_pairs / pairs, most_attributes}) : 0;
    if (room == 0 || index.roots.size() >= kBvhIndexMask) {
        throw Error("pages", "{} subtrees in {} pages; the driver's texture buffers end at {} texels",
                    index.roots.size(), index.pages.size(), texels);
    }
    return static_cast<std::uint32_t>(
        std::clamp(bytes / slot, std::size_t{1}, std::min(room, std::max(index.pages.size(), std::size_t{1}))));
}

}  // namespace

std::size_t PagePool::slot_bytes(const PageIndex& index) {
    const std::size_t rows = alpha_rows(index);
    const std::size_t texels = index.limits.nodes * std::size_t{kBvhPageTexels} +
                               index.limits.pairs * std::size_t{kBvhPairTexels} + rows + 3 * rows * index.vertex_texels;
    return texels * sizeof(vec4);
}

PagePool::PagePool(const PageSource& source, std::size_t bytes, const gpu::Defines& shading)
    : source_(source),
      asked_at_(source.index().pages.size(), 0),
      used_at_(source.index().pages.size(), 0),
      shown_(source.index().roots.size(), 0),
      shown_roots_("roots of resident pages", source.index().roots.size() * sizeof(std::uint32_t)),
      uses_(source.index().pages.size()),
      shading_(shading),
      alpha_triangles_("rows of alpha-tested triangles", 0),
      alpha_attributes_("attributes of alpha-tested triangles", 0),
      reader_(source) {
    const PageIndex& index = source.index();
    const rays::Bvh top = hierarchy_over(index.roots);
    top_nodes_ = static_cast<std::uint32_t>(top.nodes.size()) + 1;
    if (const std::uint32_t still = source.still().pages; still < index.pages.size()) {
        // Poses have other hierarchies over the roots, and other roots of moving geometry. A node has two children or
        // more, so there are fewer nodes than roots.
        const auto moving = std::ranges::count_if(index.roots, [&](const PageRoot& r) { return r.page >= still; });
        top_nodes_ += static_cast<std::uint32_t>(index.roots.size()) + static_cast<std::uint32_t>(moving) + 64;
    }
    slot_of_page_.assign(index.pages.size(), kNone);
    const std::vector<uvec4> nodes = lay_out(top);

    const std::uint32_t slots = slots_for(index, top_nodes_, bytes);
    page_of_slot_.assign(slots, kNone);
    for (std::uint32_t slot = slots; slot-- > 0;) free_.push_back(slot);
    scene_.emplace(layout(top));
    if (const std::size_t rows = std::size_t{slots} * alpha_rows(index); rows > 0) {
        alpha_triangles_ = gpu::Buffer(alpha_triangles_.name(), rows * sizeof(uvec4));
        alpha_attributes_ = gpu::Buffer(alpha_attributes_.name(), 3 * rows * index.vertex_texels * sizeof(vec4));
    }
    scene_->nodes().write(std::span<const uvec4>(nodes));
}

/// Returns the nodes of the hierarchy over the roots, with the head, and finds the places of the roots in them.
std::vector<uvec4> PagePool::lay_out(const rays::Bvh& top) {
    const PageIndex& index = source_.index();
    first_root_.assign(index.pages.size() + 1, static_cast<std::uint32_t>(index.roots.size()));
    for (std::size_t root = index.roots.size(); root-- > 0;)
        first_root_[index.roots[root].page] = static_cast<std::uint32_t>(root);

    std::vector<uvec4> nodes = rays::packed_head(index.bounds);
    nodes.resize(kBvhPageTexels);
    nodes[2].x = top_nodes_;  // shaders/lib/residency.glsl
    word_of_root_.resize(index.roots.size());
    for (const rays::BvhNode& node : top.nodes) {
        std::array<std::uint32_t, 4> references{};
        for (std::size_t k = 0; k < 4; ++k) {
            const rays::BvhChild& child = node.children[k];
            references[k] = shared::kBvhNoChild;
            if (child.bounds.empty()) continue;
            references[k] = kBvhTag | (child.first + 1);
            if (!child.leaf()) continue;
            const std::uint32_t root = top.primitives[child.first];
            references[k] = reference_to(root);
            word_of_root_[root] = static_cast<std::uint32_t>((nodes.size() + kBvhPageTexels - 1) * 4 + k);
        }
        const rays::PageNode texels = rays::encode_page_node(node, references);
        nodes.insert(nodes.end(), texels.begin(), texels.end());
    }
    return nodes;
}

rays::PagedLayout PagePool::layout(const rays::Bvh& top) const {
    const PageIndex& index = source_.index();
    return {.triangles = index.triangles,
            .nodes = top_nodes_ + std::size_t{slots()} * index.limits.nodes,
            .pairs = std::size_t{slots()} * index.limits.pairs,
            .stack_entries = top.stack_entries + index.stack_entries,
            .slivers = index.slivers,
            .alpha_tested = index.alpha,
            .shading = shading_};
}

/// Returns the reference that leads to a subtree, or tells kernels that its page is missing.
std::uint32_t PagePool::reference_to(std::uint32_t root) const {
    const PageRoot& at = source_.index().roots[root];
    if (!resident(at.page)) return missing(root);
    return kBvhTag | (top_nodes_ + slot_of_page_[at.page] * source_.index().limits.nodes + at.node);
}

void PagePool::begin_pose() {
    forget();
    while (!reader_.take(true).empty()) {
    }
    leaving_.clear();
    for (std::uint32_t page = source_.still().pages; page < pages(); ++page)
        if (resident(page)) leave(page);
}

bool PagePool::end_pose() {
    const PageIndex& index = source_.index();
    const rays::Bvh top = hierarchy_over(index.roots);
    if (top.nodes.size() + 1 > top_nodes_ || index.alpha != scene_->alpha_tested()) return false;
    for (auto* per_page : {&asked_at_, &used_at_}) per_page->resize(index.pages.size(), 0);
    slot_of_page_.resize(index.pages.size(), kNone);
    uses_.follow(index.pages.size(), source_.still().pages);
    const std::vector<uvec4> nodes = lay_out(top);
    scene_->nodes().write(std::span<const uvec4>(nodes));
    shown_.clear();
    for (const PageRoot& root : index.roots) shown_.push_back(resident(root.page) ? 1 : 0);
    if (shown_roots_.bytes() != shown_.size() * sizeof(std::uint32_t))
        shown_roots_ = gpu::Buffer(shown_roots_.name(), shown_.size() * sizeof(std::uint32_t));
    shown_changed_ = true;
    scene_->update(layout(top));
    return true;
}

const gpu::Buffer& PagePool::shown_roots() {
    if (std::exchange(shown_changed_, false)) shown_roots_.write(std::span<const std::uint32_t>(shown_));
    return shown_roots_;
}

void PagePool::ask(std::span<const std::uint32_t> pages) {
    const std::vector<std::uint32_t> earlier = std::exchange(asked_, {});
    std::vector<std::uint32_t> absent;
    ++asks_;
    leaving_.clear();
    const auto add = [&](std::uint32_t page) {
        if (asked_for(page) || asked_.size() == slots()) return;
        asked_at_[page] = asks_;
        asked_.push_back(page);
        if (!resident(page)) absent.push_back(page);
    };
    std::ranges::for_each(pages, add);
    for (const std::uint32_t page : earlier)
        if (!resident(page)) add(page);
    reader_.ask(absent);
}

bool PagePool::take(bool wait) {
    const Stopwatch watch;
    for (PageReader::Arrival& arrival : reader_.take(wait)) {
        // A page that nobody asks for any more may come if that costs no other page.
        if (!resident(arrival.page) && (asked_for(arrival.page) || !free_.empty()))
            upload(arrival.page, std::move(arrival.content));
    }
    const bool more = std::ranges::any_of(asked_, [&](std::uint32_t page) { return !resident(page); });
    traffic_.seconds += watch.seconds();
    return more;
}

void PagePool::forget() {
    ++asks_;
    asked_.clear();
    reader_.ask({});
}

void PagePool::load(std::span<const std::uint32_t> pages) {
    ask(pages);
    while (take(true)) {
    }
}

void PagePool::clear() {
    leaving_.clear();
    for (std::uint32_t page = 0; page < pages(); ++page)
        if (resident(page)) leave(page);
}

void PagePool::touch(std::span<const std::uint32_t> slots) {
    ++time_;
    leaving_.clear();
    for (std::size_t slot = 0; slot < slots.size(); ++slot) {
        const std::uint32_t page = slots[slot] != 0 ? page_of_slot_[slot] : kNone;
        if (page == kNone) continue;
        used_at_[page] = time_;
        uses_.touch(page);
    }
}

void PagePool::leave(std::uint32_t page) {
    show(page, false);
    const std::uint32_t slot = std::exchange(slot_of_page_[page], kNone);
    page_of_slot_[slot] = kNone;
    free_.push_back(slot);
}

/// Returns a slot. If none is free, a page leaves that has not been asked for.
std::uint32_t PagePool::free_slot() {
    if (free_.empty()) {
        if (leaving_.empty()) {
            for (const std::uint32_t page : page_of_slot_)
                if (!asked_for(page)) leaving_.push_back(page);
            std::ranges::sort(leaving_, {}, [&](std::uint32_t page) {
                return std::tuple(uses_.next_use(page), ~used_at_[page], page);
            });
        }
        leave(leaving_.back());
        leaving_.pop_back();
        ++traffic_.evicted;
    }
    const std::uint32_t slot = free_.back();
    free_.pop_back();
    return slot;
}

void PagePool::bind_rows() const {
    if (alpha_triangles_.bytes() == 0) return;
    alpha_triangles_.bind_texture(UNIT_TRIANGLES, GL_RGBA32UI);
    alpha_attributes_.bind_texture(UNIT_VERTICES, GL_RGBA32F);
}

/// Uploads a page to a slot, with references to nodes, pairs and rows as they are there.
void PagePool::upload(std::uint32_t page, LoadedPage loaded) {
    const PageLimits& limits = source_.index().limits;
    check(page, loaded, limits);
    Page& content = loaded.page;
    std::vector<uvec4>& rows = loaded.rows.triangles;
    const std::uint32_t slot = free_slot();
    const std::uint32_t first_node = top_nodes_ + slot * limits.nodes, first_pair = slot * limits.pairs;
    const std::uint32_t first_row = slot * alpha_rows(source_.index());
    for (std::size_t texel = kBvhPageTexels - 1; texel < content.nodes.size(); texel += kBvhPageTexels) {
        for (int k = 0; k < 4; ++k) {
            std::uint32_t& reference = content.nodes[texel][k];
            if (reference != shared::kBvhNoChild) reference += shared::is_leaf(reference) ? first_pair : first_node;
        }
    }
    if (!rows.empty()) {
        for (std::uint32_t i = 0; i < rows.size(); ++i) {
            const std::uint32_t corner = 3 * (first_row + i);
            rows[i] = {corner, corner + 1, corner + 2, rows[i].w};
        }
        for (std::size_t i = kBvhPairTexels - 1; i < content.pairs.size(); i += kBvhPairTexels)
            content.pairs[i].w = std::bit_cast<float>(std::bit_cast<std::uint32_t>(content.pairs[i].w) + first_row);
        alpha_triangles_.write(std::span<const uvec4>(rows), first_row);
        alpha_attributes_.write(std::span<const vec4>(loaded.rows.attributes),
                                3 * std::size_t{first_row} * source_.index().vertex_texels);
    }
    scene_->nodes().write(std::span<const uvec4>(content.nodes), std::size_t{first_node} * kBvhPageTexels);
    scene_->pairs().write(std::span<const vec4>(content.pairs), std::size_t{first_pair} * kBvhPairTexels);
    slot_of_page_[page] = slot;
    page_of_slot_[slot] = page;
    used_at_[page] = ++time_;
    show(page, true);
    ++traffic_.loaded;
    if (page >= source_.still().pages) ++traffic_.moving;
    traffic_.bytes += content.nodes.size() * sizeof(uvec4) + content.pairs.size() * sizeof(vec4);
}

/// Lets references lead to the page in its slot, or tell kernels that it is missing.
void PagePool::show(std::uint32_t page, bool visible) {
    for (std::uint32_t root = first_root_[page]; root < first_root_[page + 1]; ++root) {
        const std::uint32_t reference = visible ? reference_to(root) : missing(root);
        scene_->nodes().write(std::span(&reference, 1), word_of_root_[root]);
        shown_[root] = visible ? 1 : 0;
    }
    shown_changed_ = true;
}

}  // namespace halflight::paging
