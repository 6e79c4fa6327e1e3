// Requirements of every extractor, including new ones: its guarantees on awkward volumes, the same bytes at
// any number of threads, and defined results for empty, full and invalid volumes.
#include <tbb/global_control.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <random>

#include "algorithms/lattice/leaf_table.h"
#include "experiments/cases/test_volumes.h"
#include "experiments/promises/methods_for_tests.h"

namespace hermesh {
namespace conformance_test {

PolygonMesh extract(const Extractor& extractor, const LevelSet& volume, double isovalue = 0.0,
                    const GivenOptions& given = {}) {
  RunContext context;
  const Options options(extractor.name, extractor.options, given);
  return hermesh::extract(volume, nullptr, {.chosen = {extractor, options}, .isovalue = isovalue}, context)
      .mesh;
}

validation::MeshReport judge_counts(const MeshFile& mesh) {
  RunContext context;
  return validation::check_mesh(mesh, kCounts, context);
}

void expect_promises(const Extractor& extractor, const MeshFile& mesh,
                     const Circumstances& circumstances = {}) {
  if (mesh.triangle_count() == 0) return;
  RunContext context;
  const auto report = test_methods::expect_guarantees(extractor.promises, mesh, context, circumstances);
  // Beyond the guarantees, our manifold meshes have no degenerate polygons.
  if (extractor.promises.manifold) {
    EXPECT_EQ(report.degenerate_polygons + report.duplicate_polygons, 0);
  }
}

LevelSet patterns(int per_axis, int size, const std::function<std::uint32_t(int)>& pattern,
                  std::uint32_t seed) {
  return make_patterns(per_axis, size, pattern, std::mt19937(seed));
}

class Conformance : public testing::TestWithParam<Extractor> {
 protected:
  const Extractor& extractor() const { return GetParam(); }
  void expect_on(const LevelSet& volume, double isovalue = 0.0, const GivenOptions& given = {}) const {
    expect_promises(extractor(), to_mesh_file(extract(extractor(), volume, isovalue, given)),
                    {.encloses_the_outside = volume.background() < isovalue});
  }
  bool proves() const { return test_methods::has_option(extractor(), "tolerance"); }
  /// Expects the guarantees on noise, in which nothing can be merged. Extractors that certify a tolerance
  /// take long there: they make the uniform mesh of the volume of `size`, and an adaptive one of `smaller`.
  void expect_on_noise(int size, int smaller, const std::function<LevelSet(int)>& volume,
                       double isovalue = 0.0) const {
    if (!proves()) return expect_on(volume(size), isovalue);
    expect_on(volume(size), isovalue, {{"tolerance", "0"}});
    expect_on(volume(smaller), isovalue);
  }
};

/// Ends the process with 0, or with 1 after a message.
[[noreturn]] void extract_and_exit(const Extractor& extractor, const LevelSet& volume) {
  try {
    extract(extractor, volume);
  } catch (const std::exception& error) {
    std::cerr << error.what() << std::endl;
    std::_Exit(1);
  }
  std::_Exit(0);
}

/// Returns volumes in which every kind of block lacks a neighbour.
std::vector<LevelSet> volumes_with_open_ends() {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> value(-1.0f, 1.0f);
  const auto noise = [&](int, int, int) { return value(random); };
  return {patterns(
              7, 2, [](int i) { return static_cast<std::uint32_t>(i % 256); }, 1),
          make_volume({17, 9, 16}, 1.0f, noise), make_volume({16, 17, 9}, -1.0f, noise),
          make_volume({8, 8, 8}, 1.0f, [](int x, int y, int z) { return x * y * z == 343 ? -1.0f : 1.0f; })};
}

/// Returns an extractor that reads samples without checking that their block exists.
Extractor careless_extractor() {
  Extractor careless = find_variant(our_extractors(), "marching-cubes");
  careless.name = "careless";
  careless.extract = [](const ExtractionInput& input) {
    const LeafTable table(input.level_set, input.isovalue, input.context);
    PolygonMesh mesh;
    for (std::size_t leaf = 0; leaf < table.size(); ++leaf) {
      const LatticePlace far = table.locate(leaf, 8, 8, 8);
      mesh.points.emplace_back(table.values(far.block)[far.sample], 0, 0);
    }
    return mesh;
  };
  return careless;
}

void expect_no_signal(const Extractor& extractor) {
  testing::GTEST_FLAG(death_test_style) = "threadsafe";
  int number = 0;
  for (const LevelSet& volume : volumes_with_open_ends()) {
    EXPECT_EXIT(extract_and_exit(extractor, volume), testing::ExitedWithCode(0), "")
        << "the extractor " << extractor.name << " does not get through volume " << number
        << "; it may read where the volume has no leaf (LeafTable::locate)";
    ++number;
  }
}

TEST(MissingBlocks, AreReportedWithoutASignal) {
  testing::GTEST_FLAG(death_test_style) = "threadsafe";
  EXPECT_EXIT(extract_and_exit(careless_extractor(), volumes_with_open_ends()[1]), testing::ExitedWithCode(1),
              "the volume has no leaf");
}

TEST_P(Conformance, EndsWithoutASignal) { expect_no_signal(extractor()); }

TEST_P(Conformance, All256PatternsOfACell) {
  expect_on(patterns(
      7, 2, [](int i) { return static_cast<std::uint32_t>(i % 256); }, 1));
}

TEST_P(Conformance, RandomPatternsOfTwoCellsAnAxis) {
  std::mt19937 random(2);
  expect_on_noise(proves() ? 12 : 20, 5, [&](int per_axis) {
    return patterns(
        per_axis, 3, [&](int) { return static_cast<std::uint32_t>(random()) & ((1u << 27) - 1); }, 3);
  });
}

TEST_P(Conformance, WhiteNoise) {
  std::mt19937 random(4);
  std::uniform_real_distribution<float> value(-1.0f, 1.0f);
  expect_on_noise(40, 14, [&](int n) {
    return make_volume({n, n, n}, 1.0f, [&](int, int, int) { return value(random); });
  });
}

TEST_P(Conformance, WhiteNoiseOnAnInsideBackground) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> value(-1.0f, 1.0f);
  expect_on_noise(30, 15, [&](int n) {
    return make_volume({n, n - 10, n - 5}, -1.0f, [&](int, int, int) { return value(random); });
  });
}

TEST_P(Conformance, IntegersWithAThirdOfTheSamplesAtTheIsovalue) {
  std::mt19937 random(6);
  std::uniform_int_distribution<int> value(-1, 1);
  for (const double isovalue : {0.0, 1.0, -1.0})
    expect_on_noise(
        48, 12,
        [&](int n) {
          return make_volume({n, n, n}, 3.0f,
                             [&](int, int, int) { return static_cast<float>(value(random)); });
        },
        isovalue);
}

TEST_P(Conformance, SphereIsOneComponentOfTheRightVolume) {
  const PolygonMesh mesh = extract(extractor(), make_sphere(20.0, 0.5));
  expect_promises(extractor(), to_mesh_file(mesh));
  const validation::MeshReport report = judge_counts(to_mesh_file(mesh));
  EXPECT_EQ(report.components, 1);
  EXPECT_EQ(report.euler_characteristic, 2);
  const double exact = 4.0 / 3.0 * M_PI * 1000.0;
  EXPECT_NEAR(report.volume, exact, 0.005 * exact);  // positive: counter-clockwise seen from outside
}

TEST_P(Conformance, FarFromTheOriginNothingIsLost) {
  const PolygonMesh near = extract(extractor(), make_sphere(12.0, 0.01));
  const PolygonMesh far = extract(extractor(), make_sphere(12.0, 0.01, {1e6, -1e6, 0.0}));
  ASSERT_EQ(near.points.size(), far.points.size());
  for (std::size_t i = 0; i < near.points.size(); ++i)
    ASSERT_LT((far.world(i) - Eigen::Vector3d(1e6, -1e6, 0.0) - near.world(i)).norm(), 1e-6);
}

TEST_P(Conformance, SameBytesAtAnyThreadCount) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> value(-1.0f, 1.0f);
  const LevelSet volume = make_volume({18, 12, 15}, 1.0f, [&](int, int, int) { return value(random); });
  std::vector<PolygonMesh> meshes;
  for (const int threads : {1, 2, 7}) {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                              static_cast<std::size_t>(threads));
    meshes.push_back(extract(extractor(), volume));
  }
  EXPECT_FALSE(meshes[0].empty());
  EXPECT_TRUE(meshes[0] == meshes[1]);
  EXPECT_TRUE(meshes[0] == meshes[2]);
}

TEST_P(Conformance, EmptyAndFullVolumesGiveEmptyMeshes) {
  EXPECT_TRUE(extract(extractor(), make_volume({0, 0, 0}, 1.0f, [](int, int, int) { return 1.0f; })).empty());
  EXPECT_TRUE(extract(extractor(), make_volume({9, 9, 9}, 1.0f, [](int, int, int) { return 1.0f; })).empty());
  EXPECT_TRUE(
      extract(extractor(), make_volume({9, 9, 9}, -1.0f, [](int, int, int) { return -1.0f; })).empty());
}

TEST_P(Conformance, OneVoxelInsideIsOneClosedComponent) {
  // At a block's first and last sample, so that the cells around it lie in blocks that do not exist.
  for (const int at : {0, 7, 8, 15}) {
    const PolygonMesh mesh = extract(extractor(), make_volume({16, 16, 16}, 1.0f, [&](int x, int y, int z) {
                                       return x == at && y == at && z == at ? -1.0f : 1.0f;
                                     }));
    expect_promises(extractor(), to_mesh_file(mesh));
    const validation::MeshReport report = judge_counts(to_mesh_file(mesh));
    EXPECT_EQ(report.components, 1);
    EXPECT_EQ(report.euler_characteristic, 2);
    EXPECT_GT(report.volume, 0.0);
  }
}

TEST_P(Conformance, ValuesThatAreNotFiniteAreRefused) {
  for (const float bad : {std::nanf(""), INFINITY}) {
    const LevelSet volume = make_volume(
        {9, 9, 9}, 1.0f, [&](int x, int, int) { return x == 4 ? bad : static_cast<float>(x - 5); });
    EXPECT_THROW(extract(extractor(), volume), Error);
  }
}

TEST_P(Conformance, CancelsAtOnce) {
  const std::atomic<bool> cancel{true};
  RunContext context;
  context.cancel = &cancel;
  const Options options(extractor().name, extractor().options, {});
  const LevelSet sphere = make_sphere(20.0, 1.0);
  EXPECT_THROW(extractor().extract({.level_set = sphere, .options = options, .context = context}), Cancelled);
}

TEST_P(Conformance, PromisesHoldAfterARoundTripThroughStl) {
  std::mt19937 random(8);
  std::uniform_int_distribution<int> value(-1, 1);
  const LevelSet volume =
      make_volume({16, 16, 16}, 3.0f, [&](int, int, int) { return static_cast<float>(value(random)); });
  RunContext context;
  const PolygonMesh mesh = extract(extractor(), volume);
  const MeshFile back = as_written(mesh, ".stl", context);
  EXPECT_EQ(back.triangle_count(), mesh.triangle_count());
  expect_promises(extractor(), back);
}

INSTANTIATE_TEST_SUITE_P(Ours, Conformance,
                         testing::ValuesIn(our_extractors().begin(), our_extractors().end()),
                         test_methods::test_name);

/// The whole million of random sign patterns, a tenth of which every run of the tests does.
TEST(Slow, MarchingCubesOnAMillionRandomPatterns) {
  const Extractor& extractor = find_variant(our_extractors(), "marching-cubes");
  std::mt19937 random(9);
  for (int batch = 0; batch < 16; ++batch)
    expect_promises(
        extractor,
        to_mesh_file(
            extract(extractor,
                    patterns(
                        40, 3, [&](int) { return static_cast<std::uint32_t>(random()) & ((1u << 27) - 1); },
                        100 + batch))));
}

}  // namespace conformance_test
}  // namespace hermesh
