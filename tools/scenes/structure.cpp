#include "tools/scenes/structure.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tools/scenes/exact.h"
#include "tools/scenes/shapes.h"

namespace halflight::scenes {
namespace {

/// Returns a unit vector perpendicular to the unit vector n.
dvec3 across(const dvec3& n) {
    return glm::normalize(glm::cross(n, std::abs(n.y) < 0.9 ? dvec3(0, 1, 0) : dvec3(1, 0, 0)));
}

/// Returns the point of a superellipse of exponent 4 with unit half sizes in the direction of t.
dvec2 round_square(const dvec2& t) {
    return {std::copysign(std::sqrt(std::abs(t.x)), t.x), std::copysign(std::sqrt(std::abs(t.y)), t.y)};
}

/// Returns the point of the square |x|, |y| <= 1 in the direction of t.
dvec2 square(const dvec2& t) {
    return t / std::max(std::abs(t.x), std::abs(t.y));
}

/// Returns direction i of a ring that starts at 45 degrees, so that 4 sides meet the corners of a square.
dvec2 diagonal_ring(int i, int sides) {
    static constexpr double kHalf = 0.70710678118654752;
    const dvec2 t = ring_of(sides)[static_cast<std::size_t>(i % sides)];
    const dvec2 turned = kHalf * dvec2(t.x - t.y, t.x + t.y);
    // Rounding must not move a corner off its diagonal, nor a middle off its axis.
    if (std::abs(std::abs(turned.x) - std::abs(turned.y)) < 1e-12)
        return {std::copysign(kHalf, turned.x), std::copysign(kHalf, turned.y)};
    return {std::abs(turned.x) < 1e-12 ? 0 : turned.x, std::abs(turned.y) < 1e-12 ? 0 : turned.y};
}

/// Returns number i of a sequence that fills [0, 1) evenly.
double golden(int i) {
    constexpr double kRatio = 0.6180339887498949;
    return i * kRatio - std::floor(i * kRatio);
}

/// Adds two triangles for each step along a band of two rows of vertices, which alternate from `first` on.
void band(MeshBuilder& mesh, std::uint32_t first, int steps) {
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(steps); ++i) {
        const std::uint32_t a = first + 2 * i;
        mesh.triangle(a, a + 1, a + 3), mesh.triangle(a, a + 3, a + 2);
    }
}

}  // namespace

int Detail::operator()(double base, int least, int most) const {
    return std::clamp(static_cast<int>(base * level + 0.5), least, most);
}

int Detail::dithered(int i, double base, int least, int most) const {
    return std::clamp(static_cast<int>(base * level + golden(i)), least, most);
}

bool Detail::has(int i, double none, double all) const {
    return golden(i) < (level - none) / (all - none);
}

dmat4 frame_at(const dvec3& at, const dvec3& forward, const dvec3& up) {
    const dvec3 z = glm::normalize(forward);
    dvec3 x = glm::cross(up, z);
    if (glm::length(x) < 1e-9) x = across(z);
    x = glm::normalize(x);
    return {dvec4(x, 0), dvec4(glm::cross(z, x), 0), dvec4(z, 0), dvec4(at, 1)};
}

std::vector<dvec2> bar_section(double width, double height) {
    const double x = width / 2, y = height / 2;
    return {{-x, -y}, {x, -y}, {x, y}, {-x, y}};
}

std::vector<dvec2> i_section(double width, double height, double plate) {
    const double x = width / 2, y = height / 2, w = plate / 2, f = y - plate;
    return {{-x, -y}, {x, -y}, {x, -f}, {w, -f}, {w, f}, {x, f}, {x, y}, {-x, y}, {-x, f}, {-w, f}, {-w, -f}, {-x, -f}};
}

std::vector<dvec2> channel_section(double width, double height, double plate) {
    const double x = width / 2, y = height / 2, p = plate;
    return {{-x, -y}, {x, -y}, {x, -y + p}, {-x + p, -y + p}, {-x + p, y - p}, {x, y - p}, {x, y}, {-x, y}};
}

std::vector<dvec2> zee_section(double width, double height, double plate) {
    const double y = height / 2, p = plate / 2;
    return {{-width, -y}, {p, -y}, {p, y - plate},   {width, y - plate},
            {width, y},   {-p, y}, {-p, -y + plate}, {-width, -y + plate}};
}

std::vector<dvec2> angle_section(double width, double height, double plate) {
    return {{0, 0}, {width, 0}, {width, plate}, {plate, plate}, {plate, height}, {0, height}};
}

void sweep(MeshBuilder& mesh, std::span<const dvec2> outline, std::span<const dmat4> frames) {
    for (std::size_t e = 0; e < outline.size(); ++e) {
        const dvec2 a = outline[e], b = outline[(e + 1) % outline.size()];
        const dvec2 n = glm::normalize(dvec2(b.y - a.y, a.x - b.x));
        std::uint32_t first = 0;
        for (std::size_t k = 0; k < frames.size(); ++k) {
            const dmat4& frame = frames[k];
            const dvec3 normal(frame * dvec4(n, 0, 0));
            const std::uint32_t index = mesh.vertex({dvec3(frame * dvec4(a, 0, 1)), normal});
            mesh.vertex({dvec3(frame * dvec4(b, 0, 1)), normal});
            if (k == 0) first = index;
        }
        band(mesh, first, static_cast<int>(frames.size()) - 1);
    }
}

void beam(MeshBuilder& mesh, std::span<const dvec2> outline, const dvec3& from, const dvec3& to, const dvec3& up,
          int pieces) {
    std::vector<dmat4> frames;
    for (int i = 0; i <= pieces; ++i) frames.push_back(frame_at(glm::mix(from, to, double(i) / pieces), to - from, up));
    sweep(mesh, outline, frames);
}

void hoop(MeshBuilder& mesh, std::span<const dvec2> outline, double x, double radius, double from, double to,
          int pieces) {
    std::vector<dmat4> frames;
    for (int i = 0; i <= pieces; ++i) {
        const dvec2 t = cos_sin_degrees(from + (to - from) * i / pieces);
        frames.emplace_back(dvec4(1, 0, 0, 0), dvec4(0, t.x, t.y, 0), dvec4(0, -t.y, t.x, 0),
                            dvec4(x, radius * t.x, radius * t.y, 1));
    }
    sweep(mesh, outline, frames);
}

std::vector<dvec3> bent(std::span<const dvec3> corners, double radius, int steps) {
    std::vector<dvec3> path{corners.front()};
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
        const dvec3 in = corners[i] - corners[i - 1], out = corners[i + 1] - corners[i];
        const double cosine = glm::dot(glm::normalize(in), glm::normalize(out));
        const double shortest = std::min(glm::length(in), glm::length(out));
        const double reach = std::min(radius * std::sqrt((1 - cosine) / (1 + cosine + 1e-9)), 0.48 * shortest);
        const dvec3 a = corners[i] - reach * glm::normalize(in), b = corners[i] + reach * glm::normalize(out);
        for (int k = 0; k <= steps; ++k) {  // a parabola, which is close to the arc
            const double t = double(k) / steps;
            path.push_back((1 - t) * (1 - t) * a + 2 * t * (1 - t) * corners[i] + t * t * b);
        }
    }
    path.push_back(corners.back());
    return path;
}

void pipe(MeshBuilder& mesh, std::span<const dvec3> corners, double radius, int sides, double bend, int steps,
          double piece) {
    const std::vector<dvec3> path = bent(corners, bend, steps);
    std::vector<dvec3> fine{path.front()};
    for (std::size_t i = 1; i < path.size(); ++i) {
        // Bends that meet leave runs of no length, which would be slivers.
        if (glm::length(path[i] - path[i - 1]) < 0.01 * radius) continue;
        const int pieces = piece > 0 ? std::max(1, static_cast<int>(glm::length(path[i] - path[i - 1]) / piece)) : 1;
        for (int k = 1; k <= pieces; ++k) fine.push_back(glm::mix(path[i - 1], path[i], double(k) / pieces));
    }
    tube(mesh, fine, radius, sides);
}

void rod(MeshBuilder& mesh, const dvec3& from, const dvec3& to, double radius, int sides, bool closed) {
    const dvec3 path[] = {from, to};
    tube(mesh, path, radius, sides);
    if (!closed) return;
    const dvec3 along = glm::normalize(to - from);
    dvec3 side = std::abs(along.y) < 0.9 ? dvec3(0, 1, 0) : dvec3(1, 0, 0);  // tube() begins with this direction
    side = glm::normalize(side - along * glm::dot(side, along));
    const dvec3 other = glm::cross(along, side);
    for (const bool end : {false, true}) {
        std::uint32_t first = 0;
        for (int i = 0; i < sides; ++i) {
            const dvec2 t = ring_of(sides)[static_cast<std::size_t>(i)];
            const std::uint32_t index =
                mesh.vertex({(end ? to : from) + radius * (side * t.x + other * t.y), end ? along : -along});
            if (i == 0) first = index;
        }
        for (std::uint32_t i = 2; i < static_cast<std::uint32_t>(sides); ++i)
            end ? mesh.triangle(first, first + i - 1, first + i) : mesh.triangle(first, first + i, first + i - 1);
    }
}

void pierced_surface(MeshBuilder& mesh, const std::function<dvec3(double, double)>& p, const dvec2& centre,
                     const dvec2& radii, int sides, int rings) {
    constexpr double kStep = 0x1p-16;
    const auto normal = [&](const dvec2& at) {
        const double u0 = std::max(at.x - kStep, 0.0), u1 = std::min(at.x + kStep, 1.0);
        const double v0 = std::max(at.y - kStep, 0.0), v1 = std::min(at.y + kStep, 1.0);
        return glm::normalize(glm::cross(p(u1, at.y) - p(u0, at.y), p(at.x, v1) - p(at.x, v0)));
    };
    std::uint32_t first = 0;
    for (int i = 0; i <= sides; ++i) {
        const dvec2 t = diagonal_ring(i, sides);
        for (int j = 0; j <= rings; ++j) {
            const dvec2 at = glm::mix(centre + radii * round_square(t), 0.5 + 0.5 * square(t), double(j) / rings);
            const std::uint32_t index = mesh.vertex({p(at.x, at.y), normal(at)});
            if (i == 0 && j == 0) first = index;
        }
    }
    const auto row = static_cast<std::uint32_t>(rings + 1);
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(sides); ++i)
        for (std::uint32_t j = 0; j + 1 < row; ++j) {
            const std::uint32_t a = first + i * row + j;
            mesh.triangle(a, a + 1, a + row + 1), mesh.triangle(a, a + row + 1, a + row);
        }
}

void pierced_plate(MeshBuilder& mesh, const dvec2& half, double radius, int sides, double thickness) {
    const double z = thickness / 2;
    const auto strip = [&](auto&& inner, auto&& outer) {  // each returns the vertex of a direction
        std::uint32_t first = 0;
        for (int i = 0; i <= sides; ++i) {
            const dvec2 t = diagonal_ring(i, sides);
            const std::uint32_t index = mesh.vertex(inner(t));
            mesh.vertex(outer(t));
            if (i == 0) first = index;
        }
        band(mesh, first, sides);
    };
    const auto hole = [&](double at, const dvec3& n) {
        return [=](const dvec2& t) { return Vertex{dvec3(radius * t, at), n}; };
    };
    const auto rim = [&](double at, const dvec3& n) {
        return [=](const dvec2& t) { return Vertex{dvec3(half * square(t), at), n}; };
    };
    const auto wall = [&](double at) {
        return [=](const dvec2& t) { return Vertex{dvec3(radius * t, at), dvec3(-t, 0)}; };
    };
    strip(hole(z, {0, 0, 1}), rim(z, {0, 0, 1}));
    strip(rim(-z, {0, 0, -1}), hole(-z, {0, 0, -1}));
    strip(wall(-z), wall(z));
}

void rivet(MeshBuilder& mesh, const dvec3& p, const dvec3& n, double radius, int sides) {
    const dvec3 a = across(n), b = glm::cross(n, a);
    const std::vector<dvec2>& ring = ring_of(sides);
    const bool domed = sides > 4;
    const std::uint32_t top = mesh.vertex({p + 0.5 * radius * n, n});
    std::uint32_t first = 0;
    for (int i = 0; i < sides; ++i) {
        const dvec2 t = ring[static_cast<std::size_t>(i)];
        const dvec3 out = a * t.x + b * t.y;
        const std::uint32_t index = mesh.vertex({p + radius * out - 0.1 * radius * n, glm::normalize(out + 0.4 * n)});
        if (domed) mesh.vertex({p + radius * (0.72 * out + 0.34 * n), glm::normalize(out + 1.2 * n)});
        if (i == 0) first = index;
    }
    const std::uint32_t step = domed ? 2 : 1;
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(sides); ++i) {
        const std::uint32_t here = first + i * step, next = first + (i + 1) % static_cast<std::uint32_t>(sides) * step;
        mesh.triangle(here + step - 1, next + step - 1, top);
        if (domed) mesh.triangle(here, next, next + 1), mesh.triangle(here, next + 1, here + 1);
    }
}

void bolt(MeshBuilder& mesh, const dvec3& p, const dvec3& n, double radius, int sides) {
    const dvec3 a = across(n), b = glm::cross(n, a);
    const auto at = [&](const dvec2& t, double r, double height) { return p + r * (a * t.x + b * t.y) + height * n; };
    const int corners = std::min(sides, 6);
    const std::vector<dvec2>& hexagon = ring_of(corners);
    const double head = sides < 12 ? 0 : 0.3 * radius;  // the washer's thickness
    std::uint32_t first = 0;
    for (int i = 0; i < corners; ++i) {
        const dvec2 s = hexagon[static_cast<std::size_t>(i)], t = hexagon[static_cast<std::size_t>(i) + 1];
        mesh.quad(at(s, radius, head - 0.05 * radius), at(t, radius, head - 0.05 * radius),
                  at(t, radius, head + 1.1 * radius), at(s, radius, head + 1.1 * radius));
    }
    for (int i = 0; i < corners; ++i) {
        const std::uint32_t index =
            mesh.vertex({at(hexagon[static_cast<std::size_t>(i)], radius, head + 1.1 * radius), n});
        if (i == 0) first = index;
    }
    for (std::uint32_t i = 2; i < static_cast<std::uint32_t>(corners); ++i)
        mesh.triangle(first, first + i - 1, first + i);
    if (sides < 12) return;
    const std::vector<dvec2>& ring = ring_of(sides);
    for (const bool top : {false, true}) {
        for (int i = 0; i <= sides; ++i) {
            const dvec2 t = ring[static_cast<std::size_t>(i)];
            const dvec3 out = a * t.x + b * t.y;
            const std::uint32_t index = mesh.vertex({at(t, 1.6 * radius, top ? head : -0.05 * radius), top ? n : out});
            mesh.vertex({at(t, (top ? 0.8 : 1.6) * radius, head), top ? n : out});
            if (i == 0) first = index;
        }
        for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(sides); ++i) {
            const std::uint32_t q = first + 2 * i;
            mesh.triangle(q, q + 2, q + 3), mesh.triangle(q, q + 3, q + 1);
        }
    }
}

void flange(MeshBuilder& mesh, double pipe_radius, int sides, int bolts) {
    const double r = 0.98 * pipe_radius, wide = 1.35 * pipe_radius + 0.05, h = 0.12 * pipe_radius + 0.02, slit = 0.004;
    const dvec2 profile[] = {{r, -h},      {wide, -h}, {wide, -slit}, {wide - 0.02, -slit}, {wide - 0.02, slit},
                             {wide, slit}, {wide, h},  {r, h}};
    lathe(mesh, profile, sides);
    const double circle = 0.5 * (pipe_radius + wide), head = std::min(0.35 * (wide - pipe_radius), 0.03);
    for (int i = 0; i < bolts; ++i) {
        const dvec2 t = circle * ring_of(bolts)[static_cast<std::size_t>(i)];
        bolt(mesh, {t.x, h, t.y}, {0, 1, 0}, head, sides < 16 ? 4 : sides < 40 ? 6 : 16);
        bolt(mesh, {t.x, -h, t.y}, {0, -1, 0}, head, sides < 16 ? 4 : sides < 40 ? 6 : 16);
    }
}

void cushion(MeshBuilder& mesh, const dvec3& lower, const dvec3& upper, double round, int n, double puff) {
    const dvec3 inner_low = lower + round, inner_high = upper - round;
    const int edge = std::max(1, n / 4), middle = n - 2 * edge;  // cells of a rounded edge and between both
    const auto node = [&](int i, int axis) {
        if (n < 3) return glm::mix(lower[axis], upper[axis], double(i) / n);
        if (i <= edge) return glm::mix(lower[axis], inner_low[axis], double(i) / edge);
        if (i >= n - edge) return glm::mix(inner_high[axis], upper[axis], double(i - n + edge) / edge);
        return glm::mix(inner_low[axis], inner_high[axis], double(i - edge) / middle);
    };
    for (int axis = 0; axis < 3; ++axis)
        for (const bool high : {false, true}) {
            const int b = (axis + (high ? 1 : 2)) % 3, c = (axis + (high ? 2 : 1)) % 3;
            std::uint32_t first = 0;
            for (int j = 0; j <= n; ++j)
                for (int i = 0; i <= n; ++i) {
                    dvec3 box;
                    box[axis] = high ? upper[axis] : lower[axis];
                    box[b] = node(i, b), box[c] = node(j, c);
                    const dvec3 inner = glm::clamp(box, inner_low, inner_high);
                    dvec3 normal = glm::normalize(box - inner), p = inner + round * normal;
                    if (puff > 0 && inner[b] == box[b] && inner[c] == box[c]) {
                        const double wide = 0.5 * (inner_high[b] - inner_low[b]),
                                     long_ = 0.5 * (inner_high[c] - inner_low[c]);
                        const double s = (box[b] - inner_low[b]) / wide - 1, t = (box[c] - inner_low[c]) / long_ - 1;
                        const double f = 1 - s * s, g = 1 - t * t;
                        p += puff * f * f * g * g * normal;
                        normal[b] += 4 * puff * s * f * g * g / wide, normal[c] += 4 * puff * t * g * f * f / long_;
                        normal = glm::normalize(normal);
                    }
                    const std::uint32_t index = mesh.vertex({p, normal});
                    if (i == 0 && j == 0) first = index;
                }
            const auto width = static_cast<std::uint32_t>(n + 1);
            for (std::uint32_t j = 0; j + 1 < width; ++j)
                for (std::uint32_t i = 0; i + 1 < width; ++i) {
                    const std::uint32_t a = first + j * width + i;
                    mesh.triangle(a, a + 1, a + width + 1), mesh.triangle(a, a + width + 1, a + width);
                }
        }
}

void grating(MeshBuilder& mesh, const dvec2& half, int bars, int rods) {
    constexpr double kBar = 0.003, kDeep = 0.03;  // half thickness and depth of a bar, metres
    for (int i = 0; i <= bars; ++i) {
        const double x = glm::mix(-half.x + kBar, half.x - kBar, double(i) / bars);
        mesh.box({x - kBar, -kDeep, -half.y}, {x + kBar, 0, half.y}, MeshBuilder::kBottom);
    }
    for (int i = 0; i < rods; ++i) {
        const double z = glm::mix(-half.y, half.y, (i + 0.5) / rods);
        mesh.box({-half.x, -0.012, z - 0.004}, {half.x, -0.003, z + 0.004}, MeshBuilder::kBottom);
    }
}

void handrail(MeshBuilder& mesh, std::span<const dvec3> path, double post_distance, int sides) {
    const dvec3 rail(0, 1.1, 0);
    for (const double height : {1.0, 0.5}) {
        std::vector<dvec3> raised;
        for (const dvec3& p : path) raised.push_back(p + height * rail);
        tube(mesh, bent(raised, 0.1, 2), 0.021, sides);
    }
    const bool closed = path.front() == path.back();
    for (std::size_t k = 0; k + 1 < path.size(); ++k) {
        const dvec3 a = path[k], b = path[k + 1];
        const int posts = std::max(1, static_cast<int>(glm::length(b - a) / post_distance));
        for (int i = k == 0 && !closed ? 0 : 1; i <= posts; ++i) {
            const dvec3 foot = glm::mix(a, b, double(i) / posts);
            rod(mesh, foot, foot + rail, 0.019, sides);
        }
        beam(mesh, bar_section(0.006, 0.1), a + dvec3(0, 0.07, 0), b + dvec3(0, 0.07, 0));
    }
}

}  // namespace halflight::scenes
