#include "experiments/pictures/render.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>

#include "algorithms/io/mesh_file.h"
#include "experiments/pictures/exploded.h"
#include "experiments/pictures/ray_scene.h"

namespace hermesh {
namespace {

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

TEST(RayScene, SamePixelsAtAnyThreadCount) {
  const PolygonMesh mesh = cube();
  RunContext context;
  std::vector<std::uint32_t> one, two;
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    one = RayScene(mesh).render(make_camera(29, 20), view_of_cube(), context).pixels;
  }
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 2);
    two = RayScene(mesh).render(make_camera(29, 20), view_of_cube(), context).pixels;
  }
  EXPECT_EQ(one, two);
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

}  // namespace
}  // namespace hermesh
