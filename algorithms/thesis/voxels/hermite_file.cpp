#include "algorithms/thesis/voxels/hermite_file.h"

#include <bit>
#include <cmath>
#include <optional>
#include <type_traits>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/hermite/sign_tree.h"
#include "algorithms/io/vdb_archive.h"
#include "algorithms/thesis/voxels/dense_tree.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;
using openvdb::BoolTree;
using openvdb::Coord;
using openvdb::Index;
using openvdb::Int32Tree;

constexpr std::int32_t kVersion = 1;
constexpr const char *kDense = "hermite", *kSigns = "hermite_signs", *kCrossings = "hermite_crossings";
constexpr const char* kNormals = "unit vectors in index space, towards the outside";
constexpr std::size_t kPerLeaf = 512;

// The names of the metadata. The last three are the parts of a placement's translation, so that the same
// meshes are made from a file as from the data written to it.
constexpr const char *kVersionKey = "hermesh_hermite_version", *kCodeKey = "hermesh_normal_code",
                     *kNormalsKey = "hermesh_normals", *kOffsetKey = "hermesh_placement_offset",
                     *kOriginKey = "hermesh_placement_origin", *kBaseKey = "hermesh_placement_base";

openvdb::Vec3d to_vdb(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

void describe(openvdb::GridBase& grid, const char* name, const IndexToWorld& placement,
              const std::string& code) {
  grid.setName(name);
  grid.setTransform(transform_of(placement));
  grid.insertMeta(kVersionKey, openvdb::Int32Metadata(kVersion));
  grid.insertMeta(kCodeKey, openvdb::StringMetadata(code));
  grid.insertMeta(kNormalsKey, openvdb::StringMetadata(kNormals));
  grid.insertMeta(kOffsetKey, openvdb::Vec3DMetadata(to_vdb(placement.offset)));
  grid.insertMeta(kOriginKey, openvdb::Vec3DMetadata(to_vdb(placement.origin)));
  grid.insertMeta(kBaseKey,
                  openvdb::Vec3IMetadata({placement.base[0], placement.base[1], placement.base[2]}));
}

/// Returns the placement of a grid that was read. The transform takes precedence, since other programs may
/// have changed it; the metadata only divide its translation.
IndexToWorld placement_of(const openvdb::GridBase& grid) {
  if (!grid.transform().isLinear()) throw Error("the Hermite data have a perspective transform");
  const openvdb::Mat4R matrix = grid.transform().baseMap()->getAffineMap()->getMat4();
  IndexToWorld plain;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) plain.linear(row, column) = matrix(column, row);
  plain.origin = {matrix(3, 0), matrix(3, 1), matrix(3, 2)};
  const double volume = std::abs(plain.linear.determinant());
  if (!std::isfinite(volume) || volume == 0.0 || !plain.origin.allFinite())
    throw Error("the Hermite data have a transform that cannot be inverted");
  const auto offset = grid.getMetadata<openvdb::Vec3DMetadata>(kOffsetKey);
  const auto origin = grid.getMetadata<openvdb::Vec3DMetadata>(kOriginKey);
  const auto base = grid.getMetadata<openvdb::Vec3IMetadata>(kBaseKey);
  if (!offset || !origin || !base) return plain;
  const openvdb::Vec3i& at = base->value();
  const IndexToWorld divided{
      plain.linear, to_eigen(offset->value()), to_eigen(origin->value()), {at.x(), at.y(), at.z()}};
  // Metadata that no longer fit the transform are out of date.
  return same_lattice(divided, plain) ? divided : plain;
}

/// Returns the name of the code of a dense grid's normals.
template <class Voxel>
std::string code_name(NormalCodeId code) {
  constexpr bool kCoded = std::is_same_v<Voxel, FixedVoxel> || std::is_same_v<Voxel, ThesisVoxel>;
  return kCoded ? std::string(name(code)) : "none";
}

/// Returns the code of the grid's normals. @throws Error if the grid is not Hermite data of this version.
std::string check_description(const openvdb::GridBase& grid) {
  const auto version = grid.getMetadata<openvdb::Int32Metadata>(kVersionKey);
  const auto code = grid.getMetadata<openvdb::StringMetadata>(kCodeKey);
  const auto normals = grid.getMetadata<openvdb::StringMetadata>(kNormalsKey);
  if (!version || !code || !normals)
    throw Error("the grid '" + grid.getName() + "' does not say that it holds Hermite data of this program");
  if (version->value() != kVersion)
    throw Error("the Hermite data are of version " + std::to_string(version->value()) +
                ", this program reads version " + std::to_string(kVersion));
  // A later version may store normals of world space.
  if (normals->value() != kNormals) throw Error("the Hermite data have normals of another kind");
  return code->value();
}

BoolTree::LeafNodeType* make_sign_leaf(const SignLeaf& signs) {
  auto leaf = std::make_unique<BoolTree::LeafNodeType>(sign_tree::coord(signs.lower));
  for_each_bit(signs.inside, [&](int sample) { leaf->setValueOnly(static_cast<Index>(sample), true); });
  for (const BlockMask& axis : crossing_edges(signs))
    for_each_bit(axis, [&](int sample) { leaf->setActiveState(static_cast<Index>(sample), true); });
  return leaf.release();
}

// Crossings are a list, laid out as a row of leaves along x, for OpenVDB has no grid of one dimension.
Coord leaf_of_crossings(std::size_t leaf) { return Coord(static_cast<std::int32_t>(8 * leaf), 0, 0); }

Int32Tree::Ptr make_crossing_tree(const LargeArray<PackedCrossing>& crossings, RunContext& context) {
  std::vector<std::unique_ptr<Int32Tree::LeafNodeType>> leaves((crossings.size() + kPerLeaf - 1) / kPerLeaf);
  parallel_blocks(leaves.size(), context, [&](std::size_t i) {
    leaves[i] = std::make_unique<Int32Tree::LeafNodeType>(leaf_of_crossings(i), 0);
    const std::size_t begin = i * kPerLeaf, end = std::min(begin + kPerLeaf, crossings.size());
    for (std::size_t n = begin; n < end; ++n) {
      const std::uint32_t bits = crossings[n].normal | (std::uint32_t{crossings[n].offset_and_tag} << 16);
      leaves[i]->setValueOn(static_cast<Index>(n - begin), std::bit_cast<std::int32_t>(bits));
    }
  });
  auto tree = std::make_shared<Int32Tree>(0);
  for (auto& leaf : leaves) tree->addLeaf(leaf.release());
  return tree;
}

/// @throws Error unless the tree has as many crossings as there are edges, in the first positions.
void read_crossings(const Int32Tree& tree, LargeArray<PackedCrossing>& crossings, RunContext& context) {
  const std::uint64_t held = tree.activeVoxelCount();
  const auto wrong = [&] {
    return Error("the Hermite data have " + std::to_string(held) + " crossings, but their signs have " +
                 std::to_string(crossings.size()) + " crossing edges, or other crossings than the first");
  };
  if (held != crossings.size()) throw wrong();
  parallel_blocks((crossings.size() + kPerLeaf - 1) / kPerLeaf, context, [&](std::size_t i) {
    // Null where another program has pruned a leaf of equal records.
    const auto* leaf = tree.probeConstLeaf(leaf_of_crossings(i));
    const std::size_t begin = i * kPerLeaf, end = std::min(begin + kPerLeaf, crossings.size());
    for (std::size_t n = begin; n < end; ++n) {
      const auto place = static_cast<Index>(n - begin);
      std::int32_t value = 0;
      const bool active =
          leaf ? leaf->probeValue(place, value)
               : tree.probeValue(leaf_of_crossings(i) + Int32Tree::LeafNodeType::offsetToLocalCoord(place),
                                 value);
      if (!active) throw wrong();
      const auto bits = std::bit_cast<std::uint32_t>(value);
      crossings[n] = {static_cast<std::uint16_t>(bits), static_cast<std::uint16_t>(bits >> 16)};
    }
  });
}

template <class Grid>
typename Grid::Ptr read_grid(VdbReader& file, const char* name) {
  auto grid = openvdb::gridPtrCast<Grid>(file.read(name));
  if (!grid) throw Error("the grid '" + std::string(name) + "' has values of another type");
  return grid;
}

PackedHermite read_packed(VdbReader& file, RunContext& context) {
  const auto signs = read_grid<openvdb::BoolGrid>(file, kSigns);
  const auto crossings = read_grid<openvdb::Int32Grid>(file, kCrossings);
  const auto is_inside = [](bool inside) { return inside; };
  PackedHermite hermite;
  const std::string code = check_description(*signs);
  hermite.normal_code = parse_normal_code(code);
  if (check_description(*crossings) != code) throw Error("the Hermite data name two codes of normals");
  hermite.placement = placement_of(*signs);
  // The signs determine the number of crossings.
  sign_tree::read_signs(signs->tree(), hermite, context, is_inside);
  read_crossings(crossings->tree(), hermite.crossings, context);
  check_consistent(hermite);
  sign_tree::check_columns(hermite);
  sign_tree::check_tiles(signs->tree(), hermite, is_inside);
  return hermite;
}

template <class Voxel>
bool read_dense_as(const openvdb::GridBase::Ptr& grid, RunContext& context,
                   std::optional<AnyHermite>& result) {
  const auto typed = openvdb::gridPtrCast<DenseGrid<Voxel>>(grid);
  if (!typed) return false;
  DenseHermite<Voxel> hermite{placement_of(*typed), {}, typed};
  const std::string code = check_description(*typed);
  // An unused code is the default, as in data that were never written.
  hermite.normal_code = code == "none" ? NormalCodeId::octahedral : parse_normal_code(code);
  // Floats have no code, and the layout of the thesis its own.
  if (code != code_name<Voxel>(hermite.normal_code))
    throw Error("the Hermite data name a code of normals that does not fit their voxels");
  check_consistent(hermite, context);
  result = std::move(hermite);
  return true;
}

AnyHermite read_dense(VdbReader& file, RunContext& context) {
  const openvdb::GridBase::Ptr grid = file.read(kDense);
  std::optional<AnyHermite> result;
  if (!(read_dense_as<FixedVoxel>(grid, context, result) ||
        read_dense_as<ThesisVoxel>(grid, context, result) ||
        read_dense_as<DirectedVoxel>(grid, context, result) ||
        read_dense_as<FloatVoxel>(grid, context, result)))
    throw Error("the grid '" + std::string(kDense) + "' has values of another type");
  return *std::move(result);
}

AnyHermite read_any(VdbReader& file, RunContext& context) {
  if (file.has(kDense)) return read_dense(file, context);
  if (file.has(kSigns) && file.has(kCrossings)) return read_packed(file, context);
  const std::string names = file.joined_names();
  throw Error("there are no Hermite data, but " + (names.empty() ? "nothing" : "the grids " + names));
}

}  // namespace

void write_hermite(const fs::path& path, const PackedHermite& hermite, RunContext& context) {
  Stage stage(context, "write Hermite data");
  initialize_openvdb();
  const auto signs = openvdb::BoolGrid::create(sign_tree::make_tree<BoolTree>(
      hermite, {false, true}, context, [&](std::size_t i) { return make_sign_leaf(hermite.leaves[i]); }));
  const auto crossings = openvdb::Int32Grid::create(make_crossing_tree(hermite.crossings, context));
  const std::string code(name(hermite.normal_code));
  describe(*signs, kSigns, hermite.placement, code);
  // A list has no position in the world.
  describe(*crossings, kCrossings, IndexToWorld{}, code);
  write_grids(path, {signs, crossings});
}

template <DenseVoxel Voxel>
void write_hermite(const fs::path& path, const DenseHermite<Voxel>& hermite, RunContext& context) {
  Stage stage(context, "write Hermite data");
  // A shallow copy, so that describing it does not change the shared grid.
  const auto grid = std::const_pointer_cast<DenseGrid<Voxel>>(hermite.grid)->copy();
  describe(*grid, kDense, hermite.placement, code_name<Voxel>(hermite.normal_code));
  write_grids(path, {grid});
}
template void write_hermite(const fs::path&, const FloatDense&, RunContext&);
template void write_hermite(const fs::path&, const DirectedDense&, RunContext&);
template void write_hermite(const fs::path&, const ThesisDense&, RunContext&);
template void write_hermite(const fs::path&, const FixedDense&, RunContext&);

void write_hermite(const fs::path& path, const FloatHermite& hermite, RunContext& context) {
  write_hermite(path, to_dense<FloatVoxel>(hermite, context), context);
}

AnyHermite read_hermite(const fs::path& path, RunContext& context) {
  Stage stage(context, "read Hermite data");
  register_dense_grids();
  return about_vdb_file(path, [&] {
    VdbReader file(path);
    try {
      return read_any(file, context);
    } catch (const Error& e) {
      throw Error(path.string() + ": " + e.what());
    }
  });
}

HermiteSummary summary_of(const AnyHermite& hermite) {
  return std::visit(
      []<class Hermite>(const Hermite& held) -> HermiteSummary {
        if constexpr (std::is_same_v<Hermite, PackedHermite>)
          return {"packed", std::string(name(held.normal_code)), held.leaves.size(), held.crossings.size(),
                  held.memory_bytes()};
        else {
          using Voxel = typename Hermite::VoxelType;
          return {Voxel::type_name, code_name<Voxel>(held.normal_code), held.leaves(), held.crossings(),
                  held.memory_bytes()};
        }
      },
      hermite);
}

FloatHermite to_float(const AnyHermite& hermite, RunContext& context, std::size_t* lost) {
  if (lost) *lost = 0;
  return std::visit(
      [&]<class Hermite>(const Hermite& held) -> FloatHermite {
        if constexpr (std::is_same_v<Hermite, PackedHermite>)
          return unpack(held, context);
        else
          return to_sparse(held, context, lost);
      },
      hermite);
}

}  // namespace hermesh
