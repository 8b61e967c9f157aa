// Another renderer among the methods that are compared: a program that is run once for each picture.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "tools/measure/converge/painter.h"

namespace halflight::converge {

struct ExternalScene {
    std::filesystem::path file;
    Environment environment;
};

/// Throws Error if the command has an open quote or lacks {output}, {samples} or {seed}.
void check_external(const External& external);

/// Returns a painter that runs the command for each picture and reads the file that it writes. Its channels R, G, B are
/// the mean scene-linear radiance (Rec.709) of pixels. The picture has no components; budgets must be of samples.
///
/// No shell is involved. split_command() splits the command, and only then placeholders are replaced inside arguments:
///   {scene} {output}            absolute path of the scene, path of the .exr to write
///   {environment}               path of an .exr, equirectangular, u = atan2(d.z, d.x) / 2 pi + 1/2
///   {camera}                    name of the camera
///   {look-from} {look-at} {up}  pose of the camera as x,y,z; world units
///   {vfov}                      vertical field of view, degrees
///   {samples} {seed}            samples per pixel, seed of the picture
///   {width} {height}            pixels
///   {bounces} {bounces-1}       reflections along a path, without the first one
///   {threads}                   hardware threads of the machine
///
/// Times that the program prints as a line of JSON, {"seconds": 1.5, "cpu_seconds": 3}, replace those of the process.
/// The painter throws Error with the last line of the program if it fails or writes no such picture.
/// Throws Error if the command cannot describe the camera, or takes no {environment} and the scene's is not black.
std::unique_ptr<Painter> external_painter(const External& external, const ExternalScene& scene, const View& view);

}  // namespace halflight::converge
