// The mask within which an adaptive extractor keeps its error bound (Aldén 2011, §9.2: tables 9.3 and 9.4).
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
    everywhere,  ///< the bound holds everywhere; the mask is ignored
    simplify,    ///< cells outside are merged as far as the topology tests allow ("max simplification")
    nothing      ///< cells with their centre outside make no polygon; the mesh is open there ("no mesh")
  };
  /// May be absent: everything is inside. The inside of a level set is where it is negative, interpolated; of
  /// any other volume, such as a fog or a mask of zeros and ones, where the nearest sample differs from the
  /// background.
  LevelSet mask;
  Outside outside = Outside::everywhere;
  /// Factor of the extractor's tolerance, interpolated, with the background outside. May be absent: 1.
  LevelSet scale;
};

/// The field at the cells of one volume. Thread-safe.
class FieldEvaluator {
 public:
  /// `field` may be null. @throws Error if the scale is negative or not finite, or a grid has perspective
  FieldEvaluator(const AdaptivityField* field, const IndexToWorld& placement);

  bool simplifies_outside() const { return outside_ == AdaptivityField::Outside::simplify; }
  bool leaves_out_outside() const { return outside_ == AdaptivityField::Outside::nothing; }
  bool has_scale() const { return static_cast<bool>(scale_); }

  /// Returns those of `cells` with their centre in the mask, in the block of 8³ cells whose first sample is
  /// `lower` (index coordinates of the volume). A block that a level set puts on one side costs one look-up.
  BlockMask inside(const std::array<std::int32_t, 3>& lower, const BlockMask& cells) const;
  /// Writes the scale at the centres of `cells` to their entries of `out`, only. Requires has_scale().
  void scales(const std::array<std::int32_t, 3>& lower, const BlockMask& cells,
              std::array<float, 512>& out) const;

 private:
  Eigen::Vector3d world(const std::array<std::int32_t, 3>& lower, const Eigen::Vector3d& local) const;

  AdaptivityField::Outside outside_ = AdaptivityField::Outside::everywhere;  ///< the value without a mask
  LevelSet mask_, scale_;
  IndexToWorld placement_;
  bool is_level_set_ = false;
  double block_radius_ = 0.0;  ///< world units: radius of a block about its middle, plus a margin
};

/// Removes unused vertices from a mesh without attributes; the others keep their order.
void drop_unused_points(PolygonMesh& mesh);

}  // namespace hermesh
