// Collapses within one cube of a round: proposed, tested, done (decimation.h).
#pragma once

#include "algorithms/extraction/certified_collapse/collapse_distance.h"
#include "algorithms/extraction/certified_collapse/cube_mesh.h"

namespace hermesh {

/// The collapses of one cube, one after another. For each first gather(), then passes(), then apply(), each
/// only if the one before said yes.
class CubeCollapse {
 public:
  CubeCollapse(DecimatedMesh& mesh, Collapses kind, const FilePoints& file, const DecimationCube& cube,
               std::span<const std::uint32_t> triangles, CubeNumbers& numbers);

  CubeMesh& mesh() { return local_; }
  const Collapse& collapse() const { return collapse_; }

  /// Makes the faces as they will be when `going` and `v`, two ends of an edge, have become the point at `x`.
  /// v keeps its number, and moves only if x is not where it is; whichever of the two moves must be free.
  /// False if x lies outside of the cube, or if a face turns over, degenerates or gets too long.
  bool gather(std::uint32_t going, std::uint32_t v, const Eigen::Vector3d& x);
  /// Whether the gathered collapse keeps near enough to the fine mesh (decimation.h); the topology is the
  /// caller's.
  bool passes();
  /// Carries out the collapse that was gathered, and notes what it joins.
  void apply();
  std::vector<Join>& joins() { return joins_; }

  /// Sum of the quadrics of two vertices, about `anchor`.
  WideQuadric quadric_about(std::uint32_t u, std::uint32_t v, const Eigen::Vector3d& anchor) const;

  /// Squared distances to the planes of the faces around two vertices, weighted by area, about `anchor`.
  WideQuadric quadric_of_faces(std::uint32_t u, std::uint32_t v, const Eigen::Vector3d& anchor) const;

  /// What a collapse may cost, voxels⁴, or 0 where the tests alone say.
  double moment() const { return mesh_.moment; }
  float tolerance_at(std::uint32_t v) const { return mesh_.least_tolerance[local_.vertices[v].global]; }
  bool is_dirty(std::uint32_t v) const { return mesh_.dirty[local_.vertices[v].global] != 0; }
  /// Has the edges at a vertex looked at in the next round: what failed there may succeed then.
  void mark_dirty(std::uint32_t v) { mesh_.dirty_next[local_.vertices[v].global] = 1; }
  Eigen::Vector3d rounded(const Eigen::Vector3d& p) const { return file_.rounded(p); }

 private:
  bool make_faces(std::uint32_t moved);
  bool is_short(const Corners& at, std::uint32_t moved);
  bool is_well_shaped(const Collapse::NewFace& made, const Corners& before) const;
  void merge_vertices();

  DecimatedMesh& mesh_;
  const Collapses kind_;
  const FilePoints& file_;
  const DecimationCube& cube_;
  CubeMesh local_;
  Collapse collapse_;  ///< the one under way
  CollapseDistance distance_;
  std::vector<Join> joins_;
};

}  // namespace hermesh
