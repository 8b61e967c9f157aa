// Cryptomatte: ids and coverage of the objects and materials of each pixel, by which compositing programs select
// (Friedman and Jones 2015, Fully automatic ID mattes with support for motion blur and transparency; Psyop's
// Cryptomatte specification, version 1.2.0).
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/paging/pages.h"
#include "engine/settings/layers.h"
#include "engine/tables/tables.h"
#include "shaders/shared/ray_structs.h"

namespace halflight {

/// Returns MurmurHash3_x86_32 (Appleby) with seed 0.
std::uint32_t murmur3(std::string_view bytes);
/// Returns the hash of a name as a float that files preserve. If it would be a denormal number, an infinity or not a
/// number, the lowest bit of the exponent is flipped ("uint32_to_float32" of the specification).
float cryptomatte_id(std::string_view name);

/// Returns the file attributes of a layer such as "CryptoObject": hash, conversion to float, and the manifest (JSON of
/// names and ids). Names may repeat.
std::map<std::string, std::string> cryptomatte_attributes(std::string_view layer, std::span<const std::string> names);

/// Counts samples by pixel and id.
class IdCoverage {
  public:
    explicit IdCoverage(std::size_t pixels) : first_(pixels, kNone) {}

    /// Adds samples of a pixel that hit `id`. Samples that hit nothing are not added.
    void add(std::size_t pixel, float id, std::uint32_t samples = 1);
    /// Writes pairs of id and coverage in [0,1], sorted by falling coverage, then by the bits of the ids. Zeros fill
    /// the rest. samples: all samples of the pixel, including those that hit nothing.
    void rank(std::size_t pixel, int samples, std::span<float, 2 * kCryptomatteRanks> to) const;
    /// Removes all samples.
    void clear();
    struct Count {
        std::uint32_t pixel;
        std::uint32_t id;  // bits of the id
        std::uint32_t samples;
    };
    /// Returns all samples, from which set() restores them.
    std::vector<Count> counts() const;
    void set(std::span<const Count> counts);
    void add(std::span<const Count> counts);

  private:
    static constexpr std::uint32_t kNone = ~0u;
    struct Seen {
        std::uint32_t id;
        std::uint32_t samples;
        std::uint32_t next;  // next id of the same pixel, or kNone
    };
    std::vector<std::uint32_t> first_;
    std::vector<Seen> seen_;
};

/// Counts the objects and materials that camera rays hit. Tables and names must outlive it.
class Mattes {
  public:
    /// Prepares counts for the mattes among the layers. paths: number of paths of a band. pages: the scene's pages,
    /// which outlive the object; null if its geometry is in memory.
    Mattes(const TraceTables& tables, std::span<const std::string> objects, std::span<const std::string> materials,
           std::span<const std::string> aovs, std::size_t paths, const paging::PageSource* pages = nullptr);

    bool empty() const { return layers_.empty(); }
    /// Adds one sample of all paths.
    void add(std::span<const shared::Hit> hits);
    struct Layer {
        const AovInfo* aov;
        std::span<const std::string> names;
        std::vector<float> ids;  // id of each name
        IdCoverage coverage;     // coverage per path
    };
    const std::vector<Layer>& layers() const { return layers_; }
    /// Replaces the samples of a layer.
    void set(std::size_t layer, std::span<const IdCoverage::Count> counts) { layers_[layer].coverage.set(counts); }
    /// Adds samples to a layer.
    void add(std::size_t layer, std::span<const IdCoverage::Count> counts) { layers_[layer].coverage.add(counts); }
    /// Removes all samples, before another band.
    void clear();

  private:
    const TraceTables& tables_;
    const paging::PageSource* pages_;
    std::vector<Layer> layers_;
};

}  // namespace halflight
