// Unions, intersections, differences and complements of Hermite data (constructive solid geometry; Aldén
// 2011, §7.1), on the crossings as they are stored: nothing is unpacked.
#pragma once

#include "algorithms/core/run_context.h"
#include "algorithms/hermite/boolean_rule.h"
#include "algorithms/hermite/sparse_hermite.h"

namespace hermesh {

/// The union, the intersection or the difference `a` \ `b`, by the rule of boolean_rule.h, which says what is
/// lost and what laws hold. Leaves without a crossing edge are left out, so the laws hold member by member;
/// placement and normal code are those of `a`. Time goes with the leaves of both operands that are near each
/// other: what one of them alone has is copied in long runs, or skipped, without a look at its samples. The
/// bytes are the same for every number of threads.
/// @throws Error if the operands are on different lattices, have normals in different codes, or the result
/// would have 2³² crossings or more. @throws Cancelled.
template <class Crossing>
SparseHermite<Crossing> combine(Boolean boolean, const SparseHermite<Crossing>& a,
                                const SparseHermite<Crossing>& b, RunContext& context);

/// The complement: what is outside becomes inside, at infinity, too; normals are turned about, offsets and
/// tags stay. Works in place if its argument is moved into it. An involution, bit by bit, for normals that
/// the pack() of a NormalCode returned. @throws Cancelled.
template <class Crossing>
SparseHermite<Crossing> complement(SparseHermite<Crossing> hermite, RunContext& context);

}  // namespace hermesh
