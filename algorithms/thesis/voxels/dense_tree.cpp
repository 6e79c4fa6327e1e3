#include "algorithms/thesis/voxels/dense_tree.h"

HERMESH_INSTANTIATE_TREE(template, hermesh::FloatDenseTree)
HERMESH_INSTANTIATE_TREE(template, hermesh::DirectedDenseTree)
HERMESH_INSTANTIATE_TREE(template, hermesh::ThesisDenseTree)
HERMESH_INSTANTIATE_TREE(template, hermesh::FixedDenseTree)
