// What theory says of orders of accuracy, and how a measured one is held against it.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "experiments/accuracy/mesh_errors.h"
#include "experiments/accuracy/slope_fit.h"
#include "experiments/harness/json_values.h"

namespace hermesh {

/// What errors should do as voxels shrink.
enum class Expectation {
  kSmooth,      ///< chords of a curved surface: h² in distances, area and volume, h in normals
  kSharp,       ///< creases cut off: h beside them, on a part of the area that shrinks with h
  kKept,        ///< creases between curved faces, kept: as smooth, and the creases' own chords
  kExact,       ///< flat faces and kept creases: no error but that of rounding
  kFirstOrder,  ///< whatever the quantity, proportional to the step
};

/// `keeps_creases`: of a method that knows the normals on both sides of a crease exactly.
Expectation expectation(const ExactShape& shape, bool keeps_creases);

/// The order that theory gives; none where the result should be exact. Where creases are cut off a strip of
/// width h is off by h and has other normals: its squares give 3/2 and 1/2, its area's error is h, its
/// volume's h². Mean curvature by cotangents does not converge on meshes whose triangles do not follow the
/// curvature: order 0 (Etiene et al. 2009, Xu 2004).
std::optional<double> theory(Expectation expectation, Quantity quantity);

/// Powers of the voxel size at a crease and on smooth faces, where signed errors add up from both; none for
/// other quantities.
std::optional<std::pair<double, double>> two_powers(Quantity quantity);

/// Largest deviation of a slope from theory that counts as none.
inline constexpr double kOrderTolerance = 0.15;
/// Error up to which a result counts as exact: what single precision does to coordinates around 1, in world
/// units, with what it does to the triangles' angles in radians.
double rounding_error(Quantity quantity, double voxel_size);

/// Writes order, order_low, order_high, order_theory, order_within ("yes" or "no"), error_coarse, error_fine
/// and exact ("yes" or "no") into a row's values. A slope has no figure where all errors are those of
/// rounding.
void describe_order(Json& values, const std::vector<ErrorsAtSize>& errors, Expectation expectation,
                    Quantity quantity, std::uint64_t seed, int draws);

}  // namespace hermesh
