#include "algorithms/extraction/certified_octree/shell_prism.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <random>
#include <vector>

#include "algorithms/extraction/certified_octree/kernels/shell_kernels.h"
#include "algorithms/lattice/simd/simd_level.h"

namespace hermesh {
namespace shell_prism_test {

using Eigen::Vector3d;

const Vector3d kUp = Vector3d::UnitZ();
const Corners kTriangle = {Vector3d(0, 0, 0), Vector3d(4, 0, 0), Vector3d(0, 4, 0)};

ShellPrism upright(double height) { return ShellPrism(kTriangle, {kUp, kUp, kUp}, height); }
Corners raised(Corners corners, double by) {
  for (Vector3d& corner : corners) corner.z() += by;
  return corners;
}

TEST(ShellPrism, StandsWherePillarsRiseAndKeepApart) {
  EXPECT_TRUE(upright(2).stands());
  EXPECT_FALSE(ShellPrism(kTriangle, {-kUp, -kUp, -kUp}, 2).stands()) << "they point down";
  EXPECT_FALSE(ShellPrism({kTriangle[0], kTriangle[1], 0.5 * kTriangle[1]}, {kUp, kUp, kUp}, 2).stands())
      << "no area";
  // Pillars that lean towards one another by 45 degrees meet 2 above the middle of the side of length 4.
  const std::array<Vector3d, 3> leaning = {Vector3d(1, 0, 1).normalized(), Vector3d(-1, 0, 1).normalized(),
                                           kUp};
  EXPECT_TRUE(ShellPrism(kTriangle, leaning, 1).stands());
  EXPECT_FALSE(ShellPrism(kTriangle, leaning, 3).stands());
}

TEST(ShellPrism, MeetsWhatPassesThroughIt) {
  const ShellPrism prism = upright(1);
  const Corners wide = {Vector3d(-5, -5, 0), Vector3d(20, -5, 0), Vector3d(-5, 20, 0)};
  EXPECT_EQ(meet(prism, raised(wide, 0.5), 1), Meeting::good);
  EXPECT_EQ(meet(prism, raised(wide, -0.9), 1), Meeting::good);
  EXPECT_EQ(meet(prism, raised(wide, 0.5), 0.4), Meeting::bad) << "farther than its own tolerance";
  EXPECT_EQ(meet(prism, raised({wide[0], wide[2], wide[1]}, 0.5), 1), Meeting::bad) << "it faces down";
  EXPECT_EQ(meet(prism, raised(wide, 1.1), 1), Meeting::none) << "above the lid";
  EXPECT_EQ(meet(prism, {Vector3d(-1, 1, 0), Vector3d(-1, 1, 5), Vector3d(-2, 3, 0)}, 1), Meeting::none)
      << "beyond a wall";
  // Through the lid over the prism's interior, and through its plane only beyond the walls.
  EXPECT_EQ(meet(prism, {Vector3d(1, 1, 0), Vector3d(2, 1, 0), Vector3d(1, 2, 3)}, 1), Meeting::bad);
  EXPECT_EQ(meet(prism, {Vector3d(1, 1, 0), Vector3d(1, 2, 0), Vector3d(-6, 1, 5)}, 1), Meeting::good);
}

TEST(ShellPrism, IsReachedIntoByWhatIsWithinEitherPillarsWall) {
  const ShellPrism prism = upright(1);
  EXPECT_TRUE(reaches_into(prism, {Vector3d(1, 1, 0), Vector3d(1.1, 1, 0), Vector3d(1, 1.1, 0)}));
  EXPECT_TRUE(reaches_into(prism, {Vector3d(-5, 1, 0.5), Vector3d(9, 1, 0.5), Vector3d(-5, 2, 0.5)}));
  EXPECT_FALSE(reaches_into(prism, {Vector3d(-2, 1, 0), Vector3d(-1, 1, 0), Vector3d(-1, 2, 0)}));
}

/// The lid is lower than the height if pillars lean: a triangle between the two is not in the prism, and does
/// not prove that S is.
TEST(ShellPrism, IsNotMetAboveALowLid) {
  const Vector3d leaning(0.6, 0, 0.8);
  const ShellPrism prism(kTriangle, {leaning, leaning, leaning}, 0.5);  // the lid is at 0.4
  ASSERT_TRUE(prism.stands());
  EXPECT_EQ(meet(prism, raised(kTriangle, 0.45), 1), Meeting::none);
  EXPECT_EQ(meet(prism, raised(kTriangle, 0.35), 1), Meeting::good);
  EXPECT_TRUE(reaches_into(prism, raised(kTriangle, 0.35)));
  // Above the lid, and through its plane beyond the first wall.
  EXPECT_EQ(meet(prism, {Vector3d(1.2, -2, 0.3), Vector3d(1.9, 0.02, 0.46), Vector3d(1, 0.02, 0.46)}, 1),
            Meeting::none);
}

/// The planes of an upright prism over kTriangle, moved along x: its walls are at y = 0, x + y = 4 and x = 0.
shell_kernels::Planes planes(float height, float x = 0) {
  using shell_kernels::Planes;
  Planes result{};
  const float s = std::sqrt(0.5f);
  const float normals[Planes::kAll][3] = {{0, -1, 0}, {s, s, 0}, {-1, 0, 0}, {0, 0, 1}, {0, 0, -1}};
  const float offsets[Planes::kAll] = {0, (4 + x) * s, -x, height, height};
  std::copy_n(&normals[0][0], 3 * Planes::kAll, &result.normals[0][0]);
  std::copy_n(offsets, Planes::kAll, result.offsets);
  result.rounding = 1e-3f;
  return result;
}

/// A block whose first vertices are those of cells along z, and which has quads.
class KernelBlock {
 public:
  KernelBlock(std::vector<std::array<float, 3>> points, std::vector<std::array<std::uint32_t, 4>> quads)
      : quads_(std::move(quads)),
        upright_(quads_.size(), 1),
        certain_(points.size() + shell_kernels::kLargestVector) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const auto& point : points) axes_[axis].push_back(point[axis]);
    for (auto& axis : axes_) axis.resize(certain_.size());
    const auto first = [](std::size_t n) { return n < 64 ? (std::uint64_t{1} << n) - 1 : ~std::uint64_t{0}; };
    const std::size_t in_cells = std::min<std::size_t>(points.size(), 64);
    cells_.active[0] = first(in_cells);
    crossing_[1][0] = first(quads_.size());
    block_.cells = &cells_;
    block_.first_later = static_cast<std::uint32_t>(in_cells);
    block_.later_points = static_cast<std::uint32_t>(points.size() - in_cells);
    for (int axis = 0; axis < 3; ++axis) {
      block_.crossing[axis] = crossing_[axis].data();
      block_.without_quad[axis] = none_.data();
    }
  }
  void call_steep(std::size_t quad) { upright_[quad] = 0; }

  /// Scans the whole block; vertices between 0 and 4 along x are own ones.
  shell_kernels::Found look(const std::vector<shell_kernels::Planes>& prisms, unsigned facing = 0) {
    using namespace shell_kernels;
    const Surface surface{axes_[0].data(), axes_[1].data(),
                          axes_[2].data(), reinterpret_cast<const std::uint32_t(*)[4]>(quads_.data()),
                          upright_.data(), certain_.data()};
    const Window window{&block_, {0, 0, 0}, {~std::uint64_t{0}, 0, 8}, {~std::uint64_t{0}, 0, 8}, facing};
    const Box own{{0, -9, -9}, {4, 9, 9}};
    candidates_.resize(3 * 512);
    const Found found = chosen_kernels<Kernels>().look(
        {&surface, &window, 1, prisms.data(), static_cast<int>(prisms.size()), &own, 1}, candidates_.data());
    candidates_.resize(static_cast<std::size_t>(found.candidates));
    return found;
  }
  /// Returns the certain relations of a vertex and a prism, one bit for each Certain.
  unsigned certain(std::size_t point, int prism) const {
    unsigned bits = 0;
    for (int what = 0; what < shell_kernels::kAllCertain; ++what)
      bits |= (certain_[point] >> (shell_kernels::kMostPrisms * what + prism) & 1) << what;
    return bits;
  }
  const std::vector<std::uint16_t>& all_certain() const { return certain_; }
  const std::vector<shell_kernels::Candidate>& candidates() const { return candidates_; }

 private:
  std::array<std::vector<float>, 3> axes_;
  std::vector<std::array<std::uint32_t, 4>> quads_;
  std::vector<std::uint8_t> upright_;
  std::vector<std::uint16_t> certain_;
  std::vector<shell_kernels::Candidate> candidates_;
  ActiveCells cells_{};
  std::array<std::uint64_t, 8> none_{};
  std::array<std::array<std::uint64_t, 8>, 3> crossing_{};
  shell_kernels::Block block_{};
};

class ShellKernels : public testing::TestWithParam<SimdLevel> {
 protected:
  ShellKernels() { setenv("HERMESH_SIMD", std::string(name(GetParam())).c_str(), 1); }
  ~ShellKernels() override { unsetenv("HERMESH_SIMD"); }
};

TEST_P(ShellKernels, TellWhereAPointIs) {
  using namespace shell_kernels;
  constexpr unsigned between = 1u << kBetweenLids, above = 1u << kAboveLid, below = 1u << kBelowBottom;
  const std::vector<std::pair<std::array<float, 3>, unsigned>> cases = {
      {{1, 1, 0}, between},           {{1, 1, 2}, above},        {{1, 1, -2}, below},
      {{-1, 1, 0}, between | 4},      {{1, -1, 0}, between | 1}, {{5, 5, 2}, above | 2},
      {{-1, -1, 0}, between | 1 | 4}, {{1, 1, 1.0005f}, 0},      {{1, 0.0005f, 0}, between}};
  std::vector<std::array<float, 3>> points;
  for (const auto& [point, certain] : cases) points.push_back(point);
  KernelBlock block(points, {});
  block.look({planes(1)});
  for (std::size_t i = 0; i < cases.size(); ++i) EXPECT_EQ(block.certain(i, 0), cases[i].second) << i;

  // A wall whose pillars lean differently is within `spread` of its plane, so the relation is uncertain
  // there.
  Planes spread = planes(1);
  spread.spread[2] = 1.5f;
  block.look({spread});
  EXPECT_EQ(block.certain(3, 0), between);
}

TEST_P(ShellKernels, FindOwnPointsInPrismsAndBeyond) {
  const auto found_for = [](std::array<float, 3> point) {
    return KernelBlock({point}, {}).look({planes(1), planes(0.5f, -2)});
  };
  const auto expect = [&](std::array<float, 3> point, unsigned inside, unsigned beyond) {
    const shell_kernels::Found found = found_for(point);
    EXPECT_EQ(found.inside, inside) << point[0] << ' ' << point[2];
    EXPECT_EQ(found.beyond, beyond) << point[0] << ' ' << point[2];
  };
  expect({1, 0.5f, 0}, 3, 0);
  expect({1, 0.5f, 0.7f}, 1, 2);  // above the lower one
  expect({3, 0.5f, 0}, 1, 0);     // next to it
  expect({3, 0.5f, -2}, 0, 1);
  expect({-1, 0.5f, 0}, 0, 0);  // in it, but not own
}

TEST_P(ShellKernels, FindTrianglesThatMayBeInAPrism) {
  using namespace shell_kernels;
  const std::vector<std::array<float, 3>> points = {{1, 1, 0},  {2, 1, 0},  {1, 2, 0},
                                                    {-1, 1, 0}, {-1, 2, 0}, {1, 1, 2}};
  const auto look = [&](std::array<std::uint32_t, 4> quad, unsigned facing, bool upright = true) {
    KernelBlock block(points, {quad});
    if (!upright) block.call_steep(0);
    block.look({planes(1), planes(1, -10)}, facing);
    return block.candidates();
  };
  // Beyond both, each by some wall.
  EXPECT_TRUE(look({3, 4, 3, 4}, 0).empty());
  // Between the lids of the first one, where upright triangles need no test.
  const auto in_first = look({0, 1, 2, 0}, 0);
  ASSERT_EQ(in_first.size(), 1u);
  EXPECT_EQ(in_first[0].near[0], 1);
  EXPECT_EQ(in_first[0].between[0], 3);
  EXPECT_TRUE(look({0, 1, 2, 0}, 1).empty());
  EXPECT_EQ(look({0, 1, 2, 0}, 1, false).size(), 1u);
  EXPECT_EQ(look({0, 1, 2, 0}, 2).size(), 1u);
  // One triangle passes through the lid, the other does not.
  const auto through = look({0, 5, 2, 1}, 1);
  ASSERT_EQ(through.size(), 1u);
  EXPECT_EQ(through[0].near[0], 1);
  EXPECT_EQ(through[0].near[1], 0);
  EXPECT_EQ(through[0].between[0] & 1, 0);
}

TEST_P(ShellKernels, AgreeWithTheLowestLevel) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> any(-3, 6);
  std::vector<std::array<float, 3>> points(150);  // 64 in cells, and later ones
  for (auto& point : points) point = {any(random), any(random), any(random) / 3};
  std::vector<std::array<std::uint32_t, 4>> quads(64);
  for (auto& quad : quads)
    for (auto& corner : quad) corner = static_cast<std::uint32_t>(random() % points.size());
  for (std::size_t prisms = 1; prisms <= shell_kernels::kMostPrisms; ++prisms) {
    std::vector<shell_kernels::Planes> all;
    for (std::size_t p = 0; p < prisms; ++p) all.push_back(planes(0.3f + 0.2f * float(p), float(p) - 1));
    KernelBlock block(points, quads), lowest(points, quads);
    const shell_kernels::Found found = block.look(all, 1);
    setenv("HERMESH_SIMD", std::string(name(available_simd_levels().front())).c_str(), 1);
    const shell_kernels::Found expected = lowest.look(all, 1);
    setenv("HERMESH_SIMD", std::string(name(GetParam())).c_str(), 1);
    EXPECT_EQ(found.inside, expected.inside);
    EXPECT_EQ(found.beyond, expected.beyond);
    for (std::size_t i = 0; i < points.size(); ++i)
      EXPECT_EQ(block.all_certain()[i], lowest.all_certain()[i]) << i;
    ASSERT_EQ(found.candidates, expected.candidates);
    EXPECT_GT(found.candidates, 8);
    for (std::size_t i = 0; i < block.candidates().size(); ++i) {
      const auto &a = block.candidates()[i], &b = lowest.candidates()[i];
      EXPECT_EQ(a.quad, b.quad);
      for (int t = 0; t < 2; ++t) {
        EXPECT_EQ(a.near[t], b.near[t]);
        EXPECT_EQ(a.between[t], b.between[t]);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Levels, ShellKernels, testing::ValuesIn(available_simd_levels()),
                         [](const auto& level) { return std::string(name(level.param)); });

}  // namespace shell_prism_test
}  // namespace hermesh
