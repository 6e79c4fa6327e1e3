// Where an adaptive extractor keeps its error bound, and what it does elsewhere (Aldén 2011, §9.2: tables 9.3
// and 9.4).
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/level_set.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/lattice/block_mask.h"
#include "algorithms/lattice/placement.h"

namespace hermesh {

/// A mask and a scale, both in world coordinates, on lattices of their own.
struct AdaptivityField {
  enum class Outside {
    everywhere,  ///< the bound holds everywhere; the mask is not looked at
    simplify,    ///< outside the mask cells are merged as far as the topology tests allow ("max
                 ///< simplification")
    nothing      ///< no polygon is made of a cell whose centre is outside: the mesh is open there ("no mesh")
  };
  /// May be absent: inside is then everywhere. In a level set the inside is where it is negative,
  /// interpolated; in any other volume, such as a fog or a mask of zeros and ones, where it differs from the
  /// background, to the nearest sample.
  LevelSet mask;
  Outside outside = Outside::everywhere;
  /// May be absent: 1 everywhere. Factor of the extractor's tolerance, interpolated; its background holds
  /// outside of it.
  LevelSet scale;
};

/// The field at the cells of one volume. It may be asked from many threads at a time.
class FieldEvaluator {
 public:
  /// `field` may be null. @throws Error for a scale that is negative or not finite somewhere, or a grid with
  /// perspective.
  FieldEvaluator(const AdaptivityField* field, const IndexToWorld& placement);

  bool simplifies_outside() const { return outside_ == AdaptivityField::Outside::simplify; }
  bool leaves_out_outside() const { return outside_ == AdaptivityField::Outside::nothing; }
  bool has_scale() const { return static_cast<bool>(scale_); }

  /// The cells among `cells` whose centres lie in the mask, in the block of 8³ cells whose first sample is
  /// `lower` (index coordinates of the volume). A block that a level set puts wholly on one side costs one
  /// look-up.
  BlockMask inside(const std::array<std::int32_t, 3>& lower, const BlockMask& cells) const;
  /// Writes the scale at the centres of `cells` to their entries of `out`; other entries are left as they
  /// are. There must be a scale (has_scale()).
  void scales(const std::array<std::int32_t, 3>& lower, const BlockMask& cells,
              std::array<float, 512>& out) const;

 private:
  Eigen::Vector3d world(const std::array<std::int32_t, 3>& lower, const Eigen::Vector3d& local) const;

  AdaptivityField::Outside outside_ =
      AdaptivityField::Outside::everywhere;  ///< everywhere also if there is no mask
  LevelSet mask_, scale_;
  IndexToWorld placement_;
  bool is_level_set_ = false;
  double block_radius_ =
      0.0;  ///< world units: no point of a block is farther from its middle than this, less margin
};

/// Takes out of a mesh without attributes the points that no polygon uses; the others keep their order.
void drop_unused_points(PolygonMesh& mesh);

}  // namespace hermesh
