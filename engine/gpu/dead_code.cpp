#include "engine/gpu/dead_code.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

namespace halflight::gpu {
namespace {

using Value = std::optional<long long>;  // empty: not known

/// Returns the value of an integer literal, as `2` and `2u`.
Value number(std::string_view text) {
    if (text.ends_with('u')) text.remove_suffix(1);
    long long value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size() ? Value(value) : Value{};
}

struct Token {
    std::size_t begin, end;  // in the text
    std::size_t partner;     // a bracket: index of the one that closes it; else the token's own index
};

/// A function or constant at global scope.
struct Definition {
    std::size_t begin, end;  // tokens
    bool reached = false;
};

class Source {
  public:
    Source(const std::string& text, const Defines& defines) : text_(text), keeps_(text.size(), true) {
        for (const auto& [name, value] : defines.values()) macros_[name] = number(value);
    }

    std::string pruned() {
        read_tokens();
        if (!match_brackets()) return text_;
        read_items();
        if (!definitions_.contains("main")) return text_;
        close_branches(0, tokens_.size());
        reach("main");
        for (const std::size_t i : roots_)
            if (keeps_[tokens_[i].begin]) reach(word(i));
        for (const std::string_view name : directive_words_) reach(name);
        for (const auto& [name, all] : definitions_)
            for (const Definition& each : all)
                if (!each.reached) remove(each.begin, each.end);
        std::string left;
        left.reserve(text_.size());
        for (std::size_t line = 0; line < text_.size(); ++line) {
            bool empty = true;
            const std::size_t begin = left.size();
            for (; line < text_.size() && text_[line] != '\n'; ++line) {
                if (!keeps_[line]) continue;
                left += text_[line];
                empty = empty && text_[line] == ' ';
            }
            if (empty) left.resize(begin);
            left += '\n';
        }
        return left;
    }

  private:
    std::string_view word(std::size_t i) const {
        if (i >= tokens_.size()) return {};
        return std::string_view(text_).substr(tokens_[i].begin, tokens_[i].end - tokens_[i].begin);
    }

    void read_tokens() {
        bool line_begins = true;
        for (std::size_t at = 0; at < text_.size();) {
            const char c = text_[at];
            const std::string_view two = std::string_view(text_).substr(at, 2);
            std::size_t end = at + 1;
            if (line_begins && c == '#') {
                at = read_directive(at);
                continue;
            }
            if (two == "//" || two == "/*") {
                end = two == "//" ? text_.find('\n', at) : text_.find("*/", at);
                end = end == std::string::npos ? text_.size() : end + (two == "//" ? 0 : 2);
                std::fill(keeps_.begin() + std::ptrdiff_t(at), keeps_.begin() + std::ptrdiff_t(end), false);
                at = end;
                continue;
            }
            if (in_identifier(c))
                while (end < text_.size() && (in_identifier(text_[end]) || (text_[end] == '.' && std::isdigit(c) != 0)))
                    ++end;
            else if (two == "&&" || two == "||" || two == "==" || two == "!=" || two == "<=" || two == ">=")
                ++end;
            if (std::isspace(static_cast<unsigned char>(c)) == 0) {
                tokens_.push_back({at, end, tokens_.size()});
                line_begins = false;
            }
            line_begins = line_begins || c == '\n';
            at = end;
        }
    }

    /// Notes the words of a directive and returns its end.
    std::size_t read_directive(std::size_t at) {
        std::size_t end = std::min(text_.find('\n', at), text_.size());
        while (end < text_.size() && text_[end - 1] == '\\') end = std::min(text_.find('\n', end + 1), text_.size());
        bool defines = false;
        while (at < end) {
            std::size_t to = at;
            while (to < end && in_identifier(text_[to])) ++to;
            const std::string_view found = std::string_view(text_).substr(at, to - at);
            if (!found.empty()) directive_words_.insert(found);
            if (defines && !found.empty()) defined_.insert(found), defines = false;
            defines = defines || found == "define";
            at = std::max(to, at + 1);
        }
        return end;
    }

    bool match_brackets() {
        std::vector<std::size_t> open;
        for (std::size_t i = 0; i < tokens_.size(); ++i) {
            const char c = text_[tokens_[i].begin];
            if (c == '(' || c == '[' || c == '{') open.push_back(i);
            if (c != ')' && c != ']' && c != '}') continue;
            if (open.empty() || text_[tokens_[open.back()].begin] != (c == ')' ? '(' : c == ']' ? '[' : '{'))
                return false;
            tokens_[open.back()].partner = i;
            open.pop_back();
        }
        return open.empty();
    }

    /// Finds definitions at global scope. The tokens of all other items are roots.
    void read_items() {
        for (std::size_t begin = 0; begin < tokens_.size();) {
            std::size_t end = begin;
            bool is_function = false;
            while (end < tokens_.size() && word(end) != ";" && !is_function) {
                is_function = word(end) == "{" && end > begin && word(end - 1) == ")";
                end = tokens_[end].partner + 1;
            }
            end = std::min(end + (is_function ? 0 : 1), tokens_.size());
            const bool understood = is_function ? read_function(begin, end) : read_constant(begin, end);
            for (std::size_t i = begin; i < end && !understood; ++i) roots_.push_back(i);
            begin = end;
        }
    }

    bool read_function(std::size_t begin, std::size_t end) {
        std::size_t first = begin, bracket = begin;
        for (std::size_t at = begin; word(at) != "{"; at = tokens_[at].partner + 1) {
            if (word(at) != "(") continue;
            if (bracket > begin) first = tokens_[bracket].partner + 1;  // a macro's call precedes the function
            bracket = at;
        }
        for (std::size_t i = begin; i < first; ++i) roots_.push_back(i);
        definitions_[word(bracket - 1)].push_back({first, end});
        return true;
    }

    /// Reads `const T name = value;`.
    bool read_constant(std::size_t begin, std::size_t end) {
        if (word(begin) != "const" || word(begin + 3) != "=") return false;
        for (std::size_t i = begin; i < end; i = tokens_[i].partner + 1)
            if (word(i) == ",") return false;
        std::vector<Definition>& all = definitions_[word(begin + 2)];
        all.push_back({begin, end});
        std::size_t at = begin + 4;
        const Value value = disjunction(at);
        constants_[word(begin + 2)] = all.size() == 1 && word(at) == ";" ? value : Value{};
        return true;
    }

    // Expressions: `at` is the first token, and then the one behind them. Those with operators that are not read here
    // are not known.
    Value disjunction(std::size_t& at) {
        for (std::size_t end = at; end < tokens_.size() && word(end) != ")" && word(end) != ";";
             end = tokens_[end].partner + 1)
            if (word(end) == "?" || word(end) == "," || word(end) == "^" || word(end) == "|") {
                while (at < tokens_.size() && word(at) != ")" && word(at) != ";") at = tokens_[at].partner + 1;
                return {};
            }
        Value any = conjunction(at);
        while (word(at) == "||") {
            const Value next = conjunction(++at);
            any = any.value_or(0) != 0 || next.value_or(0) != 0 ? Value(1) : any && next ? Value(0) : Value{};
        }
        return any;
    }
    Value conjunction(std::size_t& at) {
        Value all = comparison(at);
        while (word(at) == "&&") {
            const Value next = comparison(++at);
            all = all.value_or(1) == 0 || next.value_or(1) == 0 ? Value(0) : all && next ? Value(1) : Value{};
        }
        return all;
    }
    Value comparison(std::size_t& at) {
        Value left = term(at);
        const std::string_view sign = word(at);
        if (sign == "!=" || sign == "==" || sign == ">" || sign == "<") {
            const Value right = term(++at);
            left = !left || !right ? Value{}
                   : sign == "!="  ? Value(*left != *right)
                   : sign == "=="  ? Value(*left == *right)
                   : sign == ">"   ? Value(*left > *right)
                                   : Value(*left < *right);
        }
        bool whole = true;  // the rest of another expression makes the value unknown
        for (; at < tokens_.size() && word(at) != "&&" && word(at) != "||" && word(at) != ")" && word(at) != ";";
             at = tokens_[at].partner + 1)
            whole = false;
        return whole ? left : Value{};
    }
    Value term(std::size_t& at) {
        if (word(at) == "!") {
            const Value value = term(++at);
            return value ? Value(*value == 0) : Value{};
        }
        if (word(at) == "uint" && word(at + 1) == "(") ++at;
        if (word(at) == "(") {
            std::size_t inner = at + 1;
            const std::size_t close = tokens_[at].partner;
            const Value value = disjunction(inner);
            at = close + 1;
            return inner == close ? value : Value{};
        }
        const std::string_view name = word(at++);
        if (name.empty() || word(at) == "(" || word(at) == "[" || word(at) == ".") return {};
        if (std::isdigit(static_cast<unsigned char>(name[0])) != 0) return number(name);
        if (const auto constant = constants_.find(name); constant != constants_.end()) return constant->second;
        if (!name.starts_with("HALFLIGHT_") || defined_.contains(name)) return {};
        const auto macro = macros_.find(name);
        return macro == macros_.end() ? Value(0) : macro->second;
    }

    /// Returns the token behind the statement at a token.
    std::size_t statement_end(std::size_t at) const {
        if (word(at) == "{") return tokens_[at].partner + 1;
        if (word(at) == "if" || word(at) == "for" || word(at) == "while" || word(at) == "switch") {
            const std::size_t end = statement_end(tokens_[at + 1].partner + 1);
            return word(at) == "if" && word(end) == "else" ? statement_end(end + 1) : end;
        }
        if (word(at) == "do") return statement_end(statement_end(at + 1) + 1);
        while (at < tokens_.size() && word(at) != ";") at = tokens_[at].partner + 1;
        return at + 1;
    }
    /// Returns whether a statement ends its function.
    bool returns(std::size_t begin, std::size_t end) const {
        if (word(begin) != "{") return word(begin) == "return";
        std::size_t last = begin;
        for (std::size_t at = begin + 1; at + 1 < end; at = statement_end(at)) last = at;
        return word(last) == "return";
    }

    /// Removes the branches between two tokens that are never taken, and what follows a return that always is.
    void close_branches(std::size_t begin, std::size_t end) {
        std::vector<std::size_t> blocks;  // ends of the blocks around the token
        for (std::size_t at = begin; at < end; ++at) {
            while (!blocks.empty() && blocks.back() <= at) blocks.pop_back();
            if (word(at) == "{") blocks.push_back(tokens_[at].partner);
            if (word(at) == "switch") at = statement_end(at) - 1;  // a return ends a case, not the block
            if (word(at) != "if" || !keeps_[tokens_[at].begin]) continue;
            std::size_t inner = at + 2;
            const std::size_t close = tokens_[at + 1].partner;
            const Value taken = disjunction(inner);
            if (inner != close || !taken) continue;
            const std::size_t first = close + 1, other = statement_end(first);
            const bool has_other = word(other) == "else";
            if (*taken == 0) {
                // An empty statement takes the branch's place.
                remove(at, has_other ? other + 1 : other);
                if (!has_other) text_[tokens_[at].begin] = ';', keeps_[tokens_[at].begin] = true;
            } else {
                remove(at, first);
                const std::size_t next = has_other ? statement_end(other + 1) : other;
                remove(other, next);
                const bool in_block = word(at - 1) == "{" || word(at - 1) == "}" || word(at - 1) == ";";
                if (in_block && !blocks.empty() && returns(first, other)) remove(next, blocks.back());
            }
        }
    }

    void remove(std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            std::fill(keeps_.begin() + std::ptrdiff_t(tokens_[i].begin),
                      keeps_.begin() + std::ptrdiff_t(tokens_[i].end), false);
    }

    void reach(std::string_view name) {
        const auto found = definitions_.find(name);
        if (found == definitions_.end()) return;
        for (Definition& each : found->second) {
            if (std::exchange(each.reached, true)) continue;
            for (std::size_t i = each.begin; i < each.end; ++i)
                if (keeps_[tokens_[i].begin]) reach(word(i));
        }
    }

    std::string text_;
    std::vector<char> keeps_;  // by character: whether it stays
    std::vector<Token> tokens_;
    std::unordered_set<std::string_view> directive_words_, defined_;
    std::unordered_map<std::string_view, std::vector<Definition>> definitions_;
    std::unordered_map<std::string_view, Value> constants_, macros_;
    std::vector<std::size_t> roots_;  // tokens
};

}  // namespace

std::string without_dead_code(const std::string& text, const Defines& defines) {
    return Source(text, defines).pruned();
}

}  // namespace halflight::gpu
