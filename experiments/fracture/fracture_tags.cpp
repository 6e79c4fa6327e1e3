#include "experiments/fracture/fracture_tags.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "algorithms/core/error.h"

namespace hermesh {

using Eigen::Vector3d;

double distance_to_walls(const std::vector<Vector3d>& seeds, const Vector3d& place) {
  const Vector3d& nearest = *std::ranges::min_element(
      seeds, {}, [&](const Vector3d& seed) { return (seed - place).squaredNorm(); });
  // The cell is the part of space on the near side of its walls' planes, so the nearest plane is a wall.
  double least = std::numeric_limits<double>::infinity();
  for (const Vector3d& seed : seeds)
    if (seed != nearest)
      least = std::min(least, ((seed - place).squaredNorm() - (nearest - place).squaredNorm()) /
                                  (2.0 * (seed - nearest).norm()));
  return least;
}

TagJudge::TagJudge(const DistanceOracle& input, const Vector3d& origin, double voxel_size,
                   std::vector<Vector3d> seeds)
    : input_(input), origin_(origin), voxel_size_(voxel_size), seeds_(std::move(seeds)) {}

void TagJudge::add(const PolygonMesh& piece) {
  const auto tags = std::ranges::find_if(piece.attributes, [](const MeshAttribute& a) {
    return a.name == "surface" && a.domain == AttributeDomain::polygon;
  });
  if (tags == piece.attributes.end()) throw Error("the polygons of the piece have no attribute 'surface'");
  const auto& surface = std::get<std::vector<std::int32_t>>(tags->values);
  std::size_t polygon = 0;
  const auto add_all = [&](const auto& polygons) {
    for (const auto& corners : polygons) {
      Vector3d middle = Vector3d::Zero();
      for (const std::uint32_t p : corners) middle += piece.world(p) / double(corners.size());
      add_polygon(middle, surface[polygon++] != 0);
    }
  };
  add_all(piece.triangles);
  add_all(piece.quads);
}

void TagJudge::add_polygon(const Vector3d& middle, bool tagged_cut) {
  ++counts_.polygons;
  const double to_wall = distance_to_walls(seeds_, middle) / voxel_size_;
  // Nothing nearer than the bound gives the bound itself, which must then say that the wall is nearer.
  const double to_input = input_.distance((middle - origin_) / voxel_size_, std::max(1.0, 2.0 * to_wall));
  if (to_wall < 1.0 && to_input < 1.0) {
    ++counts_.at_rims;
    return;
  }
  const bool truly_cut = to_wall < to_input;
  counts_.tagged_cut += tagged_cut;
  counts_.truly_cut += truly_cut;
  counts_.rightly_cut += tagged_cut && truly_cut;
}

}  // namespace hermesh
