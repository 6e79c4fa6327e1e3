#include "validation/fracture_report.h"

#include <gtest/gtest.h>

namespace hermesh::validation {
namespace fracture_report_test {

using Eigen::Vector3d;

/// A cuboid of twelve triangles, each side tagged; the sides at x = lower and x = upper come first.
MeshFile cuboid(const Vector3d& lower, const Vector3d& upper, bool cut_below, bool cut_above) {
  MeshFile mesh;
  for (int c = 0; c < 8; ++c)
    mesh.points.emplace_back(c & 1 ? upper.x() : lower.x(), c & 2 ? upper.y() : lower.y(),
                             c & 4 ? upper.z() : lower.z());
  // The sides across x are split along the same diagonal, so that two cuboids fit.
  mesh.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 7, 5}, {1, 3, 7}};
  for (const Quad& q : {Quad{0, 1, 5, 4}, Quad{2, 6, 7, 3}, Quad{0, 2, 3, 1}, Quad{4, 5, 7, 6}}) {
    mesh.triangles.push_back({q[0], q[1], q[2]});
    mesh.triangles.push_back({q[0], q[2], q[3]});
  }
  std::vector<std::int32_t> surface(12, 0);
  surface[0] = surface[1] = cut_below;
  surface[2] = surface[3] = cut_above;
  mesh.attributes.push_back({"surface", AttributeDomain::polygon, 1, surface, {}});
  return mesh;
}

/// A bar in three pieces.
std::vector<MeshFile> bar() {
  return {cuboid({0, 0, 0}, {1, 1, 1}, false, true), cuboid({1, 0, 0}, {3, 1, 1}, true, true),
          cuboid({3, 0, 0}, {4, 1, 1}, true, false)};
}

FractureReport checked(const std::vector<MeshFile>& pieces, const ExpectedVolumes& expected = {}) {
  RunContext context;
  return check_fracture(pieces, context, expected);
}

void remove_tags(std::vector<MeshFile>& pieces) {
  for (MeshFile& piece : pieces) piece.attributes.clear();
}

std::string first_sentence(const FractureReport& report) { return report.sentences().front(); }

TEST(FractureReport, ABarInThreePiecesIsValid) {
  const FractureReport report = checked(bar());
  EXPECT_TRUE(report.is_valid()) << report.sentences().front();
  EXPECT_EQ(report.pieces, 3);
  EXPECT_EQ(report.triangles, 36);
  EXPECT_EQ(report.seam_triangles, 8);
  EXPECT_EQ(report.rest_triangles, 28);
  EXPECT_DOUBLE_EQ(report.rest_volume, 4.0);
  EXPECT_DOUBLE_EQ(report.pieces_volume, 4.0);
}

TEST(FractureReport, NoPiecesAreInvalid) {
  EXPECT_FALSE(checked({}).is_valid());
  EXPECT_EQ(first_sentence(checked({})), "There are no pieces.");
}

TEST(FractureReport, PiecesWithoutTagsAreInvalid) {
  std::vector<MeshFile> pieces = bar();
  remove_tags(pieces);
  for (const double gap : {0.0, 0.5}) {
    for (Vector3d& p : pieces[2].points) p.x() += gap;
    const FractureReport report = checked(pieces);
    EXPECT_EQ(report.unmatched_cut, 0) << gap;
    EXPECT_FALSE(report.is_valid()) << gap;
    EXPECT_FALSE(report.gaps_checked) << gap;
  }
  pieces = bar();
  pieces[1].attributes.clear();
  EXPECT_FALSE(checked(pieces).is_valid());
}

TEST(FractureReport, GapsBetweenPiecesWithoutCutsAreInvalid) {
  for (const double gap : {1e-7, 0.5}) {
    const std::vector<MeshFile> pieces = {cuboid({0, 0, 0}, {1, 1, 1}, false, false),
                                          cuboid({1 + gap, 0, 0}, {3, 1, 1}, false, false)};
    const FractureReport report = checked(pieces);
    EXPECT_FALSE(report.is_valid()) << gap;
    EXPECT_FALSE(report.gaps_checked) << gap;
  }
}

TEST(FractureReport, AcceptsPiecesThatTouchInAnEdgeIfTheyFollowTheWhole) {
  const std::vector<MeshFile> pieces = {cuboid({0, 0, 0}, {1, 1, 1}, false, false),
                                        cuboid({1, 1, 0}, {2, 2, 1}, false, false)};
  MeshFile whole = pieces[0];
  for (const Triangle& t : pieces[1].triangles) whole.triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
  whole.points.insert(whole.points.end(), pieces[1].points.begin(), pieces[1].points.end());
  // The volume of the whole differs from that of the pieces, so a gap cannot be excluded by volume.
  EXPECT_FALSE(checked(pieces, {.whole = 2.1, .pieces = {}}).is_consistent());
  const FractureReport report =
      checked(pieces, {.whole = 2.1, .pieces = {}, .surface = &whole, .reach = 0.1});
  EXPECT_TRUE(report.is_consistent()) << first_sentence(report);
  // The walls of a gap are inside the whole.
  const MeshFile bar = cuboid({0, 0, 0}, {3, 1, 1}, false, false);
  const std::vector<MeshFile> parted = {cuboid({0, 0, 0}, {1, 1, 1}, false, false),
                                        cuboid({1.01, 0, 0}, {3, 1, 1}, false, false)};
  EXPECT_FALSE(checked(parted, {.whole = 3.0, .pieces = {}, .surface = &bar, .reach = 0.1}).is_consistent());
}

TEST(FractureReport, NeedsNoTagsIfNoGapIsPossible) {
  std::vector<MeshFile> one = {cuboid({0, 0, 0}, {1, 1, 1}, false, false)};
  remove_tags(one);
  EXPECT_TRUE(checked(one).is_valid()) << first_sentence(checked(one));
  std::vector<MeshFile> apart = {cuboid({0, 0, 0}, {1, 1, 1}, false, false),
                                 cuboid({4, 0, 0}, {5, 1, 1}, false, false)};
  EXPECT_TRUE(checked(apart).is_valid()) << first_sentence(checked(apart));
  remove_tags(apart);
  EXPECT_TRUE(checked(apart).is_valid()) << first_sentence(checked(apart));
}

TEST(FractureReport, DetectsALostPiece) {
  std::vector<MeshFile> pieces = {cuboid({0, 0, 0}, {1, 1, 1}, false, true),
                                  cuboid({1, 0, 0}, {3, 1, 1}, true, false)};
  FractureReport report = checked(pieces, {.whole = 3.03, .pieces = {1.0, 2.0}});
  EXPECT_TRUE(report.is_valid()) << first_sentence(report);
  ASSERT_TRUE(report.expected_difference.has_value());
  EXPECT_NEAR(*report.expected_difference, 3.0 / 3.03 - 1.0, 1e-12);
  report = checked(pieces, {.whole = 4.0, .pieces = {}});
  EXPECT_FALSE(report.is_valid());
  EXPECT_NE(first_sentence(report).find("differs from the uncut object's volume"), std::string::npos);
  EXPECT_FALSE(checked(pieces).expected_difference.has_value());
}

TEST(FractureReport, DetectsAVolumeThatDiffersFromItsRecord) {
  EXPECT_EQ(checked(bar(), {.whole = {}, .pieces = {1.0, 2.0, 1.0 + 1e-7}}).wrong_records, 0);
  const FractureReport wrong = checked(bar(), {.whole = {}, .pieces = {1.0, 2.0, 1.001}});
  EXPECT_EQ(wrong.wrong_records, 1);
  EXPECT_FALSE(wrong.is_valid());
  EXPECT_EQ(checked(bar(), {.whole = {}, .pieces = {1.0, 2.0}}).wrong_records, 1);
}

TEST(FractureReport, DetectsAShiftedPiece) {
  std::vector<MeshFile> pieces = bar();
  for (Vector3d& p : pieces[2].points) p.x() -= 1e-7;
  const FractureReport report = checked(pieces);
  EXPECT_EQ(report.unmatched_cut, 4);
  EXPECT_GT(report.rest_open_edges, 0);
  EXPECT_GT(report.intersecting_pairs, 0);
  EXPECT_EQ(report.broken_pieces, 0);
  EXPECT_FALSE(report.is_valid());
}

TEST(FractureReport, DetectsADistantPiece) {
  std::vector<MeshFile> pieces = bar();
  for (Vector3d& p : pieces[2].points) p.x() += 0.5;
  const FractureReport report = checked(pieces);
  EXPECT_EQ(report.unmatched_cut, 4);
  EXPECT_EQ(report.intersecting_pairs, 0);
  EXPECT_FALSE(report.is_valid());
}

TEST(FractureReport, DetectsAMissingTriangle) {
  std::vector<MeshFile> pieces = bar();
  pieces[1].triangles.erase(pieces[1].triangles.begin());
  auto& surface = std::get<1>(pieces[1].attributes[0].values);
  surface.erase(surface.begin());
  const FractureReport report = checked(pieces);
  EXPECT_EQ(report.broken_pieces, 1);
  EXPECT_EQ(report.unmatched_cut, 1);
  EXPECT_FALSE(report.is_valid());
}

TEST(FractureReport, DetectsAWrongTag) {
  std::vector<MeshFile> pieces = bar();
  std::get<1>(pieces[0].attributes[0].values)[2] = 0;
  EXPECT_EQ(checked(pieces).matched_original, 1);
  pieces = bar();
  std::get<1>(pieces[0].attributes[0].values)[5] = 1;
  EXPECT_EQ(checked(pieces).unmatched_cut, 1);
}

TEST(FractureReport, DetectsTheOtherDiagonal) {
  std::vector<MeshFile> pieces = bar();
  pieces[1].triangles[0] = {0, 4, 2};
  pieces[1].triangles[1] = {4, 6, 2};
  const FractureReport report = checked(pieces);
  EXPECT_EQ(report.unmatched_cut, 4);
  EXPECT_GT(report.intersecting_pairs, 0);  // they lie in one plane, over one another
}

TEST(FractureReport, DetectsOverlapAndNesting) {
  std::vector<MeshFile> pieces = bar();
  pieces.push_back(cuboid({1.5, 0.25, 0.25}, {2.5, 0.75, 0.75}, false, false));
  FractureReport report = checked(pieces);
  EXPECT_EQ(report.nested_components, 1);
  EXPECT_EQ(report.intersecting_pairs, 0);
  EXPECT_FALSE(report.is_valid());
  pieces.back() = cuboid({1.5, 0.25, 0.25}, {2.5, 1.75, 0.75}, false, false);
  report = checked(pieces);
  EXPECT_GT(report.intersecting_pairs, 0);
}

TEST(FractureReport, DetectsAPieceTwice) {
  std::vector<MeshFile> pieces = bar();
  pieces.push_back(pieces[1]);
  const FractureReport report = checked(pieces);
  EXPECT_GT(report.repeated_triangles, 0);
  EXPECT_FALSE(report.is_valid());
}

}  // namespace fracture_report_test
}  // namespace hermesh::validation
