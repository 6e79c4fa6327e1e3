// Polygon meshes: arrays in, arrays out.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hermesh/context.h"
#include "hermesh/export.h"

namespace hermesh::HERMESH_V1 {

/// The elements that have a value of an attribute.
enum class AttributeDomain {
  point,   ///< each point
  corner,  ///< each polygon's corner: three a triangle, in their order, then four a quad
  polygon  ///< each triangle, then each quad
};

/// Named values on the points, corners or polygons of a mesh, such as "normal", "colour", "uv" or "material".
/// It is a view: the caller keeps the arrays alive, and those of a mesh live as long as it or a copy of it.
struct Attribute {
  std::string name = {};
  AttributeDomain domain = AttributeDomain::point;
  int components = 1;                           ///< numbers for each element, 1 to 4, side by side
  std::span<const float> floats = {};           ///< the values, of one kind; the other is empty
  std::span<const std::int32_t> integers = {};  ///< one component, never interpolated; −1 means "none"
  std::vector<std::string> labels = {};         ///< names of the integers from 0 on; may be empty
};

/// Triangles and quads over shared points, counter-clockwise seen from outside, and their attributes. A mesh
/// is immutable, and copies share the arrays, so copying is cheap.
///
/// A quad (a, b, c, d) of a mesh made by hermesh means the triangles abc and acd. The split of other quads is
/// unknown: functions that sample polygons (voxelize, remesh, combine, fracture, and extract from its source)
/// split each along its better diagonal, as the program does; give triangles to prescribe a split.
class HERMESH_API Mesh {
 public:
  /// Creates a mesh without points and polygons.
  Mesh();

  /// Makes a mesh of arrays, which are copied once.
  /// @snippet main.cpp arrays
  /// @param points x, y, z of each point, world units
  /// @param triangles three numbers of points each, from 0
  /// @param quads four numbers each
  /// @param attributes each with a name of its own
  /// @throws Error for an array whose size is not a multiple of 3 (or 4), an index out of range, a coordinate
  /// that is not finite, points in double precision whose box does not fit single precision about an origin
  /// of its own, and an attribute whose number of values does not fit.
  explicit Mesh(std::span<const float> points, std::span<const std::uint32_t> triangles,
                std::span<const std::uint32_t> quads = {}, std::span<const Attribute> attributes = {});
  /// Makes a mesh of points in double precision, which are stored in single precision relative to origin(),
  /// so that a model far from 0 loses no relevant precision. @throws Error as above.
  explicit Mesh(std::span<const double> points, std::span<const std::uint32_t> triangles,
                std::span<const std::uint32_t> quads = {}, std::span<const Attribute> attributes = {});

  /// Returns x, y, z of each point, world units, relative to origin(). The arrays of a mesh live as long as
  /// it or a copy of it.
  std::span<const float> points() const noexcept;
  /// Returns the origin of points(), world units; (0, 0, 0) unless the mesh lies far from it, compared with
  /// its size.
  std::array<double, 3> origin() const noexcept;
  /// Returns x, y, z of each point in world units.
  std::vector<double> world_points() const;
  std::span<const std::uint32_t> triangles() const noexcept;  ///< three numbers of points each
  std::span<const std::uint32_t> quads() const noexcept;      ///< four numbers of points each
  std::vector<Attribute> attributes() const;                  ///< views of the mesh's own arrays

  /// Returns a mesh of the same polygons whose attributes are replaced by these; all arrays are copied.
  /// @throws Error for an attribute with a wrong number of values.
  Mesh with_attributes(std::span<const Attribute> attributes) const;

  std::size_t point_count() const noexcept { return points().size() / 3; }
  std::size_t triangle_count() const noexcept { return triangles().size() / 3; }
  std::size_t quad_count() const noexcept { return quads().size() / 4; }
  bool empty() const noexcept { return triangles().empty() && quads().empty(); }

 private:
  friend struct Inside;
  struct Arrays;
  explicit Mesh(std::shared_ptr<const Arrays> arrays) : arrays_(std::move(arrays)) {}
  std::shared_ptr<const Arrays> arrays_;
};

/// Reads PLY (ASCII, binary), OBJ, OFF (text, binary), STL, glTF 2.0 or 3MF, each also gzipped. The extension
/// of the name gives the format. Polygons of more corners are split into triangles. Adds a note for each
/// tolerated fault. With `attributes` those of PLY, OBJ, glTF and 3MF are read, too.
/// @throws Error for a file that is missing, damaged, of another type or without polygons; Cancelled.
HERMESH_API Mesh read_mesh(const std::filesystem::path& path, Context& context, bool attributes = false);

/// Writes PLY (binary), OBJ, OFF, STL, glTF (.glb, .gltf) or 3MF, by the extension of the name, atomically.
/// The file has the same points, except for STL, which has single precision; a note gives the loss. Only PLY
/// stores attributes.
/// @throws Error for an unknown extension or a path that cannot be written; Cancelled.
HERMESH_API void write_mesh(const std::filesystem::path& path, const Mesh& mesh, Context& context);

}  // namespace hermesh::HERMESH_V1
