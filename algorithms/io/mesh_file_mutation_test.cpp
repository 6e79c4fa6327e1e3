// Reads thousands of damaged files of each format: each gives a mesh or one short clean message, in little
// time and memory. They are read in a child process with limits, so that a crash, a hang or too much memory
// ends the child and not the test.
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstring>

#include "algorithms/io/scenes/scene_files_for_tests.h"
#include "algorithms/io/test_mesh_files.h"

namespace hermesh {
namespace mesh_file_mutation_test {

using mesh_formats::Format;
using Files = std::vector<std::string>;

struct Kind {
  const char* name;
  Format format;
  bool text;
  Files files;  ///< undamaged
  /// Packs damaged bytes into a container with correct checksums and lengths; null if there is none.
  std::string (*wrap)(const std::string& bytes) = nullptr;

  std::string file(const std::string& bytes) const { return wrap ? wrap(bytes) : bytes; }
};

// ---- Undamaged files that use as many features as possible.

struct Ring {
  std::vector<std::array<float, 3>> points;
  std::vector<Triangle> triangles;
};

/// A mesh of two tips and a ring between them.
Ring ring(std::uint32_t n) {
  Ring result{{{0, 0, 1}, {0, 0, -1.25f}}, {}};
  for (std::uint32_t i = 0; i < n; ++i) {
    const float x = float(i) / float(n);
    result.points.push_back({x, x * (1 - x), 0.5f * x});
    const std::uint32_t a = 2 + i, b = 2 + (i + 1) % n;
    result.triangles.push_back({0, a, b});
    result.triangles.push_back({1, b, a});
  }
  return result;
}

std::string ply_header(const std::string& format, const Ring& mesh, bool strips) {
  return "ply\nformat " + format + " 1.0\ncomment origin 0 0 0\nelement vertex " +
         std::to_string(mesh.points.size()) +
         "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\n"
         "property uchar blue\nproperty float quality\n" +
         (strips ? "element tristrips 1\nproperty list int int vertex_indices\n" : "") + "element face " +
         std::to_string(mesh.triangles.size()) +
         "\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty short "
         "part\nend_header\n";
}

std::string ascii_ply(const Ring& mesh, bool strips) {
  std::ostringstream text;
  text << ply_header("ascii", mesh, strips);
  for (const auto& [x, y, z] : mesh.points) text << x << " " << y << " " << z << " 255 0 128 0.5\n";
  if (strips) text << "9 0 1 2 3 -1 4 3 2 5\n";
  for (const auto& [a, b, c] : mesh.triangles)
    text << "3 " << a << " " << b << " " << c << " 6 0 0.5 1 0.25 0 1 " << a << "\n";
  return text.str();
}

std::string binary_ply(const Ring& mesh, bool strips, bool big) {
  std::string bytes = ply_header(big ? "binary_big_endian" : "binary_little_endian", mesh, strips);
  for (const auto& point : mesh.points) {
    for (const float x : point) bytes += raw(x, big);
    bytes += "\xff\x01\x80" + raw(0.5f, big);
  }
  if (strips) bytes += raw_list<int>({9, 0, 1, 2, 3, -1, 4, 3, 2, 5}, big);
  for (const auto& [a, b, c] : mesh.triangles)
    bytes += '\3' + raw_list<std::uint32_t>({a, b, c}, big) + '\6' +
             raw_list<float>({0.f, .5f, 1.f, .25f, 0.f, 1.f}, big) + raw(std::uint16_t(a), big);
  return bytes;
}

std::string obj(const Ring& mesh) {
  std::ostringstream text;
  text << "# made by hand\nmtllib a.mtl\no part\n";
  for (const auto& [x, y, z] : mesh.points)
    text << "v " << x << " " << y << " \\\n " << z << " 0.1 0.2 0.3\n";
  for (const auto& [x, y, z] : mesh.points)
    text << "vt " << x << " " << y << "\nvn " << x << " " << y << " " << z << "\n";
  text << "usemtl red\ns off\nf 3 4 5 6\nf 3 4 5 6 7\n";
  const auto corner = [&](std::uint32_t i) { text << " " << i + 1 << "/" << i + 1 << "/" << i + 1; };
  for (const Triangle& triangle : mesh.triangles) {
    text << "f";
    for (const std::uint32_t i : triangle) corner(i);
    text << "\n";
  }
  text << "usemtl blue\nf -1//-1 -2//-2 -3//-3\n";
  return text.str();
}

std::string off(const Ring& mesh, const std::string& keyword) {
  std::ostringstream text;
  text << keyword << "\n# text\n" << mesh.points.size() << " " << mesh.triangles.size() + 1 << " 0\n";
  for (const auto& [x, y, z] : mesh.points)
    text << x << " " << y << " " << z << (keyword == "OFF" ? "" : " 1 0 0 1") << "\n";
  for (const auto& [a, b, c] : mesh.triangles) text << "3 " << a << " " << b << " " << c << " 255 0 0\n";
  text << "5 2 3 4 5 6\n";
  return text.str();
}

std::string binary_off(const Ring& mesh, bool big) {
  std::string bytes = big ? "OFF BINARY\n" : "NOFF BINARY\n";
  for (const std::size_t count : {mesh.points.size(), mesh.triangles.size(), std::size_t(0)})
    bytes += raw(std::uint32_t(count), big);
  for (const auto& point : mesh.points)
    for (std::size_t i = 0; i < (big ? 1 : 2); ++i)
      for (const float x : point) bytes += raw(x, big);
  for (const Triangle& triangle : mesh.triangles) {
    bytes += raw(3, big);
    for (const std::uint32_t corner : triangle) bytes += raw(corner, big);
    if (big) bytes += raw(0, big);
  }
  return bytes;
}

std::string points_and_indices(const Ring& mesh) {
  std::string bytes;
  for (const auto& [x, y, z] : mesh.points) bytes += raw_list<float>({x, y, z});
  for (const auto& [a, b, c] : mesh.triangles)
    bytes += raw_list<std::uint16_t>({std::uint16_t(a), std::uint16_t(b), std::uint16_t(c)});
  return bytes;
}

/// Returns a scene of two nodes and a sparse accessor over the 9 points and 14 triangles of ring(7), with
/// blanks around all words, so that these can be exchanged.
std::string gltf(const std::string& uri) {
  return R"({ "asset" : { "version" : "2.0" } , "scene" : 0 , "scenes" : [ { "nodes" : [ 0 , 1 ] } ] ,
"nodes" : [
{ "mesh" : 0 , "translation" : [ 1 , 2 , 3 ] } , { "children" : [ 2 ] , "scale" : [ 1 , -1 , 1 ] } ,
{ "mesh" : 0 , "rotation" : [ 0 , 0 , 0 , 1 ] } ] , "meshes" : [ { "primitives" : [
{ "attributes" : { "POSITION" : 0 } , "indices" : 1 , "mode" : 4 } ,
{ "attributes" : { "POSITION" : 0 } , "mode" : 5 } ] } ] ,
"accessors" : [ { "bufferView" : 0 , "byteOffset" : 0 , "componentType" : 5126 , "count" : 9 ,
"type" : "VEC3" , "sparse" : { "count" : 2 , "indices" : { "bufferView" : 1 ,
"byteOffset" : 2 , "componentType" : 5123 } , "values" : { "bufferView" : 0 , "byteOffset" : 12 } } } ,
{ "bufferView" : 1 , "componentType" : 5123 , "count" : 42 , "type" : "SCALAR" } ] ,
"bufferViews" : [ { "buffer" : 0 , "byteLength" : 108 , "byteStride" : 12 } ,
{ "buffer" : 0 , "byteOffset" : 108 , "byteLength" : 84 } ] , "buffers" : [ { )" +
         uri + R"("byteLength" : 192 } ] })";
}

std::string base64(const std::string& bytes) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  // The bytes of a ring are a multiple of three.
  for (std::size_t i = 0; i + 2 < bytes.size(); i += 3)
    for (int k = 0; k < 4; ++k)
      text += digits[((unsigned char)bytes[i] << 16 | (unsigned char)bytes[i + 1] << 8 |
                      (unsigned char)bytes[i + 2]) >>
                         (18 - 6 * k) &
                     63];
  return text;
}

std::string in_glb(const std::string& json) { return glb_of(json, points_and_indices(ring(7))); }

std::string model(const Ring& mesh) {
  std::ostringstream text;
  text << "<object id = \" 1 \" > <mesh > <vertices >\n";
  for (const auto& [x, y, z] : mesh.points)
    text << "<vertex x = \" " << x << " \" y = \" " << y << " \" z = \" " << z << " \" />\n";
  text << "</vertices > <triangles >\n";
  for (const auto& [a, b, c] : mesh.triangles)
    text << "<triangle v1 = \" " << a << " \" v2 = \" " << b << " \" v3 = \" " << c << " \" />\n";
  text << "</triangles > </mesh > </object >\n<object id = \" 2 \" > <components >"
          "<component objectid = \" 1 \" transform = \" 1 0 0 0 1 0 0 0 -1 5 6 7 \" /> <component objectid = "
          "\" 1 \" /> "
          "</components > </object >";
  return model_of(text.str(), "<item objectid = \" 2 \" /> <item objectid = \" 1 \" />",
                  "unit = \"inch\" xml:lang = \"en\"");
}

/// Returns an archive with a comment behind it, in which damage is harmless.
std::string with_comment(const std::string& archive, const std::string& comment) {
  return archive.substr(0, archive.size() - 2) + raw(std::uint16_t(comment.size())) + comment;
}

std::vector<Kind> all_kinds() {
  const Ring mesh = ring(7);
  return {{"ascii PLY", Format::ply, true, {ascii_ply(mesh, false), ascii_ply(mesh, true)}},
          {"binary PLY", Format::ply, false, {binary_ply(mesh, false, false), binary_ply(mesh, true, true)}},
          {"OBJ", Format::obj, true, {obj(mesh)}},
          {"ascii OFF", Format::off, true, {off(mesh, "OFF"), off(mesh, "COFF")}},
          {"binary OFF", Format::off, false, {binary_off(mesh, true), binary_off(mesh, false)}},
          {"GLB", Format::glb, false, {in_glb(gltf(""))}},
          {"JSON of a GLB", Format::glb, true, {gltf("")}, in_glb},
          {"glTF",
           Format::gltf,
           true,
           {gltf("\"uri\" : \"data:;base64," + base64(points_and_indices(mesh)) + "\" , ")}},
          {"3MF",
           Format::three_mf,
           false,
           {three_mf_of(model(mesh)), with_comment(three_mf_of(model(mesh)), std::string(2000, 'c'))}},
          {"model of a 3MF", Format::three_mf, true, {model(mesh)}, three_mf_of},
          {"ascii STL", Format::stl, true, {stl_text() + "endsolid part\n"}},
          {"binary STL", Format::stl, false, {binary_stl(4), binary_stl(4, "solid part")}}};
}

// ---- Damage.

class Damager {
 public:
  Damager(const std::vector<Kind>& kinds, const Kind& kind, std::uint32_t seed)
      : kinds_(kinds), kind_(kind), random_(seed) {}

  std::string damaged() {
    std::string bytes = kind_.files[below(kind_.files.size())];
    for (std::size_t times = 1 + below(3); times > 0 && !bytes.empty(); --times) damage(bytes);
    return kind_.file(bytes.empty() ? "x" : bytes);
  }

 private:
  std::size_t below(std::size_t end) { return random_() % end; }

  void damage(std::string& bytes) {
    switch (below(6)) {
      case 0:
        return flip_bytes(bytes);
      case 1:
        return bytes.resize(below(bytes.size()) + 1);
      case 2: {
        const std::size_t at = below(bytes.size());
        bytes.erase(at, 1 + below(40));
        return;
      }
      case 3:
        return splice(bytes);
      default:
        return kind_.text ? change_words(bytes) : change_numbers(bytes);
    }
  }

  void flip_bytes(std::string& bytes) {
    for (std::size_t flips = 1 + below(8); flips > 0; --flips)
      bytes[below(bytes.size())] =
          static_cast<char>(below(2) ? random_() : bytes[below(bytes.size())] ^ (1 << below(8)));
  }

  /// Inserts a piece of another file, or of the file itself, or replaces a piece by it.
  void splice(std::string& bytes) {
    const Kind& other = below(2) ? kind_ : kinds_[below(kinds_.size())];
    const std::string& from = other.files[below(other.files.size())];
    const std::size_t at = below(bytes.size());
    bytes.replace(at, below(2) ? 0 : below(60), from, below(from.size()), 1 + below(300));
  }

  /// Swaps two words of the text, or puts an extreme number in place of one.
  void change_words(std::string& bytes) {
    static const std::vector<std::string> extreme = {
        "-1",     "0",   "4294967295", "4294967296", "99999999999999999999", "nan",      "1e308", "-1e999",
        "1.#IND", "0.5", "255",        "1,5",        "2147483648",           "\x1b[31m", "-0",    "1e-400"};
    const auto [a, a_size] = word_at(bytes, below(bytes.size()));
    const auto [b, b_size] = word_at(bytes, below(bytes.size()));
    if (below(2)) return void(bytes.replace(a, a_size, extreme[below(extreme.size())]));
    const std::string first = bytes.substr(a, a_size), second = bytes.substr(b, b_size);
    if (a + a_size <= b) bytes.replace(b, b_size, first).replace(a, a_size, second);
  }

  static std::pair<std::size_t, std::size_t> word_at(const std::string& bytes, std::size_t near) {
    const std::string space = " \n/";
    const std::size_t begin = bytes.find_last_of(space, near);
    const std::size_t first = begin == std::string::npos ? 0 : begin + 1;
    return {first, std::min(bytes.find_first_of(space, first), bytes.size()) - first};
  }

  void change_numbers(std::string& bytes) {
    static const std::vector<std::uint32_t> extreme = {
        0, 1, 0xffffffff, 0x7fffffff, 0x80000000, 0x7f800000, 0x7fc00000, 0xffff, 0x7f7fffff, 255};
    if (bytes.size() < 8) return;
    const std::size_t a = below(bytes.size() - 3), b = below(bytes.size() - 3);
    std::uint32_t value = extreme[below(extreme.size())];
    if (below(2)) std::memcpy(&value, bytes.data() + b, sizeof value);
    std::memcpy(bytes.data() + a, &value, sizeof value);
  }

  const std::vector<Kind>& kinds_;
  const Kind& kind_;
  std::mt19937 random_;
};

// ---- Requirements.

/// Returns the fault of a message; empty if it has none.
std::string fault_of_message(const std::string& message) {
  if (!message.starts_with("'damaged.file'")) return "does not name the file";
  if (message.size() >= 300) return "is long";
  if (!std::ranges::all_of(message, [](char c) { return c >= ' ' && c <= '~'; }))
    return "holds control characters";
  return "";
}

std::string fault_of_mesh(const MeshFile& mesh) {
  if (mesh.triangle_count() == 0) return "no polygon";
  std::vector<bool> used(mesh.points.size());
  const auto good = [&](const auto& polygons) {
    for (const auto& polygon : polygons)
      for (const std::uint32_t corner : polygon)
        if (corner >= mesh.points.size() || !mesh.points[corner].allFinite()) return false;
    return true;
  };
  if (!good(mesh.triangles) || !good(mesh.quads))
    return "a polygon refers to a point that does not exist or is not finite";
  for (const Eigen::Vector3d& point : mesh.points)
    if (!point.allFinite()) return "a point is not finite";
  if (!mesh.triangle_numbers.empty() &&
      mesh.triangle_numbers.size() != mesh.triangles.size() + 2 * mesh.quads.size())
    return "triangles without a number";
  const std::array<std::size_t, 3> elements = {mesh.points.size(),
                                               3 * mesh.triangles.size() + 4 * mesh.quads.size(),
                                               mesh.triangles.size() + mesh.quads.size()};
  for (const MeshAttribute& attribute : mesh.attributes) {
    const std::size_t size = std::visit([](const auto& values) { return values.size(); }, attribute.values);
    if (size != elements[std::size_t(attribute.domain)] * std::size_t(attribute.components))
      return "an attribute of another size";
  }
  return "";
}

struct Reading {
  MeshFile mesh;
  std::string error, fault;
};

Reading read(const std::string& bytes, const Kind& kind, bool attributes) {
  Reading reading;
  RunContext context;
  try {
    reading.mesh = mesh_formats::parse_mesh(bytes, kind.format, "damaged.file", context,
                                            {.attributes = attributes, .triangle_numbers = attributes});
    reading.fault = fault_of_mesh(reading.mesh);
  } catch (const Error& error) {
    reading.error = error.what();
    if (const std::string fault = fault_of_message(reading.error); !fault.empty())
      reading.fault = "the error " + fault;
  }
  for (const std::string& note : context.notes)
    if (const std::string fault = fault_of_message(note); !fault.empty())
      reading.fault = "the note " + fault + ": " + note;
  return reading;
}

/// Returns the fault of a reading, or of the same reading with attributes, which must not change the mesh.
std::string fault_of(const std::string& bytes, const Kind& kind, bool& refused) {
  const Reading plain = read(bytes, kind, false), full = read(bytes, kind, true);
  refused = !plain.error.empty();
  if (!plain.fault.empty()) return plain.fault;
  if (!full.fault.empty()) return full.fault;
  if (plain.error != full.error) return "'" + plain.error + "' but with attributes '" + full.error + "'";
  if (plain.mesh.points != full.mesh.points || plain.mesh.triangles != full.mesh.triangles ||
      plain.mesh.quads != full.mesh.quads)
    return "another mesh with attributes";
  return "";
}

/// Results of the child process, in shared memory.
struct Account {
  std::uint32_t trial, refused, read;
  char fault[600];
};

std::size_t bytes_of_address_space() {
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * std::size_t(sysconf(_SC_PAGESIZE));
}

[[noreturn]] void read_all(const std::vector<Kind>& kinds, const Kind& kind, std::uint32_t trials,
                           Account& account) {
#if !defined(__SANITIZE_ADDRESS__)  // which takes terabytes of addresses for itself
  const rlim_t most = bytes_of_address_space() + (std::size_t(1) << 30);
  const rlimit memory = {most, most};
  setrlimit(RLIMIT_AS, &memory);
#endif
  const rlimit no_core = {0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  for (; account.trial < trials; ++account.trial) {
    const itimerval five_seconds = {{0, 0}, {5, 0}};  // of computing
    setitimer(ITIMER_PROF, &five_seconds, nullptr);
    bool refused = false;
    std::string fault;
    try {
      fault = fault_of(Damager(kinds, kind, account.trial).damaged(), kind, refused);
    } catch (const std::exception& error) {
      fault = std::string("thrown: ") + error.what();
    }
    (refused ? account.refused : account.read) += 1;
    if (fault.empty()) continue;
    std::strncpy(account.fault, fault.c_str(), sizeof account.fault - 1);
    _exit(1);
  }
  _exit(0);
}

void expect_survived(const std::vector<Kind>& kinds, const Kind& kind, std::uint32_t trials) {
  SCOPED_TRACE(kind.name);
  void* const shared =
      mmap(nullptr, sizeof(Account), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(shared, MAP_FAILED);
  Account& account = *new (shared) Account{};
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) read_all(kinds, kind, trials, account);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status)) << "trial " << account.trial << ": signal " << WTERMSIG(status)
                                 << (WTERMSIG(status) == SIGPROF ? ", it takes too long" : "");
  EXPECT_STREQ(account.fault, "") << "trial " << account.trial;
  EXPECT_GT(account.refused, trials / 20);
  EXPECT_GT(account.read, trials / 200);
  EXPECT_EQ(munmap(shared, sizeof(Account)), 0);
}

void expect_all_survived(std::uint32_t trials) {
  const std::vector<Kind> kinds = all_kinds();
  for (const Kind& kind : kinds) {
    for (const std::string& file : kind.files) {
      bool refused = false;
      EXPECT_EQ(fault_of(kind.file(file), kind, refused), "") << kind.name;
      EXPECT_FALSE(refused) << kind.name;
    }
    expect_survived(kinds, kind, trials);
  }
}

TEST(MeshFileMutations, FewHundredOfEachFormat) { expect_all_survived(400); }

TEST(Slow, MeshFileMutations) { expect_all_survived(5000); }

}  // namespace mesh_file_mutation_test
}  // namespace hermesh
