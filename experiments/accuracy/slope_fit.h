// Orders of accuracy: the slope of log error against log voxel size, with an interval.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace hermesh {

/// Errors of one quantity at one voxel size: of a mesh for each place of the shape between the samples.
struct ErrorsAtSize {
  double size;                 ///< of the voxel, or whatever the error is thought to be a power of; positive
  std::vector<double> errors;  ///< none negative; at least one
};

/// A slope with an interval that holds it in 95 of 100 draws.
struct SlopeFit {
  double slope, low, high;
};

/// Slope of log(mean error) against log(size) by least squares, and percentiles 2.5 and 97.5 of the slopes of
/// `draws` draws (bootstrap): sizes with replacement, and for each size errors with replacement. A draw of
/// fewer than three different sizes is drawn again where there are that many, so that no slope hangs on two
/// neighbours. None if there are fewer than two sizes, or if a mean is 0 or not finite, of which there is no
/// logarithm. Equal for equal seeds.
std::optional<SlopeFit> fit_slope(const std::vector<ErrorsAtSize>& data, std::uint64_t seed,
                                  int draws = 1000);

/// first · sizeᵃ + second · sizeᵇ with the smallest relative errors.
struct TwoTermFit {
  double first, second;
  double residual;  ///< root mean square of (fit − error) / error
};

/// Fits the means of signed errors by two powers of the size, such as the error at a crease (a) and that of
/// the smooth rest (b). None with fewer than three sizes, or where an error is 0.
std::optional<TwoTermFit> fit_two_terms(const std::vector<ErrorsAtSize>& data, double a, double b);

}  // namespace hermesh
