// Writes an HTML page that needs no other file and no script.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "engine/core/image.h"

namespace halflight::converge {

/// Replaces ASCII minus signs before figures by U+2212, and blanks before per cent signs by no-break spaces.
std::string typeset(const std::string& text);

/// Collects the page's body. Every text is escaped here, so that callers escape nothing; only markup() takes markup.
class Page {
  public:
    using Cells = std::vector<std::string>;

    explicit Page(const std::string& title) : title_(title) { heading(title, 1); }

    void markup(const std::string& markup);
    void heading(const std::string& text, int level = 2);
    /// Adds a paragraph; `style` is "" or "sub", for a line below the title.
    void paragraph(const std::string& text, std::string_view style = "");
    void begin_list() { markup("<ul>"); }
    /// Adds an item of a list; `label` precedes the text in the colour of `style`: "fine", "open" or "flag".
    void item(const std::string& text, const std::string& label = "", std::string_view style = "");
    void end_list() { markup("</ul>"); }
    /// Begins a table. names: the second column contains words, like the first.
    void begin_table(const Cells& head, const std::string& caption, bool names = false);
    /// Adds a row; `rule` draws a line above it.
    void row(const Cells& cells, bool rule = false);
    void end_table() { markup("</tbody></table>"); }
    void begin_figures() { markup("<div class=\"pictures\">"); }
    void figure(const Image& display_encoded, const std::string& caption);
    void end_figures() { markup("</div>"); }

    std::string text() const;  ///< Returns the whole page.

  private:
    std::string title_;
    std::string body_;
};

}  // namespace halflight::converge
