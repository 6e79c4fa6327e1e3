#include "experiments/pipeline.h"

#include <gtest/gtest.h>

#include "algorithms/variants.h"
#include "experiments/cases/recipes.h"
#include "experiments/cases/test_volumes.h"

namespace hermesh {
namespace pipeline_test {

using validation::MeshReport;
using Sentences = std::vector<std::string>;

TEST(PromiseCheck, AMeshThatIsInsideOutIsNotOriented) {
  MeshReport report;
  report.volume = -1.0;
  EXPECT_EQ(check_promises({.oriented = true}, report).broken,
            (std::vector<std::string>{"oriented (inside out, the volume is negative)"}));
  EXPECT_TRUE(check_promises({.closed = true}, report).broken.empty());
  report.volume = 1.0;
  EXPECT_TRUE(check_promises({.oriented = true}, report).broken.empty());
  report.inside_out_components = 1;  // of several
  EXPECT_EQ(check_promises({.oriented = true, .no_self_intersection = true}, report).broken.size(), 1u);
  // Where components may intersect each other or themselves, only the whole counts.
  EXPECT_TRUE(check_promises({.oriented = true}, report).broken.empty());
}

TEST(PromiseCheck, NamesWhatIsBrokenAndWhatNobodyLookedAt) {
  const Promises all{true, true, true, true};
  MeshReport good;
  EXPECT_TRUE(check_promises(all, good).broken.empty());
  EXPECT_EQ(check_promises(all, good).unchecked, (std::vector<std::string>{"no self-intersection"}));

  MeshReport bad;
  bad.boundary_edges = 5;
  bad.non_manifold_vertices = 2;
  bad.inconsistent_edges = 1;
  bad.self_intersections.emplace().pairs = 7;
  const PromiseCheck check = check_promises(all, bad);
  EXPECT_EQ(check.broken, (std::vector<std::string>{
                              "closed (5 boundary edges)", "manifold (0 edges and 2 vertices are not)",
                              "oriented (1 inconsistent edges)", "no self-intersection (7 pairs)"}));
  EXPECT_TRUE(check.unchecked.empty());
  EXPECT_EQ(promise_letters(all, check), "cmoi BROKEN");
  EXPECT_EQ(promise_letters(all, check_promises(all, good)), "cmoi unchecked");
  EXPECT_EQ(promise_letters({.manifold = true}, {}), "m kept");
  EXPECT_EQ(promise_letters({}, {}), "none");
  EXPECT_EQ(promise_verdict({.closed = true, .oriented = true}, {}), "promises closed, oriented: kept");
  EXPECT_EQ(promise_verdict({.closed = true}, check_promises({.closed = true}, bad)),
            "BROKEN: closed (5 boundary edges)");
  EXPECT_TRUE(check_promises({}, bad).broken.empty());
  EXPECT_EQ(check_promises({.manifold = true}, bad).broken.size(), 1u);
}

TEST(PromiseCheck, PolygonsWithoutAreaOrGivenTwiceMeet) {
  MeshReport report;
  report.self_intersections.emplace();
  report.degenerate_polygons = 2;
  report.duplicate_polygons = 1;
  EXPECT_EQ(check_promises({.no_self_intersection = true}, report).broken,
            Sentences{"no self-intersection (2 degenerate and 1 duplicate polygons)"});
  EXPECT_TRUE(check_promises({.closed = true, .manifold = true, .oriented = true}, report).broken.empty());
}

TEST(PromiseCheck, ACutExcusesTheBoundaryAndWhereItTouchesItself) {
  MeshReport report;
  report.boundary_edges = 5;
  report.non_manifold_vertices = 1;
  const Promises promises{.closed = true, .manifold = true};
  EXPECT_EQ(check_promises(promises, report).broken.size(), 2u);
  EXPECT_TRUE(check_promises(promises, report, {.cut_open = true}).broken.empty());
  report.non_manifold_edges = 1;
  EXPECT_EQ(check_promises(promises, report, {.cut_open = true}).broken,
            Sentences{"manifold (1 edges and 0 vertices are not)"});
}

TEST(PromiseCheck, WhatEnclosesTheOutsideHasANegativeVolume) {
  MeshReport report;
  report.volume = -1.0;
  EXPECT_TRUE(check_promises({.oriented = true}, report, {.encloses_the_outside = true}).broken.empty());
}

TEST(PromiseCheck, ABoundIsInVoxelsAndBothWays) {
  MeshReport uniform, report;
  report.certified_from_reference = {.lower = 0.0, .upper = 0.19};
  report.certified_to_reference = {.lower = 0.0, .upper = 0.19};
  const Circumstances circumstances{.bound = Circumstances::Bound{0.1, 2.0, &uniform}};
  EXPECT_TRUE(check_promises({}, report, circumstances).broken.empty());
  // Only 0.005 voxel for the proof and 0.001 for the validator are added.
  report.certified_to_reference->upper = 2.0 * (0.1 + 0.006);
  EXPECT_TRUE(check_promises({}, report, circumstances).broken.empty());
  report.certified_to_reference->upper = 2.0 * (0.1 + 0.0065);
  EXPECT_EQ(check_promises({}, report, circumstances).broken.size(), 1u);
  report.certified_to_reference->upper = 0.3;
  EXPECT_EQ(check_promises({}, report, circumstances).broken,
            Sentences{"tolerance (up to 0.150000 voxels to the uniform mesh)"});
  report.components = 2;
  EXPECT_EQ(check_promises({}, report, circumstances).broken.size(), 2u);
}

TEST(Pipeline, GoesFromPolygonsToAJudgedFile) {
  RunContext context;
  const Job job{.source = {.load = [](RunContext& inner) { return make_recipe("torus", {}, inner); }},
                .voxelize = {.chosen = choose(our_voxelizers(), "hermesh"), .resolution = 30},
                .extract = {.chosen = choose(our_extractors(), "manifold-dual-contouring")},
                .format = ".stl",
                .judge = kPromisesAlone};
  const Outcome outcome = run(job, context);
  EXPECT_GT(outcome.polygons.points.size(), 0u);
  EXPECT_NEAR(outcome.volume.voxel_size(), bounds(outcome.polygons).size().maxCoeff() / 30, 1e-12);
  EXPECT_EQ(outcome.written.triangle_count(), outcome.made.mesh.triangle_count());
  EXPECT_EQ(outcome.judgement.report.euler_characteristic, 0);
  EXPECT_TRUE(outcome.judgement.promises.broken.empty());
  EXPECT_TRUE(outcome.judgement.promises.unchecked.empty());
}

TEST(Pipeline, StagesMayBeLeftOut) {
  RunContext context;
  const LevelSet sphere = make_sphere(8.0, 0.5);
  Job job{.source = {.volume = &sphere}, .extract = {.chosen = choose(our_extractors(), "marching-cubes")}};
  EXPECT_TRUE(run(job, context).written.points.empty()) << "nobody asked for a judge";
  job.judge = kCounts;
  EXPECT_EQ(run(job, context).judgement.report.components, 1);
  job.extract.isovalue = 1.6;  // beyond the band there is nothing
  const Outcome nothing = run(job, context);
  EXPECT_TRUE(nothing.made.mesh.empty());
  EXPECT_TRUE(nothing.judgement.promises.broken.empty());
}

TEST(Pipeline, WhatIsCutOpenPromisesNoClosedMesh) {
  RunContext context;
  const LevelSet full = make_volume({6, 6, 6}, 1.0f, [](int x, int, int) { return float(x) - 2.5f; });
  Job job{.source = {.volume = &full},
          .extract = {.chosen = choose(our_extractors(), "marching-cubes"), .ends = Ends::open},
          .judge = kCounts};
  const Outcome open = run(job, context);
  EXPECT_GT(open.judgement.report.boundary_edges, 0);
  EXPECT_TRUE(open.judgement.promises.broken.empty());
  job.extract.ends = Ends::closed;
  EXPECT_EQ(run(job, context).judgement.report.boundary_edges, 0);
}

TEST(Pipeline, NamesThatThereAreNotAreRefused) {
  EXPECT_THROW(choose(our_voxelizers(), "unicorn"), Error);
  EXPECT_THROW(choose(our_extractors(), "marching-cubes", {{"horn", "1"}}), Error);
}

}  // namespace pipeline_test
}  // namespace hermesh
