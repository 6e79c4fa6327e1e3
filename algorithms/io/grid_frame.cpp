#include "algorithms/io/grid_frame.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <tuple>

#include "algorithms/core/error.h"
#include "algorithms/core/level_set_grid.h"
#include "algorithms/io/vdb_archive.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// A node at the top of a tree has this many voxels along each side, and can be moved by whole sides.
constexpr int kTop = 4096;

/// Moves a node and all below it; values and masks are relative to the node.
template <class Node>
void move_node(Node& node, const openvdb::Coord& by) {
  node.setOrigin(node.origin() + by);
  if constexpr (Node::LEVEL > 0)
    for (auto child = node.beginChildOn(); child; ++child) move_node(*child, by);
}

template <class Tree>
void move_tree(Tree& tree, const openvdb::Coord& by) {
  using Root = typename Tree::RootNodeType;
  Root& root = tree.root();
  // The root is a map from origins to nodes and tiles, so all are removed and inserted again.
  std::vector<std::tuple<openvdb::Coord, typename Root::ValueType, bool>> tiles;
  for (auto tile = root.cbeginValueAll(); tile; ++tile)
    tiles.emplace_back(tile.getCoord(), *tile, tile.isValueOn());
  std::vector<typename Root::ChildNodeType*> nodes;
  root.stealNodes(nodes);
  root.clear();
  for (typename Root::ChildNodeType* node : nodes) {
    move_node(*node, by);
    root.addChild(node);
  }
  for (const auto& [at, value, on] : tiles) root.addTile(at + by, value, on);
}

openvdb::math::Transform::Ptr transform_of(const GridFrame& frame) {
  openvdb::Mat4d matrix = openvdb::Mat4d::identity();  // transposed, since OpenVDB multiplies row vectors
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) matrix(i, j) = frame.voxel_size * frame.rotation(j, i);
    matrix(3, i) = frame.offset[i];
  }
  return openvdb::math::Transform::createLinearTransform(matrix);
}

}  // namespace

GridFrame grid_frame(const openvdb::math::Transform& transform) {
  if (!transform.isLinear())
    throw Error("the grid's transform has a perspective, in which distances are not those of voxels");
  GridFrame frame;
  const Vector3d zero = to_eigen(transform.indexToWorld(openvdb::Vec3d(0, 0, 0)));
  // Differences of transformed points would lose precision.
  const openvdb::Mat4d matrix = transform.baseMap()->getAffineMap()->getMat4();
  Eigen::Matrix3d linear;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) linear(i, j) = matrix(j, i);
  // With one scale and right angles, the cube root of the volume is the scale, and the rest a rotation.
  frame.voxel_size = std::cbrt(std::abs(linear.determinant()));
  frame.rotation = linear / frame.voxel_size;
  frame.offset = zero;
  const double off = (frame.rotation.transpose() * frame.rotation - Eigen::Matrix3d::Identity()).norm();
  if (!(off <= 1e-6))
    throw Error(
        "the grid's transform is sheared or scales its axes differently, so that distances are not those of "
        "voxels");
  if (linear.determinant() < 0)
    throw Error("the grid's transform mirrors, which would turn the mesh inside out");
  return frame;
}

GridFrame read_grid_frame(const std::filesystem::path& path) {
  return about_vdb_file(path, [&] {
    VdbReader file(path);
    for (const std::string& name : file.names()) {
      const openvdb::GridBase::Ptr grid = file.read_metadata(name);
      if (!grid->isType<openvdb::FloatGrid>()) continue;
      return about_file(path.string(), [&] { return grid_frame(grid->transform()); });
    }
    throw Error(path.string() + " holds no float grid whose lattice could be taken");
  });
}

FramedMesh into_frame(const PolygonMesh& mesh, const GridFrame& frame) {
  // The inverse of a rotation is its transpose.
  const Eigen::Matrix3d back = frame.rotation.transpose();
  const Vector3d start = back * (mesh.origin - frame.offset);
  const auto place = [&](const Eigen::Vector3f& p) { return Vector3d(start + back * p.cast<double>()); };
  Bounds box;
  for (const Eigen::Vector3f& p : mesh.points) box.add(place(p));
  FramedMesh result{mesh, {}};
  Vector3d moved = Vector3d::Zero();
  for (int a = 0; a < 3; ++a) {
    // The middle of the mesh in multiples of kTop voxels, rounded, becomes the new origin: near enough for
    // single precision, and a tree can be moved back by whole top nodes.
    const double middle = box.empty() ? 0.0 : 0.5 * (box.lower[a] + box.upper[a]) / frame.voxel_size / kTop;
    if (!(std::abs(middle) < (1 << 30) / kTop))
      throw Error(
          "the mesh lies more than 1.07e+09 voxels from the origin of the grid whose lattice it is to share");
    result.first[std::size_t(a)] = int(std::lround(middle)) * kTop;
    moved[a] = frame.voxel_size * result.first[std::size_t(a)];
  }
  result.mesh.origin.setZero();
  for (Eigen::Vector3f& p : result.mesh.points) p = (place(p) - moved).cast<float>();
  return result;
}

void out_of_frame(const std::vector<openvdb::GridBase::Ptr>& grids, const GridFrame& frame,
                  const std::array<int, 3>& first) {
  const openvdb::Coord by(first[0], first[1], first[2]);
  const Vector3d moved = frame.voxel_size * Vector3d(first[0], first[1], first[2]);
  for (const openvdb::GridBase::Ptr& grid : grids) {
    if (const auto zero = grid->getMetadata<openvdb::Vec3DMetadata>(kZeroOfPositions)) {
      const auto points = openvdb::gridPtrCast<openvdb::Vec3SGrid>(grid);
      for (auto value = points->beginValueOn(); value; ++value) {
        // Relative to their zero, so they are only rotated; the zero is transformed in double precision.
        const Vector3d turned = frame.rotation * to_eigen(*value);
        value.setValue(openvdb::Vec3s(openvdb::Vec3d(turned.x(), turned.y(), turned.z())));
      }
      const Vector3d world = frame.offset + frame.rotation * (to_eigen(zero->value()) + moved);
      points->insertMeta(kZeroOfPositions, openvdb::Vec3DMetadata({world.x(), world.y(), world.z()}));
    }
    if (by != openvdb::Coord(0, 0, 0))
      grid->apply<openvdb::TypeList<openvdb::FloatGrid, openvdb::Int32Grid, openvdb::Vec3SGrid>>(
          [&](auto& typed) { move_tree(typed.tree(), by); });
    grid->setTransform(transform_of(frame));
  }
}

}  // namespace hermesh
