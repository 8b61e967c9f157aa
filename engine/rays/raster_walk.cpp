#include "engine/rays/raster_walk.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <queue>
#include <utility>

#include "shaders/shared/raster_lists.h"
#include "shaders/shared/sobol.h"

namespace halflight::rays {
namespace {

using shared::kRasterCandidates;

constexpr std::size_t kHiddenAtOnce = 64;  // maximum number of nodes waiting for a query
constexpr std::size_t kRoundLeaves = 16;   // leaves traced at a time
// mean number of runs between re-tests of a visible leaf (5 to 10 in the paper)
constexpr std::uint32_t kRetestMean = 6;

/// Returns the probability that a node hidden for `runs` runs stays hidden (eq. 6 of the paper, fitted there).
double stays_hidden(std::uint32_t runs) {
    return 0.98 - 0.7 * std::exp(-static_cast<double>(runs));
}

class Walk {
  public:
    Walk(const CullTree& tree, CullState& state, CullDevice& device, RasterStatistics& statistics)
        : tree_(tree), state_(state), device_(device), statistics_(statistics) {
        if (state_.nodes.size() != tree_.nodes.size()) {
            state_.nodes.assign(tree_.nodes.size(), {});
            state_.eye = tree_.hull.centre();
        }
        if (!all_finite(state_.eye)) state_.eye = tree_.hull.centre();
        ++state_.run;
    }

    void run() {
        open(0);
        while (true) {
            if (std::exchange(listens_, false)) {
                while (!asked_.empty() && hear(false)) {
                }
            }
            if (!front_.empty()) {
                const std::uint32_t node = front_.top().second;
                front_.pop();
                visit(node);
            } else if (!ready_.empty()) {
                trace();
            } else if (!hidden_.empty()) {
                ask_hidden();
            } else if (!again_.empty()) {
                ask(std::exchange(again_, {}), 1);
            } else if (!asked_.empty()) {
                ++statistics_.waits;
                hear(true);
                listens_ = true;  // reads the answers that have arrived meanwhile, too: draws become fewer and larger
            } else {
                return;
            }
        }
    }

  private:
    struct Question {
        std::size_t number;
        std::vector<std::uint32_t> nodes;
    };

    CullMemory& memory(std::uint32_t node) { return state_.nodes[node]; }

    void set_visible(std::uint32_t node, bool visible) {
        CullMemory& m = memory(node);
        if ((m.visible == 1) == visible) return;
        m.visible = visible ? 1 : 0;
        m.since = state_.run;
    }

    /// Marks all ancestors of a visible node as visible.
    void pull_up(std::uint32_t node) {
        for (set_visible(node, true); node != 0; set_visible(node, true)) node = tree_.nodes[node].parent;
    }

    void visit(std::uint32_t node) {
        ++statistics_.nodes;
        if (memory(node).visible != 1) {
            hidden_.push_back(node);
            if (hidden_.size() == kHiddenAtOnce) ask_hidden();
            return;
        }
        if (tree_.nodes[node].child_count == 0) {
            // This leaf's re-test is due, or the state is invalid.
            if (memory(node).retest - state_.run - 1 >= 2 * kRetestMean) {
                again_.push_back(node);
            } else {
                ++statistics_.saved_visible;
                pull_up(node);
            }
        }
        open(node);
    }

    void open(std::uint32_t node) {
        const CullNode& n = tree_.nodes[node];
        if (n.child_count != 0) {
            set_visible(node, false);  // hidden until a child turns out to be visible
            for (std::uint32_t c = n.first_child; c < n.first_child + n.child_count; ++c)
                front_.emplace(distance(c), c);
            return;
        }
        ++statistics_.leaves;
        ready_.push_back(node);
        if (ready_.size() == kRoundLeaves) trace();
    }

    float distance(std::uint32_t node) const { return distance_to(tree_.nodes[node].box, state_.eye); }

    void trace() {
        ++statistics_.traces;
        device_.trace(std::exchange(ready_, {}));
        listens_ = true;
    }

    /// Issues one query for each run of `at_once` nodes.
    void ask(const std::vector<std::uint32_t>& nodes, std::size_t at_once) {
        for (std::size_t i = 0; i < nodes.size(); i += at_once) {
            const std::size_t end = std::min(i + at_once, nodes.size());
            const auto first = nodes.begin() + static_cast<std::ptrdiff_t>(i);
            Question question{questions_++, {first, nodes.begin() + static_cast<std::ptrdiff_t>(end)}};
            ++statistics_.queries;
            if (question.nodes.size() > 1) ++statistics_.multi_queries;
            device_.ask(question.nodes);
            asked_.push_back(std::move(question));
        }
    }

    /// Groups nodes that have been hidden for long into multi-queries of the best size (section 5 of the paper). The
    /// benefit is the number of nodes. The cost is one query and, with the probability of a "yes", one more query per
    /// node.
    void ask_hidden() {
        std::vector<std::uint32_t> nodes = std::exchange(hidden_, {});
        const auto runs = [&](std::uint32_t node) { return state_.run - memory(node).since; };
        std::stable_sort(nodes.begin(), nodes.end(),
                         [&](std::uint32_t a, std::uint32_t b) { return runs(a) > runs(b); });
        for (std::size_t first = 0; first < nodes.size();) {
            double all_hidden = 1, best = 0;
            std::size_t end = first;
            while (end < nodes.size() && end - first < kRasterCandidates) {
                all_hidden *= stays_hidden(runs(nodes[end]));
                const auto count = static_cast<double>(end + 1 - first);
                const double value = count / (1 + (1 - all_hidden) * count);
                if (value <= best) break;
                best = value;
                ++end;
            }
            const auto at = nodes.begin() + static_cast<std::ptrdiff_t>(first);
            ask({at, nodes.begin() + static_cast<std::ptrdiff_t>(end)}, end - first);
            first = end;
        }
    }

    /// Takes the answer to the oldest query, if available.
    bool hear(bool wait) {
        const std::optional<bool> answer = device_.answer(asked_.front().number, wait);
        if (!answer) return false;
        const Question question = std::move(asked_.front());
        asked_.pop_front();
        if (*answer && question.nodes.size() > 1) {
            ask(question.nodes, 1);
            return true;
        }
        if (!*answer) statistics_.saved_hidden += question.nodes.size() - 1;
        for (const std::uint32_t node : question.nodes) {
            const bool leaf = tree_.nodes[node].child_count == 0;
            const bool opened = leaf && memory(node).visible == 1;
            set_visible(node, *answer);
            if (!*answer) continue;
            if (leaf) {
                const std::uint32_t random = shared::hash_combine(node, state_.run);
                memory(node).retest = state_.run + 1 + random % (2 * kRetestMean);
                pull_up(node);
            }
            if (!opened) open(node);
        }
        return true;
    }

    const CullTree& tree_;
    CullState& state_;
    CullDevice& device_;
    RasterStatistics& statistics_;

    using Near = std::pair<float, std::uint32_t>;
    std::priority_queue<Near, std::vector<Near>, std::greater<>> front_;
    std::vector<std::uint32_t> hidden_;  // nodes to query before they are opened
    std::vector<std::uint32_t> again_;   // visible leaves due for a re-test
    std::deque<Question> asked_;         // queries without an answer, oldest first
    std::vector<std::uint32_t> ready_;   // leaves to trace
    std::size_t questions_ = 0;
    bool listens_ = false;  // true: answers may have arrived
};

}  // namespace

float distance_to(const Bounds& box, const vec3& point) {
    const vec3 away = glm::max(glm::max(box.lower - point, point - box.upper), vec3(0));
    return glm::dot(away, away);
}

void walk(const CullTree& tree, CullState& state, CullDevice& device, RasterStatistics& statistics) {
    ++statistics.runs;
    if (!tree.nodes.empty()) Walk(tree, state, device, statistics).run();
}

}  // namespace halflight::rays
