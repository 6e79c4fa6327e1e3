#include "experiments/pictures/slice.h"

#include <algorithm>
#include <cmath>

#include "algorithms/core/error.h"
#include "algorithms/core/level_set_grid.h"

namespace hermesh {
namespace {

std::uint32_t packed(const Tone& tone, double brightness) {
  const auto byte = [&](double c) {
    return static_cast<std::uint32_t>(std::lround(255.0 * std::clamp(brightness * c, 0.0, 1.0)));
  };
  return 0xff000000u | byte(tone.red) << 16 | byte(tone.green) << 8 | byte(tone.blue);
}

int extent(const SliceFrame& frame, int direction) {
  return frame.upper[direction] - frame.lower[direction] + 1;
}

}  // namespace

SliceFrame slice_frame(const LevelSet& level_set, int axis, double share, int margin) {
  const openvdb::CoordBBox box = level_set.grid().grid->evalActiveVoxelBoundingBox();
  if (box.empty()) throw Error("a level set without active samples has no slice to draw");
  SliceFrame frame;
  frame.axis = axis;
  frame.at = box.min()[axis] + static_cast<int>(std::lround(share * (box.max()[axis] - box.min()[axis])));
  for (int i = 0; i < 2; ++i) {
    frame.lower[i] = box.min()[(axis + 1 + i) % 3] - margin;
    frame.upper[i] = box.max()[(axis + 1 + i) % 3] + margin;
  }
  return frame;
}

Image draw_slice(const LevelSet& level_set, const SliceFrame& frame, int pixels, double contour) {
  if (pixels < 1) throw Error("a slice of no pixels cannot be drawn");
  const int longest = std::max(extent(frame, 0), extent(frame, 1));
  const double scale = pixels >= longest ? std::floor(double(pixels) / longest) : double(pixels) / longest;
  Image image;
  image.width = std::max(1, static_cast<int>(extent(frame, 0) * scale));
  image.height = std::max(1, static_cast<int>(extent(frame, 1) * scale));
  std::vector<std::uint32_t> samples;
  samples.reserve(static_cast<std::size_t>(extent(frame, 0)) * extent(frame, 1));
  const double voxel = level_set.voxel_size();
  const auto accessor = level_set.grid().grid->getConstAccessor();
  for (int v = frame.lower[1]; v <= frame.upper[1]; ++v)
    for (int u = frame.lower[0]; u <= frame.upper[0]; ++u) {
      openvdb::Coord at;
      at[frame.axis] = frame.at;
      at[(frame.axis + 1) % 3] = u;
      at[(frame.axis + 2) % 3] = v;
      float value = 0.0f;
      const bool active = accessor.probeValue(at, value);
      const Tone tone = value < 0.0f ? (active ? kInsideTone : kDeepTone) : (active ? kOutsideTone : kPaper);
      const bool dark =
          active && contour > 0.0 && std::fmod(std::abs(value) / voxel, 2.0 * contour) >= contour;
      samples.push_back(packed(tone, dark ? 0.78 : 1.0));
    }
  image.pixels.resize(static_cast<std::size_t>(image.width) * image.height);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const int u = std::min(extent(frame, 0) - 1, static_cast<int>(x / scale));
      const int v = std::min(extent(frame, 1) - 1, static_cast<int>((image.height - 1 - y) / scale));
      image.pixels[static_cast<std::size_t>(y) * image.width + x] =
          samples[static_cast<std::size_t>(v) * extent(frame, 0) + u];
    }
  return image;
}

std::vector<LegendEntry> slice_legend() {
  return {{kOutsideTone, "outside, in the band"},
          {kInsideTone, "inside, in the band"},
          {kDeepTone, "inside, beyond the band"},
          {kPaper, "outside, beyond the band"}};
}

}  // namespace hermesh
