// Booleans of pairs of solids, validated on the contents of their files: closed, manifold, oriented, free of
// self-intersection, volumes that add up, and the same bytes for either order of the solids.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <string>

#include "algorithms/hermite/solids.h"
#include "algorithms/remesh/thin_parts.h"
#include "experiments/promises/methods_for_tests.h"
#include "experiments/promises/solids_for_tests.h"
#include "validation/geometry/triangle_tree.h"

namespace hermesh {
namespace combine_test {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using recipes::Random;
using test_solids::cuboid;
using test_solids::placed;
using test_solids::random_turn;
using test_solids::random_vector;
using test_solids::solid;

struct Pair {
  PolygonMesh a, b;
  double voxel_size;
  /// True if nothing that the two bound is thinner than a voxel except where their surfaces intersect, so
  /// that volumes add up.
  bool adds_up = false;
};

PolygonMesh turned_solid(Random& random, const Vector3d& at, double scale = 1.0) {
  const std::uint64_t which = random.bits();
  return placed(solid(which), scale * random_turn(random), at);
}

/// Numbers of solids. The tips of a gear's teeth are thinner than a voxel, however small voxels are.
constexpr std::uint64_t kBall = 0, kGear = 2, kTorus = 3;

/// Solids in general position: turned, and about half as far apart as they are wide.
Pair general(Random& random) {
  const double voxel = 2.0 / random.uniform(40.0, 56.0);
  const std::uint64_t a = random.bits(), b = random.bits();
  const Matrix3d turn = random_turn(random);
  const Vector3d at = random_vector(random, 0.3);
  const double scale = random.uniform(0.6, 1.3);
  const Matrix3d other_turn = scale * random_turn(random);
  return {placed(solid(a), turn, at), placed(solid(b), other_turn, random_vector(random, 0.9)), voxel,
          a % 6 != kGear && b % 6 != kGear};
}

/// Boxes that share a part of a face, on the lattice and off it, turned and not.
Pair touching(Random& random) {
  const bool turns = random.bits() % 2 == 0;
  const double voxel =
      turns ? 1.0 / random.uniform(24.0, 40.0) : std::array{0.1, 0.125, 0.0625, 0.07}[random.bits() % 4];
  const Matrix3d turn = turns ? random_turn(random) : Matrix3d::Identity();
  const Vector3d at = turns ? random_vector(random, 1.0) : Vector3d::Zero();
  return {placed(cuboid({0, 0, 0}, {1, 1, 1}), turn, at),
          placed(cuboid({1, 0.25 * double(random.bits() % 3), 0.5 * double(random.bits() % 2)}, {0.75, 1, 1}),
                 turn, at),
          voxel, true};
}

/// A solid and itself, or two solids that share a part of their surface.
Pair coincident(Random& random) {
  const double voxel = 2.0 / random.uniform(36.0, 48.0);
  const Matrix3d turn = random.bits() % 3 == 0 ? Matrix3d(Matrix3d::Identity()) : random_turn(random);
  const Vector3d at = random_vector(random, 1.0);
  if (random.bits() % 2) {
    const std::uint64_t which = random.bits();
    const PolygonMesh one = placed(solid(which), turn, at);
    return {one, one, voxel, which % 6 != kGear};
  }
  return {placed(cuboid({-1, -1, -1}, {2, 2, 2}), turn, at),
          placed(cuboid({-1, -1, -0.25}, {2, 1.5, 0.75}), turn, at), voxel, true};
}

/// A solid within a ball or a box half as large again.
Pair inside(Random& random) {
  const Vector3d at = random_vector(random, 1.0);
  const std::uint64_t which = random.bits();
  const PolygonMesh small = solid(which % 6 == kTorus || which % 6 == kGear ? kBall : which);
  return {placed(solid(random.bits() % 2), 1.5 * random_turn(random), at),
          placed(small, 0.7 * random_turn(random), at), 2.0 / random.uniform(40.0, 50.0), true};
}

/// Solids in general position, far from the world's zero.
Pair far_away(Random& random) {
  Pair pair = general(random);
  const Vector3d offset = random_vector(random, std::pow(10.0, random.uniform(4.0, 10.0)));
  pair.a = placed(pair.a, Matrix3d::Identity(), offset);
  pair.b = placed(pair.b, Matrix3d::Identity(), offset);
  return pair;
}

/// Plates, and shells between a solid and its like, of a fifth of a voxel to one and a half.
Pair thin(Random& random) {
  const double voxel = 2.0 / random.uniform(12.0, 24.0), thickness = voxel * random.uniform(0.2, 1.5);
  const Vector3d at = random_vector(random, 0.2);
  if (random.bits() % 2) {
    const std::uint64_t which = random.bits();
    const Matrix3d turn = random_turn(random);
    return {placed(solid(which), turn, at), placed(solid(which), (1.0 - thickness) * turn, at), voxel};
  }
  return {placed(cuboid({-1, -1, -0.5 * thickness}, {2, 2, thickness}), random_turn(random), at),
          turned_solid(random, at), voxel};
}

/// Polygons that overlap, are duplicated, flipped or open, or enclose no solid at all.
Pair dirty(Random& random) {
  RunContext context;
  const double voxel = 3.0 / random.uniform(12.0, 30.0);
  const auto one = [&] {
    const double seed = double(random.bits() % 1000);
    switch (random.bits() % 3) {
      case 0:
        return make_recipe(
            "sphere-cluster",
            {{"spheres", 4.0}, {"cuts", 4.0}, {"copies", 2.0}, {"turned", 1.0}, {"seed", seed}}, context);
      case 1:
        return make_recipe("holed-sphere", {{"open", 1.0}, {"hole", 0.2}, {"around", 48.0}}, context);
      default: {
        MeshFile soup;
        for (std::uint32_t i = 0; i < 60; ++i) {
          const Vector3d middle = random_vector(random, 0.8);
          for (int corner = 0; corner < 3; ++corner)
            soup.points.push_back(middle + random_vector(random, 0.6));
          soup.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
        }
        return to_polygon_mesh(soup);
      }
    }
  };
  const PolygonMesh a = one();
  return {a, placed(one(), random_turn(random), random_vector(random, 0.7)), voxel};
}

/// A solid of a few voxels next to, inside and across a large one.
Pair sizes(Random& random) {
  const double voxel = 2.0 / random.uniform(24.0, 40.0);
  const Vector3d at = random_vector(random, 0.2), of_other = random_vector(random, 1.1);
  const double scale = voxel * random.uniform(0.6, 3.0);
  return {turned_solid(random, at), turned_solid(random, of_other, scale), voxel};
}

struct Counts {
  int written = 0, empty = 0, refused = 0;
  double worst_sum = 0.0;  ///< relative error of the volumes' sums
};

class Pairs {
 public:
  explicit Pairs(const Pair& pair, std::map<std::string, std::string> options)
      : pair_(pair),
        lattice_(shared_lattice(pair.a, pair.b, pair.voxel_size)),
        options_(std::move(options)) {}

  PolygonMesh contour(Boolean boolean) { return contour(boolean, sampled(pair_.a), sampled(pair_.b)); }

  void check(Counts& counts) {
    std::optional<SampledSolid> a, b;
    try {
      a = sampled(pair_.a);
      b = sampled(pair_.b);
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("no inside"), std::string::npos) << error.what();
      ++counts.refused;
      return;
    }
    const double both = judged(Boolean::unite, *a, *b, counts),
                 common = judged(Boolean::intersect, *a, *b, counts);
    const double without_b = judged(Boolean::subtract, *a, *b, counts),
                 without_a = judged(Boolean::subtract, *b, *a, counts);
    if (!pair_.adds_up) return;
    const double of_a = volume(pair_.a), of_b = volume(pair_.b);
    const auto expect_sum = [&](double parts, double whole) {
      EXPECT_NEAR(parts, whole, 1e-3 * whole);
      counts.worst_sum = std::max(counts.worst_sum, std::abs(parts - whole) / whole);
    };
    expect_sum(both + common, of_a + of_b);
    expect_sum(without_b + common, of_a);
    expect_sum(without_a + common, of_b);
  }

 private:
  SampledSolid sampled(const PolygonMesh& mesh) {
    return sample_solid(mesh, lattice_, [&](const PolygonMesh& framed) {
      const LevelSet level_set = test_methods::voxelized(framed, lattice_.voxel_size, context_);
      return solid_of(framed, level_set, ThinRule::drop, context_).solid;
    });
  }
  PolygonMesh contour(Boolean boolean, const SampledSolid& a, const SampledSolid& b) {
    const CombinedSolid result = combine(boolean, a, b, context_);
    if (result.hermite.leaves.empty()) return {};
    return extract(result.level_set, nullptr,
                   {.chosen = choose(our_extractors(), "manifold-dual-contouring", options_),
                    .hermite = &result.hermite},
                   context_)
        .mesh;
  }
  double judged(Boolean boolean, const SampledSolid& a, const SampledSolid& b, Counts& counts) {
    const PolygonMesh mesh = contour(boolean, a, b);
    if (boolean != Boolean::subtract) {
      EXPECT_EQ(mesh, contour(boolean, b, a)) << "depends on which comes first";
    }
    ++(mesh.empty() ? counts.empty : counts.written);
    if (mesh.empty()) return 0.0;
    return test_methods::expect_guarantees({true, true, true, true}, to_mesh_file(mesh), context_).volume;
  }
  double volume(const PolygonMesh& mesh) {
    return validation::check_mesh(to_mesh_file(mesh), kCounts, context_).volume;
  }

  const Pair pair_;
  const SharedLattice lattice_;
  const GivenOptions options_;
  RunContext context_;
};

struct Kind {
  const char* name;
  Pair (*make)(Random&);
};
constexpr Kind kKinds[] = {{"general", general}, {"touching", touching}, {"coincident", coincident},
                           {"inside", inside},   {"far away", far_away}, {"thin", thin},
                           {"dirty", dirty},     {"sizes", sizes}};

void check_pairs(std::uint64_t seed, int of_each_kind) {
  for (const Kind& kind : kKinds) {
    Counts counts;
    for (int i = 0; i < of_each_kind; ++i) {
      SCOPED_TRACE(std::string(kind.name) + " " + std::to_string(i));
      Random random(double(seed + std::uint64_t(i)));
      const Pair pair = kind.make(random);
      // Two extractors' worth of code: the uniform mesh, and merges of its points.
      Pairs(pair, i % 2 ? std::map<std::string, std::string>{{"tolerance", "0"}}
                        : std::map<std::string, std::string>{})
          .check(counts);
    }
    EXPECT_GE(counts.written, 2 * of_each_kind) << kind.name << ": too few results to tell anything";
    testing::Test::RecordProperty(
        kind.name, std::to_string(counts.written) + " written, " + std::to_string(counts.empty) + " empty, " +
                       std::to_string(counts.refused) + " refused, sums of volumes off by " +
                       std::to_string(counts.worst_sum) + " at most");
  }
}

/// The mesh's mean distance to the circle in which a ball of radius 1 about zero meets the plane z = 0.31,
/// rotated.
double mean_distance_to_circle(const PolygonMesh& mesh, const Matrix3d& turn) {
  const validation::TriangleTree tree{validation::TriangleSoup(to_mesh_file(mesh))};
  const double radius = std::sqrt(1.0 - 0.31 * 0.31);
  double sum = 0.0;
  constexpr int kPoints = 1000;
  for (int i = 0; i < kPoints; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kPoints;
    sum += std::sqrt(
        tree.closest(turn * Vector3d(radius * std::cos(angle), radius * std::sin(angle), 0.31)).squared);
  }
  return sum / kPoints;
}

TEST(CombineSolids, TheCurveWhereTheSurfacesMeetIsSharp) {
  RunContext context;
  Random random(5);
  const Matrix3d turn = random_turn(random);
  const PolygonMesh ball = placed(make_recipe("uv-sphere", {{"around", 256.0}, {"upward", 128.0}}, context),
                                  turn, Vector3d::Zero());
  const PolygonMesh box = placed(cuboid({-2, -2, 0.31}, {4, 4, 1.5}), turn, Vector3d::Zero());
  constexpr double kVoxel = 0.05;
  // In voxels: of the uniform mesh, and of that whose points were merged within 0.1 voxels.
  for (const auto& [tolerance, most] : {std::pair("0", 0.02), std::pair("0.1", 0.03)}) {
    Pairs pairs({ball, box, kVoxel}, {{"tolerance", tolerance}});
    for (const Boolean boolean : {Boolean::unite, Boolean::intersect, Boolean::subtract}) {
      const double distance = mean_distance_to_circle(pairs.contour(boolean), turn) / kVoxel;
      EXPECT_LE(distance, most) << tolerance << ", " << int(boolean);
      RecordProperty(std::string("voxels_") + tolerance + "_" + std::to_string(int(boolean)),
                     std::to_string(distance));
    }
  }
}

TEST(CombineSolids, ResultsAreWatertightAddUpAndCommute) { check_pairs(1, 1); }

TEST(Slow, ResultsOf430PairsAreWatertightAddUpAndCommute) { check_pairs(1000, 54); }

}  // namespace combine_test
}  // namespace hermesh
