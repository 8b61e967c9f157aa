#include "engine/io/ies.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <system_error>

#include "engine/core/error.h"
#include "engine/io/files.h"

namespace halflight {
namespace {

constexpr double kMostCandela = 1e12;
constexpr double kLeastStep = 1e-4;  // degrees, so that radians in float32 differ

bool is_space(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\f' || c == '\v' || c == ',' || c == '\x1a' ||
           c == '\0';
}

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
    while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
    return text;
}

std::string upper(std::string_view text) {
    std::string all(text);
    std::ranges::transform(all, all.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    return all;
}

/// The text of a file, read from its start.
class Reader {
  public:
    Reader(const std::string& name, std::string_view text) : name_(name), rest_(text) {}

    template <class... Args>
    [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
        throw Error(name_, "{}", fmt::format(format, std::forward<Args>(args)...));
    }

    /// Skips space. Returns whether nothing else is left.
    bool at_end() {
        while (!rest_.empty() && is_space(rest_.front())) rest_.remove_prefix(1);
        return rest_.empty();
    }

    std::string_view line() {
        const std::size_t end = std::min(rest_.find_first_of("\r\n"), rest_.size());
        const std::string_view line = rest_.substr(0, end);
        const bool two = rest_.substr(end).starts_with("\r\n");
        rest_.remove_prefix(std::min(end + (two ? 2 : 1), rest_.size()));
        return trimmed(line);
    }

    /// Reads a number. `what` names it in errors, with its place in a list if that has more than one.
    double number(const char* what, std::size_t place = 0, std::size_t count = 1) {
        const auto which = [&] { return count > 1 ? fmt::format("{} {} of {}", what, place + 1, count) : what; };
        if (at_end()) fail("ends before {}", which());
        const auto end = static_cast<std::size_t>(std::ranges::find_if(rest_, is_space) - rest_.begin());
        const std::string_view token = rest_.substr(0, end);
        rest_.remove_prefix(end);
        const std::string_view digits = token.starts_with('+') ? token.substr(1) : token;
        double value = 0;
        const auto [last, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
        if (error != std::errc() || last != digits.data() + digits.size() || !std::isfinite(value))
            fail("{} is '{}', not a number", which(), token.substr(0, 40));
        return value;
    }

    std::size_t count(const char* what, std::size_t least) {
        const double value = number(what);
        if (!(value >= double(least) && value <= double(kMostIesValues)) || value != std::floor(value))
            fail("{} is {}, not a whole number from {} to {}", what, value, least, kMostIesValues);
        return static_cast<std::size_t>(value);
    }

    double factor(const char* what) {
        const double value = number(what);
        if (!(value > 0)) fail("{} is {}, not positive", what, value);
        return value;
    }

    /// Reads ascending angles, degrees.
    std::vector<double> angles(const char* what, std::size_t count, double most) {
        std::vector<double> all;
        for (std::size_t i = 0; i < count; ++i) {
            all.push_back(number(what, i, count));
            if (!(all[i] >= 0 && all[i] <= most)) fail("{} {} is {}, not from 0 to {}", what, i + 1, all[i], most);
            if (i > 0 && !(all[i] - all[i - 1] > kLeastStep))
                fail("{} {} is {}, not greater than {} before it", what, i + 1, all[i], all[i - 1]);
        }
        return all;
    }

  private:
    const std::string& name_;
    std::string_view rest_;
};

/// Reads all lines up to that of TILT. Returns whether the file is of 1986 or 1991.
bool read_keywords(Reader& reader) {
    std::string first;
    std::size_t lines = 0;
    for (; !reader.at_end(); ++lines) {
        const std::string_view line = reader.line();
        if (lines == 0) first = upper(line);
        if (!upper(line.substr(0, 5)).starts_with("TILT=")) continue;
        const std::string tilt = upper(trimmed(line.substr(5)));
        if (tilt == "INCLUDE") {
            reader.number("lamp to luminaire geometry of TILT");
            const std::size_t pairs = reader.count("number of TILT angles", 1);
            reader.angles("TILT angle", pairs, 180);
            for (std::size_t i = 0; i < pairs; ++i) reader.number("TILT factor", i, pairs);
        }
        // Later editions put "IESNA:LM-63-1995", "IESNA:LM-63-2002" or "IES:LM-63-2019" into their first line.
        const bool later = first.find("LM-63-") != std::string::npos && first.find("1986") == std::string::npos &&
                           first.find("1991") == std::string::npos;
        return !later;
    }
    reader.fail("has no line TILT=, so it is no IES LM-63 file or is truncated");
}

/// The table of a file: angles in degrees, all vertical angles of each horizontal one.
struct Table {
    std::vector<double> vertical, horizontal, candela;
    void add_column(double angle, std::size_t from) {
        const std::size_t rows = vertical.size();
        horizontal.push_back(angle);
        for (std::size_t v = 0; v < rows; ++v) candela.push_back(candela[from * rows + v]);
    }
};

/// Completes horizontal angles to 0 to 360 degrees by the symmetries of LM-63, section on horizontal angles.
void complete(Table& table, const Reader& reader) {
    std::vector<double>& angles = table.horizontal;
    const std::size_t rows = table.vertical.size();
    const double first = angles.front(), last = angles.back();
    if (angles.size() == 1) {
        if (first != 0) reader.fail("its only horizontal angle is {}, not 0", first);
        return;
    }
    if (first == 90 && last == 270) {  // symmetric about the plane of 90 and 270 degrees, as 1995 allows
        Table turned{table.vertical, {}, {}};
        const auto take = [&](std::size_t from, double angle) {
            turned.horizontal.push_back(angle);
            const auto begin = table.candela.begin() + static_cast<std::ptrdiff_t>(from * rows);
            turned.candela.insert(turned.candela.end(), begin, begin + static_cast<std::ptrdiff_t>(rows));
        };
        const auto middle =  // the last column up to 180 degrees is the first one from 0
            static_cast<std::size_t>(std::ranges::upper_bound(angles, 180.0) - angles.begin());
        for (std::size_t i = middle; i-- > 0;) take(i, 180 - angles[i]);
        if (turned.horizontal.front() != 0) reader.fail("horizontal angles from 90 to 270 lack 180");
        for (std::size_t i = 1; i < angles.size(); ++i) take(i, angles[i]);
        for (std::size_t i = angles.size() - 1; i-- > middle - 1;) take(i, 540 - angles[i]);
        table = std::move(turned);
        return;
    }
    if (first != 0) reader.fail("horizontal angles begin at {}, not at 0", first);
    if (last == 90)
        for (std::size_t i = angles.size() - 1; i-- > 0;) table.add_column(180 - angles[i], i);
    if (last == 90 || last == 180)
        for (std::size_t i = angles.size() - 1; i-- > 0;) table.add_column(360 - angles[i], i);
    // Some programs leave out the last angle, which is the first one.
    const double step = last - *(angles.end() - 2);
    if (last > 180 && last < 360 && std::abs(360 - last - step) < 0.01 * step) table.add_column(360, 0);
    if (angles.back() != 360) reader.fail("horizontal angles end at {}, not at 0, 90, 180 or 360", last);
}

}  // namespace

LightProfile read_ies(const std::string& name, std::string_view text) {
    if (text.size() > kMostIesBytes) throw Error(name, "has {} bytes, more than {}", text.size(), kMostIesBytes);
    Reader reader(name, text);
    const bool early = read_keywords(reader);
    reader.number("number of lamps");
    reader.number("lumens per lamp");
    double factor = reader.factor("candela multiplier");
    const std::size_t rows = reader.count("number of vertical angles", 2);
    const std::size_t columns = reader.count("number of horizontal angles", 1);
    if (rows * columns > kMostIesValues)
        reader.fail("has {} x {} candela values, more than {}", rows, columns, kMostIesValues);
    const double type = reader.number("photometric type");
    if (type == 2 || type == 3)
        throw UnsupportedProfile(name, "is of photometric type {}; only type C can be read", type == 2 ? "B" : "A");
    if (type != 1) reader.fail("photometric type is {}, not 1 (C), 2 (B) or 3 (A)", type);
    const double units = reader.number("type of units");
    if (units != 1 && units != 2) reader.fail("type of units is {}, not 1 (feet) or 2 (metres)", units);
    for (const char* const side : {"width", "length", "height"}) reader.number(side);
    factor *= reader.factor("ballast factor");
    // Editions from 1995 on reserve this number, or store there how the file was made.
    if (early)
        factor *= reader.factor("ballast-lamp photometric factor");
    else
        reader.number("number after the ballast factor");
    reader.number("input watts");

    Table table;
    table.vertical = reader.angles("vertical angle", rows, 180);
    table.horizontal = reader.angles("horizontal angle", columns, 360);
    double most = 0;
    for (std::size_t i = 0; i < rows * columns; ++i) {
        const double candela = factor * reader.number("candela value", i, rows * columns);
        if (!(candela >= 0 && candela <= kMostCandela))
            reader.fail("candela value {} of {} is {}, not from 0 to {}", i + 1, rows * columns, candela, kMostCandela);
        table.candela.push_back(candela);
        most = std::max(most, candela);
    }
    if (!reader.at_end()) reader.fail("has more numbers than its {} x {} candela values", rows, columns);
    complete(table, reader);

    LightProfile profile{.name = name, .candela = static_cast<float>(most)};
    for (const double angle : table.vertical) profile.vertical.push_back(static_cast<float>(glm::radians(angle)));
    for (const double angle : table.horizontal) profile.horizontal.push_back(static_cast<float>(glm::radians(angle)));
    for (const double candela : table.candela)
        profile.shares.push_back(static_cast<float>(most > 0 ? candela / most : 0));
    return profile;
}

LightProfile load_ies(const std::filesystem::path& path) {
    LightProfile profile = read_ies(path.string(), read_file(path, kMostIesBytes));
    profile.path = path.string();
    return profile;
}

}  // namespace halflight
