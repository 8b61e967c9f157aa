#include "engine/color/color.h"

#include <cmath>

#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/targets.h"

namespace halflight::fuzz {
namespace {

void check_view(const ColorConfig& config, const ViewTransform& wanted) {
    const ViewProcessor view = config.view(wanted);
    Image image(3, 1, 4);
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
        image.pixels[i] = i == 5 ? std::numeric_limits<float>::infinity() : 0.2f * static_cast<float>(i);
    for (const float v : view.apply(image).pixels)
        if (std::isnan(v)) throw Broken("a pixel of the view is not a number");
    if (view.gpu_shader().glsl.find("ocio_view") == std::string::npos) throw Broken("the shader has no function");
}

}  // namespace

void color(std::string_view input) {
    std::string names[4];
    for (std::string& name : names) {
        const std::size_t end = std::min(input.find('\n'), input.size());
        name = input.substr(0, end);
        input.remove_prefix(std::min(end + 1, input.size()));
    }
    const MemoryFile file(input);
    check_errors("", [&] {
        const ColorConfig config = input.empty() ? ColorConfig::load() : ColorConfig::load(file.path());
        check_errors("", [&] { check_view(config, {names[0], names[1], names[2]}); });
        check_errors("", [&] { config.linear_space(names[3]); });
        for (const std::string& display : config.displays())
            check_errors("", [&] { check_view(config, {display, "", ""}); });
    });
}

}  // namespace halflight::fuzz
