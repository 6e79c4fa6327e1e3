#include "experiments/pictures/slice.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <iterator>

#include "algorithms/core/error.h"
#include "algorithms/core/level_set_grid.h"

namespace hermesh {
namespace {

constexpr std::uint32_t kPaperPixel = 0xffffffff;

/// Samples in the plane z = 5: inside at (0, 0) to (1, 0), outside at (2, 0) and (0, 1), inactive inside at
/// (1, 1).
LevelSet few_samples() {
  initialize_openvdb();
  const openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(3.0f);
  auto values = grid->getAccessor();
  values.setValue({0, 0, 5}, -1.0f);
  values.setValue({1, 0, 5}, -2.5f);
  values.setValue({2, 0, 5}, 0.5f);
  values.setValue({0, 1, 5}, 1.5f);
  values.setValueOff({1, 1, 5}, -3.0f);
  return make_level_set(grid);
}

std::uint32_t at(const Image& image, int x, int y) {
  return image.pixels[static_cast<std::size_t>(y) * image.width + x];
}

TEST(Slice, FrameIsThatOfTheActiveSamples) {
  const SliceFrame frame = slice_frame(few_samples(), 2, 0.5, 1);
  EXPECT_EQ(frame.at, 5);
  EXPECT_EQ(frame.lower, (std::array{-1, -1}));
  EXPECT_EQ(frame.upper, (std::array{3, 2}));
  EXPECT_EQ(slice_frame(few_samples(), 0, 1.0, 0).at, 2);
  initialize_openvdb();
  EXPECT_THROW(slice_frame(make_level_set(openvdb::FloatGrid::create(1.0f)), 2, 0.5, 0), Error);
}

TEST(Slice, ColoursSayTheSideAndTheState) {
  const LevelSet level_set = few_samples();
  const SliceFrame frame = slice_frame(level_set, 2, 0.0, 0);  // samples (0, 0) to (2, 1)
  const Image image = draw_slice(level_set, frame, 30);
  ASSERT_EQ(image.width, 30);
  ASSERT_EQ(image.height, 20);
  // The second direction runs upwards, so that y = 0 is the lower half.
  const std::uint32_t inside = at(image, 5, 15), outside = at(image, 25, 15), deep = at(image, 15, 5);
  EXPECT_EQ(at(image, 15, 15), inside);
  EXPECT_EQ(at(image, 5, 5), outside);
  EXPECT_EQ(at(image, 25, 5), kPaperPixel);
  EXPECT_NE(inside, outside);
  EXPECT_NE(inside, deep);
  EXPECT_NE(deep, kPaperPixel);
  EXPECT_GT(inside >> 16 & 0xff, inside >> 8 & 0xff) << "red is inside";
  EXPECT_LT(outside >> 16 & 0xff, outside >> 8 & 0xff) << "green is outside";
  // Of the distances 1 and 2.5 the second is darker where the tone changes each two voxels.
  const Image rings = draw_slice(level_set, frame, 30, 2.0);
  EXPECT_EQ(at(rings, 5, 15), inside);
  EXPECT_LT(at(rings, 15, 15) >> 16 & 0xff, inside >> 16 & 0xff);
}

TEST(Slice, CountsItsSamples) {
  const LevelSet level_set = few_samples();
  const SliceCounts counts = count_slice(level_set, slice_frame(level_set, 2, 0.0, 2));
  EXPECT_EQ(counts.active_inside, 2u);
  EXPECT_EQ(counts.active_outside, 2u);
  EXPECT_EQ(counts.inactive_inside, 1u);
}

TEST(Slice, LargeOnesAreThinnedToTheirPixels) {
  const LevelSet level_set = few_samples();
  SliceFrame frame = slice_frame(level_set, 2, 0.0, 50);
  const Image image = draw_slice(level_set, frame, 40);
  EXPECT_EQ(image.width, 40);
  EXPECT_LE(image.height, 40);
  EXPECT_THROW(draw_slice(level_set, frame, 0), Error);
}

TEST(Panels, TheSameSheetIsTheSameFile) {
  const LevelSet level_set = few_samples();
  PanelSheet sheet;
  sheet.title = "a title that is far too long for a sheet with one picture on it, and is cut";
  sheet.subtitle = "words";
  sheet.legend = slice_legend();
  sheet.panels.push_back(
      {"one", {"a caption"}, draw_slice(level_set, slice_frame(level_set, 2, 0.0, 1), 40)});
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("hermesh-panels-" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  std::vector<std::string> files;
  for (const char* name : {"a.png", "b.png"}) {
    draw_panels(folder / name, sheet);
    std::ifstream file(folder / name, std::ios::binary);
    files.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  EXPECT_GT(files[0].size(), 1000u);
  EXPECT_EQ(files[0].substr(1, 3), "PNG");
  EXPECT_EQ(files[0], files[1]);
  EXPECT_THROW(draw_panels(folder / "no" / "such" / "folder.png", sheet), Error);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace hermesh
