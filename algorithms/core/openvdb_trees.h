// OpenVDB, and the trees that most files use, compiled once: without these declarations every file that makes such a grid
// compiles all virtual functions of its tree, reading and writing among them. Include it instead of <openvdb/openvdb.h>.
#pragma once

#include <openvdb/openvdb.h>
#include <openvdb/tree/LeafManager.h>

/// A tree and its grid; `Instance` is `extern template` or `template`.
#define HERMESH_INSTANTIATE_TREE(Instance, Tree_)                                      \
  namespace openvdb::OPENVDB_VERSION_NAME {                                            \
  namespace tree {                                                                     \
  Instance class Tree<Tree_::RootNodeType>;                                            \
  }                                                                                    \
  Instance class Grid<Tree_>;                                                          \
  }
/// The nodes below the root, of values that have no nodes of their own.
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
