// The OpenVDB trees of DenseHermite. Heavy: include it from the few .cpp files that need it.
#pragma once

#include "algorithms/core/openvdb_trees.h"
#include "algorithms/thesis/voxels/dense_hermite.h"

// OpenVDB calls these functions by their full names, so they must be specialised type by type: an overload
// for all voxel types would be declared too late to be found.
#define HERMESH_DECLARE_VDB_VALUE(Voxel)                                                               \
  template <>                                                                                          \
  inline const char* typeNameAsString<hermesh::Voxel>() {                                              \
    return hermesh::Voxel::type_name;                                                                  \
  }                                                                                                    \
  template <>                                                                                          \
  inline hermesh::Voxel zeroVal<hermesh::Voxel>() {                                                    \
    return {};                                                                                         \
  }                                                                                                    \
  namespace math {                                                                                     \
  inline hermesh::Voxel Abs(const hermesh::Voxel& voxel) { return voxel; }                             \
  template <>                                                                                          \
  inline bool isApproxEqual(const hermesh::Voxel& a, const hermesh::Voxel& b) {                        \
    return a == b;                                                                                     \
  }                                                                                                    \
  template <>                                                                                          \
  inline bool isApproxEqual(const hermesh::Voxel& a, const hermesh::Voxel& b, const hermesh::Voxel&) { \
    return a == b;                                                                                     \
  }                                                                                                    \
  }

namespace openvdb {
namespace OPENVDB_VERSION_NAME {
HERMESH_DECLARE_VDB_VALUE(FloatVoxel)
HERMESH_DECLARE_VDB_VALUE(DirectedVoxel)
HERMESH_DECLARE_VDB_VALUE(ThesisVoxel)
HERMESH_DECLARE_VDB_VALUE(FixedVoxel)
}  // namespace OPENVDB_VERSION_NAME
}  // namespace openvdb
#undef HERMESH_DECLARE_VDB_VALUE

namespace hermesh {

using FloatDenseTree = DenseGrid<FloatVoxel>::TreeType;
using DirectedDenseTree = DenseGrid<DirectedVoxel>::TreeType;
using ThesisDenseTree = DenseGrid<ThesisVoxel>::TreeType;
using FixedDenseTree = DenseGrid<FixedVoxel>::TreeType;

}  // namespace hermesh

// They are compiled in dense_tree.cpp.
HERMESH_INSTANTIATE_TREE(extern template, hermesh::FloatDenseTree)
HERMESH_INSTANTIATE_TREE(extern template, hermesh::DirectedDenseTree)
HERMESH_INSTANTIATE_TREE(extern template, hermesh::ThesisDenseTree)
HERMESH_INSTANTIATE_TREE(extern template, hermesh::FixedDenseTree)

namespace hermesh {

/// Returns a placement as a grid's transform: the map of index coordinates, without the split into parts near
/// the base and the origin.
openvdb::math::Transform::Ptr transform_of(const IndexToWorld& placement);

}  // namespace hermesh
