#include "tools/measure/converge/page.h"

#include <fmt/format.h>

#include "tools/measure/converge/maps.h"
#include "tools/measure/converge/plot.h"

namespace halflight::converge {
namespace {

constexpr const char* kStyle = R"css(
:root { color-scheme: light }
body { background: #fff; color: #222; font: 15px/1.5 Helvetica, Arial, sans-serif; max-width: 1160px;
  margin: 32px auto; padding: 0 24px }
h1 { font-size: 26px; margin: 0 0 4px } h2 { font-size: 19px; margin: 36px 0 10px } h3 { font-size: 15px; margin: 22px 0 6px }
p { max-width: 80ch; margin: 8px 0 } .sub { color: #666; margin: 0 0 18px }
table { border-collapse: collapse; min-width: 760px; font-size: 12.5px; font-variant-numeric: tabular-nums; margin: 8px 0 }
th { text-align: right; font-weight: 600; border-bottom: 1.5px solid #222; padding: 4px 6px; vertical-align: bottom }
td { text-align: right; border-bottom: 1px solid #e4e4e4; padding: 4px 6px; white-space: nowrap }
th:first-child, td:first-child { text-align: left; padding-left: 2px } .names :is(th, td):nth-child(2) { text-align: left }
tr.first td { border-top: 1.5px solid #999 }
caption { caption-side: bottom; text-align: left; color: #666; font-size: 12.5px; padding: 6px 2px; max-width: 95ch }
.fine { color: #00724f; font-weight: 600 } .open { color: #666; font-weight: 600 } .flag { color: #b3400a; font-weight: 600 }
.plots { display: grid; grid-template-columns: 1fr 1fr; gap: 18px 26px } .plots svg { width: 100%; height: auto }
.pictures { display: grid; grid-template-columns: repeat(auto-fill, minmax(255px, 1fr)); gap: 16px 18px }
figure { margin: 0 } figcaption { font-size: 12.5px; color: #444; margin-top: 4px }
figure img { width: 100%; height: auto; display: block; border: 1px solid #ddd; image-rendering: pixelated }
ul { padding-left: 20px; max-width: 85ch } li { margin: 4px 0 }
@media print { body { margin: 0; max-width: none; font-size: 11pt } h2 { break-after: avoid }
  table, figure, .plots svg { break-inside: avoid } }
@media (max-width: 800px) { .plots { grid-template-columns: 1fr }
  table { display: block; overflow-x: auto; min-width: 0 } }
)css";

}  // namespace

std::string typeset(const std::string& text) {
    std::string out;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char before = i > 0 ? text[i - 1] : ' ', after = i + 1 < text.size() ? text[i + 1] : ' ';
        if (text[i] == '-' && (before == '(' || before == ' ') && after >= '0' && after <= '9')
            out += "−";
        else if (text[i] == ' ' && after == '%')
            out += "\u00a0";
        else
            out += text[i];
    }
    return out;
}

void Page::markup(const std::string& markup) {
    body_ += markup + '\n';
}

void Page::heading(const std::string& text, int level) {
    markup(fmt::format("<h{0}>{1}</h{0}>", level, escape(text)));
}

void Page::paragraph(const std::string& text, std::string_view style) {
    markup(fmt::format("<p class=\"{}\">{}</p>", style, escape(typeset(text))));
}

void Page::item(const std::string& text, const std::string& label, std::string_view style) {
    const std::string mark =
        label.empty() ? "" : fmt::format("<span class=\"{}\">{}</span> ", style, escape(typeset(label)));
    markup(fmt::format("<li>{}{}</li>", mark, escape(typeset(text))));
}

void Page::begin_table(const Cells& head, const std::string& caption, bool names) {
    markup(fmt::format("<table class=\"{}\">", names ? "names" : ""));
    markup(fmt::format("<caption>{}</caption>", escape(typeset(caption))));
    std::string row;
    for (const std::string& cell : head) row += fmt::format("<th>{}</th>", escape(typeset(cell)));
    markup(fmt::format("<thead><tr>{}</tr></thead>\n<tbody>", row));
}

void Page::row(const Cells& cells, bool rule) {
    std::string text;
    for (const std::string& cell : cells) text += fmt::format("<td>{}</td>", escape(typeset(cell)));
    markup(fmt::format("<tr class=\"{}\">{}</tr>", rule ? "first" : "", text));
}

void Page::figure(const Image& display_encoded, const std::string& caption) {
    markup(fmt::format(
        "<figure><img src=\"{}\" width=\"{}\" height=\"{}\" alt=\"{}\"/><figcaption>{}</figcaption></figure>",
        data_uri(display_encoded), display_encoded.width, display_encoded.height, escape(caption), escape(caption)));
}

std::string Page::text() const {
    return fmt::format(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<meta name=\"viewport\" "
        "content=\"width=device-width, initial-scale=1\"/>\n<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n"
        "{}</body>\n</html>\n",
        escape(title_), kStyle, body_);
}

}  // namespace halflight::converge
