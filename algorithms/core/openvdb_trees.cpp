#include "algorithms/core/openvdb_trees.h"

namespace openvdb::OPENVDB_VERSION_NAME::tree {
/// Required by LeafNode::str(), which is never called.
template <class Value, Index kLog2Dim>
std::ostream& operator<<(std::ostream& out, const LeafBuffer<Value, kLog2Dim>&) {
  return out;
}
}  // namespace openvdb::OPENVDB_VERSION_NAME::tree

HERMESH_INSTANTIATE_NODES(template, float)
HERMESH_INSTANTIATE_TREE(template, FloatTree)
HERMESH_INSTANTIATE_TREE(template, Int32Tree)
HERMESH_INSTANTIATE_TREE(template, BoolTree)
template class openvdb::tree::LeafManager<openvdb::FloatTree>;
