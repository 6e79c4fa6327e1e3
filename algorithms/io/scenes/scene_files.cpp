#include "algorithms/io/scenes/scene_files.h"

#include <Eigen/LU>

namespace hermesh::mesh_formats {

std::optional<Eigen::Vector3d> stated_origin(const PolygonMesh& mesh) {
  // As in to_mesh_file(): left out only at 0, if a reader would choose 0 by default.
  if (mesh.origin.isZero(0.0) && choose_origin(bounds(mesh)).isZero(0.0)) return std::nullopt;
  return mesh.origin;
}

void PartPlacer::spend(double bytes) {
  // In double precision, where sums and products of counts cannot overflow.
  spent_ += bytes;
  if (!(spent_ <= double(memory_limit())))
    builder_.fail("its parts, with all their repetitions, take more than half of the memory");
}

void PartPlacer::place(const ScenePart& part, const Placement& placement) {
  if (!placement.linear.allFinite() || !placement.translation.allFinite())
    builder_.fail("a transform of it holds a number that is not finite, or too large");
  const double determinant = placement.linear.determinant();
  // Scenes hide parts by a scale of zero. The sheets that would remain enclose nothing.
  if (determinant == 0.0) {
    flattened_ += !part.triangles.empty();
    return;
  }
  // Copies share no points: two of them that touch are still two surfaces.
  const std::int64_t first = static_cast<std::int64_t>(builder_.mesh.points.size());
  for (const Eigen::Vector3d& point : part.points) builder_.mesh.points.push_back(placement(point));
  std::size_t done = 0;
  for (const auto& [a, b, c] : part.triangles) {
    if (a == ScenePart::kLeftOut) continue;
    builder_.tick(++done, part.triangles.size());
    std::array<std::int64_t, 3> corners = {first + a, first + b, first + c};
    if (determinant < 0.0) std::swap(corners[1], corners[2]);
    builder_.add_polygon(corners);
  }
}

void PartPlacer::note_left_out() {
  if (flattened_ > 0) builder_.note(flattened_, " parts that a transform flattens were left out");
}

}  // namespace hermesh::mesh_formats
