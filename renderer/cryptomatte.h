// Cryptomatte: which objects and materials the samples of each pixel have seen, and how often, in the form that
// compositing programs select by (Friedman and Jones 2015, Fully automatic ID mattes with support for motion blur and
// transparency; Psyop's Cryptomatte specification, version 1.2.0).
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/tables/tables.h"
#include "shaders/shared/rays.h"

namespace halflight {

/// Objects or materials that a pixel keeps: those with most coverage.
inline constexpr std::size_t kCryptomatteRanks = 6;

/// MurmurHash3_x86_32 (Appleby) with seed 0.
std::uint32_t murmur3(std::string_view bytes);
/// A name's hash as a float that every file keeps: where the exponent would make it a denormal number, an infinity or
/// not a number, the exponent's lowest bit is flipped ("uint32_to_float32" of the specification).
float cryptomatte_id(std::string_view name);

/// The layer of AOV "cryptoobject" or "cryptomaterial"; empty for others.
std::string_view cryptomatte_layer(std::string_view aov);
/// Channels of a layer, for the image of IdCoverage: "CryptoObject00.R" and so on, pairs of id and coverage by rank.
std::vector<std::string> cryptomatte_channels(std::string_view layer);
/// What a file's header says of a layer, by attribute: how ids are made, and the manifest, which is JSON of names and
/// ids. Names may come twice.
std::map<std::string, std::string> cryptomatte_attributes(std::string_view layer, std::span<const std::string> names);

/// Samples of many pixels, counted by id.
class IdCoverage {
  public:
    explicit IdCoverage(std::size_t pixels) : first_(pixels, kNone) {}

    /// So many samples have seen `id`. Those that see nothing are not told.
    void add(std::size_t pixel, float id, std::uint32_t samples = 1);
    /// Pairs of id and coverage in [0,1], those of most coverage first (of equal ones, by the ids' bits); zeros where
    /// there are no more. samples: of the pixel, those that saw nothing too.
    void rank(std::size_t pixel, int samples, std::span<float, 2 * kCryptomatteRanks> to) const;
    /// As at first.
    void clear();

  private:
    static constexpr std::uint32_t kNone = ~0u;
    struct Seen {
        std::uint32_t id;
        std::uint32_t samples;
        std::uint32_t next;  // of the same pixel, or kNone
    };
    std::vector<std::uint32_t> first_;
    std::vector<Seen> seen_;
};

/// The objects and materials that camera rays meet. Tables and names must outlive it.
class Mattes {
  public:
    /// AOVs that are no Cryptomatte are not looked at. paths: of a band.
    Mattes(const TraceTables& tables, std::span<const std::string> objects, std::span<const std::string> materials,
           std::span<const std::string> aovs, std::size_t paths);

    bool empty() const { return layers_.empty(); }
    /// A sample of all paths.
    void add(std::span<const shared::Hit> hits);
    struct Layer {
        std::string aov;
        std::span<const std::string> names;
        std::vector<float> ids;  // of the names
        IdCoverage coverage;     // by path
    };
    const std::vector<Layer>& layers() const { return layers_; }
    /// No samples, as for another band.
    void clear();

  private:
    const TraceTables& tables_;
    std::vector<Layer> layers_;
};

}  // namespace halflight
