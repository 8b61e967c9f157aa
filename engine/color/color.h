// Colour management through OpenColorIO: which config, which display and view, and the same transform as CPU code and
// as GLSL. Rendering happens in linear Rec.709 whatever the config; display transforms are baked into display images
// only.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/chromaticities.h"
#include "engine/core/image.h"
#include "engine/core/math.h"

namespace halflight {

/// What is wanted. Names are those of the config, in any case; a display's trailing " - Display" may be left out.
struct ViewTransform {
    std::string display;  // empty: the config's default
    std::string view;     // empty: the display's default
    std::string look;     // empty: those of the view; otherwise it replaces them ("a, -b": a, then b undone)
    float exposure = 0;   // stops: radiance is multiplied by 2^exposure before anything else
    bool operator==(const ViewTransform&) const = default;
};

/// A texture that the shader samples: upload as GL_R32F or GL_RGB32F, clamp to edge, no mipmaps.
struct GpuLut {
    std::string sampler;        // name of the uniform, of type sampler{dimensions}D
    int dimensions = 3;         // 1, 2 or 3
    int width = 1;              // texels
    int height = 1;             // texels
    int depth = 1;              // texels
    int channels = 3;           // 1 or 3
    bool linear = true;         // filter: linear or nearest
    std::vector<float> values;  // width * height * depth * channels, x fastest
};

/// GLSL 4.5 text without #version that declares its samplers and defines
///     vec4 ocio_view(vec4 pixel)
/// of linear Rec.709, exposure already multiplied in, to display-encoded values in [0,1]; alpha passes through.
struct GpuShader {
    std::string glsl;
    std::vector<GpuLut> luts;
    std::string cache_id;  // same id, same text and textures
};

/// One display, view and look. Cheap to copy; const members may be called from many threads.
///
/// On both sides: NaN counts as 0 and values are held within +-65504, so that an infinity shows as white; then OCIO;
/// then the result is clamped to [0,1].
class ViewProcessor {
  public:
    /// Display-encoded copy of a linear Rec.709 image of 3 or 4 channels; exposure applied; alpha untouched.
    Image apply(const Image& image) const;
    /// The same for the GPU, except exposure: the caller multiplies by exposure_scale() first.
    GpuShader gpu_shader() const;
    float exposure_scale() const;
    const std::string& display() const;
    const std::string& view() const;
    const std::string& look() const;

  private:
    friend class ColorConfig;
    struct Data;
    explicit ViewProcessor(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
    std::shared_ptr<const Data> data_;
};

/// A linear space of the config that scene-linear output can be converted to.
struct LinearSpace {
    std::string name;
    mat3 from_rec709{1};                           // column vectors
    std::optional<Chromaticities> chromaticities;  // where it is Rec.709, AP1 or AP0; unknown otherwise
};

class ColorConfig {
  public:
    /// `file`, else $OCIO, else the config that is compiled in. What is named and cannot be read is an Error, never a
    /// reason to take the next one.
    static ColorConfig load(const std::optional<std::filesystem::path>& file = std::nullopt);

    const std::string& source() const;  ///< the file's name, or "built-in"
    /// What the config is made of: its own file, then LUTs that it names and that are there; none of the built-in one.
    const std::vector<std::filesystem::path>& files() const;
    std::vector<std::string> displays() const;
    std::vector<std::string> views(const std::string& display) const;
    std::vector<std::string> looks() const;
    std::vector<std::string> color_spaces() const;
    std::string default_display() const;
    std::string default_view(const std::string& display) const;

    /// Error lists the valid names where one is not known.
    ViewProcessor view(const ViewTransform& transform) const;

    /// A colour space, alias or role by name; Error where it is unknown or not a matrix away from linear Rec.709.
    /// "" is the rendering space itself and asks nothing of the config.
    LinearSpace linear_space(const std::string& name) const;

  private:
    struct Data;
    explicit ColorConfig(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
    std::shared_ptr<const Data> data_;
};

}  // namespace halflight
