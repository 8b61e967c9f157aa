// Parts of engineering structures: beams, pipes, plates with holes, fasteners. All take the builder's material and
// frame. Ends of beams and pipes are open where other parts hide them.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "tools/scenes/mesh.h"

namespace halflight::scenes {

/// Level of detail of a scene: numbers of pieces grow with it.
struct Detail {
    double level = 1;

    /// Returns base * level, rounded and limited to [least, most].
    int operator()(double base, int least, int most = 1 << 20) const;
    /// Returns base * level, rounded up for some and down for others of many parts, so that their mean is exact.
    int dithered(int i, double base, int least, int most) const;
    bool above(double threshold) const { return level >= threshold; }
    /// Returns whether part i of many is built. Below the level `none` no part is, above `all` every part is, and their
    /// number grows evenly in between.
    bool has(int i, double none, double all) const;
};

/// Sets a builder's frame relative to its current one, until the end of the block.
class Local {
  public:
    Local(MeshBuilder& mesh, const dmat4& matrix) : mesh_(mesh), outer_(mesh.frame()) { mesh.frame(outer_ * matrix); }
    Local(const Local&) = delete;
    Local& operator=(const Local&) = delete;
    ~Local() { mesh_.frame(outer_); }

  private:
    MeshBuilder& mesh_;
    dmat4 outer_;
};

/// Returns the frame at `at` whose +z points along `forward` and whose +y is close to `up`.
dmat4 frame_at(const dvec3& at, const dvec3& forward, const dvec3& up = {0, 1, 0});

// Outlines of rolled sections around the origin, counter-clockwise; width along x, height along y, thickness of plates.
std::vector<dvec2> bar_section(double width, double height);
std::vector<dvec2> i_section(double width, double height, double plate);
std::vector<dvec2> channel_section(double width, double height, double plate);  ///< Makes a C, open towards +x.
std::vector<dvec2> zee_section(double width, double height, double plate);      ///< Makes a Z: foot to -x, head to +x.
std::vector<dvec2> angle_section(double width, double height, double plate);    ///< Makes an L with its corner at 0.

/// Sweeps a closed outline, counter-clockwise in the xy planes of the frames, along their +z. Edges stay sharp; normals
/// are smooth along the path.
void sweep(MeshBuilder& mesh, std::span<const dvec2> outline, std::span<const dmat4> frames);
/// Sweeps an outline along a line in `pieces` pieces.
void beam(MeshBuilder& mesh, std::span<const dvec2> outline, const dvec3& from, const dvec3& to,
          const dvec3& up = {0, 1, 0}, int pieces = 1);
/// Sweeps an outline around the x axis, between two angles in degrees from +y towards +z. The outline's x is the
/// position along the axis and its y the height above `radius`.
void hoop(MeshBuilder& mesh, std::span<const dvec2> outline, double x, double radius, double from, double to,
          int pieces);

/// Returns a path whose inner corners are replaced by arcs of `radius` in `steps` pieces.
std::vector<dvec3> bent(std::span<const dvec3> corners, double radius, int steps);
/// Adds a round pipe with bends. Straight runs have pieces of at most `piece` metres; 0: one piece.
void pipe(MeshBuilder& mesh, std::span<const dvec3> corners, double radius, int sides, double bend, int steps,
          double piece = 0);
/// Adds a straight round bar, closed at its ends by flat discs if `closed`.
void rod(MeshBuilder& mesh, const dvec3& from, const dvec3& to, double radius, int sides, bool closed = false);

/// Adds the surface p(u, v) in [0, 1] x [0, 1] around a hole: a superellipse of half sizes `radii` about `centre`,
/// in u and v. Its front is in the direction of dp/du x dp/dv. `sides` is a multiple of 4.
void pierced_surface(MeshBuilder& mesh, const std::function<dvec3(double, double)>& p, const dvec2& centre,
                     const dvec2& radii, int sides, int rings);
/// Adds a plate |x| <= half.x, |y| <= half.y of `thickness` about z = 0 with a round hole, without its outer rim.
void pierced_plate(MeshBuilder& mesh, const dvec2& half, double radius, int sides, double thickness);

/// Adds a domed rivet head at p, with its axis along the unit vector n.
void rivet(MeshBuilder& mesh, const dvec3& p, const dvec3& n, double radius, int sides);
/// Adds a hexagonal bolt head at p, with a washer below it from 12 sides on.
void bolt(MeshBuilder& mesh, const dvec3& p, const dvec3& n, double radius, int sides);
/// Adds two flanges of a pipe face to face, at the origin across +y, with bolts around.
void flange(MeshBuilder& mesh, double pipe_radius, int sides, int bolts);

/// Adds a box with round edges, each face of n x n cells; `puff` is the height of a cushion's bulge, metres.
void cushion(MeshBuilder& mesh, const dvec3& lower, const dvec3& upper, double round, int n, double puff = 0);

/// Adds a grating, |x| <= half.x and |z| <= half.y with its top at y = 0: bars along z, and `rods` rods across.
void grating(MeshBuilder& mesh, const dvec2& half, int bars, int rods);
/// Adds a handrail along a path: posts, two rails and a toe board. Height 1.1 m.
void handrail(MeshBuilder& mesh, std::span<const dvec3> path, double post_distance, int sides);

}  // namespace halflight::scenes
