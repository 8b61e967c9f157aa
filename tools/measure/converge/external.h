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

/// Throws Error where the command has an open quote or lacks {output}, {samples} or {seed}.
void check_external(const External& external);

/// Runs the command for each picture and reads the file that it writes: channels R, G, B, mean scene-linear radiance
/// (Rec.709) of the view's pixels. No shell is involved: split_command() makes arguments of the command, and only then
/// are placeholders replaced inside them:
/// - {scene}: absolute path of the file; {output}: the .exr to write;
/// - {environment}: an .exr, equirectangular, u = atan2(d.z, d.x) / 2 pi + 1/2;
/// - {camera}: the camera's name; {look-from}, {look-at}, {up}: x,y,z of points and direction, world units; {vfov}:
///   vertical field of view, degrees;
/// - {samples} per pixel, {seed}, {width} and {height} in pixels, {bounces}, {bounces-1}, {threads} of the machine.
/// Times that the program prints as a line of JSON, {"seconds": 1.5, "cpu_seconds": 3}, count, each for itself;
/// otherwise the times of the whole process. The picture has no components, and budgets must be of samples.
/// paint() throws Error with the last line that the program has printed where it fails or writes no such picture.
/// Throws Error where the command cannot describe the camera, or takes no {environment} and the scene's is not black.
std::unique_ptr<Painter> external_painter(const External& external, const ExternalScene& scene, const View& view);

}  // namespace halflight::converge
