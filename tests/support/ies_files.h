// Makes IES LM-63 files for tests.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace halflight::test {

/// Contents of a file. Angles are in degrees.
struct IesFile {
    std::string first_line = "IESNA:LM-63-2002";  // "": none, as in files of 1986
    std::string tilt = "NONE";                    // with what follows the line TILT=
    std::vector<double> vertical{}, horizontal{};
    std::function<double(double v, double h)> candela{};  // before factors
    double multiplier = 1, ballast = 1, lamp = 1;         // candela multiplier, ballast and ballast-lamp factor
    int type = 1;                                         // photometric type; 1: C
    std::string end = "\n", separator = " ";

    std::string text() const {
        std::string text = first_line.empty() ? "" : first_line + end;
        text += "[TEST] a \xe9 {odd} line = 1, [2]" + end + "[MANUFAC]" + end + "TILT=" + tilt + end;
        const auto line = [&](const std::vector<double>& numbers) {
            text += fmt::format("{}", fmt::join(numbers, separator)) + end;
        };
        line({1, -1, multiplier, double(vertical.size()), double(horizontal.size()), double(type), 2, 0, 0, 0});
        line({ballast, lamp, 18.5});
        line(vertical);
        line(horizontal);
        for (const double h : horizontal) {
            std::vector<double> column;
            for (const double v : vertical) column.push_back(candela(v, h));
            line(column);
        }
        return text;
    }
};

/// Returns angles from `first` to `last`.
inline std::vector<double> degrees(double first, double last, double step) {
    std::vector<double> all;
    for (std::size_t i = 0; first + double(i) * step <= last + 1e-9; ++i) all.push_back(first + double(i) * step);
    return all;
}

/// Returns a narrow downlight, alike around its axis and dark above.
inline IesFile downlight() {
    return {.vertical = degrees(0, 90, 5), .horizontal = {0}, .candela = [](double v, double) {
                return 40 + 3 * (90 - v) * (90 - v) / 10;
            }};
}

/// Returns a street lamp, symmetric about the plane of 0 and 180 degrees.
inline IesFile street_lamp() {
    return {.first_line = "IESNA:LM-63-1995",
            .vertical = {0, 10, 25, 40, 55, 65, 72, 80, 90, 180},
            .horizontal = degrees(0, 180, 15),
            .candela = [](double v, double h) { return v > 90 ? 0 : (10 + v) * (200 - h); },
            .multiplier = 0.5,
            .ballast = 0.9,
            .lamp = 7};
}

/// Returns a lamp that shines up and down and differs in all directions, with the separators of some programs.
inline IesFile washer() {
    return {.first_line = "IESNA91",
            .vertical = degrees(0, 180, 7.5),
            .horizontal = {0, 20, 45, 90, 130, 180, 225, 300, 360},
            .candela =
                [](double v, double h) {
                    const double turn = h == 360 ? 0 : h;  // the last angle is the first one
                    return 30 + v + (turn < 100 ? 2 * turn : 1.5 * (250 - turn) * (v > 90 ? -0.2 : 0.5) + 60);
                },
            .multiplier = 3,
            .ballast = 1.1,
            .lamp = 0.8,
            .end = "\r\n",
            .separator = ", "};
}

}  // namespace halflight::test
