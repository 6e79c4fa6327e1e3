// Files that violate their format as other programs write them: each is the same tetrahedron, with one note
// about the deviation, or an Error.
#include <gtest/gtest.h>

#include <algorithm>

#include "algorithms/io/test_mesh_files.h"

namespace hermesh {
namespace mesh_file_foreign_test {

class ForeignFileTest : public MeshFileTest {
 protected:
  /// Expects the tetrahedron from the file, and one note that holds `note`, or none where that is empty.
  void expect_read(const std::string& name, const std::string& bytes, const std::string& note = "") {
    SCOPED_TRACE(name + ": " + bytes.substr(0, 120));
    context.notes.clear();
    MeshFile mesh;
    ASSERT_EQ(error_in([&] { mesh = read(name, bytes); }), "");
    EXPECT_EQ(mesh.points, tetrahedron_points);
    EXPECT_EQ(mesh.triangles, tetrahedron_triangles);
    EXPECT_TRUE(mesh.quads.empty());
    EXPECT_EQ(context.notes.size(), note.empty() ? 0u : 1u);
    if (!note.empty() && !context.notes.empty()) {
      expect_words(context.notes[0], note);
      EXPECT_TRUE(context.notes[0].starts_with("'" + name + "': ")) << context.notes[0];
    }
  }
  void expect_refused(const std::string& name, const std::string& bytes, const std::string& words) {
    SCOPED_TRACE(name);
    expect_words(error_of(name, bytes), words);
  }
};

TEST_F(ForeignFileTest, LineEndsOfAllSystems) {
  for (const char* end : {"\r", "\r\n", "\n\r\n", " \t\n"}) {
    expect_read("a.obj", replaced(obj_text, "\n", end));
    expect_read("a.off", replaced(off_text, "\n", end));
    expect_read("a.stl", replaced(stl_text() + "endsolid part\n", "\n", end));
    expect_read("a.ply", replaced(ply_text, "\n", std::string(end) == "\n\r\n" ? "\r\n" : end));
  }
  // Of files put together on two systems.
  expect_read("b.obj", replaced(obj_text, "0\nv", "0\rv"));
  expect_read("b.ply", replaced(ply_text, "0\n1", "0\r1"));
  expect_read("c.ply", replaced(ply_text, "ply\n", "ply\r\n"));
  // As a line that goes on on the next one.
  for (const char* end : {"\\\n", " \\\n", "\\\r\n", " \\\r", "\\ \n"})
    expect_read("c.obj", replaced(replaced(obj_text, "0 1.5", "0" + std::string(end) + " 1.5"), "f 1 3 4",
                                  "f 1 3" + std::string(end) + " 4"));
}

TEST_F(ForeignFileTest, LinesAreCountedWhateverEndsThem) {
  for (const char* end : {"\n", "\r", "\r\n"})
    EXPECT_EQ(error_of("a.obj", replaced("v 0 0 0\nv 1 0 0\nv 0 x 0\n", "\n", end)),
              "'a.obj', line 3: 'x' is not a number");
}

TEST_F(ForeignFileTest, ByteOrderMarks) {
  const std::string mark = "\xEF\xBB\xBF";
  expect_read("a.obj", mark + obj_text);
  expect_read("a.off", mark + off_text);
  expect_read("a.ply", mark + ply_text);
  expect_read("a.stl", mark + stl_text() + "endsolid\n");
  std::string wide = "\xFF\xFE";
  for (const char c : obj_text) wide += {c, '\0'};
  expect_refused("b.obj", wide, "UTF-16");
}

TEST_F(ForeignFileTest, PaddingBehindTheData) {
  for (const std::string& text : {obj_text, off_text, ply_text, stl_text() + "endsolid part\n"}) {
    const std::string name = text == obj_text   ? "a.obj"
                             : text == off_text ? "a.off"
                             : text == ply_text ? "a.ply"
                                                : "a.stl";
    expect_read(name, text + " \n\t\r\n");
    for (const std::string& padding : {std::string("\x1a"), std::string("\n\x1a\n"), std::string(600, '\0')})
      expect_read(name, text + padding, "zeros or Ctrl-Z");
  }
  expect_read("b.stl", binary_stl(4) + "\n");
  expect_read("b.stl", binary_stl(4) + std::string(13, '\0'), "zeros or Ctrl-Z");
}

TEST_F(ForeignFileTest, WhatFollowsTheDataIsNotIgnored) {
  expect_refused("a.off", off_text + "3 0 1 2\n",
                 "line 11: the file holds more than the 4 points and 4 polygons");
  expect_refused("a.ply", ply_text + "3 0 1 2\n", "more than its header declares");
  expect_refused("a.stl", binary_stl(4) + "abc", "bytes follow");
  expect_refused("b.stl", stl_text() + "endsolid part\nv 0 0 0\n", "no keyword of an STL file");
  expect_refused("a.obj", obj_text + "\x01\n", "'?' is no keyword");
  std::string binary = replaced(
      replaced(ply_text.substr(0, ply_text.find("end_header") + 11), "ascii", "binary_little_endian"),
      "vertex 4", "vertex 3");
  binary = replaced(binary, "face 4", "face 1");
  for (const float x : {0, 0, 0, 1, 0, 0, 0, 1, 0}) binary += raw(x);
  binary += '\3' + raw(0) + raw(1) + raw(2);
  EXPECT_EQ(error_of("b.ply", binary), "");
  expect_refused("b.ply", binary + "\3", "1 bytes more than its header declares");
}

TEST_F(ForeignFileTest, OffKeywords) {
  expect_read("a.off", "OFF4 4 0\n" + off_body, "keyword and the count");
  expect_read("a.off", "4 4 0\n" + off_body, "lacks the keyword");
  expect_read("a.off", "# made by hand\n4 4\n" + off_body, "lacks the keyword");
  expect_read("a.off", "off\n4 4 0\n" + off_body);
  for (const char* keyword : {"COFF", "NOFF", "STOFF", "CNOFF", "NCOFF", "STCNOFF", "NCSTOFF", "OFF # text"})
    expect_read("a.off", std::string(keyword) +
                             "\n4 4 0\n0 0 0 .1 .2 .3\n1 0 0 .1 .2 .3\n0 1.5 0 9\n0 0 -2.25 1 # last\n" +
                             off_body.substr(off_body.find("3 0 1 2")));
  expect_read("a.off", "COFF4 4 0\n" + off_body, "keyword and the count");
  expect_refused("a.off", "4OFF\n4 4 0\n" + off_body, "4OFF files are not read");
  expect_refused("a.off", "nOFF\n3\n4 4 0\n" + off_body, "nOFF files are not read");
  expect_refused("a.off", "OFFICE\n4 4 0\n", "does not begin like OFF");
}

/// OFF BINARY as Geomview and CGAL, PMP and OpenMesh write it, without normals and with.
TEST_F(ForeignFileTest, BinaryOff) {
  for (const bool big : {true, false})
    for (const bool counted : {true, false})
      for (const std::string keyword : {"OFF", "NOFF", "COFF", "STCNOFF"}) {
        std::string bytes = keyword + " BINARY\n" + raw(4, big) + raw(4, big) + raw(0, big);
        const std::size_t more = keyword == "NOFF" ? 3 : keyword == "COFF" ? 4 : keyword == "OFF" ? 0 : 9;
        for (const Eigen::Vector3d& p : tetrahedron_points) {
          for (const double x : p) bytes += raw(static_cast<float>(x), big);
          for (std::size_t i = 0; i < more; ++i) bytes += raw(0.5f, big);
        }
        for (std::size_t t = 0; t < 4; ++t) {
          bytes += raw(3, big);
          for (const std::uint32_t corner : tetrahedron_triangles[t]) bytes += raw(corner, big);
          if (!counted) continue;
          const int colour = t == 2 ? 3 : 0;
          bytes += raw(colour, big);
          for (int i = 0; i < colour; ++i) bytes += raw(0.25f, big);
        }
        expect_read("a.off", bytes);
        expect_refused("a.off", bytes.substr(0, bytes.size() - 5), "binary data are of another length");
        expect_refused("a.off", bytes + "abc", "binary data are of another length");
      }
}

TEST_F(ForeignFileTest, PlyHeaders) {
  expect_read("a.ply", replaced(ply_text, "ply\n", "ply \t\n"));
  expect_read("a.ply", replaced(ply_text, "end_header\n", "end_header  \n"));
  expect_read("a.ply", replaced(ply_text, "format ascii 1.0\n",
                                "comment first\nformat ascii 1.0\ncomment\nobj_info x\n\n"));
  expect_read(
      "a.ply",
      replaced(ply_text, "element vertex", "Created by a modeller, source file: a.b\nVCGLIB\nelement vertex"),
      "2 lines of its header that are no declaration were ignored, the first is line 3");
  // A line in the form of a declaration may be a damaged declaration.
  expect_refused("a.ply", replaced(ply_text, "element face", "elemnet face"),
                 "line 7: 'elemnet' is no keyword");
  expect_refused("a.ply", replaced(ply_text, "property float y", "proprety float y"),
                 "line 5: 'proprety' is no keyword");
  expect_refused("a.ply", replaced(ply_text, "property list", "properly list"),
                 "line 8: 'properly' is no keyword");
  for (const char* types :
       {"list uchar uint vertex_index", "list int int vertex_indices", "list uint8 int32 vertex_indices",
        "list char short vertex_index", "list ushort uchar vertex_index"})
    expect_read("a.ply", replaced(ply_text, "list uchar int vertex_indices", types));
}

TEST_F(ForeignFileTest, AsciiPlyIsReadByLines) {
  // The header declares fewer properties than the lines hold.
  const std::string long_lines =
      replaced(replaced(ply_text, "0 2 3\n", "0 2 3 6 .1 .2 .3 .4 .5 .6 9 \n"), "1 0 0\n", "1 0 0 255 255\n");
  expect_read("a.ply", long_lines, "2 lines hold more words than the header declares, the first is line 11");
  const std::string list =
      replaced(ply_text, "vertex_indices\n",
               "vertex_indices\nproperty list uchar float texcoord\nproperty uchar red\n");
  expect_read("b.ply",
              replaced(replaced(replaced(replaced(list, "3 0 1 2\n", "3 0 1 2 0 7\n"), "3 0 2 3\n",
                                         "3 0 2 3 2 .5 .5 7 8 9\n"),
                                "3 0 3 1\n", "3 0 3 1 0 7\n"),
                       "3 1 3 2\n", "3 1 3 2 0 7\n"),
              "1 lines hold more words");
  // Too few words on a line are not made up from the next one.
  expect_refused("c.ply", replaced(ply_text, "3 0 2 3\n", "3 0 2\n"), "line 15: the line has fewer values");
  expect_refused("c.ply", replaced(ply_text, "1 0 0\n", "1 0\n"), "line 11: the line has fewer values");
  expect_refused("c.ply", replaced(ply_text, "0 0 0\n1 0 0\n", "0 0 0 1 0 0\n"), "");
  expect_refused("c.ply", replaced(ply_text, "3 1 3 2\n", "3 1 3\n"), "truncated");
  // A list may take several lines, but not share the last one.
  expect_read("d.ply", replaced(ply_text, "3 0 2 3\n", "3\n0 2\n\n3\n"));
  expect_read("d.ply", replaced(ply_text, "3 0 2 3\n", "\n3 0 2 3\n \n"));
  expect_read("d.ply",
              replaced(ply_text, "3 0 2 3\n", "comment polygons\n# more\n3 0 2 3\n") + "comment end\n");
}

TEST_F(ForeignFileTest, TriangleStrips) {
  const std::string strips = "ply\n" + ply_head +
                             "element tristrips 1\nproperty list int int vertex_indices\nend_header\n" +
                             off_body.substr(0, off_body.find("3 0 1 2"));
  // Every other triangle of a strip is flipped; −1 begins a new strip, and a repeated corner only continues
  // it.
  context.notes.clear();
  EXPECT_EQ(read("a.ply", strips + "10 0 1 2 3 -1 0 3 1 1 2\n").triangles,
            (std::vector<Triangle>{{0, 1, 2}, {2, 1, 3}, {0, 3, 1}}));
  EXPECT_EQ(read("a.ply", strips + "9 0 1 2 -1 2 -1 1 3 2\n").triangles,
            (std::vector<Triangle>{{0, 1, 2}, {1, 3, 2}}));
  EXPECT_EQ(read("a.ply", replaced(strips, "int int", "int uint") + "7 0 1 2 4294967295 1 3 2\n").triangles,
            (std::vector<Triangle>{{0, 1, 2}, {1, 3, 2}}));
  EXPECT_TRUE(context.notes.empty());
  expect_refused("a.ply", strips + "3 0 1 4\n", "refers to point 4");
  expect_refused("a.ply", strips + "3 0 1 -2\n", "refers to point -2");
  // With polygons and their attributes in addition.
  const std::string both = replaced(strips, "end_header",
                                    "element face 1\nproperty list uchar int vertex_indices\nproperty "
                                    "list uchar float texcoord\nproperty int part\nend_header");
  const MeshFile file =
      mesh_formats::parse_mesh(both + "4 0 1 2 3\n3 0 1 2 6 1 2 3 4 5 6 7\n", mesh_formats::Format::ply,
                               "a.ply", context, {.attributes = true});
  ASSERT_EQ(file.triangles.size(), 3u);
  ASSERT_EQ(file.attributes.size(), 2u);
  EXPECT_EQ(std::get<1>(file.attributes[0].values), (std::vector<std::int32_t>{-1, -1, 7}));
  EXPECT_EQ(std::get<0>(file.attributes[1].values),
            (std::vector<float>{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 4, 5, 6}));
}

TEST_F(ForeignFileTest, TheSizeOfABinaryStlDecides) {
  for (const std::string header :
       {"exported", "solid part", "COLOR=\xff\xff\xff\xff,MATERIAL=abc", "v 1.0", "ply ", "OFF"}) {
    expect_read("a.stl", binary_stl(4, header));
    for (const std::uint32_t count : {0u, 2u, 5u, 0xffffffffu})
      expect_read("a.stl", binary_stl(count, header),
                  "declares " + std::to_string(count) + " triangles but has the length of 4");
  }
  expect_refused("a.stl", binary_stl(5) + "x", "truncated");
  expect_refused("a.stl", binary_stl(3) + "x", "51 bytes follow");
  expect_refused("a.stl", binary_stl(5).substr(0, 84), "truncated");
}

TEST_F(ForeignFileTest, TextStl) {
  expect_read("a.stl", stl_text() + "end solid part\n");
  expect_read("a.stl", stl_text("part", "end loop", "end facet") + "END SOLID\n");
  expect_read("a.stl", stl_text() + "endsolid facet normal vertex\n");
  expect_read("a.stl", stl_text(), "does not end in 'endsolid'; if there was more than 4 facets");
  expect_read("a.stl", stl_text("part", "endloop", "end facet"), "does not end in 'endsolid'");
  expect_read("a.stl", "# from a CAD\n" + stl_text() + "endsolid # done\n");
  expect_read("a.stl", stl_text().substr(11) + "endsolid\n");  // no line 'solid'
  expect_read("a.stl", replaced(stl_text(), "  outer", "  color 1 0 0\n  outer") + "endsolid\n",
              "4 lines that do not belong");
  const std::string whole = stl_text() + "endsolid part\n";
  expect_refused("a.stl", replaced(whole, "vertex 1 0 0", "vertx 1 0 0"), "");
  for (const char* word : {"vertx 0 0 0", "0 0 0"})
    EXPECT_NE(error_of("a.stl", replaced(whole, "vertex 0 0 0", word)), "") << word;
  EXPECT_NE(error_of("a.stl", replaced(whole, "endloop", "endlop")), "");
  expect_refused("a.stl", whole.substr(0, whole.find("endsolid") - 3), "truncated");
}

TEST_F(ForeignFileTest, PointsThatNoPolygonUsesMayBeAnything) {
  for (const char* bad : {"nan", "-nan", "NaN", "nan(ind)", "-nan(ind)", "1.#IND", "-1.#IND", "1.#QNAN",
                          "1.#QNAN0", "1.#INF", "-1.#INF00", "inf", "-Infinity", "1e999", "1e300"}) {
    expect_read(
        "a.obj",
        "v " + std::string(bad) + " 0 0\n" +
            replaced(replaced(replaced(replaced(obj_text, "f 1 2 3", "f 2 3 4"), "f 1 3 4", "f 2 4 5"),
                              "f 1 4 2", "f 2 5 3"),
                     "f 2 4 3", "f 3 5 4"),
        "1 points that no polygon uses were left out");
    expect_read(
        "a.off",
        replaced(replaced(off_text, "4 4 0", "5 4 0"), "-2.25\n", "-2.25\n1 2 " + std::string(bad) + "\n"),
        "1 points that no polygon uses");
    if (std::string(bad) == "1e300") continue;
    expect_refused("b.off", replaced(off_text, "1.5", bad),
                   "point 2 (counting from 0) has a coordinate that is not a finite number");
  }
  // Their attributes go with them.
  const MeshFile file = mesh_formats::parse_mesh(
      "v 0 0 0 .1 .2 .3\nv nan 0 0 9 9 9\nv 1 0 0 .4 .5 .6\nv 0 1 0 .7 .8 .9\nf 1 3 4\n",
      mesh_formats::Format::obj, "a.obj", context, {.attributes = true});
  EXPECT_EQ(file.points.size(), 3u);
  ASSERT_EQ(file.attributes.size(), 1u);
  EXPECT_EQ(std::get<0>(file.attributes[0].values),
            (std::vector<float>{.1f, .2f, .3f, .4f, .5f, .6f, .7f, .8f, .9f}));
}

TEST_F(ForeignFileTest, DecimalCommasAreRefusedWithAHint) {
  expect_refused("a.obj", replaced(obj_text, "1.5", "1,5"), "'1,5' is not a number; decimals need a point");
  expect_refused("a.off", replaced(off_text, "1.5", "1,5"), "'1,5' is not a number; decimals need a point");
  expect_refused("a.ply", replaced(ply_text, "1.5", "1,5"), "'1,5' is not a number; decimals need a point");
  expect_refused("a.stl", replaced(stl_text(), "1.5", "1,5"), "'1,5' is not a number; decimals need a point");
}

TEST_F(ForeignFileTest, Obj) {
  expect_read("a.obj", replaced(obj_text, "f ", "fo "));
  expect_read("a.obj", replaced(obj_text, "f 1 2 3", "f -4 -3 -2"));
  expect_read("a.obj", replaced(obj_text, "f 1 2 3", "f 1/ 2// 3/#c"));
  expect_read("a.obj",
              replaced(obj_text, "f 1 2 3", "l 1 2\np 1\nf 1/,/ 2/1,5/x 3"));  // no attributes are requested
  expect_read("a.obj", obj_text + "cstype bezier\nsurf 0 1 0 1 1 2 3 4\nend\ncall other.obj\n",
              "curves, surfaces or calls of other files on 2 lines");
}

/// Complaints quote a file without control characters and without megabytes of a word.
TEST_F(ForeignFileTest, SentencesAreCleanAndShort) {
  const std::string evil = "\x1b[31m\x1b]0;pwned\x07" + std::string(3000000, 'a');
  const std::vector<std::pair<std::string, std::string>> files = {
      {"a.ply", replaced(ply_text, "ascii", evil)},
      {"a.ply", replaced(ply_text, "float x", evil + " x")},
      {"a.ply", replaced(ply_text, "element face 4",
                         "element face 4 4\nelement " + evil + " 99999999\nproperty int i\nelement face 4")},
      {"a.ply", replaced(ply_text, "format", evil + " list")},
      {"a.ply", replaced(ply_text, "1.5", evil)},
      {"a.obj", replaced(obj_text, "1.5", evil)},
      {"a.obj", replaced(obj_text, "f 1 2 3", "f 1 2 " + evil)},
      {"a.obj", obj_text + evil},
      {"a.off", replaced(off_text, "1.5", evil)},
      {"a.off", "OFF " + evil},
      {"a.off", evil + "OFF"},
      {"a.stl", "solid\n" + evil},
      {"a.stl", replaced(stl_text(), "1.5", evil)},
      {"a.stl", replaced(stl_text(), "endloop", evil)}};
  for (const auto& [name, bytes] : files) {
    const std::string error = error_of(name, bytes);
    EXPECT_NE(error, "") << name;
    EXPECT_LT(error.size(), 300u);
    EXPECT_TRUE(std::ranges::all_of(error, [](char c) { return c >= ' ' && c <= '~'; })) << name;
  }
  // Names of attributes end up in notes, and in the names of grids.
  const std::string named = replaced(
      ply_text, "element face", "property float " + evil + "\nproperty float " + evil + "\nelement face");
  const MeshFile file = mesh_formats::parse_mesh(
      replaced(replaced(replaced(replaced(named, "0 0 0\n", "0 0 0 1 2\n"), "1 0 0\n", "1 0 0 nan 2\n"),
                        "1.5 0\n", "1.5 0 3 2\n"),
               "-2.25\n", "-2.25 1 2\n"),
      mesh_formats::Format::ply, "a.ply", context, {.attributes = true});
  ASSERT_EQ(file.attributes.size(), 1u);
  context.notes.push_back(file.attributes[0].name);
  for (const std::string& note : context.notes) {
    EXPECT_LT(note.size(), 300u);
    EXPECT_TRUE(std::ranges::all_of(note, [](char c) { return c >= ' ' && c <= '~'; }));
  }
}

TEST_F(ForeignFileTest, TrianglesAreNumberedInTheOrderOfTheFile) {
  const auto numbers = [&](const std::string& polygons) {
    return mesh_formats::parse_mesh("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv -1 .5 0\n" + polygons,
                                    mesh_formats::Format::obj, "a.obj", context, {.triangle_numbers = true})
        .triangle_numbers;
  };
  using Numbers = std::vector<std::uint32_t>;
  // In the mesh, the triangles come first: 1 of the file, three of the pentagon; then the quads.
  EXPECT_EQ(numbers("f 1 2 3 4\nf 1 2 3\nf 1 2\nf 1 2 3 4 5\nf 1 2 3 4\n"),
            (Numbers{2, 3, 4, 5, 0, 1, 6, 7}));
  EXPECT_EQ(numbers("f 1 2 3\nf 1 2 3 4\nf 1 2 3\n"), (Numbers{0, 3, 1, 2}));
  for (const char* in_order :
       {"f 1 2 3\nf 1 2 4\n", "f 1 2 3 4\nf 1 2 3 4\n", "f 1 2 3\nf 1 2 3 4 5\nf 1 2 3 4\n"})
    EXPECT_EQ(numbers(in_order), Numbers()) << in_order;
  EXPECT_TRUE(
      read("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nf 1 2 3\n").triangle_numbers.empty());
}

}  // namespace mesh_file_foreign_test
}  // namespace hermesh
