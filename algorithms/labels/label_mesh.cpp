#include "algorithms/labels/label_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "algorithms/core/error.h"
#include "algorithms/core/number_text.h"
#include "algorithms/labels/label_surface.h"

namespace hermesh {

LabelMeshes label_meshes(const LabelMap& map, const LabelMeshOptions& options, RunContext& context) {
  if (!(options.smoothing >= kLeastSmoothing && options.smoothing <= 0.5))
    throw Error("the smoothing of labels must be from 0.01 to 0.5 voxels, not " + text(options.smoothing));
  if (map.lowers.empty()) throw Error("the label map holds no label");
  LabelMeshes result;
  {
    const LabelSurface surface(map, options.smoothing, context);
    // Labels are neither split nor merged: they mean something. Crossings need no correction for the
    // curvature bias of linear interpolation.
    FractureOptions fracture;
    fracture.split = false;
    fracture.least_samples = 0;
    fracture.from_voxels = options.smoothing;
    result.fracture = labelled_fracture(surface.solid(context), surface, fracture, context);
  }
  for (const auto& [label, samples] : map.samples()) {
    const auto piece = std::find(result.fracture.codes.begin() + 1, result.fracture.codes.end(), label);
    result.labels.push_back({label, samples,
                             piece == result.fracture.codes.end()
                                 ? 0
                                 : static_cast<std::uint32_t>(piece - result.fracture.codes.begin())});
  }
  return result;
}

PolygonMesh LabelMeshes::mesh_of(const Label& label) const {
  if (label.piece == 0) return {};
  PolygonMesh mesh = piece_mesh(fracture.mesh, fracture.pieces->of(label.piece));
  std::erase_if(mesh.attributes, [](const MeshAttribute& attribute) { return attribute.name == "cutter"; });
  for (MeshAttribute& attribute : mesh.attributes)
    if (attribute.name == "neighbour")
      for (std::int32_t& other : std::get<std::vector<std::int32_t>>(attribute.values))
        other = other < 0 ? 0 : static_cast<std::int32_t>(fracture.codes[static_cast<std::size_t>(other)]);
  return mesh;
}

PolygonMesh LabelMeshes::shared_walls() const {
  PolygonMesh mesh;
  mesh.origin = fracture.mesh.placement.origin;
  const FilePoints file(fracture.mesh.placement);
  mesh.points.reserve(fracture.mesh.points.size());
  for (const Eigen::Vector3d& point : fracture.mesh.points) mesh.points.push_back(file.in_file(point));
  mesh.triangles = fracture.mesh.triangles;
  if (fracture.mesh.placement.mirrors())
    for (Triangle& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  std::vector<std::int32_t> behind, front;
  for (const EdgeSides& sides : fracture.mesh.sides) {
    behind.push_back(static_cast<std::int32_t>(fracture.codes[sides.back]));
    front.push_back(sides.front == 0 ? 0 : static_cast<std::int32_t>(fracture.codes[sides.front]));
  }
  mesh.attributes.push_back({"label", AttributeDomain::polygon, 1, std::move(behind), {}});
  mesh.attributes.push_back({"neighbour", AttributeDomain::polygon, 1, std::move(front), {}});
  return mesh;
}

double distance_from_voxel_boundary(const LabelMap& map, const Eigen::Vector3d& place) {
  using At = std::array<std::int32_t, 3>;
  const auto label = [&](const At& at) -> std::uint32_t {
    const At lower = {at[0] & ~7, at[1] & ~7, at[2] & ~7};
    const auto found = std::ranges::lower_bound(map.lowers, lower);
    if (found == map.lowers.end() || *found != lower) return 0;
    return map.values(static_cast<std::int32_t>(found - map.lowers.begin()),
                      sample_index(at[0] & 7, at[1] & 7, at[2] & 7));
  };
  At nearest;
  for (int a = 0; a < 3; ++a)
    nearest[a] = map.placement.base[a] + static_cast<std::int32_t>(std::lround(place[a]));
  double squared = std::numeric_limits<double>::infinity();
  for (int x = -2; x <= 1; ++x)
    for (int y = -2; y <= 1; ++y)
      for (int z = -2; z <= 1; ++z)
        for (int axis = 0; axis < 3; ++axis) {
          const At from = {nearest[0] + x, nearest[1] + y, nearest[2] + z};
          At to = from;
          ++to[axis];
          if (label(from) == label(to)) continue;
          double sum = 0.0;
          for (int a = 0; a < 3; ++a) {
            // Off the face of the voxels between the two samples: a unit square across the axis.
            const double off = place[a] - double(from[a] - map.placement.base[a]);
            const double along = a == axis ? off - 0.5 : std::max(0.0, std::abs(off) - 0.5);
            sum += along * along;
          }
          squared = std::min(squared, sum);
        }
  return std::sqrt(squared);
}

}  // namespace hermesh
