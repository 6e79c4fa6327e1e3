// Finds those polygons of a mesh not covered by a proof that intersect others.
#pragma once

#include <Eigen/Core>
#include <array>
#include <compare>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/core/bounds.h"
#include "algorithms/core/large_array.h"
#include "algorithms/core/run_context.h"
#include "algorithms/extraction/contact/triangle_contact.h"

namespace hermesh {

/// A triangle, or a quad that is cut from its first corner to its third. (Without initializers, so that
/// creating many does not write them twice.)
struct NamedPolygon {
  std::uint64_t name;  ///< unique
  int corners;
  std::array<std::uint32_t, 4> names;  ///< corners of the same name are the same point
  std::array<Eigen::Vector3d, 4> points;
  /// Corners around which triangles are known not to intersect (polygon_stars.h), one bit each.
  unsigned settled;
};

/// Determines which polygons intersect other ones, or may do so, in more than their shared corners and edge,
/// or intersect themselves if they are quads.
class LoosePolygons {
 public:
  /// Sets the polygons to be tested. @throws Cancelled
  LoosePolygons(LargeArray<NamedPolygon> tested, const RunContext& context);

  /// Tests against some of the polygons of the mesh, preferably near one another. The polygons to be tested
  /// may be among them. Safe to call concurrently.
  void test_against(std::span<const NamedPolygon> polygons);
  /// Returns the indices, in the list of tested polygons, of those that intersect polygons that they were
  /// tested against; ascending.
  std::vector<std::size_t> that_meet() const;

 private:
  /// Polygons by the cubes of a lattice that their boxes overlap.
  class ByPlace {
   public:
    ByPlace(std::span<const Bounds> boxes, const RunContext& context);
    /// Calls f(polygon, cube) for those that share a cube with the box.
    template <class F>
    void for_each_near(const Bounds& box, F&& f) const;

   private:
    struct Entry {
      std::uint64_t place;
      std::uint32_t polygon;
      auto operator<=>(const Entry&) const = default;
    };
    LargeArray<Entry> entries_;  ///< ascending
    struct Range {
      std::uint64_t place;
      std::uint32_t first, end;  ///< a free slot if both are equal
    };
    std::size_t slot_of(std::uint64_t place) const;
    std::vector<Range> ranges_;  ///< range of each cube's entries, found by hashing
  };

  struct Near;
  void find_near(const Bounds& box, Near& near) const;

  LargeArray<NamedPolygon> polygons_;
  std::vector<Bounds> boxes_;  ///< one for each polygon
  ByPlace by_place_;
  std::vector<std::uint8_t> meets_;  ///< 1 for polygons that intersect others
};

}  // namespace hermesh
