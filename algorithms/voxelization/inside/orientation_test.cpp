#include "algorithms/voxelization/inside/orientation.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

namespace hermesh {
namespace orientation_test {

using Verdict = Orientation::Verdict;

struct Soup {
  std::vector<Eigen::Vector3f> points;
  std::vector<Triangle> triangles;

  Orientation orient() const { return orient_faces(points, triangles); }
  void add(const Soup& other) {
    const auto shift = static_cast<std::uint32_t>(points.size());
    points.insert(points.end(), other.points.begin(), other.points.end());
    for (const Triangle& t : other.triangles) triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
  }
  void flip(std::size_t face) { std::swap(triangles[face][1], triangles[face][2]); }
  void flip_all() {
    for (std::size_t i = 0; i < triangles.size(); ++i) flip(i);
  }
};

Soup cube(float half, const Eigen::Vector3f& centre = Eigen::Vector3f::Zero()) {
  Soup box;
  for (int i = 0; i < 8; ++i)
    box.points.push_back(centre + half * Eigen::Vector3f(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
  box.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                   {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return box;
}

/// The mesh with points of its own for every triangle.
Soup unwelded(const Soup& soup) {
  Soup result;
  for (const Triangle& t : soup.triangles) {
    const auto first = static_cast<std::uint32_t>(result.points.size());
    for (const std::uint32_t p : t) result.points.push_back(soup.points[p]);
    result.triangles.push_back({first, first + 1, first + 2});
  }
  return result;
}

/// A strip of quads around a circle that turns by that many half turns.
Soup strip(int half_turns, int quads = 20) {
  Soup soup;
  for (int i = 0; i < quads; ++i) {
    const double around = 2 * std::numbers::pi * i / quads, turn = half_turns * around / 2;
    for (const double side : {-1.0, 1.0}) {
      const double r = 5 + side * std::cos(turn);
      soup.points.push_back(
          Eigen::Vector3d(r * std::cos(around), r * std::sin(around), side * std::sin(turn)).cast<float>());
    }
  }
  const bool crossed = half_turns % 2 != 0;
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(quads); ++i) {
    const bool last = i + 1 == static_cast<std::uint32_t>(quads);
    const std::uint32_t next = last ? 0 : 2 * i + 2, swap = last && crossed ? 1 : 0;
    soup.triangles.push_back({2 * i, 2 * i + 1, next + (1 ^ swap)});
    soup.triangles.push_back({2 * i, next + (1 ^ swap), next + swap});
  }
  return soup;
}

double volume(const Soup& soup, const std::vector<std::int8_t>& turns) {
  double sum = 0;
  for (std::size_t i = 0; i < soup.triangles.size(); ++i) {
    const auto& [a, b, c] = soup.triangles[i];
    Eigen::Matrix3d m;
    m << soup.points[a].cast<double>(), soup.points[b].cast<double>(), soup.points[c].cast<double>();
    sum += turns[i] * m.determinant() / 6;
  }
  return sum;
}

TEST(Orientation, LeavesAGoodMeshAlone) {
  const Orientation found = cube(1).orient();
  EXPECT_EQ(found.turns, std::vector<std::int8_t>(12, 1));
  EXPECT_EQ(found.patches, 1u);
  EXPECT_EQ(found.flipped + found.duplicates + found.boundary_edges + found.non_manifold_edges, 0u);
  EXPECT_EQ(found.verdict, Verdict::usable);
  EXPECT_STREQ(explanation(found.verdict), "");
}

TEST(Orientation, TurnsAnInvertedMeshOver) {
  Soup box = cube(1, {100, 0, 0});
  box.flip_all();
  const Orientation found = box.orient();
  EXPECT_EQ(found.turns, std::vector<std::int8_t>(12, -1));
  EXPECT_EQ(found.flipped, 12u);
}

TEST(Orientation, MakesRandomlyFlippedFacesAgree) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 50; ++trial) {
    Soup box = cube(1, {3, -20, 7});
    std::size_t flips = 0;
    for (std::size_t i = 0; i < 12; ++i)
      if (random() % 2) box.flip(i), ++flips;
    for (const Soup& soup : {box, unwelded(box)}) {
      const Orientation found = soup.orient();
      EXPECT_NEAR(volume(soup, found.turns), 8, 1e-4);
      EXPECT_EQ(found.flipped, flips);
      EXPECT_EQ(found.patches, 1u);
      EXPECT_EQ(found.boundary_edges, 0u);
    }
  }
}

TEST(Orientation, KeepsNestedShellsAsTheyWereGiven) {
  Soup shell = cube(3), hole = cube(1);
  hole.flip_all();
  shell.add(hole);
  EXPECT_EQ(shell.orient().flipped, 0u);
  EXPECT_EQ(shell.orient().patches, 2u);
  shell.flip_all();
  EXPECT_EQ(shell.orient().flipped, 24u);
  EXPECT_NEAR(volume(shell, shell.orient().turns), 216 - 8, 1e-9);
}

TEST(Orientation, GivesOnlyRepairedPatchesTheirOrientationByVolume) {
  Soup shell = cube(3), hole = cube(1);
  hole.flip_all();
  shell.flip(0);
  shell.add(hole);
  const Orientation found = shell.orient();
  EXPECT_EQ(found.flipped, 1u);
  EXPECT_EQ(found.turns[0], -1);
  shell.flip_all();
  EXPECT_EQ(shell.orient().flipped, 23u);
  EXPECT_NEAR(volume(shell, shell.orient().turns), 216 - 8, 1e-9);
}

TEST(Orientation, IgnoresDuplicatesOfEitherWinding) {
  Soup box = cube(1);
  box.triangles.push_back({2, 3, 0});
  box.triangles.push_back({4, 7, 5});
  box.triangles.push_back({7, 5, 4});
  const Orientation found = box.orient();
  EXPECT_EQ(found.duplicates, 3u);
  EXPECT_EQ(found.patches, 1u);
  EXPECT_EQ(found.boundary_edges + found.non_manifold_edges, 0u);
  EXPECT_NEAR(volume(box, found.turns), 8, 1e-12);
  EXPECT_EQ(found.verdict, Verdict::usable);
}

TEST(Orientation, TellsFacesThatCancel) {
  Soup box = cube(1), other = cube(1);
  other.flip_all();
  box.add(other);
  const Orientation found = box.orient();
  EXPECT_EQ(found.duplicates, 12u);
  EXPECT_EQ(found.verdict, Verdict::cancelling);
  EXPECT_STRNE(explanation(found.verdict), "");
}

/// Two cubes face on face: the side between them is there with both windings, and bounds nothing.
Soup two_cubes_face_on_face() {
  Soup boxes = cube(1);
  boxes.add(cube(1, {2, 0, 0}));
  return boxes;
}

TEST(Orientation, LeavesOutTheWallBetweenTwoParts) {
  const Soup boxes = two_cubes_face_on_face();
  const Orientation found = boxes.orient();
  EXPECT_EQ(found.duplicates, 2u);
  EXPECT_EQ(found.flipped, 0u);
  EXPECT_EQ(std::count(found.turns.begin(), found.turns.end(), 0), 4);
  EXPECT_EQ(found.boundary_edges + found.non_manifold_edges, 0u);
  EXPECT_NEAR(volume(boxes, found.turns), 16, 1e-12);
  EXPECT_EQ(found.verdict, Verdict::usable);
}

/// A solid of two rooms is closed without the wall between them, as either room would be with it.
TEST(Orientation, LeavesOutASingleWallWithinASolid) {
  Soup soup;
  for (const float z : {0.0f, 2.0f, 5.0f})
    for (const auto& [x, y] :
         {std::pair(0.0f, 0.0f), std::pair(1.0f, 0.0f), std::pair(1.0f, 1.0f), std::pair(0.0f, 1.0f)})
      soup.points.emplace_back(x, y, z);
  soup.triangles = {{0, 3, 2}, {0, 2, 1}, {8, 9, 10}, {8, 10, 11}};
  for (std::uint32_t low : {0u, 4u})
    for (std::uint32_t i = 0; i < 4; ++i) {
      const std::uint32_t a = low + i, b = low + (i + 1) % 4;
      soup.triangles.push_back({a, b, b + 4});
      soup.triangles.push_back({a, b + 4, a + 4});
    }
  for (const bool upside_down : {false, true}) {
    Soup walled = soup;
    walled.triangles.push_back({4, 5, 6});
    walled.triangles.push_back({4, 6, 7});
    if (upside_down) walled.flip(walled.triangles.size() - 1), walled.flip(walled.triangles.size() - 2);
    const Orientation found = walled.orient();
    for (std::size_t face = 0; face < walled.triangles.size(); ++face)
      EXPECT_EQ(found.turns[face], face < soup.triangles.size() ? 1 : 0) << face;
  }
}

TEST(Orientation, WallsDoNotCancelTheSurface) {
  // 144 walls between 64 cubes, and 96 outer sides.
  Soup boxes;
  for (int i = 0; i < 64; ++i)
    boxes.add(cube(1, 2 * Eigen::Vector3f(float(i % 4), float(i / 4 % 4), float(i / 16))));
  const Orientation found = boxes.orient();
  EXPECT_EQ(found.duplicates, 2u * 144);
  EXPECT_NEAR(volume(boxes, found.turns), 8 * 64, 1e-9);
  EXPECT_EQ(found.verdict, Verdict::usable);
}

TEST(Orientation, LeavesOutAFinOfNoThickness) {
  Soup box = cube(1);
  box.points.push_back({0, 0, 3});
  box.triangles.push_back({4, 7, 8});  // on the diagonal of the top
  box.triangles.push_back({7, 4, 8});
  const Orientation found = box.orient();
  EXPECT_EQ(std::count(found.turns.begin(), found.turns.end(), 0), 2);
  EXPECT_EQ(found.boundary_edges + found.non_manifold_edges, 0u);
  EXPECT_NEAR(volume(box, found.turns), 8, 1e-12);
}

TEST(Orientation, TakesOneOfTwoFacesThatAreTheOnlyOnesThere) {
  // Every face twice and wound at random, so some cancel: no part of a wall, for the surface needs them.
  std::mt19937 random(1);
  for (int trial = 0; trial < 20; ++trial) {
    Soup box = cube(1);
    box.add(cube(1));
    for (std::size_t face = 0; face < box.triangles.size(); ++face)
      if (random() % 2) box.flip(face);
    const Orientation found = box.orient();
    if (found.verdict == Verdict::cancelling) continue;  // most of them do
    EXPECT_EQ(found.duplicates, 12u);
    EXPECT_EQ(found.boundary_edges + found.non_manifold_edges, 0u);
    EXPECT_NEAR(std::abs(volume(box, found.turns)), 8, 1e-12);
  }
}

TEST(Orientation, TellsAMoebiusStrip) {
  const Orientation twisted = strip(1).orient();
  EXPECT_EQ(twisted.non_orientable_patches, 1u);
  EXPECT_EQ(twisted.patches, 1u);
  EXPECT_EQ(twisted.boundary_edges, 40u);
  EXPECT_EQ(twisted.verdict, Verdict::not_orientable);
  EXPECT_EQ(strip(0).orient().verdict, Verdict::usable);
  EXPECT_EQ(strip(2).orient().non_orientable_patches, 0u);
  EXPECT_EQ(strip(3).orient().verdict, Verdict::not_orientable);
}

TEST(Orientation, SurvivesASmallMoebiusStripBesideALargeMesh) {
  Soup soup = cube(30, {100, 0, 0});
  soup.add(strip(1));
  const Orientation found = soup.orient();
  EXPECT_EQ(found.non_orientable_patches, 1u);
  EXPECT_EQ(found.verdict, Verdict::usable);
}

TEST(Orientation, TellsThatThereIsNoArea) {
  const Soup line{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}, {0, 0, 1}, {1, 1, 1}}};
  EXPECT_EQ(line.orient().verdict, Verdict::no_area);
  EXPECT_EQ(Soup().orient().verdict, Verdict::no_area);
}

TEST(Orientation, OfAnOpenPatchFollowsTheLargerArea) {
  Soup open = cube(1);
  open.triangles.resize(10);
  open.flip(3);
  open.flip(5);
  const Orientation most = open.orient();
  EXPECT_EQ(most.flipped, 2u);
  EXPECT_EQ(most.turns[3], -1);
  EXPECT_EQ(most.turns[5], -1);
  EXPECT_EQ(most.boundary_edges, 4u);
  // Once most of the area is inside out, so is the volume, and all faces are reversed.
  open.flip_all();
  EXPECT_EQ(open.orient().flipped, 8u);
}

TEST(Orientation, LeavesAFlatSheetAlone) {
  const Soup sheet{{{0, 0, 5}, {1, 0, 5}, {1, 1, 5}, {0, 1, 5}}, {{0, 2, 1}, {0, 3, 2}}};
  EXPECT_EQ(sheet.orient().flipped, 0u);
}

TEST(Orientation, TurnsNoSheetWhoseVolumeDependsOnThePlace) {
  // A ridge of height 1 and a valley of depth 2 next to it, unit length in y. About an apex at height z the
  // cone to the ridge has volume (2 − 2z)/3, to the valley (−4 − 2z)/3, together (−2 − 4z)/3: from 2 at the
  // valley's bottom to −2 at the ridge's top, and −0.11 about the centre of the area at −0.42.
  Soup sheet;
  for (const float y : {0.0f, 1.0f})
    for (const auto& [x, z] :
         {std::pair{-1.0f, 0.0f}, {0.0f, 1.0f}, {1.0f, 0.0f}, {2.0f, -2.0f}, {3.0f, 0.0f}})
      sheet.points.push_back({x, y, z});
  for (std::uint32_t i = 0; i < 4; ++i) {
    sheet.triangles.push_back({i, i + 1, i + 6});
    sheet.triangles.push_back({i, i + 6, i + 5});
  }
  EXPECT_EQ(sheet.orient().flipped, 0u);
  sheet.flip_all();
  EXPECT_EQ(sheet.orient().flipped, 0u);
}

TEST(Orientation, DoesNotJoinFacesOverEdgesOfMoreThanTwo) {
  Soup fan;
  fan.points = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}};
  fan.triangles = {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}};
  const Orientation found = fan.orient();
  EXPECT_EQ(found.patches, 3u);
  EXPECT_EQ(found.non_manifold_edges, 1u);
  EXPECT_EQ(found.boundary_edges, 6u);
  EXPECT_EQ(found.non_orientable_patches, 0u);
}

TEST(Orientation, LetsFacesThatFormNoSurfaceKeepTheirWinding) {
  // Half of all faces over twelve points: an edge has five, wound at random.
  std::mt19937 random(3);
  for (int trial = 0; trial < 5; ++trial) {
    Soup soup;
    for (int i = 0; i < 12; ++i)
      soup.points.push_back(
          Eigen::Vector3f(float(random() % 100), float(random() % 100), float(random() % 100)));
    for (std::uint32_t a = 0; a < 12; ++a)
      for (std::uint32_t b = a + 1; b < 12; ++b)
        for (std::uint32_t c = b + 1; c < 12; ++c)
          if (random() % 2) soup.triangles.push_back(random() % 2 ? Triangle{a, b, c} : Triangle{a, c, b});
    const Orientation found = soup.orient();
    EXPECT_GT(found.non_manifold_edges, 50u);
    EXPECT_TRUE(found.flipped == 0 || found.flipped == soup.triangles.size()) << found.flipped;
  }
}

TEST(Orientation, IsTheSameForEveryNumberOfThreads) {
  std::mt19937 random(2);
  Soup soup;
  for (int i = 0; i < 3000; ++i) {
    Soup box = cube(1, {static_cast<float>(2 * (i % 60)), static_cast<float>(2 * (i / 60)), 0});
    for (std::size_t k = 0; k < 12; ++k)
      if (random() % 4 == 0) box.flip(k);
    soup.add(box);
  }
  std::vector<Orientation> found;
  for (const std::size_t threads : {1, 2, 7}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    found.push_back(soup.orient());
    EXPECT_EQ(found[0].turns, found.back().turns);
    EXPECT_EQ(found[0].patches, found.back().patches);
  }
  EXPECT_GT(found[0].duplicates, 0u);
}

}  // namespace orientation_test
}  // namespace hermesh
