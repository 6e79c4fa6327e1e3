// Polygons of a mesh that nothing but a test keeps from meeting others.
#pragma once

#include <Eigen/Core>
#include <array>
#include <compare>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/core/large_array.h"
#include "algorithms/core/run_context.h"
#include "algorithms/extraction/contact/triangle_contact.h"
#include "algorithms/extraction/contact/triangle_grid.h"

namespace hermesh {

/// A triangle, or a quad that is cut from its first corner to its third. (Without initializers, so that many
/// can be made without writing them twice.)
struct NamedPolygon {
  std::uint64_t name;  ///< no other polygon has it
  int corners;
  std::array<std::uint32_t, 4> names;  ///< corners of the same name are the same point
  std::array<Eigen::Vector3d, 4> points;
  /// Corners around which triangles are known not to meet (polygon_stars.h), a bit each.
  unsigned settled;
};

/// A test of which polygons meet another one in more than the corners and the edge that they share, or may do
/// so, or meet themselves where they are quads.
class LoosePolygons {
 public:
  /// Takes the polygons that are tested. @throws Cancelled
  LoosePolygons(LargeArray<NamedPolygon> tested, const RunContext& context);

  /// Tests against some of the polygons around, best such as are near one another. The polygons that are
  /// tested may be among them or not. Safe to call for several lots at once.
  void test_against(std::span<const NamedPolygon> polygons);
  /// The numbers, in the list of those tested, of the polygons that meet what they were tested against;
  /// ascending.
  std::vector<std::size_t> that_meet() const;

 private:
  /// Polygons by the cubes of a lattice that their boxes touch.
  class ByPlace {
   public:
    ByPlace(std::span<const Bounds> boxes, const RunContext& context);
    /// Calls f(polygon, the cube) for those that share a cube with the box.
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
      std::uint32_t first, end;  ///< a free slot if they are equal
    };
    std::size_t slot_of(std::uint64_t place) const;
    std::vector<Range> ranges_;  ///< where each place's entries are, found by hashing
  };

  struct Near;
  void find_near(const Bounds& box, Near& near) const;

  LargeArray<NamedPolygon> polygons_;
  std::vector<Bounds> boxes_;  ///< one for each polygon
  ByPlace by_place_;
  std::vector<std::uint8_t> meets_;  ///< 1 for polygons that meet others
};

}  // namespace hermesh
