// Plans the city: places models block by block.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "engine/core/error.h"
#include "tools/scenes/city.h"
#include "tools/scenes/exact.h"

namespace halflight::scenes {
namespace {

/// Returns block n of a square spiral around the origin: 0 at the centre, then ring after ring.
ivec2 spiral(std::uint32_t n) {
    if (n == 0) return {0, 0};
    auto ring = static_cast<int>((std::sqrt(static_cast<double>(n)) + 1) / 2);
    const auto cells = [](int r) { return (2 * r + 1) * (2 * r + 1); };  // number of blocks up to and including ring r
    while (cells(ring) <= static_cast<int>(n)) ++ring;
    while (cells(ring - 1) > static_cast<int>(n)) --ring;
    const int step = static_cast<int>(n) - cells(ring - 1), side = step / (2 * ring), along = step % (2 * ring) + 1;
    switch (side) {
        case 0:
            return {ring, -ring + along};
        case 1:
            return {ring - along, ring};
        case 2:
            return {-ring, ring - along};
        default:
            return {-ring + along, -ring};
    }
}

class Planner {
  public:
    Planner(const std::vector<CityModel>& models, std::uint64_t triangles) : remaining_(triangles) {
        for (std::uint32_t i = 0; i < models.size(); ++i) {
            counts_.push_back(models[i].mesh.triangles());
            by_kind_[static_cast<std::size_t>(models[i].kind)].push_back(i);
        }
    }

    std::vector<Placement> plan() {
        for (std::uint32_t n = 0; remaining_ >= largest_ground(); ++n) block(n);
        // Bollards along a kerb of the last block use up the rest, which is less than a block's ground.
        for (int i = 0;
             put(ModelKind::bollard, -kBlockX / 2 + 1.5 + 1.5 * (i % 54), (i < 54 ? 1 : -1) * (kBlockZ / 2 - 0.4), 0);
             ++i) {
        }
        return std::move(placements_);
    }

    std::uint64_t largest_ground() const {
        std::uint64_t most = 0;
        for (const ModelKind kind :
             {ModelKind::ground_urban, ModelKind::ground_tower, ModelKind::ground_houses, ModelKind::ground_park})
            for (const std::uint32_t model : of(kind)) most = std::max(most, counts_[model]);
        return most;
    }

  private:
    const std::vector<std::uint32_t>& of(ModelKind kind) const { return by_kind_[static_cast<std::size_t>(kind)]; }

    /// Puts a model of this kind at (x, z) of the current block: one at random, or the largest that still fits.
    bool put(ModelKind kind, double x, double z, std::uint32_t quarter_turns) {
        const std::vector<std::uint32_t>& models = of(kind);
        std::uint32_t choice = models[hash(key_, counter_++) % models.size()];
        if (counts_[choice] > remaining_) {
            for (const std::uint32_t other : models)
                if (counts_[other] <= remaining_ && (counts_[choice] > remaining_ || counts_[other] > counts_[choice]))
                    choice = other;
            if (counts_[choice] > remaining_) return false;
        }
        remaining_ -= counts_[choice];
        placements_.push_back(
            {choice, quarter_turns, static_cast<float>(centre_.x + x), static_cast<float>(centre_.y + z)});
        return true;
    }

    void block(std::uint32_t n) {
        const ivec2 cell = spiral(n);
        // The centre of the grid is a crossing, so that streets lead away from the origin.
        centre_ = {(cell.x + 0.5) * kPitchX, (cell.y + 0.5) * kPitchZ};
        key_ = hash(static_cast<std::uint32_t>(cell.x + 40000), static_cast<std::uint32_t>(cell.y + 40000));
        counter_ = 0;
        Random random(key_);
        const double density =
            0.55 * district(cell) + 0.45 * random() + 0.25 / (1 + 0.08 * glm::dot(dvec2(cell), dvec2(cell)));
        if (n > 0 && random() < 0.1)
            park(random);
        else if (density > 0.84)
            towers();
        else if (density < 0.36)
            houses(random);
        else
            perimeter(random);
        street(random);
    }

    /// Returns a smooth random field over the blocks, in [0, 1]: quarters of the city.
    static double district(const ivec2& cell) {
        const dvec2 at = dvec2(cell) / 5.0 + 1000.0, low = glm::floor(at), f = at - low;
        const auto corner = [&](double i, double j) {
            return hash(static_cast<std::uint32_t>(low.x + i), static_cast<std::uint32_t>(low.y + j)) * 0x1p-32;
        };
        return glm::mix(glm::mix(corner(0, 0), corner(1, 0), f.x), glm::mix(corner(0, 1), corner(1, 1), f.x), f.y);
    }

    /// Places houses wall to wall around a court.
    void perimeter(Random& random) {
        put(ModelKind::ground_urban, 0, 0, 0);
        for (int i = -2; i <= 2; ++i) {
            const double z = kLotsZ / 2 - (kLotDepth - 1.5) / 2;
            put(i == -2 ? ModelKind::row_left : i == 2 ? ModelKind::row_right : ModelKind::row, kRowLot * i, z, 0);
            put(i == -2 ? ModelKind::row_right : i == 2 ? ModelKind::row_left : ModelKind::row, kRowLot * i, -z, 2);
        }
        put(ModelKind::corner, kLotsX / 2 - 6.25, 0, 1);
        put(ModelKind::corner, -kLotsX / 2 + 6.25, 0, 3);
        for (int i = 0; i < 6; ++i)
            put(ModelKind::tree, -20 + 8 * i + random.in(-2, 2), random.in(-7, 7), random_turn(random));
    }

    void towers() {
        put(ModelKind::ground_tower, 0, 0, 0);
        for (const double x : {-20.5, 20.5})
            for (const double z : {-15.5, 15.5}) put(ModelKind::tower, x, z, z > 0 ? 0 : 2);
        for (int i = 0; i < 8; ++i) put(ModelKind::tree, -35 + 10 * i, 0, static_cast<std::uint32_t>(i % 4));
    }

    void houses(Random& random) {
        put(ModelKind::ground_houses, 0, 0, 0);
        for (int i = -2; i <= 2; ++i)
            for (const double side : {1.0, -1.0}) {
                put(ModelKind::house, kRowLot * i + random.in(-1, 1), side * (17 + random.in(-1, 1)), side > 0 ? 0 : 2);
                put(ModelKind::tree, kRowLot * (i + 0.5) - 0.5, side * random.in(8, 11), random_turn(random));
                put(ModelKind::tree, kRowLot * i + random.in(-4, 4), side * random.in(2.5, 6), random_turn(random));
            }
    }

    void park(Random& random) {
        put(ModelKind::ground_park, 0, 0, 0);
        for (int i = 0; i < 9; ++i)
            for (int j = 0; j < 6; ++j) {
                const double x = -35 + 8.6 * i + random.in(-2, 2), z = -25 + 10 * j + random.in(-2.5, 2.5);
                if (x * x + z * z < 130 || std::abs(x) < 3.2 || std::abs(z) < 3.2) continue;
                put(ModelKind::tree, x, z, random_turn(random));
            }
    }

    void street(Random& random) {
        for (const double side : {1.0, -1.0}) {
            for (int i = 0; i < 6; ++i)
                put(ModelKind::tree, -33 + 13.2 * i, side * (kBlockZ / 2 - 1.2), random_turn(random));
            for (int i = 0; i < 3; ++i)
                put(ModelKind::lamp, -26.4 + 26.4 * i, side * (kBlockZ / 2 - 0.7), side > 0 ? 0 : 2);
            for (int i = 0; i < 2; ++i)
                put(ModelKind::lamp, side * (kBlockX / 2 - 0.7), -15 + 30 * i, side > 0 ? 1 : 3);
            for (int i = 0; i < 12; ++i)
                if (random() < 0.6) put(ModelKind::car, -31 + 5.6 * i, side * (kBlockZ / 2 + 1.2), side > 0 ? 1 : 3);
            for (int i = 0; i < 8; ++i)
                if (random() < 0.5) put(ModelKind::car, side * (kBlockX / 2 + 1.2), -20 + 5.6 * i, side > 0 ? 0 : 2);
        }
    }

    static std::uint32_t random_turn(Random& random) { return static_cast<std::uint32_t>(random.below(4)); }

    std::vector<std::uint64_t> counts_;                // number of triangles of each model
    std::vector<std::uint32_t> by_kind_[kModelKinds];  // indices of the models of each kind
    std::uint64_t remaining_;
    dvec2 centre_{0};                      // centre of the current block
    std::uint32_t key_ = 0, counter_ = 0;  // state of the random choices
    std::vector<Placement> placements_;
};

}  // namespace

std::vector<Placement> city_plan(const std::vector<CityModel>& models, std::uint64_t triangles) {
    Planner planner(models, triangles);
    if (triangles < planner.largest_ground())
        throw Error("city", "{} triangles are fewer than the {} of one block's ground", triangles,
                    planner.largest_ground());
    return planner.plan();
}

}  // namespace halflight::scenes
