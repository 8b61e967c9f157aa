// Preview modes over a whole picture: what its bands have added up to goes in, another picture comes out.
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
#include "passes/preview/temporal.h"
#include "shaders/shared/aov.h"
#include "shaders/shared/frame.h"

namespace halflight {

/// What pictures leave to the next one with Preview::temporal. It is of no renderer: those of other sizes, and of other
/// poses of a scene, may go on with it, one after the other, in the same context, which must outlive it. Who changes
/// what is seen in a way that no motion tells, another scene, other lights, a cut, forgets it.
class PictureHistory {
  public:
    void forget() { earlier_.reset(), shown_.reset(); }

  private:
    friend class PreviewPicture;
    struct Kept {
        Kept(const shared::Frame& frame, const dvec3& origin);
        gpu::Texture light, guide, place;  // as PreviewTexels
        shared::Frame frame;               // of the whole picture; its previous camera is its own
        dvec3 origin;                      // TraceTables::origin
        bool filled = false;
    };
    std::optional<Kept> earlier_;  // that the picture in the making looks back at
    std::optional<Kept> shown_;    // the picture in the making, as it was seen last
};

class PreviewPicture {
  public:
    /// Of a picture of this size. Throws Error where the driver takes none so large.
    PreviewPicture(gpu::ProgramCache& programs, const Preview& preview, const ivec2& image);

    /// Another picture begins: the one before it is that which it looks back at. history: or null; outlives the
    /// picture.
    void begin(PictureHistory* history);
    /// To be filled by add_preview_input(), band by band.
    PreviewPixels import_pixels(graph::Graph& graph);
    /// Where what a band shows was in the earlier picture, where there is one; for all bands or for none.
    void add_motion(const Band& band, std::span<const shared::AovRecord> records, const TraceTables& tables,
                    const PreviousSurfaces& surfaces);

    struct Made {
        std::optional<Image> beauty;      // none: the mean is the picture
        std::vector<std::string> biases;  // phrases; empty with it
        std::uint64_t nans = 0;           // readings of the earlier picture that were refused
        std::uint64_t infinities = 0;
    };
    /// Of all bands as they are, each with `samples` at least. frame: of the whole picture through the pixels' centres,
    /// its previous camera its own; origin: TraceTables::origin. May be called again, with more samples.
    Made make(const shared::Frame& frame, const dvec3& origin, int samples);

    std::size_t bytes() const;  ///< In device memory; of the history, too.
    void measure(bool on) { executor_.measure(on); }
    const std::vector<graph::PassTime>& times() const { return executor_.times(); }  ///< since begin()

  private:
    std::optional<EarlierPicture> import_earlier(graph::Graph& graph, const dvec3& origin);
    PreviewTexels import_shown(graph::Graph& graph, const shared::Frame& frame, const dvec3& origin);

    Preview preview_;
    gpu::Texture light_, guide_, place_, albedo_, beauty_;  // as PreviewPixels
    gpu::Buffer frame_constants_;
    gpu::Buffer refused_;
    std::optional<gpu::Texture> before_;  // as EarlierPicture::before
    Image moved_;                         // its content; empty: nothing but the camera has moved
    PictureHistory* history_ = nullptr;
    graph::Executor executor_;
    std::size_t transient_bytes_ = 0;
};

}  // namespace halflight
