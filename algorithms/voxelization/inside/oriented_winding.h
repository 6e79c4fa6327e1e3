// The winding numbers of a mesh whose faces are first made to agree.
#pragma once

#include <optional>

#include "algorithms/voxelization/distance/index_soup.h"
#include "algorithms/voxelization/inside/orientation.h"
#include "algorithms/voxelization/inside/winding_number.h"

namespace hermesh {

/// The orientation and the winding number of a mesh. It keeps a reference to the mesh, and copies its
/// triangles if it has quads.
class OrientedWinding {
 public:
  explicit OrientedWinding(const IndexSoup& soup) : OrientedWinding(soup.mesh(), soup.scale()) {}
  OrientedWinding(const OrientedWinding&) = delete;
  OrientedWinding& operator=(const OrientedWinding&) = delete;

  const Orientation& orientation() const { return orientation_; }
  /// Whether the number tells inside from outside.
  bool usable() const { return orientation_.verdict == Orientation::Verdict::usable; }
  /// The winding number at points in voxels relative to the mesh's origin.
  const WindingNumber& number() const { return number_; }
  /// The winding number of the closed shells that face inwards (Orientation::inward); none if there are no
  /// such shells.
  std::optional<WindingNumber> inward() const {
    if (orientation_.inward.empty()) return std::nullopt;
    return WindingNumber(tree_, orientation_.inward);
  }

 private:
  OrientedWinding(const PolygonMesh& mesh, double scale)
      : triangles_(mesh.quads.empty() ? std::vector<Triangle>() : triangulated(mesh)),
        faces_(mesh.quads.empty() ? std::span<const Triangle>(mesh.triangles) : triangles_),
        orientation_(orient_faces(mesh.points, faces_)),
        tree_(mesh.points, faces_, scale),
        number_(tree_, orientation_.turns) {}

  std::vector<Triangle> triangles_;
  std::span<const Triangle> faces_;
  Orientation orientation_;
  TriangleTree tree_;
  WindingNumber number_;
};

}  // namespace hermesh
