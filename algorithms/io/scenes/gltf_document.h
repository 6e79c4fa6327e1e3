// The structure of a glTF file: its JSON, buffers and accessors. Private to algorithms/io.
#pragma once

#include <map>
#include <nlohmann/json.hpp>

#include "algorithms/io/scenes/scene_files.h"
#include "algorithms/io/stored_number.h"

namespace hermesh::mesh_formats {

/// Looks up parts of a glTF file. nlohmann's library parses the JSON; every index, count and offset in it is
/// checked here before it is followed, since no glTF library does that for accessors. Each function throws an
/// Error if the file has another structure.
class GltfDocument {
 protected:
  using Json = nlohmann::json;

  /// `binary` is the first buffer if that has no URI. @throws Error for damaged JSON, another version than 2,
  /// and required extensions that may change shapes.
  GltfDocument(std::string_view json, std::string_view binary, MeshBuilder& builder);

  const Json& root() const { return root_; }
  /// Returns a member of an object; null if it has none, or is not an object.
  const Json* member(const Json& object, const char* key) const;
  /// Returns a member that is an integer, such as an index, a length or an offset, if there is one.
  std::optional<std::size_t> count_if_any(const Json& object, const char* key) const;
  /// Returns a mandatory member as above.
  std::size_t count(const Json& object, const char* key) const;
  /// Returns the entries of an array, if there is one.
  const Json& list(const Json& object, const char* key) const;
  /// Returns an entry of one of the arrays of the root.
  const Json& entry(const char* key, std::size_t index) const;
  /// Returns a member that is an array of `size` numbers, if there is one.
  std::optional<std::vector<double>> numbers(const Json& object, const char* key, std::size_t size) const;
  /// Returns all numbers of an accessor of this type, element by element; whole numbers that the file
  /// declares as normalised are from -1 to 1. @param whole true if they must be indices
  std::vector<double> values(std::size_t index, std::size_t components, const char* type, bool whole);
  [[noreturn]] void fail_compressed(const std::string& extension) const;

  MeshBuilder& builder_;
  PartPlacer placer_;

 private:
  struct Elements;
  void check_extensions() const;
  /// Returns the bytes of a buffer. Buffers with a URI are fetched once.
  std::string_view buffer(std::size_t index);
  /// Returns elements of a buffer view. @throws Error if they reach beyond it, or it beyond its buffer.
  Elements elements(const Json& from, std::size_t view, NumberType type, std::size_t components,
                    std::size_t number);
  /// Replaces the values that a sparse accessor lists.
  void read_sparse(const Json& sparse, const std::string& name, NumberType type, std::size_t components,
                   std::vector<double>& values);

  std::string_view binary_, json_;
  Json root_;
  std::map<std::size_t, std::string> buffers_;
};

}  // namespace hermesh::mesh_formats
