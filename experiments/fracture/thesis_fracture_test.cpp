// Fractures as the thesis breaks solids (§7.1), by eq. 7.1 as printed and by the repaired rule.
#include "algorithms/thesis/thesis_fracture.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <limits>

#include "algorithms/fracture/mass_properties.h"
#include "experiments/fracture/fracture_for_tests.h"

namespace hermesh {
namespace thesis_fracture_test {

using Eigen::Vector3d;

struct ThesisPieces {
  std::vector<PolygonMesh> meshes;
  double volume = 0.0;
  RunContext context;
  double figure(const std::string& name) const {
    for (const auto& [each, value] : context.figures)
      if (each == name) return value;
    return -1.0;
  }
};
using Rule = ThesisFractureOptions::Rule;

void break_by_thesis(ThesisPieces& result, const FloatHermite& object, const Cutters& cutters,
                     const ThesisFractureOptions& options) {
  thesis_fracture(
      object, cutters, options,
      [&](ThesisPiece&& piece) {
        result.volume += mass_properties(piece.mesh).volume;
        if (!piece.mesh.empty()) result.meshes.push_back(std::move(piece.mesh));
      },
      result.context);
}

TEST(FractureMethods, TheThesisLeavesGapsAndTheVolumeNearlyAddsUp) {
  const FloatHermite object = turned_box();
  const auto cutters = cutters_of("voronoi", object, 6);
  for (const Rule rule : {Rule::printed, Rule::repaired})
    for (const double threshold : {0.0, 0.1}) {
      ThesisPieces pieces;
      break_by_thesis(pieces, object, *cutters, {rule, threshold});
      const validation::FractureReport ledger = judged(pieces.meshes);
      EXPECT_FALSE(ledger.gaps_checked);
      EXPECT_FALSE(ledger.is_valid()) << text(ledger);
      EXPECT_GE(pieces.figure("escaped"), 0.0);
      if (rule == Rule::printed) {
        // Polygons that bound nothing lie along the rims, and where all samples are taken they are a piece of
        // their own.
        EXPECT_EQ(pieces.meshes.size(), 7u);
        EXPECT_GT(pieces.figure("needless_crossings"), 0.0);
        ASSERT_EQ(pieces.context.notes.size(), 1u);
        EXPECT_NE(pieces.context.notes[0].find("bound nothing"), std::string::npos);
        continue;
      }
      // Signs leave no data without a change of sign, and exact data lose none: each piece is closed, so it
      // has a volume.
      EXPECT_EQ(pieces.meshes.size(), 6u);
      EXPECT_NEAR(pieces.volume, 24.0 * 18.0 * 28.0, 0.01 * 24.0 * 18.0 * 28.0) << threshold;
      EXPECT_EQ(pieces.figure("lost_crossings") + pieces.figure("needless_crossings"), 0.0);
      EXPECT_TRUE(pieces.context.notes.empty());
    }
}

TEST(FractureMethods, TheThresholdOfTheThesisMergesCells) {
  const FloatHermite object = turned_box();
  const auto cutters = cutters_of("voronoi", object, 3);
  for (const Rule rule : {Rule::printed, Rule::repaired}) {
    std::size_t before = std::numeric_limits<std::size_t>::max();
    for (const double threshold : {0.0, 0.1, 1.0}) {
      ThesisPieces pieces;
      break_by_thesis(pieces, object, *cutters, {rule, threshold});
      std::size_t points = 0;
      for (const PolygonMesh& mesh : pieces.meshes) points += mesh.points.size();
      EXPECT_TRUE(threshold == 0.1 ? points < before : points <= before);
      before = points;
    }
  }
}

/// A box with faces across the axes.
FloatHermite straight_box() {
  const auto beyond = [](const Vector3d& p) { return Vector3d(p.cwiseAbs() - Vector3d(8.3, 6.4, 6.4)); };
  return sampled({.value = [=](const Vector3d& p) { return beyond(p).maxCoeff(); },
                  .gradient =
                      [=](const Vector3d& p) {
                        Vector3d n = Vector3d::Zero();
                        int axis;
                        beyond(p).maxCoeff(&axis);
                        n[axis] = p[axis];
                        return n;
                      }},
                 {20, 20, 20});
}

// Eq. 7.1 by hand (trap T11). The face x = 8.3 of a box and the plane x = 8.1 cross the same edges, from 8 to
// 9. Beyond the plane lie 0.2 voxel of the box and no sample. At a sample x = 8 the box has the component
// −0.3, and the half-space beyond the plane 0.1: the intersection takes the greater one, with its data,
// although both ends of the edge are outside of it.
TEST(FractureMethods, TheEquationLeavesDataBetweenSamplesOfOneSign) {
  const FloatHermite object = straight_box();
  const auto cutters = plane_cutters({{Vector3d(1, 0, 0), 8.1}}, object.placement);
  ThesisPieces printed, repaired;
  break_by_thesis(printed, object, *cutters, {Rule::printed, 0.0});
  break_by_thesis(repaired, object, *cutters, {Rule::repaired, 0.0});
  EXPECT_EQ(repaired.figure("needless_crossings"), 0.0);
  EXPECT_EQ(repaired.meshes.size(), 1u);
  // The face has 13 × 13 samples, each with an edge; every edge is a quad of the second "piece".
  EXPECT_EQ(printed.figure("needless_crossings"), 169.0);
  ASSERT_EQ(printed.meshes.size(), 2u);
  EXPECT_EQ(printed.meshes[1].quads.size(), 169u);
  // The first one is the box up to the plane, except for the rounding of offsets.
  EXPECT_NEAR(mass_properties(printed.meshes[0]).volume, repaired.volume, 0.005 * repaired.volume);
}

// A plane x = 0.3 has two sides, each a cutter. Once both are taken nothing is left but their wall: behind it
// rest's samples are outside with the component 0.7 or 0.3, and the complement of the last cutter has the
// same there.
TEST(FractureMethods, TheEquationLeavesTheWallThatTwoCuttersShare) {
  const FloatHermite object = straight_box();
  const auto cutters = plane_cutters({{Vector3d(1, 0, 0), 0.3}}, object.placement);
  ThesisPieces printed, repaired;
  break_by_thesis(printed, object, *cutters, {Rule::printed, 0.0});
  break_by_thesis(repaired, object, *cutters, {Rule::repaired, 0.0});
  EXPECT_EQ(repaired.meshes.size(), 2u);
  ASSERT_EQ(printed.meshes.size(), 3u);
  EXPECT_EQ(printed.figure("needless_crossings"), 169.0);
  EXPECT_EQ(printed.meshes[2].quads.size(), 169u);
  for (std::size_t i = 0; i < printed.meshes[2].points.size(); ++i)
    EXPECT_NEAR(printed.meshes[2].world(i).x(), 0.3, 0.01);
  for (int piece : {0, 1})
    EXPECT_NEAR(mass_properties(printed.meshes[piece]).volume, mass_properties(repaired.meshes[piece]).volume,
                5.0);
}

TEST(FractureMethods, TheThesisMakesTheSameBytesAtAnyNumberOfThreads) {
  const FloatHermite object = turned_box();
  const auto cutters = cutters_of("voronoi", object, 4);
  std::vector<PolygonMesh> first;
  for (const std::size_t threads : {1, 2, 7}) {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    ThesisPieces pieces;
    break_by_thesis(pieces, object, *cutters, {Rule::printed, 0.1});
    if (threads == 1) first = pieces.meshes;
    EXPECT_EQ(pieces.meshes, first);
  }
}

}  // namespace thesis_fracture_test
}  // namespace hermesh
