// hermesh import --labels, and extract of label maps.
#include <algorithm>

#include "algorithms/io/import/files_for_tests.h"
#include "algorithms/io/mesh_file.h"
#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace cli_labels_test {

using Json = nlohmann::json;

class LabelsTest : public ProgramTest {
 protected:
  void expect_refusal(int exit_code, const Words& arguments, const Words& words) {
    ProgramTest::expect_refusal(exit_code, arguments, words, true);
  }
  /// Three labels side by side, each of 7 x 8 x 8 samples of 1 x 1 x 2 mm.
  static NiftiBytes boxes(std::int32_t first = 1, std::int32_t second = 2, std::int32_t third = 3) {
    std::vector<std::int32_t> values;
    for (int z = 0; z < 12; ++z)
      for (int y = 0; y < 12; ++y)
        for (int x = 0; x < 25; ++x)
          values.push_back(x < 2 || x >= 23 || y < 2 || y >= 10 || z < 2 || z >= 10 ? 0
                           : x < 9                                                  ? first
                           : x < 16                                                 ? second
                                                                                    : third);
    return NiftiBytes().dims({25, 12, 12}).type(8, 32).put<float>(88, 2.0f).samples(values);
  }
  double volume_of(const std::string& mesh) {
    const Json report = json_of({"validate", mesh, "--json", "--require", "watertight"});
    return report.at("volume").get<double>();
  }
};

TEST_F(LabelsTest, AMeshPerLabelWithTheExactVolumeOfBoxes) {
  write_gzipped(path("seg.nii.gz"), boxes().bytes());
  const Json imported = json_of("import seg.nii.gz seg.vdb --labels --json");
  EXPECT_EQ(imported["result"]["labels"].size(), 3u);
  EXPECT_EQ(imported["result"]["labels"][1]["label"], 2);
  EXPECT_EQ(imported["result"]["labels"][1]["samples"], 448);
  EXPECT_EQ(imported["result"]["highest"], 3);

  const Json made = json_of("extract seg.vdb out.ply --labels all --json");
  const Json& labels = made["result"]["labels"];
  ASSERT_EQ(labels.size(), 3u);
  std::int64_t triangles = 0;
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(labels[i]["label"], i + 1);
    EXPECT_EQ(labels[i]["file"], "out-" + std::to_string(i + 1) + ".ply");
    EXPECT_NEAR(labels[i]["volume"].get<double>(), 896.0, 1e-6);  // voxels of 2 cubic millimetres
    EXPECT_NEAR(volume_of(labels[i]["file"]), 896.0, 1e-3);
    triangles += labels[i]["triangles"].get<std::int64_t>();
  }
  EXPECT_EQ(made["triangles"], triangles);
  EXPECT_EQ(labels[1]["neighbours"].size(), 2u);
  EXPECT_FALSE(files().contains("out.ply"));

  run_to(0, "extract seg.vdb two.ply --label 2");
  EXPECT_TRUE(read("two.ply") == read("out-2.ply"));
  run_to(0, "extract seg.vdb some.obj.gz --labels 1,3");
  EXPECT_TRUE(files().contains("some-1.obj.gz") && files().contains("some-3.obj.gz"));
  EXPECT_FALSE(files().contains("some-2.obj.gz"));
}

TEST_F(LabelsTest, SharedWallsAreOneMeshWithLabelsOnBothSides) {
  write_bytes(path("seg.nii"), boxes(7, 2147483647, 7).bytes());
  run_to(0, "import seg.nii seg.vdb --labels");
  const Json made = json_of("extract seg.vdb walls.ply --labels all --shared-walls --json");
  EXPECT_EQ(made["result"]["labels"].size(), 2u);
  RunContext context;
  const MeshFile mesh = read_mesh_file(path("walls.ply"), context, {.attributes = true});
  EXPECT_EQ(made["triangles"], mesh.triangles.size());
  std::set<std::pair<std::int32_t, std::int32_t>> sides;
  const std::vector<std::int32_t>*behind = nullptr, *front = nullptr;
  for (const MeshAttribute& attribute : mesh.attributes) {
    if (attribute.name == "label") behind = &std::get<std::vector<std::int32_t>>(attribute.values);
    if (attribute.name == "neighbour") front = &std::get<std::vector<std::int32_t>>(attribute.values);
  }
  ASSERT_TRUE(behind && front);
  for (std::size_t t = 0; t < behind->size(); ++t) sides.emplace((*behind)[t], (*front)[t]);
  EXPECT_TRUE(sides.contains({7, 0}) && sides.contains({2147483647, 0}));
  EXPECT_TRUE(sides.contains({7, 2147483647}) || sides.contains({2147483647, 7}));
}

TEST_F(LabelsTest, BadInputIsRefusedInASentence) {
  write_bytes(path("seg.nii"), boxes().bytes());
  write_bytes(path("half.nii"),
              NiftiBytes().dims({3, 1, 1}).type(16, 32).samples<float>({0.0f, 1.5f, 2.0f}).bytes());
  write_bytes(path("minus.nii"),
              NiftiBytes().dims({3, 1, 1}).type(4, 16).samples<std::int16_t>({0, -1, 2}).bytes());
  write_bytes(path("none.nii"),
              NiftiBytes().dims({2, 1, 1}).type(4, 16).samples<std::int16_t>({0, 0}).bytes());
  expect_refusal(1, "import half.nii out.vdb --labels", "half.nii 1.5 label");
  expect_refusal(1, "import minus.nii out.vdb --labels", "minus.nii -1 label");
  expect_refusal(1, "import none.nii out.vdb --labels", {"none.nii", "no label"});
  run_to(0, "import half.nii half.vdb");
  expect_refusal(1, "extract half.vdb out.ply --labels all", "half.vdb 1.5 label");
  run_to(0, "import seg.nii seg.vdb --labels");
  expect_refusal(1, "extract seg.vdb out.ply --label 9", {"seg.vdb", "no label 9", "1, 2, 3"});
  expect_refusal(2, "extract seg.vdb out.ply --label 0", "--label");
  expect_refusal(2, "extract seg.vdb out.ply --label 1 --labels all", "--label --labels");
  expect_refusal(2, "extract seg.vdb out.ply --labels some", {"--labels", "some"});
  expect_refusal(2, "extract seg.vdb out.obj --labels all --shared-walls", {"out.obj", "only .ply"});
  expect_refusal(2, "extract seg.vdb out.ply --labels 1,2 --shared-walls", "--shared-walls");
  expect_refusal(2, "extract seg.vdb out.ply --shared-walls", "--shared-walls --labels");
  expect_refusal(2, "extract seg.vdb out.ply --labels all --smoothing 0.7", "--smoothing");
  expect_refusal(2, "extract seg.vdb out.ply --labels all --isovalue 0.5", "--isovalue");
}

TEST_F(LabelsTest, ALabelMapThatIsImportedAsAScalarVolumeIsNoted) {
  write_bytes(path("seg.nii"), boxes().bytes());
  EXPECT_PRED2(has, run_to(0, "import seg.nii scalar.vdb").err, "--labels");
  // Its labels can be extracted all the same.
  EXPECT_EQ(json_of("extract scalar.vdb out.ply --labels all --json")["result"]["labels"].size(), 3u);
  run_to(0, "import seg.nii seg.vdb --labels");
  EXPECT_PRED2(has, run("extract seg.vdb iso.ply --isovalue 0.5").err, "--labels");
}

}  // namespace cli_labels_test
}  // namespace hermesh::cli
