#include "engine/io/ies.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>
#include <system_error>

#include "engine/core/error.h"
#include "engine/io/files.h"

namespace halflight {
namespace {

constexpr double kMostCandela = 1e12;
constexpr double kLeastStep = 1e-4;  // degrees, so that radians in float32 differ
constexpr double kTypeC = 1, kTypeB = 2, kTypeA = 3;

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
    std::vector<double> angles(const char* what, std::size_t count, double least, double most) {
        std::vector<double> all;
        for (std::size_t i = 0; i < count; ++i) {
            all.push_back(number(what, i, count));
            if (!(all[i] >= least && all[i] <= most))
                fail("{} {} is {}, not from {} to {}", what, i + 1, all[i], least, most);
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
            reader.angles("TILT angle", pairs, 0, 180);
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

/// Place of an angle in a list of ascending ones.
struct Place {
    std::size_t first = 0;  // index of the angle before it
    double t = 0;           // place between that and the next, [0, 1]
};

/// Returns the place of an angle of type A or B, degrees; none beyond the angles. A list that begins at 0 is symmetric,
/// whatever its last angle.
std::optional<Place> place_of(double angle, const std::vector<double>& angles) {
    constexpr double kRounding = 1e-9;  // degrees
    if (angles.front() == 0) angle = std::abs(angle);
    if (angle < angles.front() - kRounding || angle > angles.back() + kRounding) return std::nullopt;
    const auto next = std::ranges::upper_bound(angles, angle) - angles.begin();
    const auto first = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(next, 1, std::ssize(angles) - 1) - 1);
    return Place{first, std::clamp((angle - angles[first]) / (angles[first + 1] - angles[first]), 0.0, 1.0)};
}

/// Returns the intensity of a table of type A or B, bilinear between its angles and zero beyond them.
double candela_at(const Table& table, double vertical, double horizontal) {
    const auto v = place_of(vertical, table.vertical), h = place_of(horizontal, table.horizontal);
    if (!v || !h) return 0;
    const double* const column = &table.candela[h->first * table.vertical.size() + v->first];
    const double* const next = column + table.vertical.size();
    return glm::mix(glm::mix(column[0], column[1], v->t), glm::mix(next[0], next[1], v->t), h->t);
}

/// Returns a table of type A or B, sampled at angles of type C. All have the direction of the lamp at the angles 0 and
/// 0. Type A has its poles at X and -X, where the vertical angles end; type B has them at Y and -Y, where the
/// horizontal ones end. Vertical angles turn towards X, and horizontal ones towards -Y: clockwise, seen from X
/// (LM-63-2002, section 3; EXT_lights_ies, Coordinate System Mapping).
Table to_type_c(const Table& from, double type) {
    constexpr double kLeastParts = 16, kMostParts = 360;
    const std::size_t rows = from.vertical.size();
    double step = 10;
    for (const std::vector<double>* const angles : {&from.vertical, &from.horizontal})
        for (std::size_t i = 1; i < angles->size(); ++i) step = std::min(step, (*angles)[i] - (*angles)[i - 1]);
    step /= 2;
    double lit = 0;  // the greatest angle from the direction of the lamp at which it may shine
    for (std::size_t h = 0; h + 1 < from.horizontal.size(); ++h) {
        for (std::size_t v = 0; v + 1 < rows; ++v) {
            const double* const corner = &from.candela[h * rows + v];
            if (corner[0] == 0 && corner[1] == 0 && corner[rows] == 0 && corner[rows + 1] == 0) continue;
            const double vertical = std::max(std::abs(from.vertical[v]), std::abs(from.vertical[v + 1]));
            const double horizontal = std::max(std::abs(from.horizontal[h]), std::abs(from.horizontal[h + 1]));
            const double cosine = std::cos(glm::radians(vertical)) * std::cos(glm::radians(horizontal));
            lit = std::max(lit, std::max(vertical, horizontal) > 90 ? 180 : glm::degrees(std::acos(cosine)));
        }
    }
    if (lit == 0) lit = 90;
    const auto regular = [&](double last, double parts) {
        parts = 4 * std::ceil(std::clamp(parts, kLeastParts, kMostParts) / 4);
        std::vector<double> all;
        for (int i = 0; i <= int(parts); ++i) all.push_back(last * i / parts);
        return all;
    };
    Table table{regular(lit, lit / step), regular(360, 360 * std::sin(glm::radians(std::min(lit, 90.0))) / step), {}};
    table.candela.reserve(table.vertical.size() * table.horizontal.size());
    for (const double h : table.horizontal) {
        const double right = std::cos(glm::radians(h)), up = std::sin(glm::radians(h));
        for (const double v : table.vertical) {
            const double side = std::sin(glm::radians(v)), z = std::cos(glm::radians(v));
            const double x = side * right, y = side * up;
            const double vertical = type == kTypeA ? std::asin(std::clamp(x, -1.0, 1.0)) : std::atan2(x, z);
            const double horizontal = type == kTypeA ? std::atan2(-y, z) : std::asin(std::clamp(-y, -1.0, 1.0));
            table.candela.push_back(candela_at(from, glm::degrees(vertical), glm::degrees(horizontal)));
        }
    }
    return table;
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
    if (type != kTypeC && type != kTypeB && type != kTypeA)
        reader.fail("photometric type is {}, not 1 (C), 2 (B) or 3 (A)", type);
    if (type != kTypeC && columns < 2) reader.fail("has one horizontal angle, which only photometric type C allows");
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
    // Types A and B have latitudes, and longitudes that may go round.
    const double vertical = type == kTypeA ? 90 : 180, horizontal = type == kTypeC ? 360 : type == kTypeA ? 180 : 90;
    table.vertical = reader.angles("vertical angle", rows, type == kTypeC ? 0 : -vertical, vertical);
    table.horizontal = reader.angles("horizontal angle", columns, type == kTypeC ? 0 : -horizontal, horizontal);
    for (std::size_t i = 0; i < rows * columns; ++i) {
        const double candela = factor * reader.number("candela value", i, rows * columns);
        if (!(candela >= 0 && candela <= kMostCandela))
            reader.fail("candela value {} of {} is {}, not from 0 to {}", i + 1, rows * columns, candela, kMostCandela);
        table.candela.push_back(candela);
    }
    if (!reader.at_end()) reader.fail("has more numbers than its {} x {} candela values", rows, columns);
    if (type == kTypeC)
        complete(table, reader);
    else
        table = to_type_c(table, type);
    const double most = std::ranges::max(table.candela);

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
