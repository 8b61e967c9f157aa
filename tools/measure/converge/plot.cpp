#include "tools/measure/converge/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace halflight::converge {
namespace {

// Units of the drawing, which the page scales.
constexpr double kWidth = 560, kHeight = 410;
constexpr double kLeft = 74, kRight = 14, kBottom = 52;
constexpr double kTitle = 18, kLegendRow = 18;
constexpr double kTick = 5, kMinorTick = 3;

/// Okabe and Ito's colours, which people with colour vision deficiency can distinguish (Color Universal Design, 2008).
constexpr const char* kColours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00"};

/// A logarithmic axis from pixel `from` to pixel `to`.
class Axis {
  public:
    Axis(double low, double high, double from, double to) : from_(from), to_(to) {
        // The axis has margins of a tenth of a decade and spans at least a factor of 3.
        low_ = std::log10(low) - 0.1, high_ = std::log10(high) + 0.1;
        const double missing = std::log10(3.0) - (high_ - low_);
        if (missing > 0) low_ -= missing / 2, high_ += missing / 2;
    }
    double at(double value) const { return from_ + (to_ - from_) * (std::log10(value) - low_) / (high_ - low_); }
    double clamped(double value) const {
        return value > 0 ? std::clamp(at(value), std::min(from_, to_), std::max(from_, to_)) : from_;
    }
    bool holds(double value) const { return std::log10(value) >= low_ && std::log10(value) <= high_; }
    double low() const { return std::pow(10, low_); }
    double high() const { return std::pow(10, high_); }

    struct Tick {
        double value;
        bool labelled;
        bool decade;
    };
    /// Returns ticks at powers of ten and their multiples. An axis with one power of ten has labels at 2 and 5, too; an
    /// axis without any has labels at all odd multiples and 2.
    std::vector<Tick> ticks() const {
        std::vector<Tick> ticks;
        int decades = 0;
        for (int d = floor_decade(); d <= static_cast<int>(std::ceil(high_)); ++d) decades += holds(std::pow(10.0, d));
        for (int d = floor_decade(); d <= static_cast<int>(std::ceil(high_)); ++d) {
            for (int m = 1; m < 10; ++m) {
                const double value = m * std::pow(10.0, d);
                const bool labelled = m == 1 || (decades < 2 && (m == 2 || m == 5)) || (decades < 1 && m % 2 == 1);
                if (holds(value)) ticks.push_back({value, labelled, m == 1});
            }
        }
        return ticks;
    }

  private:
    int floor_decade() const { return static_cast<int>(std::floor(low_)); }
    double from_, to_, low_ = 0, high_ = 0;
};

/// Returns "0.5" or "20", or a power of ten if a plain number would be long.
std::string tick_text(double value) {
    const int exponent = static_cast<int>(std::floor(std::log10(value) + 1e-9));  // log10 of 1000 may be 2.99...
    if (exponent >= -2 && exponent <= 3) return fmt::format("{:g}", value);
    const long mantissa = std::lround(value / std::pow(10.0, exponent));
    const std::string times = mantissa == 1 ? "" : fmt::format("{}·", mantissa);
    const std::string minus = exponent < 0 ? "−" : "";
    return fmt::format(R"({}10<tspan dy="-5" font-size="9">{}{}</tspan>)", times, minus, std::abs(exponent));
}

std::string marker(std::size_t index, double x, double y) {
    const char* colour = kColours[index % std::size(kColours)];
    switch (index % 4) {
        case 0:
            return fmt::format(R"(<circle cx="{:.2f}" cy="{:.2f}" r="4" fill="{}"/>)", x, y, colour);
        case 1:
            return fmt::format(R"(<rect x="{:.2f}" y="{:.2f}" width="7" height="7" fill="{}"/>)", x - 3.5, y - 3.5,
                               colour);
        case 2:
            return fmt::format(R"(<path d="M{:.2f} {:.2f}l4.5 8h-9z" fill="{}"/>)", x, y - 5, colour);
        default:
            return fmt::format(R"(<path d="M{:.2f} {:.2f}l5 5l-5 5l-5 -5z" fill="{}"/>)", x, y - 5, colour);
    }
}

bool has_marker(const Dot& dot) {
    return dot.x > 0 && dot.y > 0 && std::isfinite(dot.x) && std::isfinite(dot.y);
}

bool has_bar(const Dot& dot) {
    return dot.x > 0 && dot.high > 0 && std::isfinite(dot.x) && std::isfinite(dot.high);
}

struct Range {
    double low = std::numeric_limits<double>::infinity();
    double high = 0;
    void add(double value) { low = std::min(low, value), high = std::max(high, value); }
};

class Drawing {
  public:
    explicit Drawing(const Plot& plot) : plot_(plot), legend_(legend()) {
        top_ = kTitle + kLegendRow * (legend_.empty() ? 1 : legend_.back().row + 2);
        for (const Curve& curve : plot.curves) {
            for (const Dot& dot : curve.dots) {
                if (has_marker(dot) || has_bar(dot)) x_range_.add(dot.x);
                if (has_marker(dot)) y_range_.add(dot.y);
                if (has_bar(dot)) y_range_.add(dot.high);
                // The axis need not contain bars of more than two decades, which may end near 0.
                if (has_bar(dot) && dot.low > dot.high / 100) y_range_.add(dot.low);
            }
        }
    }

    std::string text() {
        out_ = fmt::format(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" role=\"img\" "
            "font-family=\"Helvetica, Arial, sans-serif\" font-size=\"12\" fill=\"#222\">\n<title>{}</title>\n",
            kWidth, kHeight, escape(plot_.title));
        add(R"(<text x="{}" y="{}" font-size="14" font-weight="bold">{}</text>)", kLeft, kTitle, escape(plot_.title));
        if (y_range_.high > 0)
            draw();
        else
            add(R"(<text x="{}" y="{}" text-anchor="middle" fill="#777">nothing above zero to show</text>)", kWidth / 2,
                kHeight / 2);
        return out_ + "</svg>\n";
    }

  private:
    template <class... Args>
    void add(fmt::format_string<Args...> format, Args&&... args) {
        fmt::format_to(std::back_inserter(out_), format, std::forward<Args>(args)...);
        out_ += '\n';
    }
    void line(double x0, double y0, double x1, double y1, const char* style) {
        add(R"(<path d="M{:.2f} {:.2f}L{:.2f} {:.2f}" fill="none" {}/>)", x0, y0, x1, y1, style);
    }

    void draw() {
        const Axis x(x_range_.low, x_range_.high, kLeft, kWidth - kRight);
        const Axis y(y_range_.low, y_range_.high, kHeight - kBottom, top_);
        draw_axes(x, y);
        if (plot_.guide != 0) draw_guide(x, y);
        for (std::size_t i = 0; i < plot_.curves.size(); ++i) draw_curve(i, x, y);
        draw_legend();
    }

    void draw_axes(const Axis& x, const Axis& y) {
        constexpr const char* kGrid = R"(stroke="#e4e4e4" stroke-width="1")";
        constexpr const char* kInk = R"(stroke="#222" stroke-width="1")";
        const double bottom = kHeight - kBottom, right = kWidth - kRight;
        for (const Axis::Tick& t : x.ticks()) {
            const double at = x.at(t.value);
            if (t.labelled) line(at, top_, at, bottom, kGrid);
            line(at, bottom, at, bottom - (t.decade ? kTick : kMinorTick), kInk);
            if (t.labelled)
                add(R"(<text x="{:.2f}" y="{:.2f}" text-anchor="middle">{}</text>)", at, bottom + 17,
                    tick_text(t.value));
        }
        for (const Axis::Tick& t : y.ticks()) {
            const double at = y.at(t.value);
            if (t.labelled) line(kLeft, at, right, at, kGrid);
            line(kLeft, at, kLeft + (t.decade ? kTick : kMinorTick), at, kInk);
            if (t.labelled)
                add(R"(<text x="{:.2f}" y="{:.2f}" text-anchor="end">{}</text>)", kLeft - 7, at + 4,
                    tick_text(t.value));
        }
        add(R"(<rect x="{}" y="{}" width="{}" height="{}" fill="none" {}/>)", kLeft, top_, right - kLeft, bottom - top_,
            kInk);
        add(R"(<text x="{}" y="{}" text-anchor="middle" font-size="13">{}</text>)", (kLeft + right) / 2, kHeight - 12,
            escape(plot_.x_label));
        add(R"svg(<text transform="translate(18 {}) rotate(-90)" text-anchor="middle" font-size="13">{}</text>)svg",
            (top_ + bottom) / 2, escape(plot_.y_label));
    }

    /// Draws the guide through the middle of the curves' ranges, clipped to the frame.
    void draw_guide(const Axis& x, const Axis& y) {
        const double mx = std::sqrt(x_range_.low * x_range_.high), my = std::sqrt(y_range_.low * y_range_.high);
        double low = x.low(), high = x.high();
        const auto height = [&](double at) { return my * std::pow(at / mx, plot_.guide); };
        const double at_top = mx * std::pow(y.high() / my, 1 / plot_.guide);
        const double at_bottom = mx * std::pow(y.low() / my, 1 / plot_.guide);
        low = std::max(low, std::min(at_top, at_bottom)), high = std::min(high, std::max(at_top, at_bottom));
        line(x.at(low), y.at(height(low)), x.at(high), y.at(height(high)),
             R"(stroke="#999" stroke-width="1" stroke-dasharray="5 4")");
    }

    void draw_curve(std::size_t index, const Axis& x, const Axis& y) {
        const std::string style =
            fmt::format(R"(stroke="{}" stroke-width="1.6")", kColours[index % std::size(kColours)]);
        std::string path, bars, marks;
        for (const Dot& dot : plot_.curves[index].dots) {
            if (has_bar(dot)) {
                const double px = x.at(dot.x);
                bars += fmt::format("M{0:.2f} {1:.2f}V{2:.2f}", px, y.clamped(dot.low), y.clamped(dot.high));
                for (const double end : {dot.low, dot.high})
                    if (end > 0 && y.holds(end)) bars += fmt::format("M{:.2f} {:.2f}h6", px - 3, y.at(end));
            }
            if (has_marker(dot)) {
                path += fmt::format("{}{:.2f} {:.2f}", path.empty() ? "M" : "L", x.at(dot.x), y.at(dot.y));
                marks += marker(index, x.at(dot.x), y.at(dot.y)) + '\n';
            }
        }
        if (!path.empty()) add(R"(<path d="{}" fill="none" {}/>)", path, style);
        if (!bars.empty()) add(R"(<path d="{}" fill="none" {}/>)", bars, style);
        out_ += marks;
    }

    struct Entry {
        std::string label;
        double left;
        int row;
    };
    /// Places the legend between title and frame, in as many rows as needed.
    std::vector<Entry> legend() const {
        constexpr double kLetter = 7;  // width of a wide letter
        std::vector<Entry> entries;
        for (const Curve& curve : plot_.curves) entries.push_back({curve.name, 0, 0});
        if (plot_.guide != 0)
            entries.push_back({fmt::format("slope {}{:g}", plot_.guide < 0 ? "−" : "", std::abs(plot_.guide)), 0, 0});
        double left = kLeft;
        int row = 0;
        for (Entry& entry : entries) {
            const double width = kSample + 18 + kLetter * static_cast<double>(entry.label.size());
            if (left + width > kWidth && left > kLeft) left = kLeft, ++row;
            entry.left = left, entry.row = row;
            left += width;
        }
        return entries;
    }

    void draw_legend() {
        for (std::size_t i = 0; i < legend_.size(); ++i) {
            const Entry& entry = legend_[i];
            const double at = kTitle + kLegendRow * (entry.row + 1);
            const bool guide = i == plot_.curves.size();
            const std::string stroke =
                fmt::format(R"(stroke="{}" {})", guide ? "#999" : kColours[i % std::size(kColours)],
                            guide ? R"(stroke-width="1" stroke-dasharray="5 4")" : R"(stroke-width="1.6")");
            line(entry.left, at, entry.left + kSample, at, stroke.c_str());
            if (!guide) out_ += marker(i, entry.left + kSample / 2, at) + '\n';
            add(R"(<text x="{:.2f}" y="{:.2f}">{}</text>)", entry.left + kSample + 6, at + 4, escape(entry.label));
        }
    }

    static constexpr double kSample = 24;  // length of a line in the legend

    const Plot& plot_;
    std::vector<Entry> legend_;
    double top_ = 0;  // upper edge of the frame
    Range x_range_, y_range_;
    std::string out_;
};

}  // namespace

std::string escape(const std::string& text) {
    std::string out;
    for (const char c : text) {
        switch (c) {
            case '&':
                out += "&amp;";
                break;
            case '<':
                out += "&lt;";
                break;
            case '>':
                out += "&gt;";
                break;
            case '"':
                out += "&quot;";
                break;
            case '\'':
                out += "&#39;";
                break;
            default:
                out +=
                    static_cast<unsigned char>(c) < ' ' && c != '\t' && c != '\n' ? "\xef\xbf\xbd" : std::string(1, c);
        }
    }
    return out;
}

std::string svg(const Plot& plot) {
    return Drawing(plot).text();
}

}  // namespace halflight::converge
