// Fingerprints of frames: text in their files by which later runs recognise frames of the same settings.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "renderer/render.h"
#include "tools/halflight/animated_scene.h"
#include "tools/halflight/arguments.h"

namespace halflight {

/// Returns a fingerprint of everything that decides the pixels of a sequence: settings, version of the program, and the
/// contents of all files (scene, environment map, colour config with its LUTs). Throws Error for a file that can no
/// longer be read.
std::string sequence_fingerprint(const RenderArguments& arguments, const RenderSettings& settings,
                                 const AnimatedScene& scene, const ColorConfig& config);

/// Returns the fingerprint of one frame: 16 hexadecimal digits.
std::string frame_fingerprint(const std::string& sequence, std::uint32_t frame);

/// Name of the attribute of an .exr, and keyword of a .png, that holds the fingerprint.
inline constexpr const char* kFingerprintName = "halflightFingerprint";

enum class FrameFile {
    missing,     // does not exist or is no file
    whole,       // can be read completely and has the expected fingerprint
    incomplete,  // an .exr or .png that cannot be read to its end
    other,       // has another fingerprint or none
};

/// Examines an .exr or .png, which is recognised by its contents.
FrameFile examine_frame(const std::filesystem::path& path, const std::string& fingerprint);

}  // namespace halflight
