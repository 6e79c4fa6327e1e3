#include <tbb/global_control.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "algorithms/io/grid_frame.h"
#include "algorithms/io/import/import_volume.h"
#include "algorithms/io/mesh_file.h"
#include "algorithms/io/scenes/zip_archive.h"
#include "algorithms/io/vdb_file.h"
#include "experiments/fuzzing/targets.h"

namespace hermesh::fuzzing {
namespace {

namespace fs = std::filesystem;

/// A directory of this process, for files that are read by their path; removed at the end.
class Directory {
 public:
  Directory() : path_(fs::temp_directory_path() / ("hermesh-fuzz-" + std::to_string(getpid()))) {
    fs::create_directories(path_);
  }
  ~Directory() {
    std::error_code error;
    fs::remove_all(path_, error);
  }
  fs::path put(const std::string& name, std::string_view bytes) const {
    std::ofstream(path_ / name, std::ios::binary).write(bytes.data(), std::streamsize(bytes.size()));
    return path_ / name;
  }

 private:
  fs::path path_;
};

fs::path put(const std::string& name, std::string_view bytes) {
  static const Directory directory;
  return directory.put(name, bytes);
}

void require(bool condition, const char* what) {
  if (!condition) throw std::logic_error(what);
}

/// Calls the functions, all of them, with one thread. @throws the last Error if none of them has a value.
template <class... Read>
void any_of(bool names_file, Read... read) {
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  bool has_value = false;
  std::string last;
  const auto attempt = [&](auto& each) {
    try {
      each();
      has_value = true;
    } catch (const Error& error) {
      last = error.what();
      check_message(last, names_file);
    }
  };
  (attempt(read), ...);
  if (!has_value) throw Error(last);
}

// ---- Meshes.

/// Checks what a reader guarantees of its mesh.
void check(const MeshFile& mesh) {
  require(mesh.triangle_count() > 0, "a mesh without polygons");
  const auto exist = [&](const auto& polygons) {
    return std::ranges::all_of(polygons, [&](const auto& polygon) {
      return std::ranges::all_of(polygon, [&](std::uint32_t corner) { return corner < mesh.points.size(); });
    });
  };
  require(exist(mesh.triangles) && exist(mesh.quads), "a polygon with a point that does not exist");
  for (const Eigen::Vector3d& point : mesh.points) require(point.allFinite(), "a point that is not finite");
  require(mesh.triangle_numbers.empty() || mesh.triangle_numbers.size() == mesh.triangle_count(),
          "triangles without a number");
  const std::array<std::size_t, 3> elements = {mesh.points.size(),
                                               3 * mesh.triangles.size() + 4 * mesh.quads.size(),
                                               mesh.triangles.size() + mesh.quads.size()};
  for (const MeshAttribute& attribute : mesh.attributes) {
    const std::size_t size = std::visit([](const auto& values) { return values.size(); }, attribute.values);
    require(size == elements[std::size_t(attribute.domain)] * std::size_t(attribute.components),
            "an attribute with the number of values of another mesh");
  }
}

void read_polygons(const char* name, std::string_view bytes) {
  const fs::path path = put(name, bytes);
  RunContext context;
  const MeshFile mesh = read_mesh_file(path, context, {.attributes = true, .triangle_numbers = true});
  check(mesh);
  about_file(path.string(), [&] { return to_polygon_mesh(mesh); });
}

void read_ply(std::string_view bytes) { read_polygons("input.ply", bytes); }
void read_obj(std::string_view bytes) { read_polygons("input.obj", bytes); }
void read_off(std::string_view bytes) { read_polygons("input.off", bytes); }
void read_stl(std::string_view bytes) { read_polygons("input.stl", bytes); }
void read_gltf(std::string_view bytes) {
  read_polygons(bytes.starts_with("glTF") ? "input.glb" : "input.gltf", bytes);
}

/// Reads an archive, or text as the model of an archive, since damage to packed text only breaks checksums.
void read_three_mf(std::string_view bytes) {
  if (bytes.starts_with("PK")) return read_polygons("input.3mf", bytes);
  const std::string_view relationships =
      "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\"><Relationship "
      "Id=\"a\" Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\" "
      "Target=\"/3D/3dmodel.model\"/></Relationships>";
  mesh_formats::ZipWriter archive;
  for (const auto& [name, content] : {std::pair("_rels/.rels", relationships), {"3D/3dmodel.model", bytes}}) {
    archive.begin(name, double(content.size()));
    archive.write(content);
  }
  read_polygons("input.3mf", archive.finish());
}

// ---- Volumes.

/// Reads one file, or the two of a pair (.hdr, .img) one behind the other if the header is that of a pair.
void read_nifti(std::string_view bytes) {
  constexpr std::size_t kHeader = 348;
  const bool is_pair = bytes.size() >= kHeader && bytes.substr(kHeader - 4, 3) == "ni1";
  const fs::path path =
      put(is_pair ? "input.hdr" : "input.nii", bytes.substr(0, is_pair ? kHeader : bytes.npos));
  if (is_pair) put("input.img", bytes.substr(kHeader));
  RunContext context;
  any_of(
      true, [&] { import_nifti(path, {}, context); },
      [&] { import_nifti(path, {.replacement = 0.0f, .frame = 1}, context); },
      [&] { import_nifti_labels(path, {}, context); });
}

/// Reads samples behind their layout: three numbers of 8 bytes each of dimensions and spacing, one of the
/// offset, and the type.
void read_raw(std::string_view bytes) {
  RawLayout layout;
  const auto take = [&](void* to, std::size_t size) {
    std::memcpy(to, bytes.data(), size);
    bytes.remove_prefix(size);
  };
  if (bytes.size() < 58) return;
  take(layout.dims.data(), 24), take(layout.spacing.data(), 24), take(&layout.offset, 8);
  layout.format = {NumberType(static_cast<unsigned char>(bytes[0]) % 10), bytes[1] % 2 != 0};
  const fs::path path = put("input.raw", bytes.substr(2));
  RunContext context;
  any_of(
      false, [&] { import_raw(path, layout, {}, context); },
      [&] { import_raw(path, layout, {.replacement = 0.0f, .frame = {}}, context); },
      [&] { import_raw_labels(path, layout, {}, context); });
}

/// Returns the file with the checksum at its end corrected, if there is one: damage that breaks only the
/// checksum reaches no other code.
std::string resealed(std::string bytes) {
  constexpr std::string_view kSeal = "hermesh\n";
  if (bytes.size() < 12 || bytes.compare(bytes.size() - 12, 8, kSeal) != 0) return bytes;
  const std::size_t size = bytes.size() - 12;
  const auto sum = std::uint32_t(
      crc32(crc32(0, nullptr, 0), reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(size)));
  std::memcpy(bytes.data() + size + kSeal.size(), &sum, sizeof sum);
  return bytes;
}

void read_vdb(std::string_view bytes) {
  const fs::path path = put("input.vdb", resealed(std::string(bytes)));
  RunContext context;
  any_of(
      true, [&] { describe_vdb(path); }, [&] { read_grid_frame(path); },
      [&] { read_level_set(path, "", context); });
}

constexpr Target kFileTargets[] = {
    {"ply", read_ply, true},     {"obj", read_obj, true},   {"off", read_off, true},
    {"stl", read_stl, true},     {"gltf", read_gltf, true}, {"three_mf", read_three_mf, true},
    {"nifti", read_nifti, true}, {"raw", read_raw, false},  {"vdb", read_vdb, true}};

}  // namespace

std::span<const Target> file_targets() { return kFileTargets; }

}  // namespace hermesh::fuzzing
