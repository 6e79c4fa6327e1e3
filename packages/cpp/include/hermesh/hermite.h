// hermesh::hermite: Hermite data, the points and normals where a surface crosses the edges of a lattice
// (chapter 4).
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "hermesh/mesh.h"
#include "hermesh/volume.h"

namespace hermesh::HERMESH_V1 {

/// A Boolean operation on two solids.
enum class Boolean {
  union_of,      ///< points in either
  intersection,  ///< points in both
  difference     ///< points in the first and not in the second
};

/// A solid on a lattice: a level set for the signs of its samples, and its crossings. Copies share the data.
class HERMESH_API Solid {
 public:
  /// Creates an empty object, whose members must not be called.
  Solid();
  explicit operator bool() const noexcept { return data_ != nullptr; }

  /// Returns the solid of a level set, with crossings interpolated between samples. @throws Error for values
  /// that are not finite; Cancelled.
  static Solid of(const Volume& level_set, Context& context);
  /// Returns a solid with the exact crossings of the polygons that the level set was made from. @throws
  /// Error; Cancelled.
  static Solid of(const Volume& level_set, const Mesh& source, Context& context);

  const Volume& level_set() const noexcept;
  std::size_t crossings() const noexcept;     ///< lattice edges with data
  std::size_t memory_bytes() const noexcept;  ///< of the crossings and their masks

  /// Returns x, y, z of each crossing, world units, and its unit normal.
  std::vector<float> crossing_points() const;
  std::vector<float> crossing_normals() const;

 private:
  friend struct Inside;
  struct Data;
  explicit Solid(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
  std::shared_ptr<const Data> data_;
};

/// Combines two solids on one lattice (made with the option `like`, for example): a sample's sign is the
/// Boolean of the operands', and an edge has data if and only if its ends differ. A union and an intersection
/// do not depend on the order.
/// @throws Error for different lattices; Cancelled.
HERMESH_API Solid combine(Boolean operation, const Solid& a, const Solid& b, Context& context);

}  // namespace hermesh::HERMESH_V1
