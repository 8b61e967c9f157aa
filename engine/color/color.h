// Colour management through OpenColorIO: configs, displays and views, and the view transform as CPU code and as GLSL.
// Rendering happens in linear Rec.709 with any config. Only display images have a display transform applied.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/chromaticities.h"
#include "engine/core/display_encoding.h"
#include "engine/core/image.h"
#include "engine/core/math.h"
#include "engine/core/versioned_file.h"
#include "engine/core/view_transform.h"

namespace halflight {

/// A texture that the shader samples. Upload it as GL_R32F or GL_RGB32F, clamped to the edge, without mipmaps.
struct GpuLut {
    std::string sampler;        // name of the uniform, whose type is sampler{dimensions}D
    int dimensions = 3;         // number of dimensions: 1, 2 or 3
    int width = 1;              // width, texels, >= 1
    int height = 1;             // height, texels, >= 1; 1 for 1D
    int depth = 1;              // depth, texels, >= 1; 1 unless 3D
    int channels = 3;           // channels per texel: 1 or 3
    bool linear = true;         // true: linear filter; false: nearest
    std::vector<float> values;  // width * height * depth * channels, x fastest
};

/// GLSL 4.5 text without #version, which may include files of shaders/shared. It declares its samplers and defines
///     vec4 ocio_view(vec4 pixel)
/// which converts linear Rec.709, already multiplied by the exposure, to display-encoded values in [0,1]. Alpha passes
/// through.
struct GpuShader {
    std::string glsl;
    std::vector<GpuLut> luts;
    std::string cache_id;  // equal ids mean equal text and textures
};

/// Transform of one display, view and look. It is cheap to copy; its const members may be called from many threads.
///
/// CPU and GPU apply the same steps. First NaN becomes 0 and values are clamped to +-65504, so that an infinity shows
/// as white. Then OCIO is applied, and its result is clamped to [0,1]. Before it, views whose view transform has the
/// family "halflight:pbr_neutral" or "halflight:agx", in any config, apply that formula (shaders/shared/tone_map.h).
class ViewProcessor {
  public:
    /// Returns a display-encoded copy of a linear Rec.709 image of 3 or 4 channels. Applies the exposure; keeps alpha.
    Image apply(const Image& image) const;
    /// Returns the transform as GLSL, without the exposure: the caller multiplies by exposure_scale() first.
    GpuShader gpu_shader() const;
    float exposure_scale() const;
    const std::string& display() const;
    const std::string& view() const;
    const std::string& look() const;
    /// Returns how the display encodes colour, measured; none for raw data and for displays of other primaries or
    /// curves. Views that end in a space of the scene tell nothing: displays with sRGB in their name have that
    /// encoding, others none.
    const std::optional<DisplayEncoding>& encoding() const;
    std::string cache_id() const;  ///< Returns a text that is the same for equal transforms, without the exposure.

  private:
    friend class ColorConfig;
    struct Data;
    explicit ViewProcessor(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
    std::shared_ptr<const Data> data_;
};

/// A linear colour space of the config, to which scene-linear output can be converted.
struct LinearSpace {
    std::string name;
    mat3 from_rec709{1};  // matrix for column vectors
    /// Primaries: published ones of Rec.709, AP1 and AP0, else those of the matrix, relative to D65. None if it does
    /// not map white to white, as that of CIE XYZ does not.
    std::optional<Chromaticities> chromaticities;
};

class ColorConfig {
  public:
    /// Loads `file`, else $OCIO, else the built-in config. Throws Error if a named file cannot be read; it never
    /// falls back to the next one.
    static ColorConfig load(const std::optional<std::filesystem::path>& file = std::nullopt);

    const std::string& source() const;  ///< Returns the file's name, or "built-in".
    /// Returns the files of the config: its own file, then the existing LUTs that it names. Empty for the built-in
    /// config. The versions are those at the time of load().
    const std::vector<VersionedFile>& files() const;
    std::vector<std::string> displays() const;
    std::vector<std::string> views(const std::string& display) const;
    std::vector<std::string> looks() const;
    std::vector<std::string> linear_spaces() const;  ///< Returns the names that linear_space() takes, without aliases.
    std::string default_display() const;
    std::string default_view(const std::string& display) const;

    /// Returns the processor of a view. Throws Error that lists the valid names if a name is unknown.
    ViewProcessor view(const ViewTransform& transform) const;

    /// Returns a colour space by name, alias or role; "" is the rendering space itself. Names and aliases of the
    /// built-in config are known with any config, whose own spaces come first. Throws Error that lists linear_spaces()
    /// if the space is unknown or holds data, or if no matrix leads to it from linear Rec.709.
    LinearSpace linear_space(const std::string& name) const;

  private:
    struct Data;
    explicit ColorConfig(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
    LinearSpace find_linear(const std::string& name) const;  ///< Returns linear_space(), with shorter errors.
    std::shared_ptr<const Data> data_;
};

}  // namespace halflight
