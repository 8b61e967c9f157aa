#include "engine/paging/page_pool.h"

#include <epoxy/gl.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>

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

constexpr std::uint32_t kNone = ~0u;
constexpr std::uint32_t kHiddenShare = 8;  // one page in so many is hidden once the pool is full

std::uint32_t missing(std::uint32_t root) {
    return kBvhTag | shared::kBvhLeaf | (root + 1);
}

/// Returns whether a reference is a leaf of pairs below `pairs`.
bool is_leaf_within(std::uint32_t reference, std::size_t pairs) {
    const std::uint32_t count = (reference >> shared::kBvhCountShift) & 7u;
    return shared::is_leaf(reference) && count > 0 && (reference & kBvhIndexMask) + std::size_t{count} <= pairs;
}

rays::Bvh hierarchy_over(const std::vector<PageRoot>& roots) {
    std::vector<Bounds> boxes;
    boxes.reserve(roots.size());
    for (const PageRoot& root : roots) boxes.push_back(root.bounds);
    rays::Bvh bvh = rays::build_bvh(boxes);
    if (bvh.nodes.empty()) bvh.nodes.emplace_back();  // a root without children, for a scene without triangles
    return bvh;
}

/// Returns the table rows of alpha-tested triangles in a slot.
std::uint32_t alpha_rows(const PageIndex& index) {
    return index.alpha ? index.limits.alpha_tested : 0;
}

std::uint32_t slots_for(const PageIndex& index, std::size_t top_nodes, std::size_t bytes) {
    const std::size_t nodes = index.limits.nodes, pairs = index.limits.pairs, rows = alpha_rows(index);
    const std::size_t attributes = 3 * rows * index.vertex_texels;
    const std::size_t slot =
        (nodes * kBvhPageTexels + pairs * kBvhPairTexels + rows + attributes) * sizeof(vec4);  // texels have 16 bytes
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

PagePool::PagePool(const PageSource& source, std::size_t bytes, const gpu::Defines& shading)
    : source_(source),
      alpha_triangles_("rows of alpha-tested triangles", 0),
      alpha_attributes_("attributes of alpha-tested triangles", 0) {
    const PageIndex& index = source.index();
    const rays::Bvh top = hierarchy_over(index.roots);
    top_nodes_ = static_cast<std::uint32_t>(top.nodes.size()) + 1;

    first_root_.assign(index.pages.size() + 1, static_cast<std::uint32_t>(index.roots.size()));
    for (std::size_t root = index.roots.size(); root-- > 0;)
        first_root_[index.roots[root].page] = static_cast<std::uint32_t>(root);
    slot_of_page_.assign(index.pages.size(), kNone);
    state_.assign(index.pages.size(), State::missing);

    std::vector<uvec4> nodes = rays::packed_head(index.bounds);
    nodes.resize(kBvhPageTexels);
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
            references[k] = missing(root);
            word_of_root_[root] = static_cast<std::uint32_t>((nodes.size() + kBvhPageTexels - 1) * 4 + k);
        }
        const rays::PageNode texels = rays::encode_page_node(node, references);
        nodes.insert(nodes.end(), texels.begin(), texels.end());
    }

    const std::uint32_t slots = slots_for(index, top_nodes_, bytes);
    page_of_slot_.assign(slots, kNone);
    for (std::uint32_t slot = slots; slot-- > 0;) free_.push_back(slot);
    scene_.emplace(rays::PagedLayout{.triangles = index.triangles,
                                     .nodes = top_nodes_ + std::size_t{slots} * index.limits.nodes,
                                     .pairs = std::size_t{slots} * index.limits.pairs,
                                     .stack_entries = top.stack_entries + index.stack_entries,
                                     .slivers = index.slivers,
                                     .alpha_tested = index.alpha,
                                     .shading = shading});
    if (const std::size_t rows = std::size_t{slots} * alpha_rows(index); rows > 0) {
        alpha_triangles_ = gpu::Buffer(alpha_triangles_.name(), rows * sizeof(uvec4));
        alpha_attributes_ = gpu::Buffer(alpha_attributes_.name(), 3 * rows * index.vertex_texels * sizeof(vec4));
    }
    scene_->nodes().write(std::span<const uvec4>(nodes));
}

std::uint32_t PagePool::lasting_slots() const {
    return slots() - slots() / kHiddenShare;
}

void PagePool::load(std::span<const std::uint32_t> asked) {
    const Stopwatch watch;
    std::vector<std::uint32_t> wanted(asked.begin(), asked.end());
    std::ranges::sort(wanted);
    wanted.erase(std::ranges::unique(wanted).begin(), wanted.end());
    if (wanted.size() > slots()) throw Error("pages", "{} pages for {} slots", wanted.size(), slots());

    std::vector<bool> kept(state_.size(), false);
    std::vector<std::uint32_t> absent;
    for (const std::uint32_t page : wanted) {
        kept[page] = true;
        if (state_[page] == State::missing) absent.push_back(page);
        if (state_[page] != State::hidden) continue;
        std::erase(hidden_, page);
        queue_.push_back(page);
        show(page, true);
        ++traffic_.revived;
    }
    // Pages are read by all threads, in portions that bound the memory.
    constexpr std::size_t kPortion = 64;
    std::vector<Loaded> contents(std::min(kPortion, absent.size()));
    for (std::size_t first = 0; first < absent.size(); first += kPortion) {
        const std::size_t count = std::min(kPortion, absent.size() - first);
        tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) { contents[i] = read(absent[first + i]); });
        for (std::size_t i = 0; i < count; ++i) upload(absent[first + i], free_slot(kept), std::move(contents[i]));
    }
    // A full pool hides its oldest pages.
    if (free_.empty() && slots() < pages()) {
        for (std::size_t i = 0; hidden_.size() < slots() / kHiddenShare && i < queue_.size(); ++i) {
            const std::uint32_t page = queue_.front();
            queue_.pop_front();
            if (kept[page]) {
                queue_.push_back(page);
                continue;
            }
            show(page, false);
            hidden_.push_back(page);
        }
    }
    traffic_.seconds += watch.seconds();
}

void PagePool::clear() {
    for (std::uint32_t page = 0; page < pages(); ++page) {
        if (state_[page] == State::resident) show(page, false);
        if (state_[page] == State::missing) continue;
        free_.push_back(slot_of_page_[page]);
        page_of_slot_[slot_of_page_[page]] = slot_of_page_[page] = kNone;
        state_[page] = State::missing;
    }
    queue_.clear();
    hidden_.clear();
}

/// Returns a slot; where none is free, the oldest page that is not kept leaves.
std::uint32_t PagePool::free_slot(const std::vector<bool>& kept) {
    if (free_.empty()) {
        std::deque<std::uint32_t>& from = hidden_.empty() ? queue_ : hidden_;
        const auto oldest = std::ranges::find_if(from, [&](std::uint32_t page) { return !kept[page]; });
        const std::uint32_t page = *oldest;
        from.erase(oldest);
        if (state_[page] == State::resident) show(page, false);
        state_[page] = State::missing;
        free_.push_back(slot_of_page_[page]);
        slot_of_page_[page] = kNone;
        ++traffic_.evicted;
    }
    const std::uint32_t slot = free_.back();
    free_.pop_back();
    return slot;
}

/// Reads a page and the rows of its alpha-tested triangles, whose pairs get the place of their first row. Thread-safe.
PagePool::Loaded PagePool::read(std::uint32_t page) const {
    Loaded loaded{source_.read(page), {}};
    if (!source_.index().alpha) return loaded;
    std::vector<std::uint32_t> triangles;
    for (std::size_t i = kBvhPairTexels - 1; i < loaded.page.pairs.size(); i += kBvhPairTexels) {
        uvec4 words = std::bit_cast<uvec4>(loaded.page.pairs[i]);
        words.w = kBvhTag | static_cast<std::uint32_t>(triangles.size());
        const bool single = words.x == words.y;
        for (int which = 0; which < (single ? 1 : 2); ++which)
            if ((words.z & (shared::kBvhAlphaTested << (which * shared::kBvhAlphaShift))) != 0)
                triangles.push_back(words[which] & shared::kBvhTriangleMask);
        loaded.page.pairs[i] = std::bit_cast<vec4>(words);
    }
    source_.read_rows(triangles, loaded.rows);
    return loaded;
}

void PagePool::bind_rows() const {
    if (alpha_triangles_.bytes() == 0) return;
    alpha_triangles_.bind_texture(UNIT_TRIANGLES, GL_RGBA32UI);
    alpha_attributes_.bind_texture(UNIT_VERTICES, GL_RGBA32F);
}

void PagePool::upload(std::uint32_t page, std::uint32_t slot, Loaded loaded) {
    Page& content = loaded.page;
    std::vector<uvec4>& rows = loaded.rows.triangles;
    const PageLimits& limits = source_.index().limits;
    const std::uint32_t first_row = slot * alpha_rows(source_.index());
    const std::uint32_t first_node = top_nodes_ + slot * limits.nodes, first_pair = slot * limits.pairs;
    if (content.nodes.size() > std::size_t{limits.nodes} * kBvhPageTexels ||
        content.pairs.size() > std::size_t{limits.pairs} * kBvhPairTexels || rows.size() > limits.alpha_tested) {
        free_.push_back(slot);
        throw Error("pages", "page {} is larger than the limits of the scene", page);
    }
    const std::size_t nodes = content.nodes.size() / kBvhPageTexels, pairs = content.pairs.size() / kBvhPairTexels;
    for (std::size_t node = 0; node < nodes; ++node) {
        for (int k = 0; k < 4; ++k) {
            std::uint32_t& reference = content.nodes[node * kBvhPageTexels + kBvhPageTexels - 1][k];
            if (reference == shared::kBvhNoChild) continue;
            const std::uint32_t index = reference & kBvhIndexMask;
            const bool inner = shared::is_inner_node(reference);
            // Nodes follow their parents, so a damaged file cannot make kernels go in circles.
            const bool valid = inner ? index > node && index < nodes : is_leaf_within(reference, pairs);
            if (!valid) {
                free_.push_back(slot);
                throw Error("pages", "page {} has a node that leads out of it", page);
            }
            reference += inner ? first_node : first_pair;
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
    queue_.push_back(page);
    show(page, true);
    ++traffic_.loaded;
    traffic_.bytes += content.nodes.size() * sizeof(uvec4) + content.pairs.size() * sizeof(vec4);
}

/// Lets references lead to the page, or tell kernels that it is missing. The page stays in its slot.
void PagePool::show(std::uint32_t page, bool visible) {
    const std::uint32_t first_node = top_nodes_ + slot_of_page_[page] * source_.index().limits.nodes;
    for (std::uint32_t root = first_root_[page]; root < first_root_[page + 1]; ++root) {
        const std::uint32_t reference =
            visible ? kBvhTag | (first_node + source_.index().roots[root].node) : missing(root);
        scene_->nodes().write(std::span(&reference, 1), word_of_root_[root]);
    }
    state_[page] = visible ? State::resident : State::hidden;
}

}  // namespace halflight::paging
