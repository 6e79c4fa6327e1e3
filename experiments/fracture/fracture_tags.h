// Checks that the polygons of a fracture's pieces are correctly tagged as cut or original. The reference is
// the input's triangles and the walls of Voronoi cells, which are known in closed form; it does not depend on
// the method.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "reference/distance_oracle.h"

namespace hermesh {

/// Counts of polygons, a quad being one.
struct TagCounts {
  std::int64_t polygons = 0;
  std::int64_t at_rims = 0;  ///< left out: their middle is within a voxel of both surfaces
  std::int64_t tagged_cut = 0, truly_cut = 0, rightly_cut = 0;  ///< counts of all other polygons

  double precision() const { return tagged_cut == 0 ? 1.0 : double(rightly_cut) / double(tagged_cut); }
  double recall() const { return truly_cut == 0 ? 1.0 : double(rightly_cut) / double(truly_cut); }
  double share_left_out() const { return polygons == 0 ? 0.0 : double(at_rims) / double(polygons); }
};

/// Returns the distance from a point to the nearest wall between the Voronoi cells of at least two different
/// seeds.
double distance_to_walls(const std::vector<Eigen::Vector3d>& seeds, const Eigen::Vector3d& place);

/// Counts the polygons of one piece after another. A polygon is truly cut if its middle is nearer to a wall
/// between cells than to the input.
class TagJudge {
 public:
  /// `input` knows the input's triangles, in voxels of `voxel_size` world units relative to `origin` (world
  /// units), and has to outlive this object; `seeds` are those of the cells, world units.
  TagJudge(const DistanceOracle& input, const Eigen::Vector3d& origin, double voxel_size,
           std::vector<Eigen::Vector3d> seeds);
  /// Counts the polygons of a piece. @throws Error for a piece without the polygon attribute `surface`.
  void add(const PolygonMesh& piece);
  const TagCounts& counts() const { return counts_; }

 private:
  void add_polygon(const Eigen::Vector3d& middle, bool tagged_cut);

  const DistanceOracle& input_;
  Eigen::Vector3d origin_;
  double voxel_size_;
  std::vector<Eigen::Vector3d> seeds_;
  TagCounts counts_;
};

}  // namespace hermesh
