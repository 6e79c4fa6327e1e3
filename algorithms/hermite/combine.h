// Unions, intersections, differences and complements of Hermite data (constructive solid geometry; Aldén
// 2011, §7.1), on the stored form of the crossings: nothing is unpacked.
#pragma once

#include "algorithms/core/run_context.h"
#include "algorithms/hermite/boolean_rule.h"
#include "algorithms/hermite/sparse_hermite.h"

namespace hermesh {

/// Computes the union, the intersection or the difference `a` \ `b`, by the rule of boolean_rule.h, which
/// lists losses and laws. Leaves without a crossing edge are omitted, so the laws hold member by member;
/// placement and normal code are those of `a`. The time grows with the number of leaves of both operands that
/// are near each other: leaves that only one operand has are copied or skipped in long runs. The bytes are
/// the same for every number of threads.
/// @throws Error if the operands are on different lattices, have normals in different codes, or the result
/// would have 2³² crossings or more; Cancelled.
template <class Crossing>
SparseHermite<Crossing> combine(Boolean boolean, const SparseHermite<Crossing>& a,
                                const SparseHermite<Crossing>& b, RunContext& context);

/// Computes the complement: the outside becomes inside, also at infinity; normals are reversed, offsets and
/// tags unchanged. Works in place if its argument is moved into it. An involution, bit by bit, for normals
/// that the pack() of a NormalCode returned.
/// @throws Cancelled.
template <class Crossing>
SparseHermite<Crossing> complement(SparseHermite<Crossing> hermite, RunContext& context);

}  // namespace hermesh
