#include "algorithms/fracture/piece_attributes.h"

#include <Eigen/Geometry>
#include <map>

#include "algorithms/core/error.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Two unit axes at right angles to a normal and to each other, the same for the opposite normal.
std::array<Vector3d, 2> frame_of(Vector3d normal) {
  int largest, smallest;
  normal.cwiseAbs().maxCoeff(&largest);
  normal.cwiseAbs().minCoeff(&smallest);
  // The largest component decides the sign, so a normal and its opposite give one frame. The axis of the
  // smallest component is the farthest from parallel to the normal, so the product is never near zero.
  if (normal[largest] < 0) normal = -normal;
  const Vector3d u = normal.cross(Vector3d(Vector3d::Unit(smallest))).normalized();
  return {u, normal.cross(u)};
}

/// The two coordinate axes other than the one along which the triangle's normal is greatest. They do not
/// depend on the sign of the normal, so a seam's triangle has the same axes on both sides.
std::array<Vector3d, 2> frame_of_triangle(const PolygonMesh& mesh, const Triangle& t) {
  const auto at = [&](int c) { return Vector3d(mesh.points[t[c]].cast<double>()); };
  int axis;
  (at(1) - at(0)).cross(at(2) - at(0)).cwiseAbs().maxCoeff(&axis);
  return {Vector3d::Unit((axis + 1) % 3), Vector3d::Unit((axis + 2) % 3)};
}

/// Returns the polygons' integer attribute of that name. @throws Error if the piece has none.
const std::vector<std::int32_t>& whole_numbers(const PolygonMesh& mesh, const std::string& name) {
  for (const MeshAttribute& a : mesh.attributes)
    if (a.name == name && a.domain == AttributeDomain::polygon) return std::get<1>(a.values);
  throw Error("the piece lacks the attribute " + name);
}

}  // namespace

void add_cut_uv(PolygonMesh& piece, const PlaneOfNeighbour& plane) {
  const auto& surface = whole_numbers(piece, "surface");
  const auto& neighbour = whole_numbers(piece, "neighbour");
  std::vector<float> uv(6 * piece.triangles.size());
  std::map<std::int32_t, std::optional<std::array<Vector3d, 2>>> frames;
  for (std::size_t t = 0; t < piece.triangles.size(); ++t) {
    if (surface[t] == 0) continue;
    // The plane depends only on the two pieces, so all triangles of a seam share one frame.
    auto [at, is_new] = frames.try_emplace(neighbour[t]);
    if (is_new)
      if (const auto normal = plane(neighbour[t])) at->second = frame_of(*normal);
    const auto axes = at->second ? *at->second : frame_of_triangle(piece, piece.triangles[t]);
    // Points are relative to the origin, which all pieces share, so both sides of a seam compute the same
    // bits.
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t i = 0; i < 2; ++i)
        uv[6 * t + 2 * c + i] =
            static_cast<float>(axes[i].dot(piece.points[piece.triangles[t][c]].cast<double>()));
  }
  piece.attributes.push_back({"uv", AttributeDomain::corner, 2, std::move(uv), {}});
}

}  // namespace hermesh
