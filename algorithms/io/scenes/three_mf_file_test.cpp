#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>

#include "algorithms/io/mesh_units.h"
#include "algorithms/io/scenes/scene_files_for_tests.h"
#include "algorithms/io/test_mesh_files.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using Points = std::vector<Vector3d>;
using Triangles = std::vector<Triangle>;

const std::string kTriangle =
    "<mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"1\" y=\"0\" z=\"0\"/><vertex x=\"0\" "
    "y=\"2\" z=\"0\"/></vertices>"
    "<triangles><triangle v1=\"0\" v2=\"1\" v3=\"2\"/></triangles></mesh>";

std::string object_of(int id, const std::string& content) {
  return "<object id=\"" + std::to_string(id) + "\" type=\"model\">" + content + "</object>\n";
}

class ThreeMfFileTest : public MeshFileTest {
 protected:
  MeshFile read(const std::string& model) { return MeshFileTest::read("a.3mf", three_mf_of(model)); }
  std::string error_of(const std::string& model) {
    return MeshFileTest::error_of("a.3mf", three_mf_of(model));
  }
  /// Holds that the sentence about this model names the file and has these words in it.
  void expect_error(const std::string& model, const std::string& part) {
    const std::string sentence = error_of(model);
    EXPECT_NE(sentence.find(part), std::string::npos) << sentence << "\nrather than " << part;
    EXPECT_EQ(sentence.rfind("'a.3mf'", 0), 0u) << sentence;
  }
};

TEST_F(ThreeMfFileTest, ReadsObjectsThatTheBuildPlaces) {
  const MeshFile mesh =
      read(model_of(object_of(1, kTriangle) + object_of(2, kTriangle), "<item objectid=\"2\"/>"));
  EXPECT_EQ(mesh.points, (Points{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}}));
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}}));
  EXPECT_TRUE(context.notes.empty());
}

TEST_F(ThreeMfFileTest, TransformsMultiplyRowsAndTheInnerComesFirst) {
  // The component turns x to y, y to z and z to x, and moves by 1 2 3; the item doubles and moves by 10 along
  // x.
  const std::string assembly =
      "<components><component objectid=\"1\" transform=\"0 1 0  0 0 1  1 0 0  1 2 3\"/></components>";
  const MeshFile mesh = read(model_of(object_of(1, kTriangle) + object_of(2, assembly),
                                      "<item objectid=\"2\" transform=\"2 0 0 0 2 0 0 0 2 10 0 0\"/>"));
  // (1,0,0) → (0,1,0) → (1,3,3) → (12,6,6); (0,2,0) → (0,0,2) → (1,2,5) → (12,4,10).
  EXPECT_EQ(mesh.points, (Points{{12, 4, 6}, {12, 6, 6}, {12, 4, 10}}));
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}}));
}

TEST_F(ThreeMfFileTest, AMirrorTurnsTrianglesRoundAndCopiesHaveTheirOwnPoints) {
  const MeshFile mesh =
      read(model_of(object_of(1, kTriangle),
                    "<item objectid=\"1\"/><item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 -1 0 0 0\"/>"));
  EXPECT_EQ(mesh.points.size(), 6u);
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}, {3, 5, 4}}));
}

TEST_F(ThreeMfFileTest, NumbersKeepDoublePrecision) {
  std::string mesh = kTriangle;
  mesh.replace(mesh.find("x=\"1\""), 5, "x=\" +1234567.0123456789e-1 \"");
  EXPECT_EQ(read(model_of(object_of(1, mesh), "<item objectid=\"1\"/>")).points[1],
            Vector3d(123456.70123456789, 0, 0));
}

TEST_F(ThreeMfFileTest, AUnitOtherThanTheMillimetreIsANote) {
  EXPECT_EQ(read(model_of(object_of(1, kTriangle), "<item objectid=\"1\"/>", "unit=\"inch\"")).points[1],
            Vector3d(1, 0, 0));
  ASSERT_EQ(context.notes.size(), 1u);
  EXPECT_EQ(context.notes[0],
            "'a.3mf': its lengths are of the unit 'inch'; the numbers were taken as they are");
  read(model_of(object_of(1, kTriangle), "<item objectid=\"1\"/>", "unit=\"millimeter\""));
  EXPECT_EQ(context.notes.size(), 1u);
}

TEST_F(ThreeMfFileTest, PrefixesAreThoseOfTheNamespaces) {
  // As Python's XML library writes it. What has another prefix is of another extension.
  const std::string model =
      "<ns0:model xmlns:ns0=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\" "
      "xmlns:s=\"urn:other\"><!-- <a> -->"
      "<ns0:resources><ns0:object id='1'><ns0:mesh><s:vertices><s:vertex x='9' y='9' z='9'/></s:vertices>"
      "<ns0:vertices><ns0:vertex x='0' y='0' z='0'/><ns0:vertex x='1' y='0' z='0'/><ns0:vertex x='0' y='2' "
      "z='0'/></ns0:vertices>"
      "<ns0:triangles><ns0:triangle v1='0' v2='1' "
      "v3='2'/></ns0:triangles></ns0:mesh></ns0:object></ns0:resources>"
      "<ns0:build><ns0:item objectid='1'/></ns0:build></ns0:model>";
  EXPECT_EQ(read(model).points, (Points{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}}));
}

TEST_F(ThreeMfFileTest, EqualPointsOfAMeshAreOne) {
  const std::string soup =
      "<mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"1\" y=\"0\" z=\"0\"/><vertex x=\"0\" "
      "y=\"2\" z=\"0\"/>"
      "<vertex x=\"1.0\" y=\"-0\" z=\"0\"/><vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"0\" y=\"0\" "
      "z=\"3\"/></vertices>"
      "<triangles><triangle v1=\"0\" v2=\"1\" v3=\"2\"/><triangle v1=\"3\" v2=\"4\" "
      "v3=\"5\"/></triangles></mesh>";
  const MeshFile mesh = read(model_of(object_of(1, soup), "<item objectid=\"1\"/>"));
  EXPECT_EQ(mesh.points.size(), 4u);
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}, {1, 0, 3}}));
}

/// The production extension, by which slicers keep each object in a file of its own.
TEST_F(ThreeMfFileTest, ObjectsMayLieInFilesOfTheirOwn) {
  const std::string production =
      "xmlns:q=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\" requiredextensions=\"q\"";
  const std::string root =
      model_of(object_of(3,
                         "<components><component q:path=\"/3D/Objects/Part.model\" objectid=\"1\" "
                         "transform=\"1 0 0 0 1 0 0 0 1 0 0 5\"/></components>"),
               "<item objectid=\"3\"/>", production);
  const auto archive = [&](const std::string& name) {
    return zip_of({{"_rels/.rels", kRelationshipsForTests},
                   {"3D/3dmodel.model", root},
                   {name, model_of(object_of(1, kTriangle), "")}});
  };
  EXPECT_EQ(MeshFileTest::read("a.3mf", archive("3D/Objects/part.model")).points[2], Vector3d(0, 2, 5));
  EXPECT_NE(
      MeshFileTest::error_of("a.3mf", archive("3D/other.model")).find("no file '3D/Objects/Part.model'"),
      std::string::npos);
}

TEST_F(ThreeMfFileTest, DamageIsASentence) {
  const std::string item = "<item objectid=\"1\"/>";
  const auto with = [&](const std::string& was, const std::string& is) {
    std::string mesh = kTriangle;
    return model_of(object_of(1, mesh.replace(mesh.find(was), was.size(), is)), item);
  };
  expect_error(model_of(object_of(1, kTriangle), ""), "places no object");
  expect_error(model_of(object_of(1, kTriangle), "<item objectid=\"2\"/>"),
               "object 2, which it does not have");
  expect_error(model_of(object_of(1, kTriangle), "<item/>"), "objectid is missing");
  expect_error(model_of(object_of(1, kTriangle) + object_of(1, kTriangle), item),
               "second object with the id 1");
  expect_error(model_of(object_of(1, "<components><component objectid=\"1\"/></components>"), item),
               "contain themselves");
  expect_error(model_of(object_of(1, ""), item), "no polygon");
  expect_error(with("v3=\"2\"", "v3=\"3\""),
               "line 4 of its model: a triangle refers to point 3, but there are 3");
  expect_error(with("v3=\"2\"", "v3=\"-1\""), "v3 is '-1', which is no whole number");
  expect_error(with("v3=\"2\"", "v3=\"4294967296\""), "no whole number");
  expect_error(with("x=\"1\"", "x=\"nan\""), "x has 'nan', which is not a finite number");
  expect_error(with("x=\"1\"", "x=\"1e999\""), "not a finite number");
  expect_error(with("x=\"1\"", ""), "a vertex without x");
  expect_error(with("x=\"1\"", "x=1"), "not well-formed");
  expect_error(with("</mesh>", ""), "mismatched tag");
  expect_error(with("</vertices>", "</vertices"), "not well-formed");
  expect_error(with("x=\"1\"", "x=\"1\" x=\"1\""), "duplicate attribute");
  expect_error(with("x=\"1\"", "x=\"&one;\""), "undefined entity");
  expect_error(model_of(object_of(1, kTriangle), "<item objectid=\"1\" transform=\"1 0 0 0 1\"/>"),
               "not a finite number");
  expect_error(
      model_of(object_of(1, kTriangle), "<item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 0 0 0 1\"/>"),
      "more than twelve");
  expect_error(model_of("", "", "xmlns:b=\"urn:lattices\" requiredextensions=\"b\""),
               "the extension 'urn:lattices'");
  expect_error("<!DOCTYPE model [<!ENTITY a \"aaaa\">]><model/>", "a document type");
  expect_error("<svg/>", "no model");
  expect_error("words", "syntax error");
  expect_error("", "breaks off");
  expect_error("\xFF\xFE<", "breaks off");
  const std::string whole = model_of(object_of(1, kTriangle), item);
  for (std::size_t size = 1; size + 2 < whole.size(); ++size)
    EXPECT_NE(error_of(whole.substr(0, size)), "") << size;
}

TEST_F(ThreeMfFileTest, TheArchiveIsChecked) {
  const std::string whole = three_mf_of(model_of(object_of(1, kTriangle), "<item objectid=\"1\"/>"));
  for (std::size_t size = 4; size < whole.size(); ++size)
    EXPECT_NE(MeshFileTest::error_of("a.3mf", whole.substr(0, size)).find("truncated"), std::string::npos)
        << size;
  const auto error = [&](const std::string& name, const std::string& bytes) {
    return MeshFileTest::error_of(name, bytes);
  };
  EXPECT_NE(error("a.3mf", zip_of({{"word/document.xml", "<w/>"}})).find("without a model of 3MF"),
            std::string::npos);
  EXPECT_NE(error("a.3mf", "solid\n").find("is named .3mf but holds STL"), std::string::npos);
  EXPECT_NE(error("a.stl", whole).find("is named .stl but holds a ZIP archive"), std::string::npos);
  // In the directory, by offsets from the signature of the last entry: flags at 8, method at 10, checksum at
  // 16, length at 24.
  const std::size_t entry = whole.rfind("PK\1\2");
  const auto changed = [&](std::size_t at, char value) {
    std::string bytes = whole;
    bytes[entry + at] = value;
    return error("a.3mf", bytes);
  };
  EXPECT_NE(changed(8, 1).find("encrypted"), std::string::npos);
  EXPECT_NE(changed(10, 12).find("method 12"), std::string::npos);
  EXPECT_NE(changed(16, char(whole[entry + 16] + 1)).find("another checksum"), std::string::npos);
  EXPECT_NE(changed(24, char(whole[entry + 24] + 1)).find("does not unpack"), std::string::npos);
  EXPECT_NE(changed(27, 127).find("a length that it cannot have"), std::string::npos);
  EXPECT_NE(changed(44, 127).find("is not where"), std::string::npos);
  // Marks of an end in a comment: a few are passed over, thousands are refused before the directory is read
  // for each.
  const auto with_marks = [&](int count) {
    std::string bytes = whole, comment;
    for (int i = 0; i < count; ++i) comment += "PK\5\6 some comment of 22";
    bytes[bytes.size() - 2] = char(comment.size() & 255);
    bytes[bytes.size() - 1] = char(comment.size() >> 8);
    return error("a.3mf", bytes + comment);
  };
  EXPECT_EQ(with_marks(2), "");
  EXPECT_NE(with_marks(2900).find("more ends than one"), std::string::npos);
}

TEST_F(ThreeMfFileTest, EncodingsAndCharactersByNumberAreRead) {
  std::string mesh = kTriangle;
  mesh.replace(mesh.find("x=\"1\""), 5, "x=\"&#49;&#x32;\"");
  const std::string text = model_of(object_of(1, mesh), "<item objectid=\"1\"/>");
  EXPECT_EQ(read("\xEF\xBB\xBF" + text).points[1], Vector3d(12, 0, 0));
  // The format is in UTF-8 or UTF-16.
  std::string wide = "\xFF\xFE";
  for (const char c : text.substr(text.find('\n') + 1)) wide += {c, '\0'};
  EXPECT_EQ(read(wide).points[1], Vector3d(12, 0, 0));
}

TEST_F(ThreeMfFileTest, WhatStandsBehindTheModelIsPassedOver) {
  const std::string text = model_of(object_of(1, kTriangle), "<item objectid=\"1\"/>");
  EXPECT_EQ(read(text + std::string(100, '\0') + "<& ").triangles.size(), 1u);
}

/// A parser keeps every name and the tag that it is in.
TEST_F(ThreeMfFileTest, XmlMadeToDoHarmDoesNotEatMemory) {
  expect_error("<model a=\"" + std::string(std::size_t(1) << 24, 'a') + "\"/>", "a tag of millions of bytes");
  std::string names;
  for (int i = 0; i < 300000; ++i) names += "<e" + std::to_string(i) + "/>";
  expect_error(model_of(names, ""), "as many names");
  std::string deep;
  for (int i = 0; i < 2000; ++i) deep += "<a>";
  expect_error(model_of(deep, ""), "nested too deeply");
}

TEST_F(ThreeMfFileTest, TheSameMeshGivesTheSameBytesInAnyTimeZone) {
  const char* const before = std::getenv("TZ");
  const std::string zone = before ? before : "";
  std::vector<std::string> archives;
  for (const char* each : {"UTC", "America/New_York", "Asia/Tokyo"}) {
    setenv("TZ", each, 1);
    tzset();
    write_mesh(folder / "a.3mf", random_mesh(1, {1, 2, 3}), context);
    archives.push_back(bytes_of(folder / "a.3mf"));
  }
  before ? setenv("TZ", zone.c_str(), 1) : unsetenv("TZ");
  tzset();
  EXPECT_EQ(archives[0], archives[1]);
  EXPECT_EQ(archives[0], archives[2]);
  // Time and date of the last entry in the directory: midnight of 1 January 1980.
  EXPECT_EQ(archives[0].substr(archives[0].rfind("PK\1\2") + 12, 4), std::string("\0\0\x21\0", 4));
}

TEST_F(ThreeMfFileTest, WritingCanBeCancelled) {
  const std::atomic<bool> cancel = true;
  context.cancel = &cancel;
  EXPECT_THROW(write_mesh(folder / "a.3mf", random_mesh(1, {0, 0, 0}), context), Cancelled);
  EXPECT_TRUE(files().empty());
}

/// A directory that declares 400 MB: what is packed could hold them, but no text of a mesh packs to a
/// thousandth.
TEST_F(ThreeMfFileTest, ArchivesMadeToDoHarmAreRefused) {
  std::string noise;
  std::mt19937 random(1);
  for (int i = 0; i < 500000; ++i) noise += char(random());
  std::string archive = three_mf_of(noise);
  const std::size_t entry = archive.rfind("PK\1\2");
  const std::uint32_t length = 400'000'000;
  for (int i = 0; i < 4; ++i) archive[entry + 24 + std::size_t(i)] = char(length >> 8 * i);
  EXPECT_NE(MeshFileTest::error_of("a.3mf", archive).find("which is the limit"), std::string::npos);
}

TEST_F(ThreeMfFileTest, TheUnitIsTheMillimetreUnlessItIsKnown) {
  const PolygonMesh mesh = random_mesh(1, {1, 2, 3});
  write_mesh(folder / "a.3mf", mesh, context);
  const PolygonMesh read_back = read_mesh(folder / "a.3mf", context);
  EXPECT_TRUE(
      std::ranges::none_of(context.notes, [](const auto& note) { return note.find("unit") != note.npos; }));
  write_mesh_in_metres(folder / "b.3mf", mesh, context);
  EXPECT_EQ(read_mesh(folder / "b.3mf", context), read_back);
  EXPECT_NE(context.notes.back().find("'meter'"), std::string::npos);
}

/// Ten objects of ten components each would be ten thousand million triangles.
TEST_F(ThreeMfFileTest, RepetitionDoesNotEatMemory) {
  std::string objects = object_of(1, kTriangle);
  const auto levels_of_ten = [&](int levels) {
    for (int id = 2; id < 2 + levels; ++id) {
      std::string components;
      for (int i = 0; i < 10; ++i) components += "<component objectid=\"" + std::to_string(id - 1) + "\"/>";
      objects += object_of(id, "<components>" + components + "</components>");
    }
    return model_of(objects, "<item objectid=\"" + std::to_string(1 + levels) + "\"/>");
  };
  EXPECT_NE(error_of(levels_of_ten(10)).find("half of the memory"), std::string::npos);
  objects = object_of(1, "");  // nothing, as many times
  EXPECT_NE(error_of(levels_of_ten(20)).find("half of the memory"), std::string::npos);
}

TEST_F(ThreeMfFileTest, LongChainsOfComponentsAreRefused) {
  // Items in ascending order, so that each chain is one longer than what was summed up before.
  std::string objects = object_of(1, kTriangle), items = "<item objectid=\"1\"/>";
  for (int id = 2; id < 20000; ++id) {
    objects +=
        object_of(id, "<components><component objectid=\"" + std::to_string(id - 1) + "\"/></components>");
    items += "<item objectid=\"" + std::to_string(id) + "\"/>";
  }
  EXPECT_NE(error_of(model_of(objects, items)).find("more than 100 deep"), std::string::npos);
}

TEST_F(ThreeMfFileTest, TrianglesWithACornerTwiceAreLeftOutWithANote) {
  PolygonMesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 1, 1}};
  mesh.quads.push_back({0, 1, 2, 2});
  write_mesh(folder / "a.3mf", mesh, context);
  EXPECT_EQ(context.notes.size(), 1u);
  EXPECT_NE(context.notes[0].find("2 triangles with a corner twice"), std::string::npos) << context.notes[0];
  EXPECT_EQ(read_mesh(folder / "a.3mf", context).triangles, (Triangles{{0, 1, 2}, {0, 1, 2}}));
}

}  // namespace
}  // namespace hermesh
