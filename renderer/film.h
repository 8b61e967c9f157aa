// The images of a picture, which are filled band by band.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/core/image.h"
#include "engine/device/scene_view.h"
#include "engine/io/exr.h"
#include "engine/paging/pages.h"
#include "engine/tables/tables.h"
#include "renderer/cryptomatte.h"
#include "renderer/render.h"
#include "shaders/shared/aov_record.h"

namespace halflight {

/// Returns whether a layer was requested.
bool asked_for(const RenderSettings& settings, std::string_view name);
/// Returns whether a layer of one of these sources was requested.
bool asked_for(const RenderSettings& settings, std::initializer_list<LayerSource> sources);
/// Returns the requested layers of light groups, in the order of Scene::light_groups.
std::vector<std::string> light_group_layers(const RenderSettings& settings);
/// Returns the bytes per pixel of a film.
std::size_t film_bytes(const RenderSettings& settings);

/// The images of a picture: its colour, the colour through the view transform, and one image per layer.
class Film {
  public:
    /// Allocates the layers that the settings request. pages: the scene's pages; null if its geometry is in memory.
    Film(const RenderSettings& settings, const TraceTables& tables, const paging::PageSource* pages = nullptr)
        : Film(settings, tables, pages, settings.aovs) {}
    /// Allocates some of the layers, as choose() does.
    Film(const RenderSettings& settings, const TraceTables& tables, const paging::PageSource* pages,
         const std::vector<std::string>& aovs);
    /// Replaces the layers before anything is added. Throws Error for a layer whose data is not rendered because the
    /// settings do not request it.
    void choose(const std::vector<std::string>& aovs);
    /// Returns whether a layer of one of these sources is in the film.
    bool wants(std::initializer_list<LayerSource> sources) const;

    /// Sums over a band's samples, by path index (see Accumulated); empty if the frame left them out.
    struct Sums {
        std::vector<double> emission{}, direct{}, indirect{}, squares{}, features{}, groups{}, catchers{};
        double beauty(std::size_t path, std::size_t channel) const;
    };
    void add_sums(const Band& band, int samples, const Sums& sums);
    /// Fills the layer "samples" of a band whose blocks of 256 paths have different numbers of samples.
    void add_sample_counts(const Band& band, std::span<const std::uint32_t> samples);
    void add_pictures(const Band& band, const std::vector<float>& beauty, const std::vector<float>& view);
    /// Replaces the colour, and the view if there is a processor.
    void replace_pictures(Image beauty, const ViewProcessor* view);
    /// Fills the layer "noisy" with the colour so far.
    void keep_noisy();
    /// Fills the layer "denoiser". weights: RGBA, DenoisedPicture::weights.
    void add_denoiser_weights(const std::vector<float>& weights);
    /// Adds a matte; coverage is by path index.
    void add_ids(const Band& band, int samples, std::string_view aov, const IdCoverage& coverage);
    /// Adds the layers of LayerSource::record.
    void add_data(const Band& band, const std::vector<shared::AovRecord>& records);
    /// Replaces the motion of surfaces that moved since the previous frame. Call it after add_data().
    void add_surface_motion(const Band& band, const std::vector<shared::AovRecord>& records,
                            const PreviousSurfaces& surfaces, const Camera& now, const Camera& previous);
    /// Adds the layers of LayerSource::debug.
    void add_debug(const Band& band, const std::vector<shared::DebugRecord>& records);

    /// Moves colour, view and layers, in the order of the request, to the result. Leaves the film empty.
    void take(RenderResult& result);
    /// Moves the pixels [first, first + size) of them.
    void take(RenderResult& result, const ivec2& first, const ivec2& size);

  private:
    struct Plane {
        const AovInfo* aov;
        Image image;
    };
    Image* plane(std::string_view aov);
    void add_materials(const Band& band, const std::vector<shared::AovRecord>& records, Image& ids) const;

    RenderSettings settings_;
    const TraceTables& tables_;
    const paging::PageSource* pages_;
    Image beauty_;
    Image view_;
    std::vector<Plane> planes_;  // layers in the order of the request
};

}  // namespace halflight
