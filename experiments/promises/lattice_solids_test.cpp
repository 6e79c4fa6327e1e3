// Solids whose faces lie in planes of samples: each voxelizer and sign rule gives exactly the solid. All
// expected values are closed forms of whole numbers.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/io/mesh_file.h"
#include "algorithms/variants.h"
#include "experiments/pipeline.h"
#include "experiments/variants.h"

namespace hermesh {
namespace lattice_solids_test {

using Cell = std::array<int, 3>;
using Cells = std::set<Cell>;

/// Polygons whose corners have whole numbers as coordinates.
struct Soup {
  std::vector<Cell> points;
  std::vector<std::array<std::uint32_t, 4>> quads;

  std::uint32_t add(const Cell& point) {
    points.push_back(point);
    return std::uint32_t(points.size() - 1);
  }
  /// The square from `corner` along axes u and v, wound so that its normal points along u × v, or the other
  /// way.
  void add_square(const Cell& corner, int axis, int length_u, int length_v, bool up) {
    const std::size_t u = std::size_t(axis + 1) % 3, v = std::size_t(axis + 2) % 3;
    Cell b = corner, c = corner, d = corner;
    b[u] += length_u, c[u] += length_u, c[v] += length_v, d[v] += length_v;
    const std::uint32_t n = add(corner);
    add(b), add(c), add(d);
    quads.push_back(up ? std::array{n, n + 1, n + 2, n + 3} : std::array{n, n + 3, n + 2, n + 1});
  }
  /// Adds the faces of a box; `out` is 1 for a solid and −1 for a cavity.
  void add_box(const Cell& low, const Cell& high, int out = 1) {
    for (int axis = 0; axis < 3; ++axis)
      for (const bool upper : {false, true}) {
        Cell corner = low;
        const auto a = std::size_t(axis);
        if (upper) corner[a] = high[a];
        const std::size_t u = (a + 1) % 3, v = (a + 2) % 3;
        add_square(corner, axis, high[u] - low[u], high[v] - low[v], upper == (out > 0));
      }
  }
};

/// The border of a set of unit cells: a square wherever a cell has no neighbour.
Soup border(const Cells& cells) {
  Soup soup;
  for (const Cell& cell : cells)
    for (int axis = 0; axis < 3; ++axis)
      for (const int side : {-1, 1}) {
        Cell other = cell;
        other[std::size_t(axis)] += side;
        if (cells.contains(other)) continue;
        soup.add_square(side > 0 ? other : cell, axis, 1, 1, side > 0);
      }
  return soup;
}

void fill(Cells& cells, const Cell& low, const Cell& high) {
  for (int x = low[0]; x < high[0]; ++x)
    for (int y = low[1]; y < high[1]; ++y)
      for (int z = low[2]; z < high[2]; ++z) cells.insert({x, y, z});
}

/// Measures of a solid, in units of its cells.
struct Amounts {
  int components = 0;  ///< components of the solid's surface
  double volume = 0.0, area = 0.0;
};

struct Solid {
  std::string name;
  Soup soup;
  Amounts flooded, wound;   ///< expected for each rule of signs
  bool parity = false;      ///< ray parity also finds the wound solid
  bool has_cavity = false;  ///< bounded by a shell that faces inwards, which `auto` preserves
};

struct Box {
  Cell low, high;
  int out = 1;
};
Soup boxes(const std::vector<Box>& all) {
  Soup soup;
  for (const auto& [low, high, out] : all) soup.add_box(low, high, out);
  return soup;
}
Soup border_of(const std::vector<Box>& all) {
  Cells cells;
  for (const Box& box : all) fill(cells, box.low, box.high);
  return border(cells);
}

std::vector<Solid> solids() {
  std::vector<Box> bricks, stairs;
  for (int row = 0; row < 3; ++row)
    for (int brick = 0; brick < 3; ++brick)
      bricks.push_back({{2 * brick + row % 2, 0, row}, {2 * brick + 2 + row % 2, 1, row + 1}});
  for (int step = 0; step < 4; ++step) stairs.push_back({{step, 0, 0}, {step + 1, 2, step + 1}});
  Soup walled = border_of({{{0, 0, 0}, {4, 1, 1}}});
  walled.add_square({2, 0, 0}, 0, 1, 1, true);
  const auto same = [](const char* name, const Soup& soup, const Amounts& amounts, bool parity) {
    return Solid{name, soup, amounts, amounts, parity};
  };
  return {
      same("overlapping", boxes({{{0, 0, 0}, {4, 1, 1}}, {{3, 0, 0}, {6, 1, 1}}}), {1, 6, 26}, false),
      same("overlapping at corners", boxes({{{0, 0, 0}, {2, 2, 2}}, {{1, 1, 1}, {3, 3, 3}}}), {1, 15, 42},
           false),
      same("stacked", boxes({{{0, 0, 0}, {3, 1, 1}}, {{3, 0, 0}, {6, 1, 1}}}), {1, 6, 26}, true),
      same("touching in a part of a face", boxes({{{0, 0, 0}, {3, 3, 2}}, {{1, 1, 2}, {2, 2, 4}}}),
           {1, 20, 50}, true),
      same("nested", boxes({{{0, 0, 0}, {4, 4, 4}}, {{1, 1, 1}, {3, 3, 3}}}), {1, 64, 96}, false),
      {"with a cavity",
       boxes({{{0, 0, 0}, {4, 4, 4}}, {{1, 1, 1}, {3, 3, 3}, -1}}),
       {1, 64, 96},
       {2, 56, 120},
       true,
       true},
      same("nested with a common face", boxes({{{0, 0, 0}, {4, 4, 4}}, {{0, 1, 1}, {2, 3, 3}}}), {1, 64, 96},
           false),
      same("bricks", boxes(bricks), {1, 18, 58}, true),
      same("single-walled", walled, {1, 4, 18}, false),
      same("stairs", border_of(stairs), {1, 20, 52}, true),
      same("extruded", border_of({{{0, 0, 0}, {1, 4, 2}}, {{0, 0, 0}, {3, 1, 2}}, {{0, 3, 0}, {2, 4, 2}}}),
           {1, 14, 46}, true)};
}

/// A map of the lattice onto itself that exchanges axes and turns their signs.
struct Turn {
  std::array<int, 3> axis{0, 1, 2}, sign{1, 1, 1};

  Cell operator()(const Cell& p) const {
    return {sign[0] * p[std::size_t(axis[0])], sign[1] * p[std::size_t(axis[1])],
            sign[2] * p[std::size_t(axis[2])]};
  }
};

std::vector<Turn> turns() {
  std::vector<Turn> all;
  std::array<int, 3> axis{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      const Turn turn{axis, {signs & 4 ? -1 : 1, signs & 2 ? -1 : 1, signs & 1 ? -1 : 1}};
      int swaps = 0;
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = i + 1; j < 3; ++j) swaps += axis[i] > axis[j] ? 1 : 0;
      const int mirrors = (signs & 1) + (signs >> 1 & 1) + (signs >> 2);
      if ((swaps + mirrors) % 2 == 0) all.push_back(turn);
    }
  } while (std::next_permutation(axis.begin(), axis.end()));
  return all;
}

/// The polygons as a mesh: turned, in an octant of space, a cell `unit` world units wide.
PolygonMesh to_mesh(const Soup& soup, const Turn& turn, unsigned octant, float unit) {
  PolygonMesh mesh;
  Cell low{1 << 20, 1 << 20, 1 << 20}, high{-(1 << 20), -(1 << 20), -(1 << 20)};
  std::vector<Cell> points;
  for (const Cell& p : soup.points) {
    points.push_back(turn(p));
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], points.back()[a]);
      high[a] = std::max(high[a], points.back()[a]);
    }
  }
  for (const Cell& p : points) {
    Eigen::Vector3f at;
    for (std::size_t a = 0; a < 3; ++a)
      at[Eigen::Index(a)] = unit * float(octant >> a & 1 ? p[a] - high[a] : p[a] - low[a]);
    mesh.points.push_back(at);
  }
  for (const auto& q : soup.quads) mesh.quads.push_back({q[0], q[1], q[2], q[3]});
  return mesh;
}

struct Rule {
  std::string voxelizer, signs;
};
const std::vector<Rule> kRules = {{"hermesh", "auto"},
                                  {"hermesh", "flood-fill"},
                                  {"hermesh", "winding-number"},
                                  {"exact", "winding-number"},
                                  {"exact", "parity"}};

validation::MeshReport remeshed(const PolygonMesh& mesh, double voxel_size, const Rule& rule,
                                RunContext& context) {
  const Job job{.source = {.polygons = &mesh},
                .voxelize = {.chosen = choose(all_voxelizers(), rule.voxelizer, {{"signs", rule.signs}}),
                             .voxel_size = voxel_size},
                .extract = {.chosen = choose(all_extractors(), "dual-contouring",
                                             {{"placement", "optimal"}, {"hermite", "exact"}})},
                .judge = kCounts};
  return run(job, context).judgement.report;
}

void expect_amounts(const validation::MeshReport& report, const Amounts& right, double unit) {
  EXPECT_EQ(report.components, right.components);
  EXPECT_NEAR(report.volume / (unit * unit * unit), right.volume, 1e-4 * right.volume);
  EXPECT_NEAR(report.area / (unit * unit), right.area, 1e-4 * right.area);
  EXPECT_EQ(report.boundary_edges, 0);
}

/// Expects the amounts from all rules; from the oracle, which takes a hundred times as long, only
/// `with_oracle`.
void check(const Solid& solid, const Turn& turn, unsigned octant, double voxel_size, bool with_oracle) {
  constexpr double kUnit = 10.0;  // a multiple of every voxel size
  const PolygonMesh mesh = to_mesh(solid.soup, turn, octant, float(kUnit));
  for (const Rule& rule : kRules) {
    if ((rule.voxelizer == "exact" && !with_oracle) || (rule.signs == "parity" && !solid.parity)) continue;
    SCOPED_TRACE(solid.name + ", " + rule.voxelizer + " " + rule.signs + ", voxel " +
                 std::to_string(voxel_size) + ", octant " + std::to_string(octant) + ", axes " +
                 std::to_string(turn.axis[0]) + std::to_string(turn.axis[1]) + std::to_string(turn.axis[2]) +
                 ", signs " + std::to_string(turn.sign[0]) + std::to_string(turn.sign[1]) +
                 std::to_string(turn.sign[2]));
    RunContext context;
    const bool flooded = rule.signs == "flood-fill" || (rule.signs == "auto" && !solid.has_cavity);
    expect_amounts(remeshed(mesh, voxel_size, rule, context), flooded ? solid.flooded : solid.wound, kUnit);
  }
}

TEST(LatticeSolids, AreWholeInEachOctantAndAxisOrder) {
  const std::vector<Turn> all = turns();
  ASSERT_EQ(all.size(), 24u);
  for (const Solid& solid : solids())
    // Each third turn: all octants. `Slow` has all turns in all of them.
    for (unsigned i = 0; i < all.size(); i += 3) {
      check(solid, all[i], i % 8, 5.0, i == 6);
      if (HasFailure()) return;
    }
}

TEST(LatticeSolids, AreWholeAtTheCoarseVoxelSizes) {
  const std::vector<Turn> all = turns();
  unsigned i = 0;
  for (const Solid& solid : solids())
    for (const double voxel_size : {2.5, 2.0}) {
      check(solid, all[7 * i % 24], i % 8, voxel_size, voxel_size == 2.5);
      ++i;
    }
}

/// Slabs of one and two voxels keep both of their faces.
TEST(LatticeSolids, ThinSlabsStay) {
  const std::vector<Turn> all = turns();
  for (unsigned i = 0; i < all.size(); ++i)
    for (const int layers : {1, 2}) {
      Soup slab;
      slab.add_box({0, 0, 0}, {12, 9, layers});
      const double area = 2.0 * (12 * 9 + 12 * layers + 9 * layers);
      const Solid solid{"slab of " + std::to_string(layers),
                        slab,
                        {1, 12.0 * 9 * layers, area},
                        {1, 12.0 * 9 * layers, area},
                        true};
      check(solid, all[i], i % 8, 10.0, i % 12 == 5);
    }
  // A fin on a body.
  Soup fin;
  fin.add_box({0, 0, 0}, {10, 10, 10});
  fin.add_box({10, 1, 4}, {27, 9, 5});
  const Amounts right{1, 1000.0 + 17 * 8, 600.0 + 2 * (17 * 8 + 17) + 8 - 8};
  check({"fin", fin, right, right, true}, all[0], 0, 10.0, true);
}

/// Two cubes overlap, and the walls of the overlap also lie in planes of samples. Within both cubes the
/// nearest surface is a side of one of them outside of the other.
TEST(LatticeSolids, DistancesPassOverWallsWithin) {
  Soup soup;
  soup.add_box({0, 0, 0}, {2, 2, 2});
  soup.add_box({1, 1, 1}, {3, 3, 3});
  const PolygonMesh mesh = to_mesh(soup, {}, 0, 0.5f);
  for (const Rule& rule : kRules) {
    if (rule.signs == "parity") continue;
    SCOPED_TRACE(rule.voxelizer + " " + rule.signs);
    RunContext context;
    const LevelSet level_set =
        voxelize(mesh,
                 {.chosen = choose(all_voxelizers(), rule.voxelizer, {{"signs", rule.signs}}),
                  .voxel_size = 0.05,
                  .exterior_band = 8.0,
                  .interior_band = 8.0},
                 context);
    const auto at = [&](int x, int y, int z) {
      return level_set.grid().grid->tree().getValue(openvdb::Coord(x, y, z));
    };
    EXPECT_NEAR(at(12, 15, 15), -std::hypot(0.1, 0.25), 2e-3);  // (0.6, 0.75, 0.75)
    EXPECT_NEAR(at(10, 15, 15), -0.25, 2e-3);  // on a wall: straight up out of the lower cube
    EXPECT_NEAR(at(20, 15, 15), -0.25, 2e-3);
    EXPECT_LT(at(10, 10, 10), 0.0f);
    EXPECT_NEAR(at(5, 5, 0), 0.0, 1e-6);
    EXPECT_LT(at(5, 5, 0), 0.0f);   // the solid is above
    EXPECT_GE(at(5, 20, 5), 0.0f);  // and here below
  }
}

// ---- Random unions next to a lattice of cells.

/// Components, handles and cavities of a set of cells whose border is a manifold.
struct Border {
  double volume = 0.0, area = 0.0;
  int euler = 0;
  bool manifold = true;  ///< no two of its cells meet only at an edge or a corner
};

Border measure(const Cells& cells) {
  Border result;
  result.volume = double(cells.size());
  std::set<Cell> points, edges;  // in half units
  int faces = 0;
  const auto filled = [&](int x, int y, int z) { return cells.contains({x, y, z}); };
  std::map<Cell, int> edge_uses;
  for (const Cell& c : cells)
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const int side : {-1, 1}) {
        Cell other = c;
        other[axis] += side;
        if (cells.contains(other)) continue;
        ++faces;
        Cell middle{2 * c[0], 2 * c[1], 2 * c[2]};
        middle[axis] += side;
        const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
        for (const int du : {-1, 0, 1})
          for (const int dv : {-1, 0, 1}) {
            Cell at = middle;
            at[u] += du, at[v] += dv;
            if (du != 0 && dv != 0) points.insert(at);
            if ((du == 0) != (dv == 0)) edges.insert(at), ++edge_uses[at];
          }
      }
  result.area = faces;
  result.euler = int(points.size()) - int(edges.size()) + faces;
  for (const auto& [edge, uses] : edge_uses) result.manifold = result.manifold && uses == 2;
  // At a corner the filled cells must be connected by faces, and the empty ones, too.
  for (const Cell& p : points) {
    const Cell low{(p[0] - 1) / 2, (p[1] - 1) / 2, (p[2] - 1) / 2};
    for (const bool wanted : {false, true}) {
      unsigned of = 0;
      for (unsigned i = 0; i < 8; ++i)
        if (filled(low[0] + int(i & 1), low[1] + int(i >> 1 & 1), low[2] + int(i >> 2)) == wanted)
          of |= 1u << i;
      if (of == 0) continue;
      unsigned reached = of & -of, before = 0;
      while (reached != before) {
        before = reached;
        for (unsigned i = 0; i < 8; ++i)
          for (const unsigned step : {1u, 2u, 4u})
            if ((before >> i & 1) && (of >> (i ^ step) & 1)) reached |= 1u << (i ^ step);
      }
      result.manifold = result.manifold && reached == of;
    }
  }
  return result;
}

/// Checks random unions of boxes whose border is a manifold.
void check_random_unions(int count, unsigned seed) {
  std::mt19937 random(seed);
  const auto number = [&](int low, int high) { return low + int(random() % unsigned(high - low + 1)); };
  int done = 0;
  while (done < count) {
    Soup soup;
    Cells cells;
    const int boxes = number(2, 7);
    for (int i = 0; i < boxes; ++i) {
      Cell low, high;
      for (std::size_t a = 0; a < 3; ++a) {
        low[a] = number(1, 8);
        high[a] = low[a] + number(1, 6);
      }
      soup.add_box(low, high);
      fill(cells, low, high);
    }
    // Flooding fills enclosed cavities.
    Cells flooded;
    fill(flooded, {0, 0, 0}, {16, 16, 16});
    std::vector<Cell> stack{{0, 0, 0}};
    flooded.erase(stack[0]);
    while (!stack.empty()) {
      const Cell at = stack.back();
      stack.pop_back();
      for (std::size_t a = 0; a < 3; ++a)
        for (const int side : {-1, 1}) {
          Cell next = at;
          next[a] += side;
          if (!cells.contains(next) && flooded.erase(next)) stack.push_back(next);
        }
    }
    const Border wound = measure(cells), flood = measure(flooded);
    if (!wound.manifold || !flood.manifold)
      continue;  // where cells meet at an edge, more than one surface is right
    const float unit = std::array{1.0f, 2.0f, 0.25f}[std::size_t(done) % 3];
    const double voxel = double(unit) / (done % 2 ? 2.0 : 1.0);
    const PolygonMesh mesh = to_mesh(soup, {}, unsigned(done) % 8, unit);
    for (const Rule& rule : kRules) {
      if (rule.signs == "parity" || (rule.voxelizer == "exact" && done % 10 != 0)) continue;
      SCOPED_TRACE("union " + std::to_string(done) + ", " + rule.voxelizer + " " + rule.signs);
      RunContext context;
      const validation::MeshReport report = remeshed(mesh, voxel, rule, context);
      const Border& right = rule.signs == "winding-number" ? wound : flood;
      const double u = unit;
      EXPECT_NEAR(report.volume, right.volume * u * u * u, 1e-4 * right.volume * u * u * u);
      EXPECT_NEAR(report.area, right.area * u * u, 1e-4 * right.area * u * u);
      EXPECT_EQ(report.euler_characteristic, right.euler);
    }
    ++done;
  }
}

TEST(LatticeSolids, RandomUnionsAreRight) { check_random_unions(20, 1); }
TEST(Slow, FiveHundredRandomUnionsOfLatticeBoxesAreRight) { check_random_unions(500, 2); }

TEST(Slow, LatticeSolidsAreWholeAtEachVoxelSizeOctantAndAxisOrder) {
  const std::vector<Turn> all = turns();
  for (const Solid& solid : solids())
    for (const double voxel_size : {2.5, 2.0, 1.0, 0.5, 0.25})
      for (unsigned octant = 0; octant < 8; ++octant)
        for (unsigned i = 0; i < all.size(); ++i)
          // All orders and octants at the coarse sizes, each of either at the fine ones.
          if (voxel_size >= 2.0 || i % 8 == octant)
            check(solid, all[i], octant, voxel_size, i == 3 * octant && voxel_size >= 1.0);
}

}  // namespace lattice_solids_test
}  // namespace hermesh
