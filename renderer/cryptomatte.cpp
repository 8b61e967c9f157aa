#include "renderer/cryptomatte.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <nlohmann/json.hpp>

namespace halflight {

std::uint32_t murmur3(std::string_view bytes) {
    const auto byte = [&](std::size_t i) { return std::uint32_t{static_cast<unsigned char>(bytes[i])}; };
    const auto mixed = [](std::uint32_t word) { return std::rotl(word * 0xcc9e2d51u, 15) * 0x1b873593u; };
    const std::size_t whole = bytes.size() / 4 * 4;
    std::uint32_t hash = 0;
    for (std::size_t i = 0; i < whole; i += 4) {
        hash ^= mixed(byte(i) | byte(i + 1) << 8 | byte(i + 2) << 16 | byte(i + 3) << 24);
        hash = std::rotl(hash, 13) * 5 + 0xe6546b64u;
    }
    std::uint32_t rest = 0;
    for (std::size_t i = bytes.size(); i > whole; --i) rest = rest << 8 | byte(i - 1);
    hash ^= mixed(rest) ^ static_cast<std::uint32_t>(bytes.size());
    hash = (hash ^ hash >> 16) * 0x85ebca6bu;
    hash = (hash ^ hash >> 13) * 0xc2b2ae35u;
    return hash ^ hash >> 16;
}

float cryptomatte_id(std::string_view name) {
    const std::uint32_t hash = murmur3(name);
    const std::uint32_t exponent = hash >> 23 & 0xffu;
    return std::bit_cast<float>(exponent == 0 || exponent == 0xffu ? hash ^ 1u << 23 : hash);
}

std::map<std::string, std::string> cryptomatte_attributes(std::string_view layer, std::span<const std::string> names) {
    nlohmann::json manifest = nlohmann::json::object();
    for (const std::string& name : names)
        manifest[name] = fmt::format("{:08x}", std::bit_cast<std::uint32_t>(cryptomatte_id(name)));
    const std::string key = fmt::format("cryptomatte/{:.7}/", fmt::format("{:08x}", murmur3(layer)));
    return {{key + "name", std::string(layer)},
            {key + "hash", "MurmurHash3_32"},
            {key + "conversion", "uint32_to_float32"},
            // Bytes that are not UTF-8 are replaced.
            {key + "manifest", manifest.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)}};
}

void IdCoverage::add(std::size_t pixel, float id, std::uint32_t samples) {
    const auto bits = std::bit_cast<std::uint32_t>(id);
    std::uint32_t* at = &first_[pixel];
    while (*at != kNone && seen_[*at].id != bits) at = &seen_[*at].next;
    if (*at != kNone) {
        seen_[*at].samples += samples;
    } else {
        *at = static_cast<std::uint32_t>(seen_.size());
        seen_.push_back({bits, samples, kNone});  // `at` may dangle from here on
    }
}

void IdCoverage::rank(std::size_t pixel, int samples, std::span<float, 2 * kCryptomatteRanks> to) const {
    std::vector<Seen> all;
    for (std::uint32_t at = first_[pixel]; at != kNone; at = seen_[at].next) all.push_back(seen_[at]);
    std::ranges::sort(
        all, [](const Seen& a, const Seen& b) { return a.samples != b.samples ? a.samples > b.samples : a.id < b.id; });
    std::ranges::fill(to, 0.0f);
    for (std::size_t i = 0; i < std::min(all.size(), kCryptomatteRanks); ++i) {
        to[2 * i] = std::bit_cast<float>(all[i].id);
        to[2 * i + 1] = static_cast<float>(all[i].samples) / static_cast<float>(samples);
    }
}

void IdCoverage::clear() {
    std::ranges::fill(first_, kNone);
    seen_.clear();
}

std::vector<IdCoverage::Count> IdCoverage::counts() const {
    std::vector<Count> all;
    all.reserve(seen_.size());
    for (std::size_t pixel = 0; pixel < first_.size(); ++pixel)
        for (std::uint32_t at = first_[pixel]; at != kNone; at = seen_[at].next)
            all.push_back({static_cast<std::uint32_t>(pixel), seen_[at].id, seen_[at].samples});
    return all;
}

void IdCoverage::set(std::span<const Count> counts) {
    clear();
    add(counts);
}

void IdCoverage::add(std::span<const Count> counts) {
    for (const Count& count : counts)
        if (count.pixel < first_.size()) add(count.pixel, std::bit_cast<float>(count.id), count.samples);
}

Mattes::Mattes(const TraceTables& tables, std::span<const std::string> objects, std::span<const std::string> materials,
               std::span<const std::string> aovs, std::size_t paths, const paging::PageSource* pages)
    : tables_(tables), pages_(pages) {
    for (const std::string& requested : aovs) {
        const AovInfo* const aov = find_aov(requested);
        if (!aov->is_matte()) continue;
        Layer layer{aov, aov->source == LayerSource::objects ? objects : materials, {}, IdCoverage(paths)};
        for (const std::string& name : layer.names) layer.ids.push_back(cryptomatte_id(name));
        layers_.push_back(std::move(layer));
    }
}

void Mattes::add(std::span<const shared::Hit> hits) {
    for (Layer& layer : layers_) {
        const bool objects = layer.aov->source == LayerSource::objects;
        paging::TriangleRows paged;
        if (!objects && pages_ != nullptr) {
            std::vector<std::uint32_t> triangles;
            for (const shared::Hit& hit : hits)
                if (hit.triangle != shared::kMiss) triangles.push_back(hit.triangle);
            pages_->read_rows(triangles, paged);
        }
        std::size_t row = 0;
        for (std::size_t path = 0; path < hits.size(); ++path) {
            const shared::Hit& hit = hits[path];
            if (hit.triangle == shared::kMiss) continue;
            const auto material = [&] {
                return (pages_ ? paged.triangles[row++] : tables_.triangles[hit.triangle]).w & kTriangleMaterialMask;
            };
            const std::uint32_t index = objects ? source_of(tables_, hit.instance, hit.triangle).instance : material();
            layer.coverage.add(path, layer.ids[index]);
        }
    }
}

void Mattes::clear() {
    for (Layer& layer : layers_) layer.coverage.clear();
}

}  // namespace halflight
