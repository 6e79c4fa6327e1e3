// Pictures: rays, fog, slices, viewpoints and sheets.
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <nlohmann/json.hpp>

#include "algorithms/core/error.h"
#include "algorithms/core/level_set_grid.h"
#include "algorithms/io/mesh_file.h"
#include "experiments/pictures/exploded.h"
#include "experiments/pictures/fog.h"
#include "experiments/pictures/ray_scene.h"
#include "experiments/pictures/render.h"
#include "experiments/pictures/slice.h"

namespace hermesh {
namespace pictures_test {

/// The cube [0,2]³ away from the world's origin, of quads seen from outside.
PolygonMesh cube() {
  PolygonMesh mesh;
  mesh.origin = Eigen::Vector3d(10, 20, 30);
  for (int i = 0; i < 8; ++i)
    mesh.points.emplace_back(static_cast<float>(i & 1) * 2, static_cast<float>(i >> 1 & 1) * 2,
                             static_cast<float>(i >> 2) * 2);
  mesh.quads = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  return mesh;
}

View view_of_cube() {
  return {.centre = {11, 21, 31}, .world_width = 5, .width = 60, .height = 60, .occlusion_radius = 0.2};
}

std::uint32_t at(const Image& image, int x, int y) {
  return image.pixels[static_cast<std::size_t>(y * image.width + x)];
}
int red(std::uint32_t pixel) { return static_cast<int>(pixel >> 16 & 0xff); }
int blue(std::uint32_t pixel) { return static_cast<int>(pixel & 0xff); }

TEST(Camera, LooksFromWhereItsAnglesSay) {
  const Camera front = make_camera(0, 0), side = make_camera(90, 0);
  EXPECT_NEAR((front.towards - Eigen::Vector3d::UnitZ()).norm(), 0, 1e-12);
  EXPECT_NEAR((front.right - Eigen::Vector3d::UnitX()).norm(), 0, 1e-12);
  EXPECT_NEAR((side.towards - Eigen::Vector3d::UnitX()).norm(), 0, 1e-12);
  EXPECT_NEAR(make_camera(29, 89).right.norm(), 1, 1e-12);
}

TEST(RayScene, ShowsTheCubeWhereItIs) {
  const PolygonMesh mesh = cube();
  RunContext context;
  const RayScene scene(mesh);
  const Image image = scene.render(make_camera(0, 0), view_of_cube(), context);
  // The cube covers the middle 24 of 60 pixels; the background is brighter and bluer than clay.
  EXPECT_GT(blue(at(image, 2, 30)), red(at(image, 2, 30)));
  EXPECT_LT(blue(at(image, 30, 30)), red(at(image, 30, 30)));
  EXPECT_GT(blue(at(image, 16, 30)), red(at(image, 16, 30)));
  EXPECT_LT(blue(at(image, 20, 30)), red(at(image, 20, 30)));
}

TEST(RayScene, FacesSeenFromBehindAreRed) {
  PolygonMesh mesh = cube();
  for (Quad& quad : mesh.quads) std::swap(quad[1], quad[3]);
  RunContext context;
  const Image image = RayScene(mesh).render(make_camera(0, 0), view_of_cube(), context);
  EXPECT_GT(red(at(image, 30, 30)), 2 * blue(at(image, 30, 30)));
}

TEST(RayScene, DrawsTheEdgesOfQuadsButNotTheirDiagonal) {
  const PolygonMesh mesh = cube();
  PolygonMesh triangles = mesh;
  triangles.triangles = triangulated(mesh);
  triangles.quads.clear();
  RunContext context;
  View view = view_of_cube();
  view.edges = true;
  const Image of_quads = RayScene(mesh).render(make_camera(0, 0), view, context);
  const Image of_triangles = RayScene(triangles).render(make_camera(0, 0), view, context);
  // The front quad (4,5,7,6) is cut from its lower left to its upper right corner.
  EXPECT_LT(red(at(of_triangles, 25, 34)) + 40, red(at(of_quads, 25, 34)));
  // An edge of the quad itself, at the cube's left side, is dark in both.
  EXPECT_LT(red(at(of_quads, 18, 30)) + 40, red(at(of_quads, 25, 34)));
}

/// Expects the same pixels from one thread and from three.
void expect_same_pixels(const std::function<Image()>& render) {
  std::vector<std::vector<std::uint32_t>> pixels;
  for (const std::size_t threads : {1, 3}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    pixels.push_back(render().pixels);
  }
  EXPECT_EQ(pixels[0], pixels[1]);
}

TEST(RayScene, SamePixelsAtAnyThreadCount) {
  const PolygonMesh mesh = cube();
  RunContext context;
  expect_same_pixels([&] { return RayScene(mesh).render(make_camera(29, 20), view_of_cube(), context); });
}

TEST(RayScene, CanBeCancelled) {
  const PolygonMesh mesh = cube();
  const std::atomic<bool> stop = true;
  RunContext context;
  context.cancel = &stop;
  EXPECT_THROW(RayScene(mesh).render(make_camera(0, 0), view_of_cube(), context), Cancelled);
}

class Sheets : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("hermesh-render-" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
    sheet_.title = "a cube";
    sheet_.frame = bounds(cube());
    sheet_.cell_pixels = 60;
    sheet_.pictures = {{"cube", {"6 quads"}, cube}, {"nothing", {}, [] { return PolygonMesh{}; }}};
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string bytes(const std::string& name) const {
    std::ifstream file(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  /// A big-endian number in a PNG's header (width at 16, height at 20).
  static int number_in(const std::string& png, std::size_t offset) {
    int value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(png[offset + i]);
    return value;
  }
  std::filesystem::path folder_;
  Sheet sheet_;
  RunContext context_;
};

TEST_F(Sheets, AreWrittenAsPngAndTheSameEveryTime) {
  render_sheet(folder_ / "a.png", sheet_, context_);
  render_sheet(folder_ / "b.png", sheet_, context_);
  const std::string png = bytes("a.png");
  ASSERT_TRUE(png.starts_with("\x89PNG\r\n"));
  EXPECT_GT(number_in(png, 16), 2 * 60);
  EXPECT_GT(number_in(png, 20), 2 * 60);
  EXPECT_EQ(png, bytes("b.png"));
  sheet_.pictures[0].load = [] { return PolygonMesh{}; };
  render_sheet(folder_ / "c.png", sheet_, context_);
  EXPECT_NE(png, bytes("c.png"));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}),
            3);  // nothing unfinished is left
}

TEST_F(Sheets, ManyPicturesWrap) {
  render_sheet(folder_ / "two.png", sheet_, context_);
  while (sheet_.pictures.size() < 7) sheet_.pictures.push_back(sheet_.pictures.front());
  render_sheet(folder_ / "seven.png", sheet_, context_);
  EXPECT_LT(number_in(bytes("seven.png"), 16), 3 * number_in(bytes("two.png"), 16));
  EXPECT_GT(number_in(bytes("seven.png"), 20), number_in(bytes("two.png"), 20) * 3 / 2);
}

TEST_F(Sheets, NoEndOfACaptionIsLost) {
  render_sheet(folder_ / "short.png", sheet_, context_);
  sheet_.pictures[0].captions = {"promises closed, manifold: kept"};
  render_sheet(folder_ / "kept.png", sheet_, context_);
  sheet_.pictures[0].captions = {"promises closed, manifold: lost"};
  render_sheet(folder_ / "lost.png", sheet_, context_);
  EXPECT_GT(number_in(bytes("kept.png"), 20), number_in(bytes("short.png"), 20));
  EXPECT_NE(bytes("kept.png"), bytes("lost.png"));
}

TEST_F(Sheets, UnwritablePathIsAnErrorAndLeavesNothing) {
  EXPECT_THROW(render_sheet(folder_ / "missing" / "a.png", sheet_, context_), Error);
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

/// Two cubes that touch, in a directory as a fracture writes it.
TEST_F(Sheets, PiecesOfAFractureAreMovedApart) {
  PolygonMesh second = cube();
  second.origin.x() += 2;
  write_mesh(folder_ / "1.ply", cube(), context_);
  write_mesh(folder_ / "2.ply", second, context_);
  const auto picture = [&](const nlohmann::json& centre_of_first, const nlohmann::json& centre_of_second) {
    const nlohmann::json pieces = {{{"file", "1.ply"}, {"centre_of_mass", centre_of_first}},
                                   {{"file", "2.ply"}, {"centre_of_mass", centre_of_second}}};
    std::ofstream(folder_ / "pieces.json") << nlohmann::json{{"pieces", pieces}};
    draw_exploded(folder_, context_);
    return bytes("exploded.png");
  };
  const nlohmann::json first = {11, 21, 31}, middle = {12, 21, 31}, far = {99, 21, 31},
                       none = {nullptr, nullptr, nullptr};
  const std::string apart = picture(first, {13, 21, 31});
  EXPECT_TRUE(apart.starts_with("\x89PNG\r\n"));
  // A centre of mass in the middle of the object leaves a piece unmoved.
  EXPECT_NE(picture(middle, middle), apart);
  // Pieces that are not closed have none, or one outside of their boxes; the box's centre replaces it.
  EXPECT_EQ(picture(none, far), apart);
  EXPECT_THROW(draw_exploded(folder_ / "missing", context_), Error);
}

// ---- Slices and panels.

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
  // The second direction runs upwards, so y = 0 is the lower half.
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

TEST(Slice, LargeOnesAreThinnedToTheirPixels) {
  const LevelSet level_set = few_samples();
  SliceFrame frame = slice_frame(level_set, 2, 0.0, 50);
  const Image image = draw_slice(level_set, frame, 40);
  EXPECT_EQ(image.width, 40);
  EXPECT_LE(image.height, 40);
  EXPECT_THROW(draw_slice(level_set, frame, 0), Error);
}

TEST_F(Sheets, OfPanelsAreTheSameEveryTime) {
  const LevelSet level_set = few_samples();
  PanelSheet sheet;
  sheet.title = "a title that is far too long for a sheet with one picture on it, and is cut";
  sheet.subtitle = "words";
  sheet.legend = slice_legend();
  sheet.panels.push_back(
      {"one", {"a caption"}, draw_slice(level_set, slice_frame(level_set, 2, 0.0, 1), 40)});
  for (const char* name : {"a.png", "b.png"}) draw_panels(folder_ / name, sheet);
  EXPECT_GT(bytes("a.png").size(), 1000u);
  EXPECT_TRUE(bytes("a.png").starts_with("\x89PNG\r\n"));
  EXPECT_EQ(bytes("a.png"), bytes("b.png"));
  EXPECT_THROW(draw_panels(folder_ / "no" / "such" / "folder.png", sheet), Error);
}

// ---- Fog.

/// Density 1 at the samples 0 to 19 along each axis, 0.1 world units apart: trilinear interpolation spreads
/// it over 20 voxels.
LevelSet block_of_fog() {
  initialize_openvdb();
  const openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(0.0f);
  grid->fill(openvdb::CoordBBox({0, 0, 0}, {19, 19, 19}), 1.0f);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.1));
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  return make_level_set(grid);
}

TEST(FogScene, TransmittanceIsThatOfTheLengthInTheFog) {
  RunContext context;
  const FogScene scene(block_of_fog(), context);
  // A line across has 19 voxels of full density and two ramps of half a voxel's worth each: 2 world units.
  for (const double extinction : {0.1, 1.0, 3.0})
    EXPECT_NEAR(scene.transmittance({0.95, 0.95, 0.95}, Eigen::Vector3d::UnitX(), extinction),
                std::exp(-2.0 * extinction), 1e-3);
  // Along a diagonal both ramps at an end are climbed at once, and t² over 0 to 1 is a third: 19 + 2/3
  // voxels.
  EXPECT_NEAR(-std::log(scene.transmittance({0.95, 0.95, 0.95}, {1, 1, 0}, 1.0)),
              0.1 * std::sqrt(2.0) * (19.0 + 2.0 / 3.0), 5e-3);
  EXPECT_DOUBLE_EQ(scene.transmittance({0.95, 5.0, 0.95}, Eigen::Vector3d::UnitX(), 1.0), 1.0);
  EXPECT_DOUBLE_EQ(scene.transmittance({0.95, 0.95, 0.95}, Eigen::Vector3d::UnitX(), 0.0), 1.0);
}

TEST(FogScene, ShowsFogWhereItIsAndShadesItFromTheLight) {
  RunContext context;
  const FogScene scene(block_of_fog(), context);
  const View view{.centre = {0.95, 0.95, 0.95}, .world_width = 4, .width = 40, .height = 40};
  const FogLook look{.extinction = 5.0, .towards_light = {1, 0, 0}};
  const Image image = scene.render(make_camera(0, 0), view, look, context);
  const auto blue_over_red = [&](int x, int y) { return blue(at(image, x, y)) - red(at(image, x, y)); };
  // The block covers the middle 20 of 40 pixels; fog is white, the sky is blue.
  EXPECT_GT(blue_over_red(3, 20), 40);
  EXPECT_LT(blue_over_red(27, 20), 20);
  // The light comes from +x, to the right.
  EXPECT_GT(red(at(image, 27, 20)), red(at(image, 13, 20)) + 20);
}

TEST(FogScene, TheSamePixelsAtAnyNumberOfThreads) {
  RunContext context;
  const View view{.centre = {0.95, 0.95, 0.95}, .world_width = 4, .width = 30, .height = 30};
  expect_same_pixels([&] {
    return FogScene(block_of_fog(), context).render(make_camera(30, 20), view, FogLook(), context);
  });
}

TEST(FogScene, RefusesEmptiness) {
  initialize_openvdb();
  RunContext context;
  EXPECT_THROW(FogScene(make_level_set(openvdb::FloatGrid::create(0.0f)), context), Error);
}

// ---- Viewpoints.

/// A wall in the plane x = 0 that faces +x, with ridges along y on its upper half, and behind it nothing.
PolygonMesh wall() {
  PolygonMesh mesh;
  mesh.origin = Eigen::Vector3d(5, 0, 0);
  constexpr int kSteps = 40;
  for (int j = 0; j <= kSteps; ++j)
    for (int i = 0; i <= kSteps; ++i)
      mesh.points.emplace_back(j > kSteps / 2 && i % 2 == 1 ? 0.1f : 0.0f, 0.1f * float(j), -0.1f * float(i));
  const auto at = [](int i, int j) { return std::uint32_t(j * (kSteps + 1) + i); };
  for (int j = 0; j < kSteps; ++j)
    for (int i = 0; i < kSteps; ++i)
      mesh.quads.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
  return mesh;
}

TEST(Viewpoint, LooksAtTheSideWithTheMostSurface) {
  PolygonMesh mesh;
  const auto board = [&](std::array<Eigen::Vector3f, 4> corners) {
    const auto first = static_cast<std::uint32_t>(mesh.points.size());
    mesh.points.insert(mesh.points.end(), corners.begin(), corners.end());
    mesh.quads.push_back({first, first + 1, first + 2, first + 3});
  };
  using V = Eigen::Vector3f;
  // Nine low boards in planes of x, which are edges if seen along z.
  for (int i = 0; i < 9; ++i) {
    const float x = 0.5f * float(i);
    board({V(x, 0, 0), V(x, 0, 0.2f), V(x, 1, 0.2f), V(x, 1, 0)});
  }
  // A tall board before them all, at z = 0.4, hides them from +z.
  board({V(-1, 0, 0.4f), V(5, 0, 0.4f), V(5, 4, 0.4f), V(-1, 4, 0.4f)});
  RunContext context;
  const Viewpoint viewpoint = open_viewpoint(mesh, context);
  const Camera camera = make_camera(viewpoint.azimuth, viewpoint.elevation);
  // From behind, where boards and the tall board are both seen.
  EXPECT_LT(camera.towards.z(), 0.0) << viewpoint.azimuth;
}

TEST(Viewpoint, OfAnEmptyMeshIsTheDefault) {
  RunContext context;
  EXPECT_EQ(open_viewpoint({}, context).azimuth, Viewpoint{}.azimuth);
}

TEST(CloseUp, IsWhereTheSurfaceTurns) {
  const PolygonMesh mesh = wall();
  RunContext context;
  const CloseUp close_up = busy_close_up(mesh, bounds(mesh), {.azimuth = 80, .elevation = 10}, 0.2, context);
  EXPECT_GT(close_up.centre[1], 0.5);
  EXPECT_LE(close_up.centre[1], 1.0);
  EXPECT_EQ(close_up.size, 0.2);
}

TEST(CloseUp, ShowsAFaceInTheShadowOfAnotherBrightly) {
  // Beneath a roof, where the key light from above does not come, a wall of fine polygons, drawn with edges.
  PolygonMesh mesh = wall();
  const auto first = static_cast<std::uint32_t>(mesh.points.size());
  for (const auto& [x, z] :
       {std::pair(-1.0f, 1.0f), std::pair(3.0f, 1.0f), std::pair(3.0f, -5.0f), std::pair(-1.0f, -5.0f)})
    mesh.points.emplace_back(x, 4.2f, z);
  mesh.quads.push_back({first, first + 1, first + 2, first + 3});
  RunContext context;
  const View view{.centre = {5, 1, -2},
                  .world_width = 3,
                  .width = 200,
                  .height = 80,
                  .edges = true,
                  .occlusion_radius = 0.5};
  const Image image = RayScene(mesh).render(make_camera(90, 0), view, context);
  double sum = 0.0;
  for (const std::uint32_t pixel : image.pixels)
    sum += (pixel >> 16 & 0xff) + (pixel >> 8 & 0xff) + (pixel & 0xff);
  EXPECT_GT(sum / (3.0 * double(image.pixels.size())), 110.0);
}

}  // namespace pictures_test
}  // namespace hermesh
