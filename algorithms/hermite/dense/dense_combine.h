// Unions, intersections, differences and complements of dense Hermite data (constructive solid geometry;
// Aldén 2011, §4.2 and §7.1: on whole grids, threaded, and directly on the compressed voxels).
#pragma once

#include "algorithms/core/run_context.h"
#include "algorithms/hermite/boolean_rule.h"
#include "algorithms/hermite/dense/dense_hermite.h"

namespace hermesh {

/// The union, the intersection or the difference `a` \ `b`.
///
/// FloatVoxel, FixedVoxel and DirectedVoxel follow the rule of boolean_rule.h: the result is the same as that
/// of the same data as SparseHermite, by values and by topology, but for tags, and the same laws hold.
///
/// ThesisVoxel follows equation 7.1 as it is printed. A component is the distance along one edge with the
/// sign of the voxel, and infinite where there are no data; a union takes the smaller of two components, an
/// intersection the greater, with what belongs to them; of equal ones that of `a`. The difference is the
/// intersection with the complement. So
///   - where the operands cross an edge against each other, the result says that it is crossed, between two
///   samples of
///     one sign (trap T11);
///   - a crossing whose data seem missing, because its normal has the code 0, loses against any other of a
///   union
///     outside and wins inside, and is missing from the result or replaced by a wrong one (trap T2);
///   - the complement turns the normal 0xE000 along x or y, one near -z with the signs of the negative
///   octant, into
///     code 0: the crossing is lost, complementing again does not bring it back, and De Morgan's laws do not
///     hold.
/// Its result is not what check_consistent() asks for.
///
/// An operand that is moved in, and that nobody else shares, gives up its nodes: branches that one operand
/// alone has are handed over whole, or dropped, without a look at their voxels. One that is shared is copied
/// as far as it is needed (`a` as a whole).
/// @throws Error if the operands are on different lattices or have normals in different codes. @throws
/// Cancelled.
template <DenseVoxel Voxel>
DenseHermite<Voxel> combine(Boolean boolean, DenseHermite<Voxel> a, DenseHermite<Voxel> b,
                            RunContext& context);

/// The complement: what is outside becomes inside, at infinity, too; normals are turned about. Works in place
/// if its argument is moved into it and shared with nobody. An involution, but for ThesisVoxel (see above).
/// @throws Cancelled.
template <DenseVoxel Voxel>
DenseHermite<Voxel> complement(DenseHermite<Voxel> hermite, RunContext& context);

}  // namespace hermesh
