#include "algorithms/fracture/label_repair.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>

#include "algorithms/fracture/label_components.h"
#include "algorithms/fracture/labelled_mesh.h"
#include "algorithms/fracture/noise.h"
#include "algorithms/hermite/test_lattice.h"

namespace hermesh {
namespace label_repair_test {

/// Any function of the sample as code, without surfaces.
class CodeFunction : public Cutters {
 public:
  explicit CodeFunction(std::function<CutCode(int, int, int)> code) : code_(std::move(code)) {}
  void codes(const At& lower, std::span<CutCode, 512> codes) const override {
    for (int i = 0; i < 512; ++i)
      codes[static_cast<std::size_t>(i)] =
          code_(lower[0] + (i >> 6), lower[1] + ((i >> 3) & 7), lower[2] + (i & 7));
  }
  std::optional<CutCrossing> crossing(const At&, int, CutCode, CutCode) const override {
    return std::nullopt;
  }
  std::size_t count() const override { return 0; }
  std::string name(std::size_t) const override { return ""; }
  std::string name_of(CutCode) const override { return ""; }
  std::optional<Eigen::Vector3d> plane_between(CutCode, CutCode) const override { return std::nullopt; }

 private:
  std::function<CutCode(int, int, int)> code_;
};

LabelledSolid labelled(const Solid& solid, std::function<CutCode(int, int, int)> code) {
  RunContext context;
  LabelledSolid result = whole_solid(to_sparse(sample_solid(solid)), context);
  label_by_codes(result, CodeFunction(std::move(code)), context);
  return result;
}

template <class F>
void for_each_cell(const LabelledSolid& solid, F&& f) {
  for (std::int32_t b = 0; b < static_cast<std::int32_t>(solid.blocks.size()); ++b)
    for (int cell = 0; cell < 512; ++cell) f(LabelledSolid::Place{b, cell});
}

bool all_simple(const LabelledSolid& solid) {
  bool all = true;
  for_each_cell(solid, [&](const LabelledSolid::Place& cell) { all = all && is_simple(solid, cell); });
  return all;
}

TEST(LabelRepair, EndsOnNoiseAndTouchesNoOutside) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 12; ++trial) {
    const CutCode kinds = 2 + static_cast<CutCode>(trial / 2);
    LabelledSolid solid = labelled(random_blobs(random), [&](int x, int y, int z) {
      return hashed(static_cast<std::uint64_t>(x * 1000003 + y * 1009 + z)) % kinds;
    });
    const HermiteView::Blocks before = solid.blocks;
    RunContext context;
    const RepairReport report = repair_labels(solid, context, trial % 2 == 1);
    EXPECT_GT(report.changed_samples, 0u);
    ASSERT_TRUE(all_simple(solid));
    for (std::int32_t b = 0; b < static_cast<std::int32_t>(before.size()); ++b)
      for (int i = 0; i < 512; ++i)
        ASSERT_EQ(solid.labels(b, i) > 0, test(before[static_cast<std::size_t>(b)].inside, i));
    // Simple cells remain simple when pieces are renumbered.
    settle_components(solid, {.split = false, .least_samples = 0}, context);
    ASSERT_TRUE(all_simple(solid));
  }
}

TEST(LabelRepair, LeavesAPlaneWallAlone) {
  LabelledSolid solid =
      labelled(box(10, 10, 10, 8.5, 8.5, 8.5), [](int x, int y, int) { return x + y > 20 ? 1u : 0u; });
  RunContext context;
  EXPECT_EQ(repair_labels(solid, context).changed_samples, 0u);
}

/// A ball and a wall nearly tangent to it: next to the boundary of the cut, cells have two sheets, one of the
/// ball and one of the wall.
LabelledSolid ball_with_a_slanting_wall(double height) {
  return labelled(ball(12, 12, 12, 10.3), [=](int x, int y, int z) {
    return 0.21 * (x - 12) + 0.13 * (y - 12) + (z - 12) > height ? 1u : 0u;
  });
}

TEST(LabelRepair, LeavesAWallAloneThatMeetsTheSurfaceAtASmallAngle) {
  for (const double height : {8.5, 6.6}) {
    LabelledSolid solid = ball_with_a_slanting_wall(height);
    RunContext context;
    EXPECT_EQ(repair_labels(solid, context).changed_samples, 0u) << height;
  }
}

TEST(LabelRepair, PartsTheTwoLinesOfAFacePinchedInBothCells) {
  // At this height the rim turns back on itself within two cells: 2 would touch itself where they meet.
  LabelledSolid solid = ball_with_a_slanting_wall(7.9);
  EXPECT_FALSE(all_simple(solid));
  RunContext context;
  const RepairReport report = repair_labels(solid, context);
  EXPECT_EQ(report.cells, 2u);
  EXPECT_LE(report.changed_samples, 3u);
  EXPECT_TRUE(all_simple(solid));
}

TEST(LabelRepair, LeavesOneSheetWhereThatIsAsked) {
  LabelledSolid solid = ball_with_a_slanting_wall(8.5);
  const auto cells_of_several = [&] {
    std::vector<LabelledSolid::Place> cells;
    for_each_cell(solid, [&](const LabelledSolid::Place& cell) {
      const CornerLabels labels = corner_labels(solid, cell);
      if (has_cut(labels) && joint_sheets(labels).sheets.sheets > 1) cells.push_back(cell);
    });
    return cells;
  };
  RunContext context;
  const std::vector<LabelledSolid::Place> several = cells_of_several();
  ASSERT_FALSE(several.empty());
  for (const LabelledSolid::Place& cell : several) solid.one_sheet.insert(LabelledSolid::key(cell));
  EXPECT_GT(repair_labels(solid, context).changed_samples, 0u);
  EXPECT_TRUE(all_simple(solid));
  for (const LabelledSolid::Place& cell : cells_of_several())
    EXPECT_FALSE(solid.one_sheet.contains(LabelledSolid::key(cell)));
}

/// Succeeds if every edge is used once in each direction and the triangles around every vertex form one fan.
testing::AssertionResult is_closed_manifold(const std::vector<Triangle>& triangles) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t>
      next;  // by directed edge, the third corner
  std::map<std::uint32_t, std::size_t> at_point;
  for (const Triangle& t : triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      if (!next.emplace(std::pair(t[i], t[(i + 1) % 3]), t[(i + 2) % 3]).second)
        return testing::AssertionFailure() << "an edge is passed twice the same way";
      ++at_point[t[i]];
    }
  for (const auto& [edge, ignored] : next)
    if (!next.contains({edge.second, edge.first})) return testing::AssertionFailure() << "an edge is open";
  for (const auto& [edge, ignored] : next) {
    std::size_t around = 0;
    std::uint32_t at = edge.second;
    do ++around, at = next.at({edge.first, at});
    while (at != edge.second);
    if (around != at_point.at(edge.first)) return testing::AssertionFailure() << "a point has two fans";
  }
  return testing::AssertionSuccess();
}

/// V − E + F of closed triangles: 2 for a ball.
int euler_characteristic(const std::vector<Triangle>& triangles) {
  std::set<std::uint32_t> points;
  for (const Triangle& t : triangles) points.insert(t.begin(), t.end());
  return static_cast<int>(points.size()) - static_cast<int>(triangles.size() / 2);
}

/// The triangles of each piece, oriented outwards, of a fracture whose labels are not repaired.
std::vector<std::vector<Triangle>> pieces_of(const Solid& object, std::function<CutCode(int, int, int)> code,
                                             const ComponentOptions& options) {
  RunContext context;
  const FloatHermite hermite = to_sparse(sample_solid(object));
  const CodeFunction cutters(std::move(code));
  LabelledSolid solid = whole_solid(hermite, context);
  find_joined_faces(solid, hermite, cutters, context);
  label_by_codes(solid, cutters, context);
  settle_components(solid, options, context);
  EXPECT_TRUE(all_simple(solid));
  const LabelledGrid grid(solid, hermite, cutters, context);
  EXPECT_EQ(grid.made_up(), 0u);  // nothing is cut
  const JointMesh mesh = joint_mesh(grid, {}, context);
  EXPECT_TRUE(mesh.meeting_joints.empty());
  const PieceTriangles sides(mesh, solid.piece_count());
  std::vector<std::vector<Triangle>> result(solid.piece_count());
  for (std::uint32_t piece = 1; piece <= solid.piece_count(); ++piece)
    for (const PieceTriangles::Side& side : sides.of(piece)) {
      Triangle t = mesh.triangles[side.triangle];
      if (side.reversed) std::swap(t[1], t[2]);
      result[piece - 1].push_back(t);
    }
  return result;
}

void expect_balls(const std::vector<std::vector<Triangle>>& pieces, std::size_t count) {
  ASSERT_EQ(pieces.size(), count);
  for (const std::vector<Triangle>& piece : pieces) {
    EXPECT_TRUE(is_closed_manifold(piece));
    EXPECT_EQ(euler_characteristic(piece), 2);
  }
}

/// The positions nearer than `radius` to the rectangle with a corner and two sides, which are at right
/// angles.
Solid plate(const Eigen::Vector3d& corner, const Eigen::Vector3d& side, const Eigen::Vector3d& other,
            double radius) {
  return [=](double x, double y, double z) {
    Eigen::Vector3d left = Eigen::Vector3d(x, y, z) - corner;
    const Eigen::Vector3d from_corner = left;
    for (const Eigen::Vector3d& s : {side, other})
      left -= std::clamp(from_corner.dot(s) / s.squaredNorm(), 0.0, 1.0) * s;
    return left.norm() - radius;
  };
}

TEST(JointMesh, PartsTwoPiecesThatHangTogetherAcrossFacesOnly) {
  // The whole solid is four samples that form a thin plate: two opposite lattice edges of one cell. The
  // normals join them across the cell's two faces at the ends of the edges, so the cell has two sheets, each
  // of which passes along both edges; and no cell has a cut, even if the two edges belong to two pieces. (A
  // single ambiguous face is not joined: it would be pinched in both of its cells.)
  for (int axis = 0; axis < 3; ++axis)
    for (const int turn : {1, -1}) {
      SCOPED_TRACE(std::to_string(axis) + " " + std::to_string(turn));
      const Eigen::Vector3d first(7, 7, 7);
      Eigen::Vector3d across = Eigen::Vector3d::Zero();
      across[(axis + 1) % 3] = 1, across[(axis + 2) % 3] = turn;
      const Solid object = plate(first, across, Eigen::Vector3d::Unit(axis), 0.55);
      const auto one = [](int, int, int) -> CutCode { return 0; };
      const auto two = [&](int x, int y, int z) -> CutCode {
        return Eigen::Vector3d(x, y, z)[(axis + 1) % 3] == 7 ? 0 : 1;
      };
      for (const bool split : {false, true}) {
        expect_balls(pieces_of(object, one, {split, 0}), 1);
        expect_balls(pieces_of(object, two, {split, 0}), 2);
        expect_balls(pieces_of(object, two, {split, 3}),
                     1);  // slivers of two samples: either joins the other
      }
    }
}

TEST(JointMesh, PartsAThinPlateAslantBetweenTwoOfItsRows) {
  // The samples of x = y from 3 to 12 with z from 3 to 12: rows along z, which are neighbours across faces
  // only.
  const Solid object = [](double x, double y, double z) {
    return std::max({std::abs(x - y) / std::sqrt(2.0) - 0.45, std::abs(x + y - 15) / std::sqrt(2.0) - 6.9,
                     std::abs(z - 7.5) - 4.9});
  };
  for (const bool split : {false, true}) {
    expect_balls(pieces_of(object, [](int, int, int) { return 0u; }, {split, 27}), 1);
    expect_balls(pieces_of(object, [](int x, int, int) { return x > 9 ? 1u : 0u; }, {split, 27}), 2);
    expect_balls(pieces_of(object, [](int x, int, int) { return x == 12 ? 1u : 0u; }, {split, 27}), 1);
  }
  // The outer rows are of one code, and have the others between them.
  const auto outer = [](int x, int, int) { return x < 6 || x > 9 ? 1u : 0u; };
  expect_balls(pieces_of(object, outer, {true, 27}), 3);
}

TEST(LabelComponents, SplitWhatHangsTogetherNowhere) {
  const Solid two = joined({ball(4, 10, 10, 3.2), ball(16, 10, 10, 3.2)});
  for (const bool split : {true, false}) {
    LabelledSolid solid = labelled(two, [](int, int, int) { return 7u; });
    RunContext context;
    const ComponentReport report = settle_components(solid, {split, 0}, context);
    EXPECT_EQ(solid.piece_count(), split ? 2u : 1u);
    EXPECT_EQ(report.split_off, split ? 1u : 0u);
    EXPECT_EQ(solid.code_of[1], 1u);
  }
}

TEST(LabelComponents, SliversJoinTheNeighbourThatTheyShareMostWith) {
  // In the box 2 … 18 the layer x = 2 is a sliver between the outside and the samples behind it; half of it
  // is 16 × 16 samples.
  LabelledSolid solid = labelled(box(10, 10, 10, 8.5, 8.5, 8.5), [](int x, int y, int) -> CutCode {
    if (x == 2 && y < 5) return 9;  // 3 × 17 samples next to code 1, 17 next to code 2
    return x == 2 ? 2 : 1;
  });
  RunContext context;
  const ComponentReport report = settle_components(solid, {true, 100}, context);
  ASSERT_EQ(report.merged.size(), 1u);
  EXPECT_EQ(report.merged[0].samples, 51u);
  EXPECT_EQ(solid.code_values[report.merged[0].code - 1], 9u);
  EXPECT_EQ(solid.code_values[report.merged[0].into_code - 1], 1u);
  EXPECT_EQ(solid.piece_count(), 2u);
  EXPECT_EQ(report.small_kept, 0u);
}

TEST(LabelComponents, ASmallPieceWithoutNeighbourIsKept) {
  LabelledSolid solid = labelled(ball(10, 10, 10, 1.5), [](int, int, int) { return 0u; });
  RunContext context;
  const ComponentReport report = settle_components(solid, {true, 1000}, context);
  EXPECT_EQ(report.small_kept, 1u);
  EXPECT_EQ(solid.piece_count(), 1u);
}

}  // namespace label_repair_test
}  // namespace hermesh
