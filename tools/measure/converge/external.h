// Another renderer, run as a command of the shell, among the methods that are compared.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "tools/measure/converge/painter.h"

namespace halflight::converge {

/// What the placeholders of Plan::external's command stand for, beside a picture's own: {samples}, {seed}, {width},
/// {height}, {bounces} and {output}, the .exr to write. Names are quoted for the shell.
struct ExternalScene {
    std::filesystem::path file;  // {scene}
    std::string camera;          // {camera}
    Environment environment;     // {environment}: an .exr, equirectangular, u = atan2(d.z, d.x) / 2 pi + 1/2
};

/// Throws Error where a command is not told where the picture goes, of how many samples it is and by which seed.
void check_external(const External& external);

/// Runs the command for each picture and reads what it writes: channels R, G, B, mean scene-linear radiance (Rec.709)
/// of the view's pixels. Its own figures count where it prints them as a line of JSON, `{"seconds": 1.5, "cpu_seconds":
/// 3}`, each for itself; else those of the whole process. The picture has no components, and needs budgets of
/// samples. What paint() throws names the command's last words where it fails, or writes no such picture. Throws Error
/// where the camera has no name, or the environment is not black and the command does not take it.
std::unique_ptr<Painter> external_painter(const External& external, const ExternalScene& scene, const View& view);

}  // namespace halflight::converge
