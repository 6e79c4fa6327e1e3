// A leaf of OpenVDB's trees of floats, for files without trees: they compile in half the time.
#pragma once

#include <openvdb/tree/LeafNode.h>

namespace hermesh {

using FloatLeaf = openvdb::tree::LeafNode<float, 3>;

}  // namespace hermesh

extern template class openvdb::tree::LeafNode<float, 3>;  // openvdb_trees.cpp
