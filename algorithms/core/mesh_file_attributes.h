// Gathers a file's attributes in the file's order and puts them into the mesh's. Private to
// algorithms/core/mesh_file*.cpp.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "algorithms/core/mesh_attribute.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh::mesh_formats {

class AttributeBuilder {
 public:
  explicit AttributeBuilder(std::string file) : file_(std::move(file)) {}

  /// A new attribute and its number. Elements that have begun already get 0, or −1 where the values are whole
  /// numbers. A name that another attribute has gets the domain in front: "polygon-colour".
  std::size_t add(std::string name, AttributeDomain domain, int components, bool whole);
  void set_labels(std::size_t attribute, std::vector<std::string> labels) {
    gathered_[attribute].result.labels = std::move(labels);
  }
  void reserve(AttributeDomain domain, std::size_t elements);

  /// The next element of the domain, filled like those in add().
  void begin(AttributeDomain domain);
  /// Of the newest element. @throws Error for a value that is not finite, or a whole number beyond 32 bits.
  void set(std::size_t attribute, int component, double value);
  /// Once for each polygon of the file, also for those that are dropped; their corners begin on their own.
  void add_polygon(std::size_t corners) { polygon_sizes_.push_back(static_cast<std::uint32_t>(corners)); }

  /// That it is cut in this way, by numbers of its corners, and not into a fan. Polygons ascend.
  void cut_polygon(std::size_t polygon, std::vector<Triangle> triangles) {
    cut_polygons_.push_back({polygon, std::move(triangles)});
  }

  /// In the order of MeshFile, its polygons cut as MeshBuilder cuts them. Notes how many elements of an
  /// attribute got no value.
  std::vector<MeshAttribute> finish(RunContext& context);

 private:
  struct Gathered {
    MeshAttribute result;
    std::size_t given = 0;  ///< elements with a value
  };
  struct CutPolygon {
    std::size_t polygon;
    std::vector<Triangle> triangles;
  };
  /// For each corner of the mesh its number in the file.
  std::vector<std::size_t> corner_order() const;
  std::size_t& begun(AttributeDomain domain) { return begun_[static_cast<std::size_t>(domain)]; }
  void grow(Gathered& gathered);
  std::string unused_name(std::string name, AttributeDomain domain) const;
  void note_missing(const Gathered& gathered, RunContext& context);
  [[noreturn]] void fail(const Gathered& gathered, const std::string& what);

  std::string file_;
  std::vector<Gathered> gathered_;
  std::array<std::size_t, 3> begun_{};  ///< elements, by domain
  std::vector<std::uint32_t> polygon_sizes_;
  std::vector<CutPolygon> cut_polygons_;
};

}  // namespace hermesh::mesh_formats
