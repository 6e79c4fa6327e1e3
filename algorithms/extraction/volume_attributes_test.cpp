#include "algorithms/extraction/volume_attributes.h"

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <unistd.h>

#include <algorithm>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/io/mesh_file.h"

namespace hermesh {
namespace volume_attributes_test {

namespace fs = std::filesystem;
using openvdb::Coord;

class VolumeAttributes : public testing::Test {
 protected:
  VolumeAttributes()
      : folder(fs::temp_directory_path() / ("hermesh-attributes-" + std::to_string(::getpid()))) {
    fs::create_directories(folder);
    initialize_openvdb();
    mesh.points = {{0.5f, 0.5f, 0.5f}, {1.0f, 1.0f, 2.0f}, {9.0f, 9.0f, 9.0f}};
    mesh.triangles = {{0, 1, 2}};
  }
  ~VolumeAttributes() override { fs::remove_all(folder); }

  /// Voxels of half a unit with the values of f(coordinate) from 0 to 4.
  template <class Grid, class F>
  typename Grid::Ptr grid(const std::string& name, F&& f) {
    auto result = Grid::create();
    result->setName(name);
    result->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
    for (const Coord& at : openvdb::CoordBBox(Coord(0), Coord(4))) result->tree().setValueOn(at, f(at));
    return result;
  }
  void save(const openvdb::GridPtrVec& grids) { openvdb::io::File((folder / "a.vdb").string()).write(grids); }
  std::vector<std::string> sample(const std::vector<std::string>& names) {
    return sample_attributes(mesh, folder / "a.vdb", names, context);
  }
  const std::vector<float>& floats(std::size_t i) { return std::get<0>(mesh.attributes[i].values); }

  fs::path folder;
  PolygonMesh mesh;
  RunContext context;
};

TEST_F(VolumeAttributes, LinearFieldsAreExactAndBeyondIsNothing) {
  save({grid<openvdb::FloatGrid>("heat",
                                 [](const Coord& at) { return float(at.x() + 10 * at.y() - at.z()); })});
  EXPECT_EQ(sample({"heat"}), std::vector<std::string>{"heat"});
  EXPECT_NEAR(floats(0)[0], 1 + 10 - 1, 1e-5);
  EXPECT_NEAR(floats(0)[1], 2 + 20 - 4, 1e-5);
  EXPECT_EQ(floats(0)[2], 0.0f);
  ASSERT_EQ(context.notes.size(), 1u);
  EXPECT_NE(context.notes[0].find("1 points lie beyond"), std::string::npos);
}

TEST_F(VolumeAttributes, InactiveSamplesDoNotCount) {
  auto heat = grid<openvdb::FloatGrid>("heat", [](const Coord&) { return 5.0f; });
  for (const Coord& at : openvdb::CoordBBox(Coord(0), Coord(4)))
    if (at.x() > 1) heat->tree().setValueOff(at, -1000.0f);
  mesh.points[0] = {0.7f, 0.5f, 0.5f};  // between samples 1 and 2
  save({heat});
  sample({"heat"});
  EXPECT_EQ(floats(0)[0], 5.0f);
}

TEST_F(VolumeAttributes, WholeNumbersAreThoseOfTheNearestSample) {
  auto ids = grid<openvdb::Int32Grid>("material", [](const Coord& at) { return at.x(); });
  ids->insertMeta("label_0", openvdb::StringMetadata("clay"));
  ids->insertMeta("label_1", openvdb::StringMetadata("tin"));
  mesh.points[0] = {0.7f, 0.0f, 0.0f};
  mesh.points[1] = {0.8f, 0.0f, 0.0f};
  save({ids});
  sample({"all"});
  EXPECT_EQ(std::get<1>(mesh.attributes[0].values), (std::vector<std::int32_t>{1, 2, -1}));
  EXPECT_EQ(mesh.attributes[0].labels, (std::vector<std::string>{"clay", "tin"}));
}

TEST_F(VolumeAttributes, VectorsTextureCoordinatesNormalsAndAlpha) {
  save({grid<openvdb::Vec3SGrid>("colour",
                                 [](const Coord& at) { return openvdb::Vec3s(0.25f * float(at.x()), 0, 1); }),
        grid<openvdb::FloatGrid>("colour-alpha", [](const Coord&) { return 0.5f; }),
        grid<openvdb::Vec3SGrid>("uv", [](const Coord&) { return openvdb::Vec3s(0.5f, 0.25f, 0); }),
        grid<openvdb::Vec3SGrid>("normal", [](const Coord&) { return openvdb::Vec3s(3, 0, 4); }),
        grid<openvdb::Vec3DGrid>("closest-point", [](const Coord&) { return openvdb::Vec3d(7, 8, 9); }),
        grid<openvdb::FloatGrid>("sdf", [](const Coord&) { return 0.0f; })});
  std::vector<std::string> names = sample({"all"});
  EXPECT_EQ(names.size(), 4u);
  for (const MeshAttribute& attribute : mesh.attributes) {
    const std::vector<float>& values = std::get<0>(attribute.values);
    if (attribute.name == "colour") {
      EXPECT_EQ(std::vector(values.begin(), values.begin() + 4), (std::vector{0.25f, 0.0f, 1.0f, 0.5f}));
    }
    if (attribute.name == "uv") {
      EXPECT_EQ(std::vector(values.begin(), values.begin() + 2), (std::vector{0.5f, 0.25f}));
    }
    if (attribute.name == "normal") {
      EXPECT_EQ(std::vector(values.begin(), values.begin() + 3), (std::vector{0.6f, 0.0f, 0.8f}));
    }
  }
  // PLY keeps all of it; colours as bytes.
  write_mesh(folder / "m.ply", mesh, context);
  const MeshFile back = read_mesh_file(folder / "m.ply", context, {.attributes = true});
  const auto find = [&](const std::string& name) {
    return *std::ranges::find(back.attributes, name, &MeshAttribute::name);
  };
  EXPECT_NEAR(std::get<0>(find("colour").values)[0], 0.25f, 0.5 / 255);
  EXPECT_EQ(find("colour").components, 4);
  EXPECT_EQ(std::get<0>(find("uv").values)[1], 0.25f);
  EXPECT_EQ(std::get<0>(find("normal").values)[2], 0.8f);
  EXPECT_EQ(std::get<0>(find("closest-point_z").values)[0], 9.0f);
  EXPECT_EQ(back.points.size(), 3u);
}

TEST_F(VolumeAttributes, WhatIsNotThereIsNamed) {
  save({grid<openvdb::FloatGrid>("sdf", [](const Coord&) { return 0.0f; })});
  for (const char* name : {"all", "heat"}) {
    try {
      sample({name});
      ADD_FAILURE();
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("sdf"), std::string::npos) << error.what();
    }
  }
}

}  // namespace volume_attributes_test
}  // namespace hermesh
