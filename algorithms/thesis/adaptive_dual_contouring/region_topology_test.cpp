#include "algorithms/thesis/adaptive_dual_contouring/region_topology.h"

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <utility>

namespace hermesh {
namespace region_topology_test {

using namespace region_topology;

/// Gerstner & Pajarola's collapse done literally: the cube's twelve edges, of which one with ends of one sign
/// is shrunk to a point until none is left; then the edges that still join two different points are counted.
bool collapses_by_hand(unsigned inside) {
  int point[8];
  for (int corner = 0; corner < 8; ++corner) point[corner] = corner;
  const auto sign = [&](int corner) { return (inside >> corner) & 1; };
  for (int a = 0; a < 8; ++a)
    for (int axis = 1; axis < 8; axis *= 2) {
      const int b = a ^ axis;
      if (sign(a) != sign(b) || point[a] == point[b]) continue;
      const int from = point[b], to = point[a];
      for (int& each : point)
        if (each == from) each = to;
    }
  std::set<std::pair<int, int>> edges;
  for (int a = 0; a < 8; ++a)
    for (int axis = 1; axis < 8; axis *= 2)
      if (const int b = a ^ axis; point[a] != point[b]) edges.insert(std::minmax(point[a], point[b]));
  return edges.size() == 1;
}

TEST(RegionTopology, TheTableIsTheCollapseDoneByHand) {
  int manifold = 0;
  for (unsigned inside = 0; inside < 256; ++inside) {
    EXPECT_EQ(kCollapsesToOneEdge[inside], collapses_by_hand(inside)) << inside;
    EXPECT_EQ(kCollapsesToOneEdge[inside], kCollapsesToOneEdge[255 - inside]) << inside;
    manifold += kCollapsesToOneEdge[inside];
  }
  EXPECT_EQ(manifold, 126);
}

/// The sign tests of §6.3, literally, for one region of 3³ samples.
bool middles_by_hand(Signs27 signs) {
  const auto sign = [&](int x, int y, int z) { return (signs >> (9 * x + 3 * y + z)) & 1; };
  for (int x = 0; x < 3; ++x)
    for (int y = 0; y < 3; ++y)
      for (int z = 0; z < 3; ++z) {
        if (x != 1 && y != 1 && z != 1) continue;
        bool agrees = false;
        for (int i = 0; i < 3; i += 2)
          for (int j = 0; j < 3; j += 2)
            for (int k = 0; k < 3; k += 2)
              agrees |= sign(x == 1 ? i : x, y == 1 ? j : y, z == 1 ? k : z) == sign(x, y, z);
        if (!agrees) return false;
      }
  return true;
}

TEST(RegionTopology, MiddlesAgreeWithSomeCorner) {
  std::mt19937 random(1);
  int agreeing = 0;
  for (int i = 0; i < 2'000'000; ++i) {
    // All signs alike except for a few, so that both answers come often.
    Signs27 signs = static_cast<Signs27>(random()) & static_cast<Signs27>(random()) & ((1u << 27) - 1);
    if (i & 1) signs &= static_cast<Signs27>(random());
    if (i & 2) signs ^= (1u << 27) - 1;
    ASSERT_EQ(middles_agree(signs), middles_by_hand(signs)) << signs;
    agreeing += middles_agree(signs);
  }
  EXPECT_GT(agreeing, 10'000);
}

TEST(RegionTopology, TheLatticeGivesTheSignsOfRegions) {
  std::mt19937_64 random(2);
  std::array<BlockMask, 8> masks;
  for (BlockMask& mask : masks)
    for (std::uint64_t& word : mask) word = random() & random();
  std::array<SignLattice::Part, 8> parts;
  for (int part = 0; part < 8; ++part) parts[part].inside = &masks[part];
  parts[3] = {nullptr, true};
  const SignLattice lattice(parts);
  const auto sign = [&](int x, int y, int z) {
    const int part = 4 * (x >> 3) + 2 * (y >> 3) + (z >> 3);
    return part == 3 || test(masks[part], sample_index(x & 7, y & 7, z & 7));
  };
  for (const int side : {2, 4, 8})
    for (int x = 0; x < 8; x += side)
      for (int z = 0; z < 8; z += side) {
        const Signs27 signs = lattice.around(x, 8 - side, z, side);
        for (int i = 0; i < 27; ++i)
          ASSERT_EQ((signs >> i) & 1,
                    sign(x + i / 9 * side / 2, 8 - side + i / 3 % 3 * side / 2, z + i % 3 * side / 2));
      }
}

}  // namespace region_topology_test
}  // namespace hermesh
