#include "algorithms/io/mesh_file.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <Eigen/Geometry>
#include <atomic>
#include <clocale>
#include <cstring>
#include <random>
#include <sstream>

#include "algorithms/io/test_mesh_files.h"

namespace hermesh {
namespace mesh_file_test {

namespace fs = std::filesystem;

void expect_tetrahedron(const MeshFile& mesh) {
  EXPECT_EQ(mesh.points, tetrahedron_points);
  EXPECT_EQ(mesh.triangles, tetrahedron_triangles);
  EXPECT_TRUE(mesh.quads.empty());
}

/// A PLY file with an element before the points, properties of other types among them, and a list behind the
/// corners.
std::string binary_ply(bool big) {
  std::string ply =
      std::string("ply\nformat binary_") + (big ? "big" : "little") +
      "_endian 1.0\nelement camera 1\nproperty list uchar double view\nproperty short id\n"
      "element vertex 4\nproperty uchar red\nproperty double z\nproperty float y\nproperty int16 x\n"
      "element face 4\nproperty list ushort uint vertex_index\nproperty list uint8 int8 flags\nend_header\n";
  ply += raw<std::uint8_t>(2, big) + raw(1.0, big) + raw(2.0, big) + raw<std::int16_t>(-7, big);
  for (const Eigen::Vector3d& p : tetrahedron_points)
    ply += raw<std::uint8_t>(255, big) + raw(p.z(), big) + raw(static_cast<float>(p.y()), big) +
           raw(static_cast<std::int16_t>(p.x()), big);
  for (const Triangle& t : tetrahedron_triangles)
    ply += raw<std::uint16_t>(3, big) + raw(t[0], big) + raw(t[1], big) + raw(t[2], big) +
           raw<std::uint8_t>(1, big) + "x";
  return ply;
}

TEST_F(MeshFileTest, ReadsPly) {
  expect_tetrahedron(read("a.ply", ply_text));
  expect_tetrahedron(read("b.PLY", binary_ply(false)));
  expect_tetrahedron(read("c.ply", binary_ply(true)));
  std::string windows;
  for (const char c : ply_text) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
  expect_tetrahedron(read("d.ply", windows));
  EXPECT_TRUE(context.notes.empty());
}

TEST_F(MeshFileTest, AsciiPlyFloatsAreRoundedAsDeclared) {
  std::string text = ply_text;
  text.replace(text.find("1 0 0"), 5, "0.1 0 0");
  EXPECT_EQ(read("a.ply", text).points[1].x(), double(0.1f));
  text.replace(text.find("float"), 5, "double");
  EXPECT_EQ(read("a.ply", text).points[1].x(), 0.1);
}

TEST_F(MeshFileTest, BinaryPlyKeepsADataByteThatLooksLikeALineEnd) {
  const std::string header =
      "ply\rformat binary_little_endian 1.0\relement vertex 3\rproperty uchar x\rproperty uchar y\rproperty "
      "uchar z\r"
      "element face 1\rproperty list uchar uchar vertex_indices\rend_header\r";
  const MeshFile mesh =
      read("a.ply", header + "\n\x01\x02\x03\x04\x05\x06\x07\x08" + std::string("\x03\0\x01\x02", 4));
  EXPECT_EQ(mesh.points[0], Eigen::Vector3d(10, 1, 2));
}

TEST_F(MeshFileTest, ReadsObj) {
  expect_tetrahedron(read("a.obj", obj_text));
  expect_tetrahedron(read(
      "b.obj",
      "# made by hand \\\nmtllib a.mtl\no part\nv 0 0 0 1\nv +1 0e5 0.0 0.5 0.5 0.5\r\nv 0 1.5 0\n"
      "vt 0 \\\n 0\nvn 0 0 1\ng one two\nv 0 0 \\\n -2.25\ns off\nusemtl red\nf 1 2 3\nf -4//1 -2//1 -1//1\n"
      "f 1/1 4/1 \\\r\n 2/1\nf 2/1/1 4/1/1 3/1/1 # last\n"));
}

TEST_F(MeshFileTest, ObjMayReferToLaterPoints) {
  EXPECT_EQ(read("a.obj", "f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0").triangles,
            (std::vector<Triangle>{{0, 1, 2}}));
}

TEST_F(MeshFileTest, ReadsOff) {
  expect_tetrahedron(read("a.off", off_text));
  expect_tetrahedron(read("b.off",
                          "# comment\nOFF 4 4 6\n\n0 0 0\n1 0 0 # one\n\n0 1.5 0\n# two\n0 0 -2.25\n"
                          "3 0 1 2 255 0 0\n3 0 2 3\n3 0 3 1\n3 1 3 2 0.5 0.5 0.5"));
  expect_tetrahedron(read("c.off",
                          "COFF\n4 4\n0 0 0 1 1 1 1\n1 0 0 1 1 1 1\n0 1.5 0 1 1 1 1\n0 0 -2.25 1 1 1 1\n"
                          "3 0 1 2\n3 0 2 3\n3 0 3 1\n3 1 3 2\n"));
  expect_tetrahedron(read("d.off",
                          "NOFF\n4 4 0\n0 0 0 9 9 9\n1 0 0 9 9 9\n0 1.5 0 9 9 9\n0 0 -2.25 9 9 9\n"
                          "3 0 1 2\n3 0 2 3\n3 0 3 1\n3 1 3 2\n"));
}

TEST_F(MeshFileTest, CountsOfOffMayHaveLinesOfTheirOwn) {
  const std::string rest = "0 0 0\n1 0 0\n0 1.5 0\n0 0 -2.25\n3 0 1 2\n3 0 2 3\n3 0 3 1\n3 1 3 2\n";
  expect_tetrahedron(read("a.off", "OFF\n4\n4\n0\n" + rest));
  expect_tetrahedron(read("b.off", "OFF\n4 4\n6\n" + rest));
  expect_tetrahedron(read("c.off", "OFF\n4\n4\n" + rest));
  expect_tetrahedron(read("d.off", "OFF\r\n4 \r\n4 \r\n# edges\r\n6 \r\n" + rest));
}

TEST_F(MeshFileTest, ReadsStlAndSharesEqualPoints) {
  expect_tetrahedron(read("a.stl", stl_text() + "endsolid part\n"));
  expect_tetrahedron(read("b.stl", binary_stl(4)));
  expect_tetrahedron(read("c.stl", binary_stl(4, "solid facet normal")));
  std::string shouting = stl_text() + "endsolid part\n";
  for (char& c : shouting) c = static_cast<char>(std::toupper(c));
  expect_tetrahedron(read("d.stl", shouting));
  const MeshFile two =
      read("e.stl", stl_text("one") + "endsolid one\n\n" + stl_text("two") + "endsolid two\n");
  EXPECT_EQ(two.points, tetrahedron_points);
  EXPECT_EQ(two.triangles.size(), 8u);
}

TEST_F(MeshFileTest, StlTreatsMinusZeroAsZeroButNotNearlyEqualPoints) {
  const MeshFile mesh =
      read("a.stl",
           "solid\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
           "facet\nouter loop\nvertex -0 0 -0.0\nvertex 0 1 0\nvertex 1.0000001 0 0\nendloop\n"
           "endfacet\nendsolid");
  EXPECT_EQ(mesh.points.size(), 4u);
  EXPECT_EQ(mesh.triangles[1], (Triangle{0, 2, 3}));
  EXPECT_FALSE(std::signbit(mesh.points[0].z()));
}

TEST_F(MeshFileTest, PolygonsBecomeFansAndSliversOfTwoCornersGo) {
  const MeshFile mesh = read(
      "a.off", "OFF 6 4 0\n0 0 0\n1 0 0\n2 1 0\n1 2 0\n0 2 0\n-1 1 0\n5 0 1 2 3 4\n4 0 1 2 3\n2 0 1\n1 4\n");
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
  EXPECT_EQ(mesh.quads, (LargeArray<Quad>{{0, 1, 2, 3}}));
  EXPECT_EQ(mesh.triangle_count(), 5u);
  ASSERT_EQ(context.notes.size(), 1u);
  expect_words(context.notes[0], "2 polygons with fewer than three corners");
}

TEST_F(MeshFileTest, ConcavePolygonsAreNotLeftByTheirTriangles) {
  // An L whose first corner does not see all of it, and whose points come behind it.
  const MeshFile mesh =
      read("a.obj", "f 1 2 3 4 5 6\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 0\n");
  ASSERT_EQ(mesh.triangles.size(), 4u);
  double area = 0;
  for (const Triangle& t : mesh.triangles) {
    const Eigen::Vector3d n =
        (mesh.points[t[1]] - mesh.points[t[0]]).cross(mesh.points[t[2]] - mesh.points[t[0]]);
    EXPECT_GT(n.z(), 0);
    area += 0.5 * n.z();
  }
  EXPECT_EQ(area, 3.0);
  EXPECT_TRUE(context.notes.empty());
}

TEST_F(MeshFileTest, CrossingPolygonsBecomeFansAndANoteSaysSo) {
  const MeshFile mesh =
      read("a.off", "OFF 6 1 0\n0 0 0\n4 0 0\n0 4 0\n4 4 0\n1 -2 0\n3 9 0\n6 0 1 2 3 4 5\n");
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}}));
  ASSERT_EQ(context.notes.size(), 1u);
  expect_words(context.notes[0], "1 concave polygons intersect themselves");
}

TEST_F(MeshFileTest, NumbersDoNotDependOnTheLocale) {
  const char* const set = std::setlocale(LC_ALL, "de_DE.UTF-8");
  expect_tetrahedron(read("a.obj", obj_text));
  EXPECT_NE(error_of("b.obj", "v 0,5 0 0\n"), "");
  if (set) std::setlocale(LC_ALL, "C");
}

TEST_F(MeshFileTest, TinyNumbersAreNotTakenForHugeOnes) {
  const MeshFile mesh = read("a.obj", "v 1e-400 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_EQ(mesh.points[0], Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(error_of("b.obj", "v 1e400 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
            "'b.obj': point 0 (counting from 0) has a coordinate that is not a finite number");
}

TEST_F(MeshFileTest, FilesAreReadRelativeToAnOriginNearTheirPoints) {
  std::ostringstream text;
  text.precision(17);
  text << "v 1000000.25 1000000 1000000\nv 1000001.0000001 1000000 1000000\nv 1000000 1000000.5 1000000\nf 1 "
          "2 3\n";
  const fs::path path = write("a.obj", text.str());
  const PolygonMesh mesh = read_mesh(path, context);
  EXPECT_LE(mesh.origin.cwiseAbs().maxCoeff(), 1000001.0);
  EXPECT_LE((mesh.world(1) - Eigen::Vector3d(1000001.0000001, 1000000, 1000000)).norm(), 1e-7);
}

TEST_F(MeshFileTest, GzipMayHaveSeveralMembers) {
  PolygonMesh mesh = random_mesh(1, {0, 0, 0}, 10);
  write_mesh(folder / "a.obj.gz", mesh, context);
  const std::string member = bytes_of(folder / "a.obj.gz");
  const MeshFile two = read("b.obj.gz", member + member);
  EXPECT_EQ(two.points.size(), 20u);
  EXPECT_EQ(two.quads.size(), 20u);
  EXPECT_EQ(error_of("c.obj.gz", member + "tail"),
            "'c.obj.gz' has bytes behind its gzip data; it is damaged");
  EXPECT_EQ(error_of("d.obj.gz", member.substr(0, member.size() - 9)),
            "'d.obj.gz' is truncated: its gzip data breaks off");
  std::string damaged = member;
  damaged[damaged.size() - 6] ^= 1;  // in the checksum
  EXPECT_EQ(error_of("e.obj.gz", damaged), "'e.obj.gz' is damaged: its gzip data does not unpack");
  EXPECT_EQ(error_of("f.obj.gz", obj_text), "'f.obj.gz' is named .gz but is not compressed by gzip");
}

/// Members of a megabyte of zeros each, 300 MB from less than half a megabyte.
TEST_F(MeshFileTest, GzipMadeToDoHarmIsRefused) {
  const std::string zeros(std::size_t(1) << 20, '\0');
  const gzFile file = gzopen((folder / "member").c_str(), "wb9");
  gzwrite(file, zeros.data(), unsigned(zeros.size()));
  gzclose(file);
  const std::string member = bytes_of(folder / "member");
  std::string all;
  for (int i = 0; i < 300; ++i) all += member;
  EXPECT_LT(all.size(), 500000u);
  expect_words(error_of("a.off.gz", all), "which is the limit");
  // Short data with the same compression ratio are decompressed, and refused only because they are not a
  // mesh.
  EXPECT_EQ(error_of("b.off.gz", member + member).find("which is the limit"), std::string::npos);
}

TEST_F(MeshFileTest, RefusesWhatIsNoMeshFile) {
  EXPECT_EQ(error_of_path(folder / "none.ply"), "'none.ply' cannot be read: there is no such file");
  fs::create_directory(folder / "sub.ply");
  EXPECT_EQ(error_of_path(folder / "sub.ply"), "'sub.ply' is a folder; name a mesh file in it");
  EXPECT_EQ(error_of("empty.ply", ""), "'empty.ply' is empty");
  EXPECT_EQ(error_of("a.fbx", "x"),
            "'a.fbx' is of an unknown type; mesh files end in .ply, .obj, .off, .stl, .glb, .gltf or .3mf "
            "(.gz may follow)");
  EXPECT_EQ(error_of("a.ply", obj_text), "'a.ply' is named .ply but holds OBJ");
  EXPECT_EQ(error_of("a.obj", ply_text), "'a.obj' is named .obj but holds PLY");
  EXPECT_EQ(error_of("a.stl", off_text), "'a.stl' is named .stl but holds OFF");
  EXPECT_EQ(error_of("a.off", stl_text() + "endsolid part\n"), "'a.off' is named .off but holds STL");
  EXPECT_EQ(error_of("b.off", "hello"), "'b.off' is named .off but does not begin like OFF");
  EXPECT_EQ(error_of("b.obj", "hello\nworld\n"), "'b.obj': it holds no polygon");
  EXPECT_EQ(error_of("b.stl", "hello\nworld\n"), "'b.stl', line 1: a word that is no keyword of an STL file");
}

TEST_F(MeshFileTest, RefusesWrongNumbersAndNamesTheLine) {
  EXPECT_EQ(error_of("a.obj", "v 0 0 0\nv 1 x 0\n"), "'a.obj', line 2: 'x' is not a number");
  EXPECT_EQ(error_of("b.obj", "v 0 0 0\nv 1 0\nv 0 1 0\n"),
            "'b.obj', line 2: the line ends where a number should be");
  EXPECT_EQ(error_of("c.obj", "v 0 0 0\nf 1 2 3z\n"),
            "'c.obj', line 2: a corner of a polygon is not a number");
  EXPECT_EQ(error_of("d.obj", "v 0 0 0\nf 1 0 1\n"),
            "'d.obj', line 2: the points of an OBJ file count from 1, but a polygon refers to point 0");
  EXPECT_EQ(error_of("e.obj", "v 0 0 0\n?? 1\n"), "'e.obj', line 2: '\?\?' is no keyword of an OBJ file");
  EXPECT_EQ(error_of("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 1.5.2\n3 0 1 2\n"),
            "'a.off', line 5: '1.5.2' is not a number");
  EXPECT_EQ(error_of("b.off", "OFF\nthree 1 0\n"), "'b.off', line 2: 'three' is not a count");
  EXPECT_EQ(error_of("c.off", "4OFF\n3 1 0\n"),
            "'c.off', line 1: 4OFF files are not read; only points with three coordinates are");
  EXPECT_EQ(error_of("a.stl", "solid\nfacet\nouter loop\nvertex 0 0 zero\n"),
            "'a.stl', line 4: 'zero' is not a number");
  std::string ply = ply_text;
  ply.replace(ply.find("3 0 2 3"), 7, "3 0 two");
  EXPECT_EQ(error_of("a.ply", ply), "'a.ply', line 15: 'two' is not a whole number");
  ply = ply_text;
  ply.replace(ply.find("float y"), 5, "quux");
  EXPECT_EQ(error_of("b.ply", ply), "'b.ply', line 5: 'quux' is no type of a PLY property");
}

TEST_F(MeshFileTest, RefusesIndicesThatAreNoWholeNumbers) {
  const auto ply = [](float index) {
    std::string file =
        "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float "
        "y\nproperty float z\n"
        "element face 1\nproperty list uchar float vertex_indices\nend_header\n";
    for (const float x : {0, 0, 0, 1, 0, 0, 0, 1, 0}) file += raw(x, false);
    return file + raw<std::uint8_t>(3, false) + raw(0.0f, false) + raw(1.0f, false) + raw(index, false);
  };
  EXPECT_EQ(error_of("half.ply", ply(1.5f)), "'half.ply': an index is not a whole number");
  EXPECT_EQ(error_of("whole.ply", ply(2.0f)), "");
}

TEST_F(MeshFileTest, RefusesIndicesOutOfRangeAndNamesThePolygon) {
  const std::string out_of_range = "polygon 1 refers to point 9, but there are 4 points (both count from 0)";
  for (auto [name, text] : {std::pair("a.ply", ply_text), std::pair("a.off", off_text)}) {
    text.replace(text.find("3 0 2 3"), 7, "3 0 9 3");
    EXPECT_EQ(error_of(name, text), "'" + std::string(name) + "': " + out_of_range);
  }
  std::string text = obj_text;
  text.replace(text.find("f 1 3 4"), 7, "f 1 10 4");
  EXPECT_EQ(error_of("a.obj", text), "'a.obj': " + out_of_range);
  text.replace(text.find("f 1 10 4"), 8, "f 1 -9 4");
  EXPECT_EQ(error_of("b.obj", text),
            "'b.obj', line 6: a polygon refers to point -9, but there are only 4 points before it");
  text = off_text;
  text.replace(text.find("3 0 2 3"), 7, "3 0 -1 3");
  EXPECT_EQ(error_of("b.off", text),
            "'b.off': polygon 1 refers to point -1, but there are 4 points (both count from 0)");
  text.replace(text.find("3 0 -1 3"), 8, "3 0 99999999999 3");
  EXPECT_NE(error_of("c.off", text), "");
}

TEST_F(MeshFileTest, RefusesCoordinatesThatAreNotFiniteAndNamesThePoint) {
  const std::string complaint = "point 2 (counting from 0) has a coordinate that is not a finite number";
  for (const char* bad : {"nan", "inf", "-inf", "1e999"}) {
    std::string ply = ply_text, text = off_text;
    EXPECT_EQ(error_of("a.ply", ply.replace(ply.find("1.5"), 3, bad)), "'a.ply': " + complaint);
    EXPECT_EQ(error_of("a.off", text.replace(text.find("1.5"), 3, bad)), "'a.off': " + complaint);
  }
  std::string stl = binary_stl(4);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(stl.data() + 84 + 50 + 12, &nan, sizeof nan);
  EXPECT_EQ(
      error_of("a.stl", stl),
      "'a.stl': point 0 of triangle 1 (both count from 0) has a coordinate that is not a finite number");
}

TEST_F(MeshFileTest, RefusesAMeshWithoutPolygons) {
  EXPECT_EQ(error_of("a.obj", "v 0 0 0\nv 1 0 0\n"), "'a.obj': it holds no polygon");
  EXPECT_EQ(error_of("a.off", "OFF 1 0 0\n0 0 0\n"), "'a.off': it holds no polygon");
  EXPECT_EQ(error_of("a.stl", "solid nothing\nendsolid\n"), "'a.stl': it holds no polygon");
  expect_words(
      error_of("a.stl",
               "solid\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendfacet\n"
               "facet\nouter loop\nvertex 0 0 1\nvertex 1 0 1\nvertex 0 1 1\nendloop\nendfacet\nendsolid\n"),
      "does not end in 'endloop'");
  EXPECT_EQ(error_of("a.ply",
                     "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                     "property float z\nend_header\n0 0 0\n"),
            "'a.ply': it holds no polygon: there is no element 'face' with a list 'vertex_indices'");
}

/// Counts that nothing in the file bears out: if they were believed, the test would run out of memory or
/// time.
TEST_F(MeshFileTest, DoesNotBelieveCountsThatTheFileIsTooShortFor) {
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    for (const char* element : {"vertex", "face", "other"}) {
      std::string ply = "ply\nformat " + std::string(format) + " 1.0\n";
      for (const char* name : {"vertex", "face", "other", "empty"})
        ply += "element " + std::string(name) + (std::strcmp(name, element) ? " 0\n" : " 1000000000000\n") +
               (*name == 'v'   ? "property float x\nproperty float y\nproperty float z\n"
                : *name == 'f' ? "property list uchar int vertex_indices\n"
                : *name == 'o' ? "property int i\n"
                               : "");
      expect_words(error_of("a.ply", ply + "end_header\n" + std::string(1000, ' ')), "truncated");
    }
  }
  const std::string list =
      "ply\nformat binary_little_endian 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list int int vertex_indices\nend_header\n";
  expect_words(error_of("b.ply", list + "\xff\xff\xff\x7f"), "truncated");
  expect_words(error_of("c.ply", list + "\xff\xff\xff\xff"), "negative");
  expect_words(error_of("a.off", "OFF\n1000000000000 1 0\n0 0 0\n"), "truncated");
  expect_words(error_of("b.off", "OFF\n0 1000000000000 0\n0 0 0\n"), "truncated");
  expect_words(error_of("c.off", "OFF\n0 1 0\n1000000000000 0 0\n"), "truncated");
  std::string stl = binary_stl(4);
  expect_words(error_of("a.stl", stl.replace(80, 4, "\xff\xff\xff\xff") + "x"), "truncated");
}

TEST_F(MeshFileTest, TruncatedFilesAreRefusedWhereverTheyBreakOff) {
  const std::string big = binary_ply(true), stl = binary_stl(4), text = stl_text() + "endsolid part\n";
  for (std::size_t size = 1; size < big.size(); ++size)
    EXPECT_NE(error_of("a.ply", big.substr(0, size)), "") << size;
  // A file that ends after a whole triangle may be complete; it is accepted with a note.
  const auto refused_or_noted = [&](const std::string& name, const std::string& part, bool whole) {
    context.notes.clear();
    EXPECT_EQ(error_of(name, part).empty(), whole) << part.size();
    EXPECT_EQ(context.notes.empty(), !whole) << part.size();
  };
  for (std::size_t size = 1; size < stl.size(); ++size)
    refused_or_noted("a.stl", stl.substr(0, size), size > 84 && (size - 84) % 50 == 0);
  // A missing name after "endsolid" and a missing last digit of text cannot be detected.
  for (std::size_t size = 1; size < text.size() - 6; ++size) {
    const std::string part = text.substr(0, size), end = part.substr(0, part.find_last_not_of(" \n") + 1);
    refused_or_noted("b.stl", part, end.ends_with("endfacet"));
  }
  for (std::size_t size = 1; size < ply_text.size() - 2; ++size)
    EXPECT_NE(error_of("b.ply", ply_text.substr(0, size)), "") << size;
  for (std::size_t size = 1; size < off_text.size() - 2; ++size)
    EXPECT_NE(error_of("a.off", off_text.substr(0, size)), "") << size;
}

/// Damage of the contents is tested by mesh_file_mutation_test.cpp.
TEST_F(MeshFileTest, DamagedGzipIsRefused) {
  std::mt19937 random(2024);
  write_mesh(folder / "a.ply.gz", random_mesh(5, {0, 0, 0}, 5), context);
  const std::string packed = bytes_of(folder / "a.ply.gz");
  int refused = 0;
  for (int trial = 0; trial < 300; ++trial) {
    std::string damaged = packed;
    for (std::uint32_t flips = 1 + random() % 3; flips > 0; --flips)
      damaged[random() % damaged.size()] = static_cast<char>(random());
    if (random() % 4 == 0) damaged.resize(1 + random() % damaged.size());
    refused += !error_of("b.ply.gz", damaged).empty();
  }
  EXPECT_GT(refused, 250);
}

TEST_F(MeshFileTest, CancellingLeavesNothingBehind) {
  const std::atomic<bool> cancel = true;
  const fs::path path = write("a.ply", ply_text);
  context.cancel = &cancel;
  EXPECT_THROW(read_mesh_file(path, context), Cancelled);
  EXPECT_THROW(write_mesh(folder / "b.ply", random_mesh(1, {0, 0, 0}, 20), context), Cancelled);
  EXPECT_EQ(files(), std::vector<std::string>{"a.ply"});
}

TEST_F(MeshFileTest, PathsAreRecognisedByTheirExtension) {
  for (const char* name : {"a.ply", "a.OBJ", "x/a.b.off", "a.stl.gz", "a.Ply.GZ"})
    EXPECT_TRUE(is_mesh_path(name)) << name;
  for (const char* name : {"a.vdb", "ply", ".gz", "a.gz", "a.ply.zip", ""})
    EXPECT_FALSE(is_mesh_path(name)) << name;
}

TEST_F(MeshFileTest, CoordinatesBeyondSinglePrecisionAreRefused) {
  const fs::path path = write("a.obj", "v 1e300 0 0\nv -1e300 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_NO_THROW(read_mesh_file(path, context));
  try {
    read_mesh(path, context);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(path.string()), std::string::npos) << error.what();
  }
}

}  // namespace mesh_file_test
}  // namespace hermesh
