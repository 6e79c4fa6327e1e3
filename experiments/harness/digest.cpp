#include "experiments/harness/digest.h"

#include <sstream>

#include "algorithms/core/level_set_grid.h"
#include "experiments/cases/sha256.h"
#include "experiments/harness/level_set_facts.h"

namespace hermesh {
namespace {

constexpr std::size_t kDigits = 16;

/// Bytes of plain values, one after the other.
class Bytes {
 public:
  template <class T>
  void add(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    add_bytes(&value, sizeof value);
  }
  template <class Array>
  void add_array(const Array& items) {
    add(std::uint64_t(items.size()));
    add_bytes(items.data(), items.size() * sizeof(items[0]));
  }
  void add_matrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
    for (Eigen::Index i = 0; i < matrix.size(); ++i) add(matrix(i % matrix.rows(), i / matrix.rows()));
  }
  std::string digest() const { return digest_of_text(text_); }

 private:
  void add_bytes(const void* data, std::size_t size) { text_.append(static_cast<const char*>(data), size); }
  std::string text_;
};

void add(Bytes& bytes, const MeshAttribute& attribute) {
  bytes.add_array(attribute.name);
  bytes.add(attribute.domain);
  bytes.add(attribute.components);
  std::visit([&](const auto& values) { bytes.add_array(values); }, attribute.values);
  for (const std::string& label : attribute.labels) bytes.add_array(label);
}

}  // namespace

std::string digest_of_text(std::string_view text) { return sha256_of_text(text).substr(0, kDigits); }

std::string digest(const PolygonMesh& mesh) {
  if (mesh.attributes.empty()) return sha256_of_mesh(mesh).substr(0, kDigits);
  Bytes bytes;
  bytes.add_array(sha256_of_mesh(mesh));
  for (const MeshAttribute& attribute : mesh.attributes) add(bytes, attribute);
  return bytes.digest();
}

std::string digest(const std::vector<PolygonMesh>& meshes) {
  Bytes bytes;
  for (const PolygonMesh& mesh : meshes) bytes.add_array(digest(mesh));
  return bytes.digest();
}

namespace {

void add_placement(Bytes& bytes, const openvdb::GridBase& grid) {
  const openvdb::Mat4d placement = grid.transform().baseMap()->getAffineMap()->getMat4();
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) bytes.add(placement[row][column]);
}

}  // namespace

std::string digest(const LevelSet& level_set) {
  Bytes bytes;
  add_placement(bytes, *level_set.grid().grid);
  bytes.add(fingerprint(level_set));
  return bytes.digest();
}

std::string digest(const openvdb::GridBase& grid) {
  Bytes bytes;
  add_placement(bytes, grid);
  bytes.add_array(grid.getName());
  std::ostringstream stream;
  grid.writeTopology(stream);
  grid.writeBuffers(stream);
  bytes.add_array(stream.str());
  return bytes.digest();
}

std::string digest(const FloatHermite& hermite) {
  static_assert(std::has_unique_object_representations_v<SignLeaf>);
  Bytes bytes;
  bytes.add_matrix(hermite.placement.linear);
  bytes.add_matrix(hermite.placement.offset);
  bytes.add_matrix(hermite.placement.origin);
  bytes.add(hermite.placement.base);
  bytes.add(hermite.outermost_inside);
  bytes.add_array(hermite.leaves);
  bytes.add_array(hermite.crossings);
  return bytes.digest();
}

}  // namespace hermesh
