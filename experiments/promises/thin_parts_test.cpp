// Thin parts are preserved: plates, shells, tubes, cones, wires and open sheets of known topology, thinner
// and thicker than a voxel, turned and moved at random. Voxels are 1 wide.
#include "algorithms/remesh/thin_parts.h"

#include <functional>
#include <string>
#include <vector>

#include "algorithms/remesh/shell.h"
#include "experiments/promises/methods_for_tests.h"
#include "experiments/promises/solids_for_tests.h"
#include "validation/geometry/triangle_soup.h"
#include "validation/visible_loss.h"

namespace hermesh {
namespace thin_parts_test {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using recipes::Random;
using test_solids::random_turn;
using test_solids::random_vector;

/// A surface over the unit square, with normals, and the topology of the solid around it.
struct Surface {
  const char* name;
  std::function<Vector3d(double u, double v)> at;
  int across, along;                 ///< squares along u and v
  bool closes_u, closes_v, twisted;  ///< u = 1 is u = 0, with v reversed if twisted
  int components, genus;             ///< of the boundary of the solid around it
};

std::vector<Surface> surfaces() {
  constexpr double kTurn = 2.0 * M_PI;
  return {{"plate", [](double u, double v) { return Vector3d(24 * u - 12, 17 * v - 8, 0); }, 1, 1, false,
           false, false, 1, 0},
          {"tube",
           [](double u, double v) {
             return Vector3d(8 * std::cos(kTurn * u), 8 * std::sin(kTurn * u), 20 * v - 10);
           },
           40, 1, true, false, false, 1, 1},
          {"cup",
           [](double u, double v) {
             const double s = 0.3 + 1.3 * v;
             return Vector3d(12 * std::sin(s) * std::cos(kTurn * u), 12 * std::sin(s) * std::sin(kTurn * u),
                             12 * std::cos(s));
           },
           48, 20, true, false, false, 1, 1},
          {"cone",
           [](double u, double v) {
             return Vector3d(9 * v * std::cos(kTurn * u), 9 * v * std::sin(kTurn * u), 18 * v - 9);
           },
           40, 1, true, false, false, 1, 0},
          {"shell",
           [](double u, double v) {
             const double r = 10 + 5 * std::cos(kTurn * v);
             return Vector3d(r * std::cos(kTurn * u), r * std::sin(kTurn * u), 5 * std::sin(kTurn * v));
           },
           60, 30, true, true, false, 2, 2},
          {"Möbius strip",
           [](double u, double v) {
             const double s = 10 * (v - 0.5), r = 13 + s * std::cos(M_PI * u);
             return Vector3d(r * std::cos(kTurn * u), r * std::sin(kTurn * u), s * std::sin(M_PI * u));
           },
           80, 6, true, false, true, 1, 1},
          {"ribbon",
           [](double u, double v) {
             return Vector3d(10 * std::cos(3 * u), 10 * std::sin(3 * u) + 0.02 * v, 14 * u - 7 + 0.02 * v);
           },
           50, 1, false, false, false, 1, 0}};
}

/// The surface itself, or its offsets by ± half of a thickness with a border between them.
PolygonMesh wall(const Surface& s, double thickness) {
  MeshFile file;
  const int nu = s.across, nv = s.along;
  constexpr double kStep = 1e-4;
  const auto normal = [&](double u, double v) {
    const Vector3d du = s.at(u + kStep, v) - s.at(u - kStep, v), dv = s.at(u, v + kStep) - s.at(u, v - kStep);
    return du.cross(dv).normalized();
  };
  const int layers = thickness > 0.0 ? 2 : 1;
  for (int layer = 0; layer < layers; ++layer)
    for (int i = 0; i <= nu; ++i)
      for (int j = 0; j <= nv; ++j) {
        const double u = double(i) / nu, v = double(j) / nv;
        const double offset = layers == 1 ? 0.0 : (layer - 0.5) * thickness;
        file.points.push_back(s.at(u, v) +
                              (offset != 0.0 ? offset * normal(u, v) : Vector3d(Vector3d::Zero())));
      }
  const auto number = [&](int layer, int i, int j) {
    if (s.closes_u && i == nu) {
      i = 0;
      if (s.twisted) j = nv - j;
    }
    if (s.closes_v && j == nv) j = 0;
    return std::uint32_t((layer * (nu + 1) + i) * (nv + 1) + j);
  };
  const auto quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    file.triangles.push_back({a, b, c});
    file.triangles.push_back({a, c, d});
  };
  for (int layer = 0; layer < layers; ++layer)
    for (int i = 0; i < nu; ++i)
      for (int j = 0; j < nv; ++j) {
        const std::uint32_t a = number(layer, i, j), b = number(layer, i + 1, j),
                            c = number(layer, i + 1, j + 1), d = number(layer, i, j + 1);
        layer == 1 || layers == 1 ? quad(a, b, c, d) : quad(a, d, c, b);
      }
  if (layers == 1) return to_polygon_mesh(file);
  if (!s.closes_u)
    for (int j = 0; j < nv; ++j) {
      quad(number(0, 0, j), number(1, 0, j), number(1, 0, j + 1), number(0, 0, j + 1));
      quad(number(0, nu, j), number(0, nu, j + 1), number(1, nu, j + 1), number(1, nu, j));
    }
  if (!s.closes_v)
    for (int i = 0; i < nu; ++i) {
      quad(number(0, i, 0), number(0, i + 1, 0), number(1, i + 1, 0), number(1, i, 0));
      quad(number(0, i, nv), number(1, i, nv), number(1, i + 1, nv), number(0, i + 1, nv));
    }
  return to_polygon_mesh(file);
}

PolygonMesh moved(PolygonMesh mesh, const Matrix3d& turn, const Vector3d& shift) {
  for (Eigen::Vector3f& p : mesh.points) p = (turn * p.cast<double>() + shift).cast<float>();
  return mesh;
}

struct Kept {
  PolygonSolid solid;
  PolygonMesh mesh;
};

Kept keep(const PolygonMesh& polygons, RunContext& context, ThinRule rule = ThinRule::keep) {
  const LevelSet level_set = test_methods::voxelized(polygons, 1.0, context, {{"signs", "auto-sheets"}});
  Kept kept{solid_of(polygons, level_set, rule, context), {}};
  if (kept.solid.solid.hermite.leaves.empty()) return kept;
  kept.mesh = extract(kept.solid.solid.level_set, nullptr,
                      {.chosen = choose(our_extractors(), "manifold-dual-contouring"),
                       .hermite = &kept.solid.solid.hermite},
                      context)
                  .mesh;
  return kept;
}

void expect_kept(const Surface& surface, double thickness, std::uint64_t seed) {
  Random random(seed);
  const Matrix3d turn = seed % 4 == 0 ? Matrix3d(Matrix3d::Identity()) : random_turn(random);
  const PolygonMesh polygons = moved(wall(surface, thickness), turn, random_vector(random, 3.0));
  SCOPED_TRACE(std::string(surface.name) + " of " + std::to_string(thickness) + ", seed " +
               std::to_string(seed));
  RunContext context;
  const Kept kept = keep(polygons, context);
  ASSERT_FALSE(kept.mesh.empty());
  const MeshFile file = to_mesh_file(kept.mesh), model = to_mesh_file(polygons);
  validation::CheckOptions options = kPromisesAlone;
  options.reference = &model;
  options.samples = 20'000;
  options.solid_samples = 0;
  options.voxel_size = 1.0;
  options.visible_samples = 5'000;
  const validation::MeshReport report = validation::check_mesh(file, options, context);
  EXPECT_TRUE(report.watertight());
  EXPECT_EQ(report.components, surface.components);
  EXPECT_EQ(report.genus.value_or(-1.0), double(surface.genus));
  EXPECT_GT(report.volume, 0.0);
  EXPECT_LE(report.visible->vanished.value, 0.002);
  EXPECT_LT(report.from_reference->max, kWireRadius + 0.25);
}

/// Offsets of a one-sided strip meet each other, and the cavity of a closed shell is preserved only if its
/// wall has samples everywhere.
bool is_possible(const Surface& surface, double thickness) {
  if (surface.closes_v) return thickness > 1.3;
  return thickness == 0.0 || (!surface.twisted && surface.name != std::string("ribbon"));
}

TEST(ThinParts, AreKeptInOnePieceWithoutHoles) {
  std::uint64_t seed = 0;
  for (const Surface& surface : surfaces())
    for (const double thickness : {0.0, 0.3, 0.9, 1.4}) {
      if (is_possible(surface, thickness)) expect_kept(surface, thickness, seed);
      ++seed;
    }
}

TEST(Slow, ThinPartsAreKeptIn300PositionsEach) {
  const std::vector<double> thickness = {0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0, 1.2, 1.5, 2.0, 3.0};
  for (const Surface& surface : surfaces())
    for (std::uint64_t seed = 0; seed < 300; ++seed)
      if (const double t = thickness[seed % thickness.size()]; is_possible(surface, t))
        expect_kept(surface, t, 1000 + seed);
}

TEST(ThinParts, OfAPlateAreOneAndAFifthVoxelsThick) {
  // The shell around a plate of 24 × 17 is at most 1.2 thick, with half a cylinder of radius 0.6 at its
  // border and up to a third of a voxel more where it is joined.
  RunContext context;
  for (const double thickness : {0.0, 0.5})
    for (std::uint64_t seed = 1; seed < 4; ++seed) {
      Random random(seed);
      const Kept kept = keep(
          moved(wall(surfaces()[0], thickness), random_turn(random), random_vector(random, 3.0)), context);
      const double volume = validation::check_mesh(to_mesh_file(kept.mesh), kCounts, context).volume;
      EXPECT_GT(volume, 24 * 17 * 1.1);
      EXPECT_LT(volume, 24 * 17 * 1.25 + 2 * (24 + 17) * 1.2);
      ASSERT_TRUE(kept.solid.thin);
      EXPECT_NEAR(kept.solid.thin->thickest, 1.2 - thickness, thickness == 0.0 ? 0.56 : 0.35);
      EXPECT_NEAR(kept.solid.thin->thinnest_wall, thickness, 1e-3);
    }
}

TEST(ThinParts, AreNotAddedWhereThereAreNone) {
  RunContext context;
  for (std::uint64_t seed = 1; seed < 4; ++seed) {
    Random random(seed);
    const PolygonMesh box = test_solids::placed(test_solids::cuboid({-6, -5, -4}, {12, 10, 8}),
                                                random_turn(random), random_vector(random, 3.0));
    const Kept kept = keep(box, context), dropped = keep(box, context, ThinRule::drop);
    EXPECT_FALSE(kept.solid.thin);
    EXPECT_EQ(kept.mesh, dropped.mesh);
  }
}

TEST(ThinParts, DoNotCloseAdjacentGaps) {
  // Plates of 1.15 with gaps of 0.85 between them, in each of which is a layer of samples, and a sheet that
  // connects their ends: only the sheet is lost, and its shell leaves the gaps open.
  MeshFile model;
  const auto add = [&](const PolygonMesh& polygons) {
    const MeshFile file = to_mesh_file(polygons);
    const auto first = static_cast<std::uint32_t>(model.points.size());
    model.points.insert(model.points.end(), file.points.begin(), file.points.end());
    for (const Triangle& t : file.triangles)
      model.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  };
  for (int i = 0; i < 6; ++i) add(test_solids::cuboid({2 * i + 0.425, 0.3, 0.3}, {1.15, 6.1, 12.3}));
  MeshFile sheet;
  sheet.points = {{-1, 6.4, 0.3}, {13, 6.4, 0.3}, {13, 6.4, 12.6}, {-1, 6.4, 12.6}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  add(to_polygon_mesh(sheet));
  RunContext context;
  const Kept kept = keep(to_polygon_mesh(model), context);
  ASSERT_TRUE(kept.solid.thin);
  const MeshFile file = to_mesh_file(kept.mesh);
  const validation::VisibleLoss loss = validation::measure_visible_loss(
      validation::TriangleSoup(model), validation::TriangleSoup(file), 1.0, 20'000, context);
  EXPECT_LE(loss.filled.value, 0.001);
  EXPECT_LE(loss.lost.value, 0.02);
}

TEST(ThinParts, AreRefusedIfAskedFor) {
  RunContext context;
  EXPECT_THROW(keep(wall(surfaces()[0], 0.0), context, ThinRule::refuse), Error);
  EXPECT_NO_THROW(keep(wall(surfaces()[0], 3.0), context, ThinRule::refuse));
}

TEST(VisibleLoss, OfAHoleIsItsShare) {
  // A cube of 12 triangles without two of them, for a model that has all.
  RunContext context;
  const MeshFile model = to_mesh_file(test_solids::cuboid({0, 0, 0}, {10, 10, 10}));
  MeshFile mesh = model;
  mesh.triangles.resize(10);
  const auto loss = [&](const MeshFile& a, const MeshFile& b) {
    return validation::measure_visible_loss(validation::TriangleSoup(a), validation::TriangleSoup(b), 0.1,
                                            20'000, context);
  };
  // Rays from samples on an edge may slip through it.
  EXPECT_LE(loss(model, model).lost.value, 1e-3);
  EXPECT_NEAR(loss(model, mesh).lost.value, 1.0 / 6.0, 0.01);
  EXPECT_NEAR(loss(mesh, model).invented.value, 1.0 / 6.0, 0.01);
  // Inside out, the mesh shows none of it.
  MeshFile turned = model;
  for (Triangle& t : turned.triangles) std::swap(t[1], t[2]);
  EXPECT_GT(loss(model, turned).lost.value, 0.99);
}

}  // namespace thin_parts_test
}  // namespace hermesh
