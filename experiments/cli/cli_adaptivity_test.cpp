#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>

#include "algorithms/core/openvdb_trees.h"
#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace cli_adaptivity_test {

class AdaptivityTest : public ProgramTest {
 protected:
  void SetUp() override {
    write_sphere();
    run_to(0, "voxelize sphere.off sphere.vdb --voxel-size 0.05");
  }
  /// Returns the number of points of the mesh from the summary.
  int points(const Words& more) {
    const std::string out = run_to(0, kExtract + more).out;
    return std::stoi(out.substr(out.find("extracted ") + 10));
  }
  void expect_refused(const Words& more, int exit_code, const std::string& words) {
    expect_refusal(exit_code, kExtract + more, {words}, true);
  }
  const Words kExtract = "extract sphere.vdb out.ply --extractor adaptive-dual-contouring";
};

TEST_F(AdaptivityTest, AFrustumLimitsTheBound) {
  const Words half = {"-o", "threshold=0.001", "--frustum", "0,0,3 0,0,0 60 1 0.1 3"};
  const auto with = [&](const char* outside) { return points(half + Words{"--outside", outside}); };
  const int everywhere = with("everywhere"), simplified = with("simplify"), nothing = with("nothing");
  EXPECT_EQ(everywhere, points("-o threshold=0.001"));
  EXPECT_EQ(simplified, points(half));
  EXPECT_LT(simplified, everywhere);
  EXPECT_LT(nothing, simplified);
  EXPECT_GT(nothing, everywhere / 4);
}

TEST_F(AdaptivityTest, AMaskFromAFile) {
  EXPECT_GT(points("--mask sphere.vdb --outside nothing"), 0);
  run_to(0,
         "remesh sphere.off out.obj --voxel-size 0.1 --extractor adaptive-dual-contouring --mask sphere.vdb");
}

TEST_F(AdaptivityTest, AMaskWithPerspectiveIsRefusedWhereItIsLookedAt) {
  openvdb::initialize();
  const auto grid = openvdb::FloatGrid::create(1.0f);
  grid->setTransform(openvdb::math::Transform::createFrustumTransform(
      openvdb::BBoxd(openvdb::Vec3d(0), openvdb::Vec3d(10)), /*taper=*/0.5, /*depth=*/1.0, /*voxelDim=*/0.1));
  grid->tree().setValue(openvdb::Coord(1, 2, 3), -1.0f);
  openvdb::io::File(path("perspective.vdb").string()).write({grid});
  expect_refused("--mask perspective.vdb", 1, "perspective.vdb'");
  EXPECT_EQ(points("--mask perspective.vdb --outside everywhere"), points({}));
}

TEST_F(AdaptivityTest, AnImportedToleranceGridMayHoldZeros) {
  // Its background lies just below them.
  write("zero.raw", std::string(8, '\0'));
  run_to(0, "import zero.raw zero.vdb --dims 2,2,2 --type uint8 --spacing 1,1,1");
  EXPECT_GT(points("-o threshold=1 --tolerance-grid zero.vdb"), points("-o threshold=1"));
}

TEST_F(AdaptivityTest, BadInputIsSaidInASentence) {
  expect_refused("--mask missing.vdb", 1, "missing.vdb");
  expect_refused("--tolerance-grid sphere.vdb", 1, "sphere.vdb'");
  expect_refused({"--mask", ""}, 2, "--mask was given an empty value");
  expect_refused("--outside nothing", 2, "needs --mask or --frustum");
  expect_refused({"--frustum", "0,0,3 0,0,0 60 1 0.1"}, 2, "it must be");
  expect_refused({"--frustum", "0,0,3 0;0;0 60 1 0.1 9"}, 2, "three numbers");
  expect_refused({"--frustum", "0,0,3 0,0,0 x 1 0.1 9"}, 2, "not a number");
  expect_refused({"--frustum", "0,0,3 0,0,0 190 1 0.1 9"}, 2, "--frustum");
  expect_refused({"--frustum", "0,0,3 0,0,0 60 1 0.1 9", "--mask", "sphere.vdb"}, 2, "--mask");
  expect_refused({"--frustum", "50,0,3 60,0,0 20 1 0.1 9", "--outside", "nothing"}, 1, "the mask");
  run_to(2, "extract sphere.vdb out.ply --extractor marching-cubes --mask sphere.vdb");
}

}  // namespace cli_adaptivity_test
}  // namespace hermesh::cli
