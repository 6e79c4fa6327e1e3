#include <gtest/gtest.h>

#include "algorithms/io/scenes/scene_files_for_tests.h"
#include "algorithms/io/test_mesh_files.h"

namespace hermesh {
namespace gltf_file_test {

using Eigen::Vector3d;
using Points = std::vector<Vector3d>;
using Triangles = std::vector<Triangle>;

/// A scene of one mesh in parts that a test replaces one by one. As it is, the triangle (0,0,0) (1,0,0)
/// (0,2,0).
struct Gltf {
  std::string head = R"("asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}])";
  std::string nodes = R"([{"mesh":0}])";
  std::string primitives = R"([{"attributes":{"POSITION":0},"indices":1}])";
  std::string accessors = R"([{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},)"
                          R"({"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}])";
  std::string views = R"([{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}])";
  std::string buffers = R"([{"byteLength":44}])";
  std::string binary = raw_list<float>({0, 0, 0, 1, 0, 0, 0, 2, 0}) + raw_list<std::uint16_t>({0, 1, 2, 0});

  std::string json() const {
    return "{" + head + ",\"nodes\":" + nodes + ",\"meshes\":[{\"primitives\":" + primitives +
           "}],\"accessors\":" + accessors + ",\"bufferViews\":" + views + ",\"buffers\":" + buffers + "}";
  }
  std::string glb() const { return glb_of(json(), binary); }
};

class GltfFileTest : public MeshFileTest {
 protected:
  MeshFile read(const Gltf& gltf) { return MeshFileTest::read("a.glb", gltf.glb()); }
  std::string error_of(const Gltf& gltf) { return MeshFileTest::error_of("a.glb", gltf.glb()); }
  /// A scene without indices whose points are whole numbers of a primitive in this mode: 0 1 2 … along x,
  /// squares along y.
  Gltf row_of_points(std::size_t count, int mode) {
    Gltf gltf;
    gltf.binary.clear();
    for (std::size_t i = 0; i < count; ++i) gltf.binary += raw_list<float>({float(i), float(i * i), 0});
    const std::string bytes = std::to_string(12 * count);
    gltf.primitives = R"([{"attributes":{"POSITION":0},"mode":)" + std::to_string(mode) + "}]";
    gltf.accessors =
        R"([{"bufferView":0,"componentType":5126,"count":)" + std::to_string(count) + R"(,"type":"VEC3"}])";
    gltf.views = R"([{"buffer":0,"byteLength":)" + bytes + "}]";
    gltf.buffers = R"([{"byteLength":)" + bytes + "}]";
    return gltf;
  }
};

TEST_F(GltfFileTest, ReadsPointsAndTriangles) {
  const MeshFile mesh = read(Gltf());
  EXPECT_EQ(mesh.points, (Points{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}}));
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}}));
  EXPECT_TRUE(context.notes.empty());
}

TEST_F(GltfFileTest, NodesPlaceTheirMeshesByTheWholeHierarchy) {
  Gltf gltf;
  // The child scales by 2 3 4, turns a quarter about z, and moves by 10; the parent moves by 100 along y.
  gltf.nodes = R"([{"translation":[0,100,0],"children":[1]},)"
               R"({"mesh":0,"translation":[10,0,0],"rotation":[0,0,0.5,0.5],"scale":[2,3,4]}])";
  const MeshFile mesh = read(gltf);
  // (1,0,0) → (2,0,0) → (0,2,0) → (10,102,0); (0,2,0) → (0,6,0) → (−6,0,0) → (4,100,0).
  ASSERT_EQ(mesh.points.size(), 3u);
  EXPECT_LT((mesh.points[0] - Vector3d(10, 100, 0)).norm(), 1e-12);
  EXPECT_LT((mesh.points[1] - Vector3d(10, 102, 0)).norm(), 1e-12);
  EXPECT_LT((mesh.points[2] - Vector3d(4, 100, 0)).norm(), 1e-12);
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}}));
}

TEST_F(GltfFileTest, AMirrorTurnsTrianglesRound) {
  Gltf gltf;
  gltf.nodes = R"([{"mesh":0,"matrix":[-1,0,0,0, 0,1,0,0, 0,0,1,0, 5,6,7,1]}])";
  const MeshFile mesh = read(gltf);
  EXPECT_EQ(mesh.points, (Points{{5, 6, 7}, {4, 6, 7}, {5, 8, 7}}));
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 2, 1}}));
  // Two mirrors are none.
  gltf.nodes = R"([{"scale":[1,-1,1],"children":[1]},{"mesh":0,"scale":[-1,1,1]}])";
  EXPECT_EQ(read(gltf).triangles, (Triangles{{0, 1, 2}}));
}

TEST_F(GltfFileTest, AMeshStandsWhereverANodeShowsIt) {
  Gltf gltf;
  gltf.head = R"("asset":{"version":"2.0"},"scenes":[{"nodes":[0,1]}])";
  gltf.nodes = R"([{"mesh":0},{"mesh":0,"translation":[0,0,1]}])";
  const MeshFile mesh = read(gltf);
  EXPECT_EQ(mesh.points.size(), 6u);
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}, {3, 4, 5}}));
  EXPECT_EQ(mesh.points[4], Vector3d(1, 0, 1));
}

TEST_F(GltfFileTest, StripsAndFansKeepTheirOrientation) {
  EXPECT_EQ(read(row_of_points(6, 4)).triangles, (Triangles{{0, 1, 2}, {3, 4, 5}}));
  EXPECT_EQ(read(row_of_points(5, 5)).triangles, (Triangles{{0, 1, 2}, {2, 1, 3}, {2, 3, 4}}));
  EXPECT_EQ(read(row_of_points(5, 6)).triangles, (Triangles{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
}

TEST_F(GltfFileTest, IndicesHaveOneTwoOrFourBytes) {
  Gltf gltf;
  const std::string points = gltf.binary.substr(0, 36);
  const auto expect = [&](const char* type, const std::string& indices) {
    gltf.accessors =
        R"([{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},{"bufferView":1,"componentType":)" +
        std::string(type) + R"(,"count":3,"type":"SCALAR"}])";
    gltf.views = R"([{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":)" +
                 std::to_string(indices.size()) + "}]";
    gltf.buffers = R"([{"byteLength":)" + std::to_string(36 + indices.size()) + "}]";
    gltf.binary = points + indices;
    EXPECT_EQ(read(gltf).triangles, (Triangles{{2, 0, 1}})) << type;
  };
  expect("5121", raw_list<std::uint8_t>({2, 0, 1}));
  expect("5123", raw_list<std::uint16_t>({2, 0, 1}));
  expect("5125", raw_list<std::uint32_t>({2, 0, 1}));
}

TEST_F(GltfFileTest, PointsMayBeWholeNumbersAndInterleaved) {
  Gltf gltf;
  gltf.primitives = R"([{"attributes":{"POSITION":0}}])";
  gltf.views = R"([{"buffer":0,"byteLength":24,"byteStride":8}])";
  gltf.buffers = R"([{"byteLength":24}])";
  gltf.accessors = R"([{"bufferView":0,"componentType":5122,"normalized":true,"count":3,"type":"VEC3"}])";
  gltf.binary = raw_list<std::int16_t>({0, 0, 0, 9, 32767, 0, 0, 9, 0, -32768, 0, 9});
  EXPECT_EQ(read(gltf).points, (Points{{0, 0, 0}, {1, 0, 0}, {0, -1, 0}}));
  gltf.accessors = R"([{"bufferView":0,"componentType":5122,"count":3,"type":"VEC3"}])";
  EXPECT_EQ(read(gltf).points, (Points{{0, 0, 0}, {32767, 0, 0}, {0, -32768, 0}}));
}

TEST_F(GltfFileTest, SparseAccessorsReplaceWhatTheyList) {
  Gltf gltf;
  gltf.accessors = R"([{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","sparse":{"count":1,)"
                   R"("indices":{"bufferView":1,"byteOffset":4,"componentType":5123},)"
                   R"("values":{"bufferView":0,"byteOffset":12}}},)"
                   R"({"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}])";
  // The index at byte 4 is 2, and the value at byte 12 is that of point 1.
  gltf.primitives = R"([{"attributes":{"POSITION":0}}])";
  EXPECT_EQ(read(gltf).points, (Points{{0, 0, 0}, {1, 0, 0}}));
  // Without a view all the other values are 0.
  gltf.accessors = R"([{"componentType":5126,"count":3,"type":"VEC3","sparse":{"count":1,)"
                   R"("indices":{"bufferView":1,"byteOffset":2,"componentType":5121},)"
                   R"("values":{"bufferView":0,"byteOffset":12}}}])";
  EXPECT_EQ(read(gltf).points, (Points{{0, 0, 0}, {1, 0, 0}}));
}

/// A closed tetrahedron, each of whose triangles has three points of its own, as exporters write it for
/// normals.
TEST_F(GltfFileTest, PointsThatSeamsSplitAreOneAgain) {
  Gltf gltf;
  const Points corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  gltf.binary.clear();
  for (const std::size_t i : {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3})
    for (const double x : corners[i]) gltf.binary += raw(i == 0 ? -float(x) : float(x));  // −0 is 0
  gltf.primitives = R"([{"attributes":{"POSITION":0}},{"attributes":{"POSITION":1}}])";
  gltf.accessors = R"([{"bufferView":0,"componentType":5126,"count":9,"type":"VEC3"},)"
                   R"({"bufferView":0,"byteOffset":108,"componentType":5126,"count":3,"type":"VEC3"}])";
  gltf.views = R"([{"buffer":0,"byteLength":144}])";
  gltf.buffers = R"([{"byteLength":144}])";
  const MeshFile mesh = read(gltf);
  EXPECT_EQ(mesh.points.size(), 4u);
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {2, 1, 3}}));
}

TEST_F(GltfFileTest, BuffersAreWithinTheFileOrBesideIt) {
  Gltf gltf;
  write("the buffer.bin", gltf.binary);
  gltf.buffers = R"([{"byteLength":44,"uri":"the%20buffer.bin"}])";
  EXPECT_EQ(read_mesh_file(write("a.gltf", gltf.json()), context).points.size(), 3u);
  // Not encoded, as some programs write names.
  write("10% über.bin", gltf.binary);
  gltf.buffers = R"([{"byteLength":44,"uri":"10% über.bin"}])";
  EXPECT_EQ(read_mesh_file(write("c.gltf", gltf.json()), context).points.size(), 3u);
  // 42 bytes in base64, by hand of another program.
  gltf.buffers = R"([{"byteLength":42,"uri":"data:application/gltf-buffer;base64,)"
                 R"(AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAAEAAAAAAAAABAAIA"}])";
  EXPECT_EQ(read_mesh_file(write("b.gltf", gltf.json()), context).points,
            (Points{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}}));
}

TEST_F(GltfFileTest, LinksOutOfTheFolderAreRefused) {
  Gltf gltf;
  std::filesystem::create_directories(folder / "inside/deep");
  write("outside.bin", gltf.binary);
  write("inside/deep/a.bin", gltf.binary);
  std::filesystem::create_symlink("../outside.bin", folder / "inside/out.bin");
  std::filesystem::create_directory_symlink("..", folder / "inside/up");
  std::filesystem::create_symlink("deep/a.bin", folder / "inside/in.bin");
  std::filesystem::create_directory_symlink("inside", folder / "other");
  const auto error = [&](const std::string& uri) {
    gltf.buffers = R"([{"byteLength":44,"uri":")" + uri + R"("}])";
    write("inside/a.gltf", gltf.json());
    return error_of_path(folder / "inside/a.gltf") + error_of_path(folder / "other/a.gltf");
  };
  for (const char* uri : {"out.bin", "up/outside.bin"}) expect_words(error(uri), "leads out of the folder");
  for (const char* uri : {"in.bin", "deep/a.bin", "up/inside/deep/a.bin"}) EXPECT_EQ(error(uri), "") << uri;
}

TEST_F(GltfFileTest, BuffersElsewhereAreRefused) {
  Gltf gltf;
  const auto sentence = [&](const std::string& uri) {
    gltf.buffers = R"([{"byteLength":44,"uri":")" + uri + R"("}])";
    return MeshFileTest::error_of("a.gltf", gltf.json());
  };
  expect_words(sentence("none.bin"), "'none.bin' does not exist");
  expect_words(sentence("../a.bin"), "not in the folder");
  expect_words(sentence("%2e%2e/a.bin"), "not in the folder");
  expect_words(sentence("/etc/hostname"), "not in the folder");
  expect_words(sentence("a%00.bin"), "not in the folder");
  expect_words(sentence("https://example.org/a.bin"), "an address");
  expect_words(sentence("data:,abc"), "not in base64");
  expect_words(sentence("data:;base64,AA!A"), "none of its digits");
  expect_words(sentence("data:;base64,AAAA"), "44 bytes, but 3 exist");
}

TEST_F(GltfFileTest, SaysWhatItLeavesOut) {
  Gltf gltf;
  gltf.head = R"("asset":{"version":"2.0"},"scene":1,"scenes":[{"nodes":[]},{"nodes":[0,1]}])";
  gltf.nodes = R"([{"mesh":0,"skin":0,"translation":[9,9,9]},{"mesh":0,"scale":[1,0,1]}])";
  gltf.primitives = R"([{"attributes":{"POSITION":0},"mode":1},)"
                    R"({"attributes":{"POSITION":0},"indices":1,"targets":[{"POSITION":0}]}])";
  EXPECT_EQ(read(gltf).points[0], Vector3d(0, 0, 0));
  std::string notes;
  for (const std::string& note : context.notes) notes += note + "\n";
  EXPECT_EQ(notes,
            "'a.glb': it has 2 scenes; the default one was read\n"
            "'a.glb': 1 parts that a transform flattens were left out\n"
            "'a.glb': 1 of its primitives have points or lines and no triangles, and were left out\n"
            "'a.glb': 1 of its meshes are bent by joints; they were read as they are stored\n"
            "'a.glb': 1 of its primitives have morph targets, which were left out\n");
}

TEST_F(GltfFileTest, DamageIsAnError) {
  struct Case {
    std::string Gltf::*part;
    std::string text, words;
  };
  const auto asset = [](const std::string& rest) {
    return R"("asset":{"version":"2.0"},)" + rest + R"("scenes":[{"nodes":[0]}])";
  };
  const auto view = [](const std::string& rest) {
    return R"([{"buffer":0,"byteLength":36)" + rest + R"(},{"buffer":0,"byteLength":6}])";
  };
  const auto accessor = [](const std::string& count) {
    return R"([{"bufferView":0,"componentType":5126,"count":)" + count + R"(,"type":"VEC3"}])";
  };
  const std::string binary = Gltf().binary;
  const Case cases[] = {
      {&Gltf::head, R"("asset":{"version":"1.0"})", "version '1.0' of glTF"},
      {&Gltf::head, R"("assets":{})", "which version"},
      {&Gltf::head, asset(R"("extensionsRequired":["KHR_draco_mesh_compression"],)"), "without compression"},
      {&Gltf::head, asset(R"("extensionsRequired":["EXT_meshopt_compression"],)"), "without compression"},
      {&Gltf::head, asset(R"("extensionsRequired":["KHR_new_shapes"],)"), "'KHR_new_shapes'"},
      {&Gltf::head, "\"asset\":", "truncated or damaged at byte"},
      {&Gltf::nodes, R"([{"mesh":0,"children":[0]}])", "two parents or is within itself"},
      {&Gltf::nodes, R"([{"mesh":1}])", "number 1 of 'meshes', but there are 1"},
      {&Gltf::nodes, R"([{"mesh":-1}])", "'mesh' must be a whole number"},
      {&Gltf::nodes, R"([{"mesh":0,"rotation":[0,0,0,0]}])", "the length 0"},
      {&Gltf::nodes, R"([{"children":[1],"scale":[1e200,1,1]},{"mesh":0,"scale":[1e200,1,1]}])",
       "not finite"},
      {&Gltf::nodes, R"([{"mesh":0,"scale":[1,1]}])", "must be 3 numbers"},
      {&Gltf::nodes, R"([{"mesh":0,"matrix":[1,0,0,1,0,1,0,0,0,0,1,0,0,0,0,1]}])", "no affine map"},
      {&Gltf::nodes, R"([{"name":"empty"}])", "no polygon"},
      {&Gltf::primitives, R"([{"attributes":{"POSITION":7}}])", "number 7 of 'accessors'"},
      {&Gltf::primitives, R"([{"attributes":{"POSITION":1}}])", "of a type that its use"},
      {&Gltf::primitives, R"([{"attributes":{"POSITION":0},"indices":0}])", "of a type that its use"},
      {&Gltf::primitives, R"([{"attributes":{"POSITION":0},"mode":9}])", "mode 9"},
      {&Gltf::binary, std::string(binary).replace(36, 1, "\3"), "refers to point 3, but there are 3"},
      {&Gltf::binary, std::string(binary).replace(12, 4, raw(0x7fc00000)), "not a finite number"},
      {&Gltf::binary, binary.substr(0, 32), "declares 44 bytes, but 32 exist"},
      {&Gltf::views, R"([{"buffer":0,"byteLength":35},{"buffer":0,"byteLength":6}])", "reaches beyond"},
      {&Gltf::views, view(R"(,"byteOffset":40)"), "reaches beyond"},
      {&Gltf::views, view(R"(,"byteStride":0)"), "byteStride"},
      {&Gltf::accessors, accessor("1e15"), "reaches beyond"},
      {&Gltf::accessors, accessor("1e300"), "'count' must be"},
      {&Gltf::accessors, accessor("1e999"), "too large"},
      // Billions of zeros, which a file of a few bytes may declare.
      {&Gltf::accessors, R"([{"componentType":5126,"count":3000000000,"type":"VEC3"}])",
       "more elements than"}};
  for (const Case& each : cases) {
    Gltf gltf;
    gltf.*each.part = each.text;
    const std::string error = error_of(gltf);
    expect_words(error, each.words);
    EXPECT_TRUE(error.starts_with("'a.glb'")) << error;
  }
}

TEST_F(GltfFileTest, LengthsOfTheContainerAreChecked) {
  const std::string whole = Gltf().glb();
  for (std::size_t size = 4; size < whole.size(); ++size)
    expect_words(MeshFileTest::error_of("a.glb", whole.substr(0, size)), "truncated");
  expect_words(MeshFileTest::error_of("a.glb", whole + "more"), "4 more follow");
  std::string old = whole;
  old[4] = 1;
  expect_words(MeshFileTest::error_of("a.glb", old), "version 1 of glTF");
  expect_words(MeshFileTest::error_of("a.gltf", whole), "is named .gltf but holds binary glTF");
  expect_words(MeshFileTest::error_of("a.glb", Gltf().json()), "is named .glb but holds glTF in text");
  expect_words(MeshFileTest::error_of("a.glb", "ply\n"), "is named .glb but holds PLY");
  expect_words(MeshFileTest::error_of("a.glb", "something else"), "does not begin like");
  expect_words(MeshFileTest::error_of("a.ply", whole), "is named .ply but holds binary glTF");
}

/// Thousands of nodes that show thousands of primitives over the same bytes: the memory that they require is
/// computed before it is allocated.
TEST_F(GltfFileTest, RepetitionDoesNotEatMemory) {
  Gltf gltf = row_of_points(3000, 4);
  gltf.nodes = "[{\"children\":[1";
  std::string rest;
  for (int i = 2; i < 40000; ++i) gltf.nodes += "," + std::to_string(i);
  gltf.nodes += "]}";
  for (int i = 1; i < 40000; ++i) gltf.nodes += ",{\"mesh\":0}";
  gltf.nodes += "]";
  std::string many = "[";
  for (int i = 0; i < 2000; ++i) many += (i > 0 ? "," : "") + std::string(R"({"attributes":{"POSITION":0}})");
  gltf.primitives = many + "]";
  expect_words(error_of(gltf), "half of the memory");
}

TEST_F(GltfFileTest, ManyNodesWithinOneAnotherAreNoRecursion) {
  Gltf gltf;
  gltf.nodes = "[";
  for (int i = 1; i < 20000; ++i) gltf.nodes += "{\"children\":[" + std::to_string(i) + "]},";
  gltf.nodes += "{\"mesh\":0}]";
  EXPECT_EQ(read(gltf).points.size(), 3u);
  EXPECT_NE(MeshFileTest::error_of("a.gltf", "{\"asset\":" + std::string(1000000, '[')), "");
}

TEST_F(GltfFileTest, RoundTripsKeepEveryBit) {
  for (const Vector3d& origin : {Vector3d(0, 0, 0), Vector3d(1e6, -1e6, 3), Vector3d(0.1, 0, 0)}) {
    const PolygonMesh mesh = random_mesh(11, origin);
    for (const char* name : {"a.glb", "a.gltf", "a.3mf", "b.glb.gz", "b.gltf.gz", "b.3mf.gz"}) {
      // Degenerate triangles are nothing that 3MF holds, so there are none here.
      PolygonMesh proper = mesh;
      std::erase_if(proper.triangles,
                    [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
      proper.quads.clear();
      for (std::uint32_t i = 0; i + 3 < proper.points.size(); ++i)
        proper.quads.push_back({i, i + 1, i + 2, i + 3});
      write_mesh(folder / name, proper, context);
      const PolygonMesh back = read_mesh(folder / name, context);
      EXPECT_EQ(back.origin, proper.origin) << name;
      EXPECT_EQ(back.points, proper.points) << name;
      EXPECT_EQ(back.triangles, triangulated(proper)) << name;
      const std::string bytes = bytes_of(folder / name);
      write_mesh(folder / name, proper, context);
      EXPECT_EQ(bytes_of(folder / name), bytes) << name;
    }
  }
  EXPECT_TRUE(context.notes.empty());
}

TEST_F(GltfFileTest, AnOriginThatTheReaderWouldNotChooseIsKept) {
  PolygonMesh mesh;
  mesh.points = {{1000, 0, 0}, {1001, 0, 0}, {1000, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  for (const char* name : {"a.glb", "a.gltf", "a.3mf"}) {
    write_mesh(folder / name, mesh, context);
    EXPECT_TRUE(read_mesh(folder / name, context) == mesh) << name;
  }
}

TEST_F(GltfFileTest, AMeshWithoutPolygonsIsAFileWithoutThem) {
  for (const char* name : {"a.glb", "a.gltf", "a.3mf"}) {
    write_mesh(folder / name, PolygonMesh(), context);
    EXPECT_NE(
        error_of_path(folder / name).find(std::string(name) == "a.3mf" ? "places no object" : "no polygon"),
        std::string::npos);
  }
}

}  // namespace gltf_file_test
}  // namespace hermesh
