// OpenVDB's grids, and the trees of most files, compiled once: without these declarations every file that
// makes such a grid compiles all virtual functions of its tree. Include it instead of <openvdb/openvdb.h>,
// which has grids of points and files in addition, and takes more than a second longer to read.
#pragma once

#include <openvdb/Grid.h>
#include <openvdb/math/Transform.h>
#include <openvdb/tree/LeafManager.h>
#include <openvdb/tree/Tree.h>

// The names that <openvdb/openvdb.h> gives them. A file may include both.
namespace openvdb::OPENVDB_VERSION_NAME {
using BoolTree = tree::Tree4<bool, 5, 4, 3>::Type;
using FloatTree = tree::Tree4<float, 5, 4, 3>::Type;
using Int32Tree = tree::Tree4<std::int32_t, 5, 4, 3>::Type;
using MaskTree = tree::Tree4<ValueMask, 5, 4, 3>::Type;
using Vec3STree = tree::Tree4<Vec3f, 5, 4, 3>::Type;
using BoolGrid = Grid<BoolTree>;
using FloatGrid = Grid<FloatTree>;
using Int32Grid = Grid<Int32Tree>;
using MaskGrid = Grid<MaskTree>;
using Vec3SGrid = Grid<Vec3STree>;
}  // namespace openvdb::OPENVDB_VERSION_NAME

/// A tree and its grid; `Instance` is `extern template` or `template`.
#define HERMESH_INSTANTIATE_TREE(Instance, Tree_) \
  namespace openvdb::OPENVDB_VERSION_NAME {       \
  namespace tree {                                \
  Instance class Tree<Tree_::RootNodeType>;       \
  }                                               \
  Instance class Grid<Tree_>;                     \
  }
/// The nodes below the root.
#define HERMESH_INSTANTIATE_NODES(Instance, Value)                     \
  namespace openvdb::OPENVDB_VERSION_NAME::tree {                      \
  Instance class LeafNode<Value, 3>;                                   \
  Instance class InternalNode<LeafNode<Value, 3>, 4>;                  \
  Instance class InternalNode<InternalNode<LeafNode<Value, 3>, 4>, 5>; \
  }

HERMESH_INSTANTIATE_NODES(extern template, float)
HERMESH_INSTANTIATE_TREE(extern template, FloatTree)
HERMESH_INSTANTIATE_TREE(extern template, Int32Tree)
HERMESH_INSTANTIATE_TREE(extern template, BoolTree)
extern template class openvdb::tree::LeafManager<openvdb::FloatTree>;
