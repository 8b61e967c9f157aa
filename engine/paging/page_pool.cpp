#include "engine/paging/page_pool.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/stopwatch.h"
#include "engine/rays/bvh.h"
#include "engine/rays/packed_bvh.h"
#include "engine/rays/page_node.h"
#include "shaders/shared/bvh_nodes.h"
#include "shaders/shared/texture_units.h"

namespace halflight::paging {
namespace {

using shared::kBvhPageTexels;

constexpr std::size_t kTexel = sizeof(uvec4);

/// Returns the node of a root while its page is missing. `texel`: its place in the buffer.
rays::PageNode missing(std::uint32_t root, const PageRoot& of, std::uint32_t texel) {
    rays::BvhNode node;
    node.children[0].bounds = of.bounds;
    rays::PageNode texels = rays::encode_page_node(node);
    rays::distance_of(texels) = (shared::kBvhPageMissing | root) - texel;
    return texels;
}

/// Returns the table rows of alpha-tested triangles in a slot.
std::uint32_t alpha_rows(const PageIndex& index) {
    return index.alpha ? index.limits.alpha_tested : 0;
}

std::uint32_t slots_for(const PageSource& source, std::size_t top_bytes, std::size_t bytes) {
    const PageIndex& index = source.index();
    if (index.roots.size() >= shared::kBvhPageIndexMask)
        throw Error(source.subject(), "{} subtrees; the limit is {}", index.roots.size(), shared::kBvhPageIndexMask);
    GLint texels = 0;
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &texels);
    const auto most_texels = static_cast<std::size_t>(texels);
    const std::size_t most_bytes =
        std::min(most_texels * sizeof(vec3), (std::size_t{shared::kBvhPageIndexMask} + 1) * kTexel);
    const std::size_t attributes = std::size_t{3} * alpha_rows(index) * index.vertex_texels;
    const std::size_t room = most_bytes > top_bytes ? std::min((most_bytes - top_bytes) / index.limits.bytes,
                                                               most_texels / std::max<std::size_t>(attributes, 1))
                                                    : 0;
    if (room == 0) {
        throw Error(source.subject(), "{} subtrees in {} pages; the driver's texture buffers end at {} texels",
                    index.roots.size(), index.pages.size(), texels);
    }
    return static_cast<std::uint32_t>(std::clamp(bytes / PagePool::slot_bytes(index), std::size_t{1},
                                                 std::min(room, std::max(index.pages.size(), std::size_t{1}))));
}

/// Returns the texels of the hierarchy over the roots, with the head and the roots.
std::size_t texels_over(const rays::Bvh& top, const PageIndex& index) {
    return kBvhPageTexels * (1 + top.nodes.size() + index.roots.size());
}

}  // namespace

std::size_t PagePool::slot_bytes(const PageIndex& index) {
    const std::size_t rows = alpha_rows(index);
    const std::size_t first_rows = rows > 0 ? index.limits.bytes / kTexel * sizeof(std::uint16_t) : 0;
    return index.limits.bytes + rows * (1 + std::size_t{3} * index.vertex_texels) * kTexel + first_rows;
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
      first_rows_("first rows of pairs", 0),
      reader_(source) {
    const PageIndex& index = source.index();
    const rays::Bvh top = hierarchy_over(index);
    // The nodes of roots are beside those of the hierarchy over them.
    std::size_t nodes_over = 1 + top.nodes.size() + index.roots.size();
    if (const std::uint32_t still = source.still().pages; still < index.pages.size()) {
        // Poses have other hierarchies over the roots, and other roots of moving geometry. A node has two children or
        // more, so there are fewer nodes than roots.
        const auto moving = std::ranges::count_if(index.roots, [&](const PageRoot& r) { return r.page >= still; });
        nodes_over = 1 + 2 * (index.roots.size() + static_cast<std::size_t>(moving) + 64);
    }
    top_texels_ = kBvhPageTexels * nodes_over;
    const std::uint32_t slots = slots_for(source, top_texels_ * kTexel, bytes);
    top_ = slots * (index.limits.bytes / static_cast<std::uint32_t>(kTexel));
    slot_of_page_.assign(index.pages.size(), kNone);
    const std::vector<uvec4> nodes = lay_out(top);

    page_of_slot_.assign(slots, kNone);
    for (std::uint32_t slot = slots; slot-- > 0;) free_.push_back(slot);
    scene_.emplace(layout(top));
    if (const std::size_t rows = std::size_t{slots} * alpha_rows(index); rows > 0) {
        alpha_triangles_ = gpu::Buffer(alpha_triangles_.name(), rows * sizeof(uvec4));
        alpha_attributes_ = gpu::Buffer(alpha_attributes_.name(), 3 * rows * index.vertex_texels * sizeof(vec4));
        first_rows_ = gpu::Buffer(first_rows_.name(), top_ * sizeof(std::uint16_t));
    }
    scene_->nodes().write(std::span<const uvec4>(nodes), top_);
}

/// Returns the nodes of the hierarchy over the roots, with the head and with the roots, whose pages count as missing.
std::vector<uvec4> PagePool::lay_out(const rays::Bvh& top) {
    const PageIndex& index = source_.index();
    first_root_.assign(index.pages.size() + 1, static_cast<std::uint32_t>(index.roots.size()));
    for (std::size_t root = index.roots.size(); root-- > 0;)
        first_root_[index.roots[root].page] = static_cast<std::uint32_t>(root);

    std::vector<uvec4> nodes = rays::packed_head(index.bounds);
    nodes.resize(texels_over(top, index));
    texel_of_root_.resize(index.roots.size());
    std::vector<std::uint32_t> places(top.nodes.size(), kBvhPageTexels);  // per node, texel in `nodes`
    std::uint32_t end = 2 * kBvhPageTexels;
    for (std::size_t i = 0; i < top.nodes.size(); ++i) {
        rays::BvhNode node = top.nodes[i];
        const std::uint32_t distance = end - places[i];
        for (rays::BvhChild& child : node.children) {
            if (child.bounds.empty()) continue;
            if (child.leaf())
                texel_of_root_[top.primitives[child.first]] = top_ + end;
            else
                places[child.first] = end;
            child.count = 0;
            end += kBvhPageTexels;
        }
        rays::PageNode encoded = rays::encode_page_node(node);
        rays::distance_of(encoded) = distance;
        std::ranges::copy(encoded, &nodes[places[i]]);
    }
    for (std::uint32_t root = 0; root < index.roots.size(); ++root) {
        const std::uint32_t texel = texel_of_root_[root];
        std::ranges::copy(missing(root, index.roots[root], texel), &nodes[texel - top_]);
    }
    return nodes;
}

rays::PagedLayout PagePool::layout(const rays::Bvh& top) const {
    const PageIndex& index = source_.index();
    return {.triangles = index.triangles,
            .texels = top_ + top_texels_,
            .top = top_,
            .slot_texels = index.limits.bytes / kTexel,
            .slot_rows = alpha_rows(index),
            .stack_entries = std::max(top.stack_entries + index.stack_entries, 1u),
            .slivers = index.slivers,
            .alpha_tested = index.alpha,
            .one_sided = index.one_sided,
            .shading = shading_};
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
    const rays::Bvh top = hierarchy_over(index);
    if (texels_over(top, index) > top_texels_ || index.alpha != scene_->alpha_tested() ||
        index.one_sided != scene_->one_sided())
        return false;
    for (auto* per_page : {&asked_at_, &used_at_}) per_page->resize(index.pages.size(), 0);
    slot_of_page_.resize(index.pages.size(), kNone);
    uses_.follow(index.pages.size(), source_.still().pages);
    const std::vector<uvec4> last = scene_->nodes().read<uvec4>(top_, top_texels_);
    const std::vector<std::uint32_t> last_texel_of_root = texel_of_root_;
    std::vector<uvec4> nodes = lay_out(top);
    shown_.assign(index.roots.size(), 0);
    for (std::uint32_t root = 0; root < index.roots.size(); ++root) {
        if (!resident(index.roots[root].page)) continue;
        // Resident pages do not move, and their roots come first, so numbers of roots are the same.
        const std::uint32_t from = last_texel_of_root[root], to = texel_of_root_[root];
        rays::PageNode node;
        std::copy_n(&last[from - top_], node.size(), node.begin());
        rays::distance_of(node) += from - to;
        std::ranges::copy(node, &nodes[to - top_]);
        shown_[root] = 1;
    }
    scene_->nodes().write(std::span<const uvec4>(nodes), top_);
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
        // A page that is no longer asked for is uploaded only if there is a free slot.
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
    show(page, nullptr);
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

void PagePool::bind_rows(const gpu::Program& program) const {
    if (alpha_triangles_.bytes() == 0) return;
    alpha_triangles_.bind_texture(shared::kUnitTriangles, GL_RGBA32UI);
    alpha_attributes_.bind_texture(shared::kUnitVertices, GL_RGBA32F);
    program.bind_texture("first_rows", first_rows_, GL_R16UI);
}

void PagePool::upload(std::uint32_t page, LoadedPage loaded) {
    std::vector<uvec4>& rows = loaded.rows.triangles;
    if (loaded.roots.size() != first_root_[page + 1] - first_root_[page])
        throw Error(source_.subject(), "page {} has other subtrees than the scene", page);
    const std::uint32_t slot = free_slot();
    const std::uint32_t slot_texels = source_.index().limits.bytes / static_cast<std::uint32_t>(kTexel);
    scene_->nodes().write(std::span<const uvec4>(loaded.texels), std::size_t{slot} * slot_texels);
    if (!rows.empty()) {
        const std::uint32_t first_row = slot * alpha_rows(source_.index());
        for (std::uint32_t i = 0; i < rows.size(); ++i) {
            const std::uint32_t corner = 3 * (first_row + i);
            rows[i] = {corner, corner + 1, corner + 2, rows[i].w};
        }
        alpha_triangles_.write(std::span<const uvec4>(rows), first_row);
        alpha_attributes_.write(std::span<const vec4>(loaded.rows.attributes),
                                3 * std::size_t{first_row} * source_.index().vertex_texels);
        first_rows_.write(std::span<const std::uint16_t>(loaded.first_rows), std::size_t{slot} * slot_texels);
    }
    slot_of_page_[page] = slot;
    page_of_slot_[slot] = page;
    used_at_[page] = ++time_;
    show(page, &loaded);
    ++traffic_.loaded;
    if (page >= source_.still().pages) ++traffic_.moving;
    traffic_.bytes += loaded.texels.size() * kTexel;
}

/// Lets the roots of a page lead to its content in the slot, or tell kernels that it is missing.
void PagePool::show(std::uint32_t page, const LoadedPage* content) {
    const std::uint32_t slot_texels = source_.index().limits.bytes / static_cast<std::uint32_t>(kTexel);
    for (std::uint32_t root = first_root_[page]; root < first_root_[page + 1]; ++root) {
        const std::uint32_t to = texel_of_root_[root];
        const PageRoot& of = source_.index().roots[root];
        rays::PageNode node;
        if (content != nullptr) {
            node = content->roots[root - first_root_[page]];
            rays::distance_of(node) += slot_of_page_[page] * slot_texels - to;
        } else {
            node = missing(root, of, to);
        }
        scene_->nodes().write(std::span<const uvec4>(node), to);
        shown_[root] = content != nullptr ? 1 : 0;
    }
    shown_changed_ = true;
}

}  // namespace halflight::paging
