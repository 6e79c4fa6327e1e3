// Gathers a file's attributes in the file's order and puts them into the mesh's. Private to
// algorithms/io/mesh_file*.cpp.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/core/mesh_attribute.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh::mesh_formats {

/// Collects the attributes of one file while it is read, element by element, and gives them out in the order
/// of the mesh.
class AttributeBuilder {
 public:
  /// Starts without attributes. `file` is the name for sentences, `required` as ReadOptions has it.
  AttributeBuilder(std::string file, std::vector<std::string> required)
      : file_(std::move(file)), required_(std::move(required)) {}

  /// Adds an attribute and returns its number. Elements that have begun already get 0, or −1 where the values
  /// are whole numbers. A name that another attribute has gets the domain in front: "polygon-colour".
  std::size_t add(std::string name, AttributeDomain domain, int components, bool whole);
  void set_labels(std::size_t attribute, const std::vector<std::string>& labels);
  void reserve(AttributeDomain domain, std::size_t elements);

  /// Begins the next element of the domain, with values as those in add() until set() gives others.
  void begin(AttributeDomain domain);
  /// Sets a component of the newest element. A value that is not finite, or a whole number beyond 32 bits,
  /// spoils the attribute.
  void set(std::size_t attribute, int component, double value);
  /// Marks an attribute as one that cannot be read and will be left out; the first reason counts.
  void spoil(std::size_t attribute, const std::string& reason);
  /// Calls spoil() for the value of the newest element; `what` is the end of the sentence, such as "is no
  /// number".
  void spoil_value(std::size_t attribute, const std::string& what);
  /// Counts a polygon of the file, also one that is dropped; its corners begin on their own.
  void add_polygon(std::size_t corners) { polygon_sizes_.push_back(static_cast<std::uint32_t>(corners)); }

  /// Says that a polygon is cut into these triangles, by numbers of its corners, and not into a fan. Calls
  /// come in ascending order of polygons.
  void cut_polygon(std::size_t polygon, std::vector<Triangle> triangles) {
    cut_polygons_.push_back({polygon, std::move(triangles)});
  }

  /// Says which points of the file the mesh keeps; without the call it keeps all.
  void keep_points(std::vector<std::size_t> points) { kept_points_ = std::move(points); }

  /// The attributes in the order of MeshFile, whose polygons are cut as MeshBuilder cuts them. Notes how many
  /// elements of an attribute got no value, and which attributes are left out. @throws Error where one of
  /// these is required.
  std::vector<MeshAttribute> finish(RunContext& context);
  bool has_left_out() const { return left_out_ > 0; }  ///< to be asked after finish()

 private:
  struct Gathered {
    MeshAttribute result;
    std::size_t given = 0;     ///< number of elements with a value
    std::string spoiled = {};  ///< why it cannot be read, as a part of a sentence
  };
  struct CutPolygon {
    std::size_t polygon;
    std::vector<Triangle> triangles;
  };
  /// Number in the file of each corner of the mesh.
  std::vector<std::size_t> corner_order() const;
  std::size_t& begun(AttributeDomain domain) { return begun_[static_cast<std::size_t>(domain)]; }
  void grow(Gathered& gathered);
  std::string unused_name(std::string name, AttributeDomain domain);
  void note_missing(const Gathered& gathered, RunContext& context);
  void leave_out_spoiled(RunContext& context);

  std::string file_;
  std::vector<std::string> required_;
  std::size_t left_out_ = 0;
  std::vector<Gathered> gathered_;
  std::array<std::vector<std::size_t>, 3> of_domain_;  ///< numbers of the attributes of each domain
  std::array<std::size_t, 3> begun_{};                 ///< number of elements of each domain
  std::map<std::string, int> names_;                   ///< the last number that was put behind each name
  std::optional<std::vector<std::size_t>> kept_points_;
  std::vector<std::uint32_t> polygon_sizes_;
  std::vector<CutPolygon> cut_polygons_;
};

}  // namespace hermesh::mesh_formats
