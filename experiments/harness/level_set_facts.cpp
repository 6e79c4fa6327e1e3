#include "experiments/harness/level_set_facts.h"

#include <tbb/parallel_for.h>

#include <cstring>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/extraction/marching_cubes/marching_cubes.h"
#include "algorithms/io/mesh_file.h"
#include "validation/solid_comparison.h"
#include "validation/topology.h"

namespace hermesh {
namespace {

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
