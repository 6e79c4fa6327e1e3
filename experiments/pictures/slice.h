// Slices through level sets: a plane of samples, coloured by side, like figures 9.1 and 9.2 of the thesis.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "algorithms/core/level_set.h"
#include "experiments/pictures/canvas.h"

namespace hermesh {

/// The samples of a slice, in index coordinates: those with `at` along `axis`, and along the two axes that
/// follow it cyclically from `lower` to `upper` inclusive; the first of these runs to the right, the second
/// upwards.
struct SliceFrame {
  int axis = 2;
  int at = 0;
  std::array<int, 2> lower{}, upper{};
};

/// Returns the frame about all active samples, `margin` samples wider on each side, that cuts their box at a
/// share of its extent.
/// @throws Error for a level set without active samples.
SliceFrame slice_frame(const LevelSet& level_set, int axis, double share, int margin);

/// Colours of the samples: active ones outside and inside, and inactive ones inside; the others stay paper.
inline constexpr Tone kOutsideTone{0.36, 0.66, 0.36}, kInsideTone{0.80, 0.25, 0.20},
    kDeepTone{0.97, 0.86, 0.84};

/// Draws the frame's samples in the colour of their sign and state. The picture has at most `pixels` along
/// each side; samples are squares of whole pixels if they fit, else each pixel shows the sample that it lies
/// in. With `contour` greater than 0, the colour of active samples alternates every `contour` voxels of
/// distance, which shows the growth of distances. @throws Error for less than one pixel.
Image draw_slice(const LevelSet& level_set, const SliceFrame& frame, int pixels, double contour = 0.0);

/// Returns the meaning of the colours.
std::vector<LegendEntry> slice_legend();

}  // namespace hermesh
