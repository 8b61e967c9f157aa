// What a frame of a sequence is of, as text in its file: frames that are there already are told by it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "renderer/render.h"
#include "tools/halflight/animated_scene.h"
#include "tools/halflight/arguments.h"

namespace halflight {

/// Of all that decides the pixels of a sequence: the contents of the scene's files, of environment map and colour
/// config with its LUTs, the settings, the program's version. How hits are found, what is printed and where files are
/// is no part of it. Throws Error for a file that can no longer be read.
std::string sequence_fingerprint(const RenderArguments& arguments, const RenderSettings& settings,
                                 const AnimatedScene& scene, const ColorConfig& config);

/// Of one frame: 16 hexadecimal digits.
std::string frame_fingerprint(const std::string& sequence, std::uint32_t frame);

/// The text that a fingerprint has as attribute of an .exr, and as keyword in a .png.
inline constexpr const char* kFingerprintName = "halflightFingerprint";

enum class FrameFile {
    missing,     // or something that is no file, which writing will complain about
    whole,       // all of it can be read, and its fingerprint is that which was asked for
    incomplete,  // an .exr or .png that cannot be read to its end
    other,       // of another fingerprint, or none: somebody else's, or of other settings
};

/// Looks at an .exr or .png; told by what is in it, not by its name.
FrameFile examine_frame(const std::filesystem::path& path, const std::string& fingerprint);

}  // namespace halflight
