#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>

#include "algorithms/core/openvdb_trees.h"
#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace {

class AdaptivityTest : public ProgramTest {
 protected:
  void SetUp() override {
    write_sphere();
    ASSERT_EQ(run({"voxelize", "sphere.off", "sphere.vdb", "--voxel-size", "0.05"}).exit_code, 0);
  }
  Outcome extract(std::vector<std::string> more, const std::string& extractor = "adaptive-dual-contouring") {
    std::vector<std::string> words = {"extract", "sphere.vdb", "out.ply", "--extractor", extractor};
    words.insert(words.end(), more.begin(), more.end());
    return run(words);
  }
  /// Number of points of the mesh, as the summary tells it.
  int points(const std::vector<std::string>& more) {
    const Outcome outcome = extract(more);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return std::stoi(outcome.out.substr(outcome.out.find("extracted ") + 10));
  }
  void expect_refused(const std::vector<std::string>& more, int exit_code, const std::string& words) {
    const Outcome outcome = extract(more);
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
    EXPECT_FALSE(files().contains("out.ply"));
  }
};

TEST_F(AdaptivityTest, AFrustumLimitsTheBound) {
  const std::vector<std::string> half = {"-o", "threshold=0.001", "--frustum", "0,0,3 0,0,0 60 1 0.1 3"};
  const auto with = [&](const char* outside) {
    std::vector<std::string> words = half;
    words.insert(words.end(), {"--outside", outside});
    return points(words);
  };
  const int everywhere = with("everywhere"), simplified = with("simplify"), nothing = with("nothing");
  EXPECT_EQ(everywhere, points({"-o", "threshold=0.001"}));
  EXPECT_EQ(simplified, points(half));
  EXPECT_LT(simplified, everywhere);
  EXPECT_LT(nothing, simplified);
  EXPECT_GT(nothing, everywhere / 4);
}

TEST_F(AdaptivityTest, AMaskFromAFile) {
  EXPECT_GT(points({"--mask", "sphere.vdb", "--outside", "nothing"}), 0);
  EXPECT_EQ(run({"remesh", "sphere.off", "out.obj", "--voxel-size", "0.1", "--extractor",
                 "adaptive-dual-contouring", "--mask", "sphere.vdb"})
                .exit_code,
            0);
}

TEST_F(AdaptivityTest, AMaskWithPerspectiveIsRefusedWhereItIsLookedAt) {
  openvdb::initialize();
  const auto grid = openvdb::FloatGrid::create(1.0f);
  grid->setTransform(openvdb::math::Transform::createFrustumTransform(
      openvdb::BBoxd(openvdb::Vec3d(0), openvdb::Vec3d(10)), /*taper=*/0.5, /*depth=*/1.0, /*voxelDim=*/0.1));
  grid->tree().setValue(openvdb::Coord(1, 2, 3), -1.0f);
  openvdb::io::File(path("perspective.vdb").string()).write({grid});
  expect_refused({"--mask", "perspective.vdb"}, 1,
                 "perspective.vdb': the mask has a transform with perspective");
  EXPECT_EQ(points({"--mask", "perspective.vdb", "--outside", "everywhere"}), points({}));
}

TEST_F(AdaptivityTest, AnImportedToleranceGridMayHoldZeros) {
  // Its background lies just below them.
  write("zero.raw", std::string(8, '\0'));
  ASSERT_EQ(
      run({"import", "zero.raw", "zero.vdb", "--dims", "2,2,2", "--type", "uint8", "--spacing", "1,1,1"})
          .exit_code,
      0);
  EXPECT_GT(points({"-o", "threshold=1", "--tolerance-grid", "zero.vdb"}), points({"-o", "threshold=1"}));
}

TEST_F(AdaptivityTest, BadInputIsSaidInASentence) {
  expect_refused({"--mask", "missing.vdb"}, 1, "does not exist");
  expect_refused({"--tolerance-grid", "sphere.vdb"}, 1,
                 "sphere.vdb': the scale of the tolerance is negative or not finite");
  expect_refused({"--mask", ""}, 2, "--mask was given an empty value");
  expect_refused({"--outside", "nothing"}, 2, "needs --mask or --frustum");
  expect_refused({"--frustum", "0,0,3 0,0,0 60 1 0.1"}, 2, "it must be");
  expect_refused({"--frustum", "0,0,3 0;0;0 60 1 0.1 9"}, 2, "three numbers");
  expect_refused({"--frustum", "0,0,3 0,0,0 x 1 0.1 9"}, 2, "not a number");
  expect_refused({"--frustum", "0,0,3 0,0,0 190 1 0.1 9"}, 2, "between 0 and 180");
  expect_refused({"--frustum", "0,0,3 0,0,0 60 1 0.1 9", "--mask", "sphere.vdb"}, 2, "--mask");
  expect_refused({"--frustum", "50,0,3 60,0,0 20 1 0.1 9", "--outside", "nothing"}, 1,
                 "no surface inside the mask");
  EXPECT_EQ(extract({"--mask", "sphere.vdb"}, "marching-cubes").exit_code, 2);
}

}  // namespace
}  // namespace hermesh::cli
