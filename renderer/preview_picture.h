// Preview modes of a whole picture: temporal accumulation and denoising of the sums of all bands.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/graph/execute.h"
#include "engine/scene/motion.h"
#include "engine/settings/preview.h"
#include "engine/tables/tables.h"
#include "passes/preview/preview_texels.h"
#include "passes/preview/temporal.h"
#include "shaders/shared/aov_record.h"
#include "shaders/shared/frame_block.h"

namespace halflight {

/// History of Preview::temporal: light and geometry of the previous picture. Renderers of other sizes and other poses
/// of a scene may share it, one after the other, in one context, which must outlive it. Call forget() after changes
/// that motion does not describe: another scene, other lights, a camera cut.
class PictureHistory {
  public:
    void forget() { earlier_.reset(), shown_.reset(); }

  private:
    friend class PreviewPicture;
    struct Kept {
        Kept(const shared::Frame& frame, const dvec3& origin);
        gpu::Texture first, second, guide, place;  // see PreviewTexels
        shared::Frame frame;   // constants of the whole picture; the previous camera in them is the current one
        dvec3 origin;          // TraceTables::origin
        bool swapped = false;  // PreviewPicture::swaps_halves()
        bool filled = false;
    };
    std::optional<Kept> earlier_;  // picture before the current one, which the current one reads
    std::optional<Kept> shown_;    // current picture as it was shown last
};

/// Applies the modes to a picture. Owns its textures.
class PreviewPicture {
  public:
    /// Allocates textures for a picture of this size. Throws Error if the driver has no textures so large.
    PreviewPicture(gpu::ProgramCache& programs, const Preview& preview, const ivec2& image);

    /// Begins another picture, which reads the previous one. history: null for none; must outlive the picture.
    void begin(PictureHistory* history);
    /// Imports the textures that add_preview_input() fills, band by band.
    PreviewPixels import_pixels(graph::Graph& graph);
    /// Returns whether the first half of the samples belongs into the texture of the second one. Pictures take turns,
    /// so that pictures of one sample each give a history of both halves.
    bool swaps_halves() const { return swapped_; }
    /// Adds the earlier positions of a band's surfaces if there is an earlier picture. Call it for all bands or none.
    void add_motion(const Band& band, std::span<const shared::AovRecord> records, const TraceTables& tables,
                    const PreviousSurfaces& surfaces);

    struct Made {
        std::optional<Image> beauty;      // picture; none: the unbiased mean remains the picture
        std::vector<std::string> biases;  // reasons for bias, phrases; empty without `beauty`
        std::uint64_t nans = 0;           // number of rejected NaNs of the earlier picture
        std::uint64_t infinities = 0;     // number of rejected infinities of the earlier picture
    };
    /// Makes the picture from all bands, each with at least `samples` samples. frame: constants of the whole picture
    /// through the pixels' centres, with its own camera as the previous one. origin: TraceTables::origin. May be called
    /// again after more samples.
    Made make(const shared::Frame& frame, const dvec3& origin, int samples);

    std::size_t bytes() const;  ///< Returns the device memory including the history, bytes.
    void measure(bool on) { executor_.measure(on); }
    const std::vector<graph::PassTime>& times() const { return executor_.times(); }  ///< Returns times since begin().

  private:
    std::optional<EarlierPicture> import_earlier(graph::Graph& graph, const dvec3& origin);
    PreviewTexels import_shown(graph::Graph& graph, const shared::Frame& frame, const dvec3& origin);

    Preview preview_;
    gpu::Texture first_, second_, guide_, albedo_, beauty_;  // see PreviewPixels
    std::optional<gpu::Texture> place_;                      // with Preview::temporal
    gpu::Buffer refused_;
    std::optional<gpu::Texture> before_;  // see EarlierPicture::before
    Image moved_;                         // contents of before_; empty: only the camera has moved
    PictureHistory* history_ = nullptr;
    bool swapped_ = false;
    graph::Executor executor_;
    std::size_t transient_bytes_ = 0;
};

}  // namespace halflight
