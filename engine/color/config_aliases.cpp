// Checks the aliases of a config's YAML text. OpenColorIO copies what an alias stands for each time, so that a few
// lines can stand for more transforms than memory holds, or nest deeper than the stack.
#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <map>
#include <sstream>

#include "engine/color/ocio.h"

namespace halflight {
namespace {

constexpr double kMaxNodes = 1e6;  // nodes of the whole text, with all aliases expanded
constexpr int kMaxDepth = 64;      // lists and maps within each other

/// Counts the nodes that the text stands for. yaml-cpp reports aliases without expanding them.
class Counter final : public YAML::EventHandler {
  public:
    void OnDocumentStart(const YAML::Mark&) override {}
    void OnDocumentEnd() override {}
    void OnNull(const YAML::Mark&, YAML::anchor_t anchor) override { add(anchor, {}); }
    void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t anchor, const std::string&) override {
        add(anchor, {});
    }
    void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
        const auto known = anchored_.find(anchor);
        if (known == anchored_.end())
            throw ocio::Exception(
                fmt::format("line {}: an alias is part of what it stands for", mark.line + 1).c_str());
        add(YAML::NullAnchor, known->second);
    }
    void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t anchor,
                         YAML::EmitterStyle::value) override {
        open_.push_back({anchor, {}});
    }
    void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t anchor, YAML::EmitterStyle::value) override {
        open_.push_back({anchor, {}});
    }
    void OnSequenceEnd() override { close(); }
    void OnMapEnd() override { close(); }

  private:
    struct Size {
        double nodes = 1;
        int depth = 1;
    };

    void close() {
        const auto [anchor, size] = open_.back();
        open_.pop_back();
        add(anchor, size);
    }

    /// Adds a complete node to the list or map around it.
    void add(YAML::anchor_t anchor, const Size& size) {
        if (anchor != YAML::NullAnchor) anchored_[anchor] = size;
        if (open_.empty()) return;
        Size& outer = open_.back().second;
        outer.nodes += size.nodes;
        outer.depth = std::max(outer.depth, size.depth + 1);
        if (outer.nodes > kMaxNodes)
            throw ocio::Exception(fmt::format("its aliases stand for more than {} nodes", kMaxNodes).c_str());
        if (outer.depth > kMaxDepth)
            throw ocio::Exception(fmt::format("its aliases nest more than {} levels", kMaxDepth).c_str());
    }

    std::vector<std::pair<YAML::anchor_t, Size>> open_;  // lists and maps that have not ended
    std::map<YAML::anchor_t, Size> anchored_;
};

}  // namespace

void check_aliases(const std::string& text) {
    if (text.find('*') == std::string::npos || text.find('&') == std::string::npos) return;
    try {
        std::istringstream stream(text);
        Counter counter;
        YAML::Parser(stream).HandleNextDocument(counter);  // OpenColorIO reads no others
    } catch (const YAML::Exception&) {                     // OpenColorIO reports the error itself
    }
}

}  // namespace halflight
