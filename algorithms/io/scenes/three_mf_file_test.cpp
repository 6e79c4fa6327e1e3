#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>

#include "algorithms/io/mesh_file.h"
#include "algorithms/io/scenes/scene_files_for_tests.h"
#include "algorithms/io/test_mesh_files.h"

namespace hermesh {
namespace three_mf_file_test {

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
  /// Expects that the message about this model names the file and contains these words.
  void expect_error(const std::string& model, const std::string& part) {
    const std::string sentence = error_of(model);
    expect_words(sentence, part);
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

TEST_F(ThreeMfFileTest, TheUnitIsReadAndChangesNoNumber) {
  const auto with = [&](const std::string& unit) {
    return read(model_of(object_of(1, kTriangle), "<item objectid=\"1\"/>", unit));
  };
  EXPECT_EQ(with("unit=\"inch\"").points[1], Vector3d(1, 0, 0));
  EXPECT_EQ(with("unit=\"inch\"").metres, 0.0254);
  EXPECT_EQ(with("unit=\"millimeter\"").metres, 0.001);
  EXPECT_EQ(with("").metres, 0.001);
  EXPECT_TRUE(context.notes.empty());
  EXPECT_EQ(with("unit=\"cubit\"").metres, 0.0);
  EXPECT_EQ(context.notes.size(), 1u);
}

TEST_F(ThreeMfFileTest, PrefixesAreThoseOfTheNamespaces) {
  // As written by Python's XML library. Elements with another prefix belong to another extension.
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
  expect_words(MeshFileTest::error_of("a.3mf", archive("3D/other.model")), "no file '3D/Objects/Part.model'");
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
    expect_words(MeshFileTest::error_of("a.3mf", whole.substr(0, size)), "truncated");
  const auto error = [&](const std::string& name, const std::string& bytes) {
    return MeshFileTest::error_of(name, bytes);
  };
  expect_words(error("a.3mf", zip_of({{"word/document.xml", "<w/>"}})), "without a model of 3MF");
  expect_words(error("a.3mf", "solid\n"), "is named .3mf but holds STL");
  expect_words(error("a.stl", whole), "is named .stl but holds a ZIP archive");
  // Offsets from the signature of the last entry of the directory, and from that of its local header: flags
  // at 8 and 6, method at 10 and 8, checksum at 16 and 14, length at 24 and 22.
  const std::size_t entry = whole.rfind("PK\1\2"), local = whole.rfind("PK\3\4");
  const auto changed = [&](std::size_t at, int value, std::size_t local_at = 0) {
    std::string bytes = whole;
    bytes[entry + at] = char(value);
    if (local_at > 0) bytes[local + local_at] = char(value);
    return error("a.3mf", bytes);
  };
  expect_words(changed(8, 1), "encrypted");
  expect_words(changed(10, 12), "method 12");
  expect_words(changed(16, whole[entry + 16] + 1, 14), "another checksum");
  expect_words(changed(24, whole[entry + 24] + 1, 22), "does not unpack");
  expect_words(changed(24, whole[entry + 24] - 1, 22), "another checksum");
  expect_words(changed(27, 127), "an impossible length");
  for (const std::size_t at : {16, 24, 44})
    expect_words(changed(at, whole[entry + at] + 1), "does not agree");
  // A flipped bit anywhere in the packed data is found, if only by the checksum. Their last byte has unused
  // bits.
  for (std::size_t at = local + 46; at + 1 < whole.find("PK\1\2"); ++at) {
    std::string bytes = whole;
    bytes[at] = char(bytes[at] ^ 4);
    EXPECT_NE(error("a.3mf", bytes), "") << at;
  }
  // Marks of an end in a comment are ignored, even thousands.
  for (const int count : {2, 2800}) {
    std::string comment;
    for (int i = 0; i < count; ++i) comment += "PK\5\6 some comment of 22";
    const std::string length = raw(std::uint16_t(comment.size()));
    EXPECT_EQ(error("a.3mf", whole.substr(0, whole.size() - 2) + length + comment), "");
  }
  // As are a whole archive in the comment, and bytes behind the archive.
  const std::string other = zip_of({{"word/document.xml", "<w/>"}});
  EXPECT_EQ(error("a.3mf", whole.substr(0, whole.size() - 2) + raw(std::uint16_t(other.size())) + other), "");
  EXPECT_EQ(error("a.3mf", whole + std::string(100, '\0')), "");
}

/// Of two members of one name the first counts; names are compared without case and leading slash.
TEST_F(ThreeMfFileTest, DuplicateAndOddNames) {
  const std::string item = "<item objectid=\"1\"/>";
  const std::string good = model_of(object_of(1, kTriangle), item), bad = "<svg/>";
  const auto error = [&](const std::vector<std::pair<std::string, std::string>>& members) {
    return MeshFileTest::error_of("a.3mf", zip_of(members));
  };
  EXPECT_EQ(error({{"3D/3dmodel.model", good}, {"3D/3dmodel.model", bad}}), "");
  EXPECT_EQ(error({{"/3d/3DMODEL.model", good}}), "");
  EXPECT_EQ(error({{"3d/3dmodel.model", bad}, {"3D/3dmodel.model", good}}), "");  // the exact name first
  EXPECT_EQ(error({{std::string(3000, 'a'), bad}, {"../../x", bad}, {"3D/3dmodel.model", good}}), "");
  expect_words(error({{"3D/3dmodel.model ", good}}), "without a model");
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

/// A directory that declares 400 MB: the compressed data could expand to that size, but the text of a mesh
/// never compresses to a thousandth.
TEST_F(ThreeMfFileTest, ArchivesMadeToDoHarmAreRefused) {
  std::string noise;
  std::mt19937 random(1);
  for (int i = 0; i < 500000; ++i) noise += char(random());
  std::string archive = three_mf_of(noise);
  const std::size_t entry = archive.rfind("PK\1\2");
  const std::uint32_t length = 400'000'000;
  for (int i = 0; i < 4; ++i) archive[entry + 24 + std::size_t(i)] = char(length >> 8 * i);
  expect_words(MeshFileTest::error_of("a.3mf", archive), "which is the limit");
}

TEST_F(ThreeMfFileTest, TheUnitIsTheMillimetreUnlessItIsKnown) {
  const PolygonMesh mesh = random_mesh(1, {1, 2, 3});
  const MeshFile numbers = to_mesh_file(mesh);
  for (const double metres : {0.0, 1e-3, 0.0254, 1.0}) {
    write_mesh(folder / "a.3mf", mesh, context, metres);
    const MeshFile read_back = read_mesh_file(folder / "a.3mf", context);
    EXPECT_EQ(read_back.points, numbers.points);
    EXPECT_EQ(read_back.metres, metres > 0.0 ? metres : 1e-3);
  }
  // Kilometres are none of the format's units, and glTF has metres only.
  for (const char* name : {"a.3mf", "a.glb", "a.gltf"}) {
    write_mesh(folder / name, mesh, context, 1000.0);
    const MeshFile scaled = read_mesh_file(folder / name, context);
    const Bounds here = bounds(mesh), there = bounds(to_polygon_mesh(scaled));
    EXPECT_LT((scaled.metres * there.lower - 1000.0 * here.lower).norm(), 1e-4) << name;
    EXPECT_LT((scaled.metres * there.upper - 1000.0 * here.upper).norm(), 1e-4) << name;
  }
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
  expect_words(error_of(levels_of_ten(10)), "half of the memory");
  objects = object_of(1, "");  // nothing, as many times
  expect_words(error_of(levels_of_ten(20)), "half of the memory");
}

TEST_F(ThreeMfFileTest, LongChainsOfComponentsAreRefused) {
  // Items in ascending order, so that each chain is one longer than the part that was summed up before.
  std::string objects = object_of(1, kTriangle), items = "<item objectid=\"1\"/>";
  for (int id = 2; id < 20000; ++id) {
    objects +=
        object_of(id, "<components><component objectid=\"" + std::to_string(id - 1) + "\"/></components>");
    items += "<item objectid=\"" + std::to_string(id) + "\"/>";
  }
  expect_words(error_of(model_of(objects, items)), "more than 100 deep");
}

TEST_F(ThreeMfFileTest, TrianglesWithACornerTwiceAreLeftOutWithANote) {
  PolygonMesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 1, 1}};
  mesh.quads.push_back({0, 1, 2, 2});
  write_mesh(folder / "a.3mf", mesh, context);
  EXPECT_EQ(context.notes.size(), 1u);
  expect_words(context.notes[0], "2 triangles with a corner twice");
  EXPECT_EQ(read_mesh(folder / "a.3mf", context).triangles, (Triangles{{0, 1, 2}, {0, 1, 2}}));
}

TEST_F(ThreeMfFileTest, LeavesOutWhatIsNoPartOfTheModelWithNotes) {
  const auto count = [&](const std::string& model, std::size_t notes) {
    context.notes.clear();
    const std::size_t triangles = read(model).triangles.size();
    EXPECT_EQ(context.notes.size(), notes);
    return triangles;
  };
  const std::string both = "<item objectid=\"1\"/><item objectid=\"2\"/>";
  for (const char* type : {"support", "solidsupport", "other"})
    EXPECT_EQ(count(model_of(object_of(1, kTriangle) + "<object id=\"2\" type=\"" + type + "\">" + kTriangle +
                                 "</object>",
                             both),
                    1),
              1u);
  EXPECT_EQ(count(model_of(object_of(1, kTriangle) + object_of(2, kTriangle),
                           "<item objectid=\"1\"/><item objectid=\"2\" printable=\"0\"/>"),
                  1),
            1u);
  const std::string lattice =
      "<mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/></vertices><triangles/>"
      "<b:beamlattice xmlns:b=\"http://b\"/></mesh>";
  EXPECT_EQ(count(model_of(object_of(1, kTriangle) + object_of(2, lattice), both), 1), 1u);
  expect_error(model_of(object_of(1, lattice), "<item objectid=\"1\"/>"), "beam");
}

TEST_F(ThreeMfFileTest, LeavesOutNegativePartsOfSlicers) {
  const std::string two =
      "<mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"1\" y=\"0\" z=\"0\"/><vertex x=\"0\" "
      "y=\"2\" z=\"0\"/></vertices><triangles><triangle v1=\"0\" v2=\"1\" v3=\"2\"/>"
      "<triangle v1=\"0\" v2=\"2\" v3=\"1\"/></triangles></mesh>";
  const auto with = [&](const std::string& model, const char* name, const std::string& settings) {
    context.notes.clear();
    return MeshFileTest::read("a.3mf", zip_of({{"_rels/.rels", kRelationshipsForTests},
                                               {"3D/3dmodel.model", model},
                                               {name, "<config>" + settings + "</config>"}}));
  };
  const auto volume = [](int triangle, const char* type) {
    const std::string id = std::to_string(triangle);
    return "<volume firstid=\"" + id + "\" lastid=\"" + id +
           "\"><metadata type=\"volume\" key=\"volume_type\" value=\"" + type + "\"/></volume>";
  };
  const std::string one_object = model_of(object_of(1, two), "<item objectid=\"1\"/>");
  const MeshFile prusa =
      with(one_object, "Metadata/Slic3r_PE_model.config",
           "<object id=\"1\">" + volume(0, "NegativeVolume") + volume(1, "ModelPart") + "</object>");
  EXPECT_EQ(prusa.triangles, (Triangles{{0, 2, 1}}));
  EXPECT_EQ(context.notes.size(), 1u);
  const std::string assembly =
      "<components><component objectid=\"1\"/><component objectid=\"2\"/></components>";
  const MeshFile bambu = with(model_of(object_of(1, kTriangle) + object_of(2, two) + object_of(3, assembly),
                                       "<item objectid=\"3\"/>"),
                              "Metadata/model_settings.config",
                              "<object id=\"3\"><part id=\"1\" subtype=\"normal_part\"/>"
                              "<part id=\"2\" subtype=\"modifier_part\"/></object>");
  EXPECT_EQ(bambu.triangles.size(), 1u);
  EXPECT_EQ(context.notes.size(), 1u);
}

}  // namespace three_mf_file_test
}  // namespace hermesh
