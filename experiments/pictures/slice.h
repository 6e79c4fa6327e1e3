// Slices through level sets: a plane of samples, coloured by side, as figures 9.1 and 9.2 of the thesis show
// them.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "algorithms/core/level_set.h"
#include "experiments/pictures/canvas.h"

namespace hermesh {

/// Which samples a slice shows, in index coordinates: those with `at` along `axis`, and along the two axes
/// that follow it (cyclically) from `lower` to `upper`, both included; the first of these runs to the right,
/// the second upwards.
struct SliceFrame {
  int axis = 2;
  int at = 0;
  std::array<int, 2> lower{}, upper{};
};

/// The frame about all active samples, `margin` samples wider to every side, that cuts their box at a share
/// of its extent.
/// @throws Error for a level set without active samples.
SliceFrame slice_frame(const LevelSet& level_set, int axis, double share, int margin);

/// Colours of the samples: active ones outside and inside, and inactive ones inside; the others stay paper.
inline constexpr Tone kOutsideTone{0.36, 0.66, 0.36}, kInsideTone{0.80, 0.25, 0.20},
    kDeepTone{0.97, 0.86, 0.84};

/// Draws the frame's samples in their colours, on the sign and state of each alone, so that a slice shows
/// what the grid holds. The picture is as wide as `pixels` says at most, and no higher; samples are squares
/// of whole pixels where there is room for one or more, else every pixel shows the sample that it lies in.
/// With `contour` greater than 0 the colour of active samples alternates each so many voxels of distance,
/// which shows whether distances grow evenly. @throws Error for less than one pixel.
Image draw_slice(const LevelSet& level_set, const SliceFrame& frame, int pixels, double contour = 0.0);

/// What the colours mean, for a sheet's legend.
std::vector<LegendEntry> slice_legend();

/// Numbers of a slice's samples by side and state.
struct SliceCounts {
  std::size_t active_outside = 0, active_inside = 0, inactive_inside = 0;
};
SliceCounts count_slice(const LevelSet& level_set, const SliceFrame& frame);

}  // namespace hermesh
