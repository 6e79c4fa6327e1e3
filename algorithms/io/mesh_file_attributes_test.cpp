// Attributes of PLY and OBJ texts.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "algorithms/io/mesh_file_formats.h"

namespace hermesh {
namespace mesh_file_attributes_test {

using mesh_formats::Format;

class AttributeFileTest : public testing::Test {
 protected:
  MeshFile ply(const std::string& text) {
    return mesh_formats::parse_mesh(text, Format::ply, "f.ply", context, {.attributes = true});
  }
  MeshFile obj(const std::string& text) {
    return mesh_formats::parse_mesh(text, Format::obj, "f.obj", context, {.attributes = true});
  }
  std::string error_of(const std::string& text) {
    try {
      text.starts_with("ply") ? ply(text) : obj(text);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }
  RunContext context;
};

MeshAttribute floats(const std::string& name, AttributeDomain domain, int components,
                     std::vector<float> values) {
  return {name, domain, components, std::move(values), {}};
}
MeshAttribute whole(const std::string& name, AttributeDomain domain, std::vector<std::int32_t> values,
                    std::vector<std::string> labels = {}) {
  return {name, domain, 1, std::move(values), std::move(labels)};
}

/// Two triangles' worth of points, with properties behind the coordinates.
std::string ply_text(const std::string& vertex_properties, const std::string& face_properties,
                     const std::string& body) {
  return "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n" +
         vertex_properties + "element face 2\nproperty list uchar int vertex_indices\n" + face_properties +
         "end_header\n" + body;
}

TEST_F(AttributeFileTest, NoneUnlessAskedFor) {
  const std::string text =
      ply_text("property float quality\n", "", "0 0 0 1\n1 0 0 2\n0 1 0 3\n1 1 0 4\n3 0 1 2\n3 1 3 2\n");
  EXPECT_TRUE(mesh_formats::parse_mesh(text, Format::ply, "f.ply", context).attributes.empty());
  const MeshFile file = ply(text);
  ASSERT_EQ(file.attributes.size(), 1u);
  EXPECT_EQ(file.attributes[0], floats("quality", AttributeDomain::point, 1, {1, 2, 3, 4}));
  EXPECT_EQ(to_polygon_mesh(file).attributes, file.attributes);
}

TEST_F(AttributeFileTest, ConcavePolygonsTakeTheirCornersAlong) {
  // The same numbers as the points have, so that they have to go the same way.
  const MeshFile file =
      obj("v 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 0\n"
          "vt 2 0\nvt 2 1\nvt 1 1\nvt 1 2\nvt 0 2\nvt 0 0\n"
          "f 6/6 1/1 2/2\nf 1/1 2/2 3/3 4/4 5/5 6/6\nf 1/1 2/2 3/3 6/6\nf 6/6 1/1 2/2 3/3 4/4\n");
  ASSERT_EQ(file.attributes.size(), 1u);
  const auto& uv = std::get<std::vector<float>>(file.attributes[0].values);
  ASSERT_EQ(file.triangles.size(), 1u + 4u + 3u);
  ASSERT_EQ(uv.size(), 2u * (3u * 8u + 4u));
  for (std::size_t t = 0; t < file.triangles.size(); ++t)
    for (std::size_t i = 0; i < 3; ++i)
      for (int a = 0; a < 2; ++a)
        EXPECT_EQ(uv[2 * (3 * t + i) + static_cast<std::size_t>(a)], file.points[file.triangles[t][i]][a])
            << t;
}

TEST_F(AttributeFileTest, PlyGroupsInAnyOrder) {
  const MeshFile file = ply(ply_text(
      "property uchar blue\nproperty float ny\nproperty uchar green\nproperty uchar red\nproperty float nx\n"
      "property float nz\nproperty float t\nproperty float s\nproperty int label\nproperty uchar "
      "confidence\n",
      "",
      "0 0 0  255 2 0 51  1 3  .75 .5  -5 9\n1 0 0  0 0 0 0  0 1  0 0  2147483647 8\n"
      "0 1 0  0 0 0 0  0 1  0 0  0 7\n1 1 0  0 0 255 0  0 1  1 1  16777217 6\n3 0 1 2\n3 1 3 2\n"));
  ASSERT_EQ(file.attributes.size(), 5u);
  EXPECT_EQ(file.attributes[0],
            floats("normal", AttributeDomain::point, 3, {1, 2, 3, 0, 0, 1, 0, 0, 1, 0, 0, 1}));
  EXPECT_EQ(file.attributes[1],
            floats("colour", AttributeDomain::point, 3, {0.2f, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1, 0}));
  EXPECT_EQ(file.attributes[2], floats("uv", AttributeDomain::point, 2, {0.5f, 0.75f, 0, 0, 0, 0, 1, 1}));
  EXPECT_EQ(file.attributes[3], whole("label", AttributeDomain::point, {-5, 2147483647, 0, 16777217}));
  EXPECT_EQ(file.attributes[4], whole("confidence", AttributeDomain::point, {9, 8, 7, 6}));
}

TEST_F(AttributeFileTest, PlyColoursWithAlphaAndInFloats) {
  const std::string faces = "3 0 1 2\n3 1 3 2\n";
  const MeshFile bytes =
      ply(ply_text("property uchar red\nproperty uchar green\nproperty uchar blue\nproperty ushort alpha\n",
                   "", "0 0 0 255 0 0 65535\n1 0 0 0 0 0 0\n0 1 0 0 0 0 0\n1 1 0 0 0 0 0\n" + faces));
  EXPECT_EQ(bytes.attributes.at(0),
            floats("colour", AttributeDomain::point, 4, {1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}));
  const MeshFile numbers =
      ply(ply_text("property float red\nproperty float green\nproperty double blue\n", "",
                   "0 0 0 .25 .5 2\n1 0 0 0 0 0\n0 1 0 0 0 0\n1 1 0 0 0 0\n" + faces));
  EXPECT_EQ(numbers.attributes.at(0),
            floats("colour", AttributeDomain::point, 3, {0.25f, 0.5f, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0}));
}

TEST_F(AttributeFileTest, PlyFacesFollowTheirPolygons) {
  // A quad, a triangle, an edge that is dropped, and a pentagon that becomes three triangles.
  const std::string text =
      "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
      "property float quality\nelement face 4\nproperty float quality\nproperty list uchar float texcoord\n"
      "property list uchar int vertex_indices\nproperty short part\nend_header\n"
      "0 0 0 1\n1 0 0 2\n1 1 0 3\n0 1 0 4\n0 0 1 5\n"
      "10  8 0 1 2 3 4 5 6 7  4 0 1 2 3  100\n"
      "11  6 10 11 12 13 14 15  3 0 1 4  101\n"
      "12  4 90 91 92 93  2 0 1  102\n"
      "13  0  5 0 1 2 3 4  -103\n";
  const MeshFile file = ply(text);
  ASSERT_EQ(file.triangles.size(), 4u);
  ASSERT_EQ(file.quads.size(), 1u);
  ASSERT_EQ(file.attributes.size(), 4u);
  EXPECT_EQ(file.attributes[1], floats("polygon-quality", AttributeDomain::polygon, 1, {11, 13, 13, 13, 10}));
  EXPECT_EQ(file.attributes[2], whole("part", AttributeDomain::polygon, {101, -103, -103, -103, 100}));
  std::vector<float> uv = {10, 11, 12, 13, 14, 15};
  uv.insert(uv.end(), 18, 0.0f);  // the pentagon has none
  for (int i = 0; i < 8; ++i) uv.push_back(float(i));
  EXPECT_EQ(file.attributes[3], floats("uv", AttributeDomain::corner, 2, uv));
  ASSERT_EQ(context.notes.size(), 2u);
  EXPECT_EQ(context.notes[1], "'f.ply': 5 of 14 corners have no 'uv' and get 0");
}

TEST_F(AttributeFileTest, BinaryPly) {
  std::string text =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
      "float z\n"
      "property double heat\nproperty uint id\nelement face 1\nproperty list uchar int "
      "vertex_indices\nend_header\n";
  const auto add = [&](auto value) { text.append(reinterpret_cast<const char*>(&value), sizeof value); };
  for (int i = 0; i < 3; ++i) {
    for (const float x : {float(i == 1), float(i == 2), 0.0f}) add(x);
    add(0.5 * i);
    add(std::uint32_t(7 * i));
  }
  add(std::uint8_t(3));
  for (const int i : {0, 1, 2}) add(i);
  const MeshFile file = ply(text);
  ASSERT_EQ(file.attributes.size(), 2u);
  EXPECT_EQ(file.attributes[0], floats("heat", AttributeDomain::point, 1, {0, 0.5f, 1}));
  EXPECT_EQ(file.attributes[1], whole("id", AttributeDomain::point, {0, 7, 14}));
}

TEST_F(AttributeFileTest, ObjCorners) {
  const MeshFile file =
      obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nvt .5 .25 .9\nvt 1\nvn 0 0 1\nvn 1 0 0\n"
          "f 1/1/1 2/2/1 3/1/2 4/-1/-2\nusemtl red paint\nf 1//2 2//2 5//1\nusemtl wood\nf 1 2/1 5\nusemtl "
          "red paint\n"
          "f 3/1/1 4/1/1 5/1/1\n");
  ASSERT_EQ(file.triangles.size(), 3u);
  ASSERT_EQ(file.quads.size(), 1u);
  ASSERT_EQ(file.attributes.size(), 3u);
  EXPECT_EQ(file.attributes[0],
            whole("material", AttributeDomain::polygon, {0, 1, 0, -1}, {"red paint", "wood"}));
  EXPECT_EQ(file.attributes[1], floats("uv", AttributeDomain::corner, 2,
                                       {0,    0,   0,    0,   0,    0,   0,    0, .5f, .25f, 0,    0, .5f,
                                        .25f, .5f, .25f, .5f, .25f, .5f, .25f, 1, 0,   .5f,  .25f, 1, 0}));
  EXPECT_EQ(file.attributes[2], floats("normal", AttributeDomain::corner, 3,
                                       {1, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
                                        1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0, 1}));
}

TEST_F(AttributeFileTest, ObjWeightsDivideCoordinates) {
  const MeshFile file = obj("v 2 4 6 2\nv 1 0 0 .25 .5 1\nv 0 1 0 4 1 0 .5\nf 1 2 3\n");
  EXPECT_EQ(file.points, (std::vector<Eigen::Vector3d>{{1, 2, 3}, {1, 0, 0}, {0, 0.25, 0}}));
  EXPECT_FALSE(context.notes.empty());
}

TEST_F(AttributeFileTest, ObjColours) {
  const MeshFile file = obj("v 0 0 0 1\nv 1 0 0 .25 .5 1\nv 0 1 0 1 1 0 .5 # weight and colour\nf 1 2 3\n");
  ASSERT_EQ(file.attributes.size(), 1u);
  EXPECT_EQ(file.attributes[0],
            floats("colour", AttributeDomain::point, 3, {0, 0, 0, .25f, .5f, 1, 1, 0, .5f}));
  EXPECT_EQ(context.notes, std::vector<std::string>{"'f.obj': 1 of 3 points have no 'colour' and get 0"});
  EXPECT_TRUE(obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nvt 0 0\nf 1 2 3\n").attributes.empty());
}

/// An attribute that cannot be read is left out with one note, whatever else the file has; asked for by name,
/// it is an error.
TEST_F(AttributeFileTest, WhatCannotBeReadIsLeftOut) {
  const auto left_out = [&](const std::string& text, const std::string& name, const std::string& reason) {
    SCOPED_TRACE(name + " " + reason);
    context.notes.clear();
    const MeshFile file = text.starts_with("ply") ? ply(text) : obj(text);
    EXPECT_GE(file.triangles.size(), 1u);
    for (const MeshAttribute& attribute : file.attributes) EXPECT_NE(attribute.name, name);
    EXPECT_TRUE(file.attributes_left_out);
    const std::string words = "the attribute '" + name + "' was left out: " + reason;
    EXPECT_EQ(std::ranges::count_if(context.notes, [&](const auto& n) { return n.find(words) != n.npos; }), 1)
        << words << (context.notes.empty() ? "; no note" : context.notes[0]);
    const Format format = text.starts_with("ply") ? Format::ply : Format::obj;
    try {
      mesh_formats::parse_mesh(text, format, "f", context, {.attributes = true, .required = {name}});
      ADD_FAILURE();
    } catch (const Error& error) {
      EXPECT_EQ(
          std::string(error.what()).rfind("'f': the attribute '" + name + "' cannot be read: " + reason, 0),
          0u)
          << error.what();
    }
    EXPECT_NO_THROW(
        mesh_formats::parse_mesh(text, format, "f", context, {.attributes = true, .required = {"other"}}));
    EXPECT_NO_THROW(mesh_formats::parse_mesh(text, format, "f", context));
  };
  const std::string faces = "3 0 1 2\n3 1 3 2\n";
  const auto with_quality = [&](const std::string& value, const std::string& type = "float") {
    return ply_text("property " + type + " quality\n", "",
                    "0 0 0 1\n1 0 0 2\n0 1 0 " + value + "\n1 1 0 4\n" + faces);
  };
  for (const char* value : {"nan", "-inf", "1e60", "1.#QNAN", "-nan(ind)"})
    left_out(with_quality(value), "quality",
             "that of point 2 (counting from 0) is not a finite number in single precision");
  for (const char* value : {"4294967295", "-2147483649"})
    left_out(with_quality(value, "int"), "quality",
             "that of point 2 (counting from 0) does not fit into 32 bits with a sign");
  for (const char* type : {"float", "uchar"})
    for (const char* value : {"red", "0,5", "--"})
      left_out(with_quality(value, type), "quality", "that of point 2 (counting from 0) is not of the type");
  left_out(with_quality("0.5", "uchar"), "quality", "that of point 2 (counting from 0) is not of the type");
  const std::string points = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n";
  const std::string coordinates = "property list uchar float texcoord\n";
  left_out(ply_text("", coordinates, points + "3 0 1 2 6 0 0 0 0 0 0\n3 1 3 2 5 0 0 0 0 0\n"), "uv",
           "the list of a polygon has 5 numbers, but the polygon has 3 corners and each takes 2");
  left_out(ply_text("", coordinates, points + "3 0 1 2 6 0 0 x 0 0 0\n3 1 3 2 0\n"), "uv",
           "a value in the list");
  left_out(ply_text("", coordinates, points + "3 0 1 2 6 0 0 nan 0 0 0\n3 1 3 2 0\n"), "uv",
           "that of corner 1");

  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n";
  left_out(triangle + "f 1/1 2/1 3/2\n", "uv",
           "a polygon refers to texture coordinate 2, but the file has 1");
  left_out(triangle + "f 1//1 2//1 3//-2\n", "normal",
           "line 6: a polygon refers to normal -2, but the file has 1");
  left_out(triangle + "f 1/0/0 2/0/0 3/0/0\n", "uv", "line 6: a polygon refers to texture coordinate 0");
  left_out(triangle + "f 1/0/0 2/0/0 3/0/0\n", "normal", "line 6: a polygon refers to normal 0");
  left_out(triangle + "f 1/x/1 2/1/1 3/1/1\n", "uv",
           "line 6: the number of a texture coordinate is no number");
  const std::string corners = "f 1//1 2//1 3//1\n";
  left_out("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0\n" + corners, "normal", "line 4: a normal is incomplete");
  left_out("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1,\n" + corners, "normal", "line 4: a normal is no number");
  for (const char* value : {"nan", "1.#IND", "-nan(ind)", "1e99"})
    left_out("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 " + std::string(value) + "\n" + corners, "normal",
             "that of corner 0 (counting from 0) is not a finite number in single precision");
  left_out("v 0 0 0 1 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "colour",
           "that of point 0 (counting from 0) is not a finite");
  left_out("v 0 0 0\nv 1 0 0 red\nv 0 1 0\nf 1 2 3\n", "colour",
           "that of point 1 (counting from 0) is no number");
  // Entries that no polygon refers to are harmless.
  context.notes.clear();
  EXPECT_EQ(obj(triangle + "vt nan nan\nvn 0 0 1,\nf 1/1 2/1 3/1\n").attributes.size(), 1u);
  EXPECT_TRUE(context.notes.empty());
  // The others stay.
  EXPECT_EQ(obj(triangle + "f 1/x/1 2/1/1 3/1/1\n").attributes.at(0).name, "normal");
}

TEST_F(AttributeFileTest, MissingValuesAreErrors) {
  const std::string faces = "3 0 1 2\n3 1 3 2\n";
  EXPECT_NE(error_of(ply_text("property float quality\n", "", "0 0 0 1\n1 0 0 2\n0 1 0 \n1 1 0 4\n" + faces))
                .find("line 13: the line has fewer values"),
            std::string::npos);
  EXPECT_NE(error_of(ply_text("", "property list uchar float texcoord\n",
                              "0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2 6 0 0 0 0"))
                .find("truncated"),
            std::string::npos);
}

}  // namespace mesh_file_attributes_test
}  // namespace hermesh
