// The picture in memory: bands of sums come in, images go out.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "engine/core/image.h"
#include "engine/device/scene_view.h"
#include "engine/io/exr.h"
#include "engine/tables/tables.h"
#include "renderer/cryptomatte.h"
#include "renderer/render.h"
#include "shaders/shared/aov.h"

namespace halflight {

/// Whether any of `names` was asked for.
bool asked_for(const RenderSettings& settings, std::initializer_list<std::string_view> names);

/// Channels that an AOV has in a file.
std::size_t layer_channels(const AovInfo& aov);
/// Of a pixel in a film.
std::size_t film_bytes(const RenderSettings& settings);

class Film {
  public:
    /// Of the AOVs that the settings ask for.
    Film(const RenderSettings& settings, const TraceTables& tables);
    /// Of these instead, before anything is added. Throws Error for those that samples with these settings do not leave
    /// behind.
    void choose(const std::vector<std::string>& aovs);
    bool wants(std::initializer_list<std::string_view> names) const;  ///< any of these AOVs

    /// What a band's samples added up to, by path index (see Accumulated); empty where the frame left it out.
    struct Sums {
        std::vector<double> emission, direct, indirect, squares, features;
        double beauty(std::size_t path, std::size_t channel) const;
    };
    void add_sums(const Band& band, int samples, const Sums& sums);
    void add_pictures(const Band& band, const std::vector<float>& beauty, const std::vector<float>& view);
    /// Instead of those pictures: another beauty, and its view if there is a processor.
    void replace_pictures(Image beauty, const ViewProcessor* view);
    /// coverage: by path index.
    void add_ids(const Band& band, int samples, std::string_view aov, const IdCoverage& coverage);
    void add_data(const Band& band, const std::vector<shared::AovRecord>& records);
    /// After add_data(): motion of surfaces that were elsewhere in the frame before.
    void add_surface_motion(const Band& band, const std::vector<shared::AovRecord>& records,
                            const PreviousSurfaces& surfaces, const Camera& previous);
    void add_debug(const Band& band, const std::vector<shared::DebugRecord>& records);

    /// Beauty, view and the AOVs that were asked for, in that order. Leaves the film empty.
    void take(RenderResult& result);

  private:
    struct Plane {
        std::string aov;
        Image image;
    };
    Image* plane(std::string_view aov);

    RenderSettings settings_;
    const TraceTables& tables_;
    Image beauty_;
    Image view_;
    std::vector<Plane> planes_;  // as asked for
};

}  // namespace halflight
