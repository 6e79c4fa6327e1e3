#include <algorithm>
#include <cmath>
#include <numbers>

#include "experiments/cases/recipe_shapes.h"

namespace hermesh::recipes {

namespace {

/// A line, or an arc about `centre` that starts `start` turns from the x axis and goes on for a quarter turn.
struct ProfilePiece {
  Eigen::Vector2d from, to;
  bool arc = false;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double start = 0.0;

  double length() const { return arc ? (from - centre).norm() * std::numbers::pi / 2.0 : (to - from).norm(); }
  Eigen::Vector2d at(double share) const {
    if (!arc) return from + share * (to - from);
    const auto [x, y] = on_circle(start + share / 4.0);
    return centre + (from - centre).norm() * Eigen::Vector2d(x, y);
  }
};

/// Outline of the part, star-shaped about (0, -0.1): a blend with a radius of 0.4, a sharp notch, a chamfer,
/// a blend with a radius of 0.25, and sharp corners.
const std::vector<ProfilePiece>& part_profile() {
  static const std::vector<ProfilePiece> pieces = {{{1, -0.6}, {1, 0.2}},
                                                   {{1, 0.2}, {0.6, 0.6}, true, {0.6, 0.2}, 0.0},
                                                   {{0.6, 0.6}, {0.2, 0.6}},
                                                   {{0.2, 0.6}, {0, 0.35}},
                                                   {{0, 0.35}, {-0.2, 0.6}},
                                                   {{-0.2, 0.6}, {-0.7, 0.6}},
                                                   {{-0.7, 0.6}, {-1, 0.3}},
                                                   {{-1, 0.3}, {-1, -0.35}},
                                                   {{-1, -0.35}, {-0.75, -0.6}, true, {-0.75, -0.35}, 0.5},
                                                   {{-0.75, -0.6}, {1, -0.6}}};
  return pieces;
}

constexpr double part_height = 0.8,
                 part_radius = 0.8;  ///< the radius is about the profile's mean distance to its centre

std::uint32_t steps_of_length(double length, double step) {
  return static_cast<std::uint32_t>(std::max(1.0, std::round(length / step)));
}

std::size_t part_triangles(double step) {
  std::size_t around = 0;
  for (const ProfilePiece& piece : part_profile()) around += steps_of_length(piece.length(), step);
  const std::size_t up = steps_of_length(part_height, step), inwards = steps_of_length(part_radius, step);
  return 2 * around * up + 2 * around * (2 * inwards - 1);
}

/// Prism over the profile. Rings of points shrink towards the centre of the lower cap, climb the side, and
/// shrink again.
PolygonMesh part_with_step(double step) {
  std::vector<Eigen::Vector2d> outline;
  for (const ProfilePiece& piece : part_profile()) {
    const std::uint32_t steps = steps_of_length(piece.length(), step);
    for (std::uint32_t i = 0; i < steps; ++i) outline.push_back(piece.at(double(i) / steps));
  }
  const std::uint32_t up = steps_of_length(part_height, step), inwards = steps_of_length(part_radius, step);
  const auto around = static_cast<std::uint32_t>(outline.size());
  const Eigen::Vector2d centre(0.0, -0.1);
  PolygonMesh mesh;
  const auto add_ring = [&](double share, double height) {
    for (const Eigen::Vector2d& point : outline) {
      const Eigen::Vector2d p = centre + share * (point - centre);
      add_point(mesh, {p.x(), p.y(), height});
    }
  };
  add_point(mesh, {centre.x(), centre.y(), -part_height / 2});
  for (std::uint32_t i = 1; i < inwards; ++i) add_ring(double(i) / inwards, -part_height / 2);
  for (std::uint32_t i = 0; i <= up; ++i) add_ring(1.0, part_height * (double(i) / up - 0.5));
  for (std::uint32_t i = inwards - 1; i > 0; --i) add_ring(double(i) / inwards, part_height / 2);
  add_point(mesh, {centre.x(), centre.y(), part_height / 2});
  connect_rings(mesh, around);
  return mesh;
}

}  // namespace

/// The longest step that gives at least the number of triangles asked for.
PolygonMesh cad_part(const RecipeParameters& parameters, RunContext&) {
  double coarse = 1.0, fine = 1.0;
  while (part_triangles(fine) < parameters.at("triangles")) fine /= 2.0;
  for (int i = 0; i < 40; ++i) {
    const double middle = (coarse + fine) / 2.0;
    (part_triangles(middle) < parameters.at("triangles") ? coarse : fine) = middle;
  }
  return part_with_step(fine);
}

}  // namespace hermesh::recipes
