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

std::uint32_t slots_for(const PageIndex& index, std::size_t top_nodes, std::size_t bytes) {
    const std::size_t nodes = index.limits.nodes, pairs = index.limits.pairs;
    const std::size_t slot = nodes * kBvhPageTexels * sizeof(uvec4) + pairs * kBvhPairTexels * sizeof(vec4);
    GLint texels = 0;
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &texels);
    const std::size_t most_nodes =
        std::min(static_cast<std::size_t>(texels) / kBvhPageTexels, std::size_t{kBvhIndexMask});
    const std::size_t most_pairs =
        std::min(static_cast<std::size_t>(texels) / kBvhPairTexels, std::size_t{kBvhIndexMask});
    const std::size_t room =
        most_nodes > top_nodes ? std::min((most_nodes - top_nodes) / nodes, most_pairs / pairs) : 0;
    if (room == 0 || index.roots.size() >= kBvhIndexMask) {
        throw Error("pages", "{} subtrees in {} pages; the driver's texture buffers end at {} texels",
                    index.roots.size(), index.pages.size(), texels);
    }
    return static_cast<std::uint32_t>(
        std::clamp(bytes / slot, std::size_t{1}, std::min(room, std::max(index.pages.size(), std::size_t{1}))));
}

}  // namespace

PagePool::PagePool(const PageSource& source, std::size_t bytes) : source_(source) {
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
                                     .slivers = index.slivers});
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
    std::vector<Page> contents(std::min(kPortion, absent.size()));
    for (std::size_t first = 0; first < absent.size(); first += kPortion) {
        const std::size_t count = std::min(kPortion, absent.size() - first);
        tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) { contents[i] = source_.read(absent[first + i]); });
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

void PagePool::upload(std::uint32_t page, std::uint32_t slot, Page content) {
    const PageLimits& limits = source_.index().limits;
    const std::uint32_t first_node = top_nodes_ + slot * limits.nodes, first_pair = slot * limits.pairs;
    if (content.nodes.size() > std::size_t{limits.nodes} * kBvhPageTexels ||
        content.pairs.size() > std::size_t{limits.pairs} * kBvhPairTexels) {
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
