// Forward declarations of OpenVDB's trees and grids of floats, for headers that only refer to them: OpenVDB's
// own take seconds to read. Files that access a tree include openvdb_trees.h, too.
#pragma once

#include <openvdb/version.h>

#include <cstdint>

namespace openvdb {
OPENVDB_USE_VERSION_NAMESPACE
namespace OPENVDB_VERSION_NAME {
namespace math {
class Coord;
class CoordBBox;
class Transform;
}  // namespace math
namespace tree {
template <typename, std::uint32_t>
class LeafNode;
template <typename, std::uint32_t>
class InternalNode;
template <typename>
class RootNode;
template <typename>
class Tree;
}  // namespace tree
template <typename>
class Grid;

using math::Coord;
using math::CoordBBox;
using FloatTree =
    tree::Tree<tree::RootNode<tree::InternalNode<tree::InternalNode<tree::LeafNode<float, 3>, 4>, 5>>>;
using FloatGrid = Grid<FloatTree>;
}  // namespace OPENVDB_VERSION_NAME
}  // namespace openvdb
