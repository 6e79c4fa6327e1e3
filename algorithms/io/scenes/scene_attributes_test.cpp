// Colours, texture coordinates and materials in glTF and 3MF.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <tuple>

#include "algorithms/io/scenes/scene_files_for_tests.h"
#include "algorithms/io/test_mesh_files.h"

namespace hermesh {
namespace scene_attributes_test {

class SceneAttributesTest : public MeshFileTest {
 protected:
  PolygonMesh read_back(const PolygonMesh& mesh, const char* name) {
    write_mesh(folder / name, mesh, context);
    return read_mesh(folder / name, context, {.attributes = true});
  }
  /// Reads the bytes of a file with its attributes.
  PolygonMesh read_bytes(const char* name, const std::string& bytes) {
    std::ofstream(folder / name, std::ios::binary) << bytes;
    return read_mesh(folder / name, context, {.attributes = true});
  }
};

/// Two squares with a common side, a quad and two triangles, which have texture coordinates of their own.
PolygonMesh two_squares() {
  PolygonMesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0, 1}, {2, 1, 1}};
  mesh.triangles = {{1, 4, 5}, {1, 5, 2}};
  mesh.quads = {Quad{0, 1, 2, 3}};
  return mesh;
}

const MeshAttribute* find(const PolygonMesh& mesh, const std::string& name) {
  const auto at = std::ranges::find(mesh.attributes, name, &MeshAttribute::name);
  return at == mesh.attributes.end() ? nullptr : &*at;
}

using Corner = std::tuple<float, float, float, float, float>;  // point, texture coordinates

/// Returns the material of each triangle, by its corners.
std::map<std::array<Corner, 3>, std::string> triangles_of(const PolygonMesh& mesh) {
  const std::vector<float>& uv = std::get<0>(find(mesh, "uv")->values);
  const MeshAttribute& material = *find(mesh, "material");
  std::map<std::array<Corner, 3>, std::string> result;
  std::size_t corner = 0, polygon = 0;
  const auto at = [&](std::uint32_t point, std::size_t element) {
    const Eigen::Vector3f& p = mesh.points[point];
    return Corner(p.x(), p.y(), p.z(), uv[2 * element], uv[2 * element + 1]);
  };
  const auto name = [&] {
    const std::int32_t number = std::get<1>(material.values)[polygon++];
    return number < 0 ? std::string("none") : material.labels.at(std::size_t(number));
  };
  for (const Triangle& t : mesh.triangles) {
    result[{at(t[0], corner), at(t[1], corner + 1), at(t[2], corner + 2)}] = name();
    corner += 3;
  }
  for (const Quad& q : mesh.quads) {
    const std::string own = name();
    result[{at(q[0], corner), at(q[1], corner + 1), at(q[2], corner + 2)}] = own;
    result[{at(q[0], corner), at(q[2], corner + 2), at(q[3], corner + 3)}] = own;
    corner += 4;
  }
  return result;
}

TEST_F(SceneAttributesTest, ColoursComeBackThroughAllFormats) {
  for (const int components : {3, 4}) {
    PolygonMesh mesh = two_squares();
    std::vector<float> values;
    for (int i = 0; i < 6 * components; ++i) values.push_back(float(i * 37 % 256) / 255.0f);
    mesh.attributes = {{"colour", AttributeDomain::point, components, values, {}}};
    for (const char* name : {"a.glb", "a.gltf", "a.3mf", "b.3mf.gz"}) {
      const PolygonMesh back = read_back(mesh, name);
      EXPECT_EQ(back.points, mesh.points) << name;
      ASSERT_TRUE(find(back, "colour")) << name;
      EXPECT_EQ(find(back, "colour")->components, components) << name;
      const auto& found = std::get<0>(find(back, "colour")->values);
      ASSERT_EQ(found.size(), values.size()) << name;
      for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(found[i], values[i], 1e-6f) << name << i;
    }
  }
  EXPECT_TRUE(context.notes.empty());
}

TEST_F(SceneAttributesTest, SeamsAndMaterialsComeBackThroughGltf) {
  PolygonMesh mesh = two_squares();
  mesh.attributes = {
      {"uv",
       AttributeDomain::corner,
       2,
       std::vector<float>{0, 0, 0.5f, 0, 0.5f, 1, 0, 0, 0.5f, 1, 0, 1, 0.25f, 0, 1, 0, 1, 0.75f, 0.25f, 1},
       {}},
      {"material", AttributeDomain::polygon, 1, std::vector<std::int32_t>{1, -1, 0}, {"red \"1\"", "ü"}}};
  for (const char* name : {"a.glb", "a.gltf"}) {
    const PolygonMesh back = read_back(mesh, name);
    EXPECT_EQ(back.points.size(), 6u) << name;
    EXPECT_EQ(triangles_of(back), triangles_of(mesh)) << name;
  }
  // Texture coordinates of points have no seam.
  mesh.attributes = {{"uv",
                      AttributeDomain::point,
                      2,
                      std::vector<float>{0, 0, 1, 0, 1, 1, 0, 1, 0.5f, 0.25f, 0.125f, 0},
                      {}}};
  const PolygonMesh back = read_back(mesh, "a.glb");
  EXPECT_EQ(std::get<0>(find(back, "uv")->values),
            (std::vector<float>{1, 0, 0.5f, 0.25f, 0.125f, 0, 1, 0, 0.125f, 0, 1, 1,  //
                                0, 0, 1,    0,     1,      1, 0, 0, 1,      1, 0, 1}));
}

TEST_F(SceneAttributesTest, ThreeMfHasMaterialsOrColoursAndNotesTheRest) {
  PolygonMesh mesh = two_squares();
  const MeshAttribute material = {
      "material", AttributeDomain::polygon, 1, std::vector<std::int32_t>{1, -1, 0}, {"<a & b>", "\"c\""}};
  mesh.attributes = {material};
  const PolygonMesh back = read_back(mesh, "a.3mf");
  ASSERT_TRUE(find(back, "material"));
  const std::vector<std::string> names = {"<a & b>", "\"c\"", "none"};
  EXPECT_EQ(find(back, "material")->labels, names);
  EXPECT_EQ(std::get<1>(find(back, "material")->values), (std::vector<std::int32_t>{1, 2, 0, 0}));
  EXPECT_TRUE(context.notes.empty());

  mesh.attributes = {material, {"colour", AttributeDomain::point, 3, std::vector<float>(18, 1.0f), {}}};
  const PolygonMesh coloured = read_back(mesh, "a.3mf");
  EXPECT_TRUE(find(coloured, "colour"));
  EXPECT_FALSE(find(coloured, "material"));
  ASSERT_EQ(context.notes.size(), 1u);
  EXPECT_NE(context.notes[0].find("material"), std::string::npos);
}

/// The triangle (0,0,0) (1,0,0) (0,1,0) with a colour for each corner in bytes, linear as the format wants.
std::string coloured_triangle(int colours) {
  const std::string json =
      R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[)"
      R"({"attributes":{"POSITION":0,"COLOR_0":1}}]}],"accessors":[)"
      R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},{"bufferView":1,"componentType":5121,)"
      R"("normalized":true,"count":)" +
      std::to_string(colours) +
      R"(,"type":"VEC3"}],"bufferViews":[{"buffer":0,"byteLength":36},)"
      R"({"buffer":0,"byteOffset":36,"byteLength":12,"byteStride":4}],"buffers":[{"byteLength":48}]})";
  return glb_of(json, raw_list<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}) +
                          raw_list<std::uint8_t>({255, 0, 55, 9, 0, 0, 0, 9, 255, 255, 255, 9}));
}

TEST_F(SceneAttributesTest, ColoursOfGltfAreLinear) {
  const PolygonMesh mesh = read_bytes("a.glb", coloured_triangle(3));
  ASSERT_TRUE(find(mesh, "colour"));
  const std::vector<float>& values = std::get<0>(find(mesh, "colour")->values);
  // 55/255 is 0.2157, whose value on screens is 1.055 · 0.2157^(1/2.4) − 0.055 = 0.50177.
  const std::vector<float> expected = {1, 0, 0.50177f, 0, 0, 0, 1, 1, 1};
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(values[i], expected[i], 1e-4) << i;
  EXPECT_TRUE(read_mesh(folder / "a.glb", context).attributes.empty());
}

TEST_F(SceneAttributesTest, ABadAttributeDoesNotCostTheMesh) {
  const PolygonMesh mesh = read_bytes("a.glb", coloured_triangle(2));
  EXPECT_EQ(mesh.triangles.size(), 1u);
  EXPECT_TRUE(mesh.attributes.empty());
  EXPECT_EQ(context.notes.size(), 1u);
  EXPECT_THROW(read_mesh(folder / "a.glb", context, {.attributes = true, .required = {"colour"}}), Error);
}

TEST_F(SceneAttributesTest, ThreeMfPropertiesAreOfTheTriangleOrItsObject) {
  const auto model = [](const std::string& triangle) {
    return three_mf_of(model_of(
        "<m:colorgroup xmlns:m=\"http://m\" id=\"7\"><m:color color=\"#FF000080\"/><m:color "
        "color=\"#00FF00\"/>"
        "</m:colorgroup><basematerials id=\"8\"><base name=\"steel\" "
        "displaycolor=\"#111111\"/></basematerials>"
        "<object id=\"1\" pid=\"8\" pindex=\"0\"><mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/><vertex "
        "x=\"1\" y=\"0\" z=\"0\"/><vertex x=\"0\" y=\"1\" z=\"0\"/></vertices><triangles><triangle v1=\"0\" "
        "v2=\"1\" v3=\"2\" " +
            triangle + "/></triangles></mesh></object>",
        "<item objectid=\"1\"/>"));
  };
  const PolygonMesh coloured = read_bytes("a.3mf", model("pid=\"7\" p1=\"0\" p2=\"1\" p3=\"1\""));
  ASSERT_TRUE(find(coloured, "colour"));
  const float half = 128.0f / 255.0f;
  EXPECT_EQ(std::get<0>(find(coloured, "colour")->values),
            (std::vector<float>{1, 0, 0, half, 0, 1, 0, 1, 0, 1, 0, 1}));
  const PolygonMesh plain = read_bytes("a.3mf", model(""));
  ASSERT_TRUE(find(plain, "material"));
  EXPECT_EQ(find(plain, "material")->labels, std::vector<std::string>{"steel"});
  EXPECT_EQ(std::get<1>(find(plain, "material")->values), std::vector<std::int32_t>{0});
  EXPECT_TRUE(context.notes.empty());
  EXPECT_EQ(read_bytes("a.3mf", model("pid=\"7\" p1=\"5\"")).triangles.size(), 1u);
  EXPECT_EQ(context.notes.size(), 1u);
}

}  // namespace scene_attributes_test
}  // namespace hermesh
