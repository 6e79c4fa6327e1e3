// Orders of accuracy: the slope of log error against log voxel size with an interval, the order that theory
// predicts, and the comparison of both. Also errors of normal codes at other resolutions, and the fewest
// triangles of a surface.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "algorithms/hermite/normal_code.h"
#include "experiments/accuracy/mesh_errors.h"
#include "experiments/harness/json_values.h"

namespace hermesh {

/// Errors of one quantity at one voxel size, one for each position of the shape between the samples.
struct ErrorsAtSize {
  double size;                 ///< of the voxel, or another step; positive
  std::vector<double> errors;  ///< at least one
};

/// A slope with its 95 % interval.
struct SlopeFit {
  double slope, low, high;
};

/// Returns the least-squares slope of log(mean error) against log(size), and percentiles 2.5 and 97.5 of the
/// slopes of `draws` bootstrap draws: sizes with replacement, and for each size errors with replacement.
/// Draws of fewer than three different sizes are repeated if there are that many, so that no slope depends on
/// two neighbours. None for fewer than two sizes, or if a mean is 0 or not finite. Equal for equal seeds.
std::optional<SlopeFit> fit_slope(const std::vector<ErrorsAtSize>& data, std::uint64_t seed,
                                  int draws = 1000);

/// first · sizeᵃ + second · sizeᵇ with the smallest relative errors.
struct TwoTermFit {
  double first, second;
  double residual;  ///< root mean square of (fit − error) / error
};

/// Fits the means of signed errors by two powers of the size, e.g. the error at a crease (a) and that of the
/// smooth rest (b). None for fewer than three sizes, or if an error is 0.
std::optional<TwoTermFit> fit_two_terms(const std::vector<ErrorsAtSize>& data, double a, double b);

/// Expected behaviour of errors as voxels shrink.
enum class Expectation {
  kSmooth,      ///< chords of a curved surface: h² in distances, area and volume, h in normals
  kSharp,       ///< creases cut off: h next to them, on a part of the area that shrinks with h
  kKept,        ///< creases between curved faces preserved: as smooth, and chords of the creases
  kExact,       ///< flat faces and preserved creases: only rounding errors
  kFirstOrder,  ///< any quantity, proportional to the step
};

/// `keeps_creases`: for a method that knows the normals on both sides of a crease exactly.
Expectation expectation(const ExactShape& shape, bool keeps_creases);

/// Returns the order by theory; none if the result should be exact. If creases are cut off, a strip of width
/// h is off by h and has other normals: its squares give 3/2 and 1/2, its area's error is h, its volume's h².
/// Mean curvature by cotangents does not converge on meshes whose triangles do not follow the curvature:
/// order 0 (Etiene et al. 2009, Xu 2004).
std::optional<double> theory(Expectation expectation, Quantity quantity);

/// Returns the powers of the voxel size at a crease and on smooth faces for quantities whose signed errors
/// add up from both; none for others.
std::optional<std::pair<double, double>> two_powers(Quantity quantity);

/// Sets order, order_low, order_high, order_theory, order_within ("yes" or "no"), error_coarse, error_fine
/// and exact
/// ("yes" or "no") in a row's values. A slope is missing if all errors are rounding errors.
void describe_order(Json& values, const std::vector<ErrorsAtSize>& errors, Expectation expectation,
                    Quantity quantity, std::uint64_t seed, int draws);

/// Errors in radians against the step, 1 over the number of levels, at 4 to 10 bits per component; and the
/// number of normals whose result at the resolution in use differs from the code in use.
struct NormalCodeOrder {
  std::vector<ErrorsAtSize> mean, max;
  std::size_t differing = 0;
};

/// Quantises like the code with any number of levels, without packing into bits. Three draws of `normals`
/// random normals for each resolution. @throws Cancelled.
NormalCodeOrder normal_code_order(NormalCodeId code, std::size_t normals, std::uint64_t seed,
                                  const RunContext& context);

/// Returns N · ε of the fewest triangles N within the distance ε of the shape, as ε goes to 0: the integral
/// of √|K| over the surface, divided by the largest areas of a triangle whose distance to a surface of
/// Gaussian curvature ±1 is at most 1. Parts with K = 0 need no triangles in this limit. None for shapes
/// without facets to integrate over, or with flat parts or creases, for which the limit is meaningless.
std::optional<double> triangles_times_error(const std::string& shape);

}  // namespace hermesh
