#include "experiments/harness/facts.h"

#include <tbb/parallel_for.h>

#include <cstring>
#include <sstream>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/extraction/marching_cubes/marching_cubes.h"
#include "algorithms/io/mesh_file.h"
#include "experiments/cases/cases.h"
#include "validation/solid_comparison.h"
#include "validation/topology.h"

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

void add_placement(Bytes& bytes, const openvdb::GridBase& grid) {
  const openvdb::Mat4d placement = grid.transform().baseMap()->getAffineMap()->getMat4();
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) bytes.add(placement[row][column]);
}

using Leaf = openvdb::FloatTree::LeafNodeType;

class Fnv {
 public:
  void add(const void* data, std::size_t bytes) {
    const auto* at = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i + 4 <= bytes; i += 4) {
      std::uint32_t word;
      std::memcpy(&word, at + i, 4);
      hash_ = (hash_ ^ word) * 0x100000001b3u;
    }
  }
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325u;
};

std::uint64_t fingerprint_of(const Leaf& leaf) {
  Fnv hash;
  hash.add(leaf.origin().data(), 3 * sizeof(std::int32_t));
  for (openvdb::Index word = 0; word < Leaf::NodeMaskType::WORD_COUNT; ++word) {
    const auto bits = leaf.getValueMask().getWord<std::uint64_t>(word);
    hash.add(&bits, sizeof bits);
  }
  hash.add(leaf.buffer().data(), Leaf::SIZE * sizeof(float));
  return hash.value();
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

std::uint64_t fingerprint(const LevelSet& level_set) {
  const openvdb::FloatTree& tree = level_set.grid().grid->tree();
  std::vector<const Leaf*> leaves;
  tree.getNodes(leaves);
  std::vector<std::uint64_t> hashes(leaves.size());
  tbb::parallel_for(std::size_t(0), leaves.size(),
                    [&](std::size_t i) { hashes[i] = fingerprint_of(*leaves[i]); });

  Fnv hash;
  const float background = tree.background();
  hash.add(&background, sizeof background);
  auto tile = tree.cbeginValueAll();
  tile.setMaxDepth(openvdb::FloatTree::ValueAllCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    const float value = *tile;
    const std::int32_t active = tile.isValueOn();
    hash.add(&value, sizeof value);
    hash.add(&active, sizeof active);
  }
  hash.add(hashes.data(), hashes.size() * sizeof(std::uint64_t));
  return hash.value();
}

std::string dimensions_of(const LevelSet& level_set) {
  std::string text;
  for (const int width : level_set.dimensions()) text += (text.empty() ? "" : " × ") + std::to_string(width);
  return text;
}

std::int64_t count_surface_components(const LevelSet& level_set, RunContext& context) {
  const PolygonMesh mesh = marching_cubes(level_set, 0.0, nullptr, context);
  if (mesh.empty()) return 0;
  validation::MeshReport report;
  validation::count_topology(to_mesh_file(mesh), report, context);
  return report.components;
}

std::optional<validation::SolidComparison> compare_surface(const LevelSet& level_set,
                                                           const PolygonMesh& source, RunContext& context) {
  const PolygonMesh mesh = marching_cubes(level_set, 0.0, nullptr, context);
  if (mesh.empty()) return std::nullopt;
  return validation::compare_solids(to_mesh_file(mesh), to_mesh_file(source),
                                    {.voxel_size = level_set.voxel_size()}, context);
}

}  // namespace hermesh
