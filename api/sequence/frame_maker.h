// Makes the pictures of the frames of a sequence.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "api/halflight/movie.h"
#include "api/halflight/sequence.h"
#include "api/halflight/statistics.h"
#include "api/sequence/develop.h"
#include "api/sequence/frame_files.h"
#include "api/sequence/noisy_files.h"
#include "engine/io/file_claims.h"

namespace halflight {

struct Stopped {};  ///< thrown when a callback stops the sequence

/// Renders and writes frames one after the other. Owns the renderer.
class FrameMaker {
  public:
    /// claims: claims of the frames, which processes share; null: nothing is shared.
    FrameMaker(LoadedScene& scene, const RenderSettings& settings, const RendererOptions& renderer,
               const SequenceOptions& options, const SequenceEvents& events, const Log& log, const FrameFiles& files,
               const FileClaims* claims);
    ~FrameMaker();
    FrameMaker(const FrameMaker&) = delete;
    FrameMaker& operator=(const FrameMaker&) = delete;

    /// Makes a frame and adds it to `movie` if that is not null. Throws Stopped, and Error if the frame cannot be made.
    void make(FrameNumber frame, Movie* movie);

  private:
    /// Makes the pictures of a frame that are missing from its .exr.
    void develop(FrameNumber frame, const std::filesystem::path& exr, Movie* movie);
    /// Returns the files of noisy frames; null if none are needed.
    std::shared_ptr<NoisyFiles> noisy_files(const FileClaims* claims);
    RendererOptions with_files(RendererOptions renderer) const;
    PictureInfo info(const RenderResult& result, const std::string& error) const;

    const SequenceOptions& options_;
    const SequenceEvents& events_;
    const Log& log_;
    const FrameFiles& files_;
    ViewTransform requested_view_;
    const LoadedScene& scene_;
    PoseWarnings warnings_;
    bool exposure_noted_ = false;
    const std::shared_ptr<NoisyFiles> noisy_files_;
    FrameRenderer renderer_;
    std::optional<Developer> developer_;
    std::vector<std::string> logged_biases_;  // biases of the previous frame
};

}  // namespace halflight
