#include "algorithms/io/mesh_file.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "algorithms/core/polygon_cut.h"
#include "algorithms/io/mesh_file_formats.h"
#include "algorithms/io/scenes/scene_files.h"
#include "algorithms/io/scenes/zip_archive.h"

namespace hermesh {

namespace mesh_formats {

namespace {

constexpr std::array<std::string_view, 7> kExtensions = {".ply", ".obj",  ".off", ".stl",
                                                         ".glb", ".gltf", ".3mf"};
constexpr std::array<const char*, 7> kFormatNames = {
    "PLY", "OBJ", "OFF", "STL", "binary glTF", "glTF in text", "a ZIP archive, as 3MF is"};

/// Returns a cursor at the first word that is not in a comment.
TextCursor to_first_word(std::string_view bytes) {
  TextCursor cursor(bytes, "");
  cursor.skip_to_word([](std::string_view) {});
  return cursor;
}

/// Returns the format that the content shows for certain.
std::optional<Format> format_of_content(std::string_view bytes) {
  // From the surest sign to the weakest: an exact length, a first line, words that other text may begin with.
  if (is_binary_stl(bytes)) return Format::stl;
  if (begins_like_ply(bytes)) return Format::ply;
  if (begins_like_glb(bytes)) return Format::glb;
  if (begins_like_zip(bytes)) return Format::three_mf;
  TextCursor cursor = to_first_word(bytes);
  const std::string_view word = cursor.word();
  cursor.skip_blanks();
  const bool is_off = parse_off_keyword(word).has_value();
  if (is_off && cursor.word() == "BINARY") return Format::off;
  // A binary STL file begins with 80 bytes of any text.
  if (without_padding(bytes.substr(0, 1000)).find('\0') != std::string_view::npos) return std::nullopt;
  if (is_off) return Format::off;
  if (word.starts_with('{')) return Format::gltf;
  if (lower_case(std::string(word)) == "solid") return Format::stl;
  for (const char* keyword : {"v", "vn", "vt", "f", "o", "g", "s", "mtllib", "usemtl"})
    if (word == keyword) return Format::obj;
  return std::nullopt;
}

bool is_utf16(std::string_view bytes) {
  return bytes.size() >= 4 && ((bytes.starts_with("\xFF\xFE") && bytes[3] == '\0') ||
                               (bytes.starts_with("\xFE\xFF") && bytes[2] == '\0'));
}

/// @throws Error if the content shows another format than the name, or does not begin as the format of the
/// name always does.
void check_format(std::string_view bytes, Format named, const std::string& file) {
  const std::optional<Format> content = format_of_content(bytes);
  const auto name_of = [](Format format) { return kFormatNames[static_cast<std::size_t>(format)]; };
  const std::string is_named =
      in_quotes(file) + " is named " + std::string(kExtensions[static_cast<std::size_t>(named)]);
  if (content && *content != named) throw Error(joined(is_named, " but holds ", name_of(*content)));
  if (content) return;
  if (is_utf16(bytes))
    throw Error(joined(in_quotes(file), " is text in UTF-16; save it as UTF-8 or plain ASCII"));
  // An OBJ file may begin with any of dozens of words, a damaged binary STL file with any byte, and an OFF
  // file without its keyword with a count.
  const char first = to_first_word(bytes).peek();
  if (named == Format::ply || named >= Format::glb || (named == Format::off && (first < '0' || first > '9')))
    throw Error(joined(is_named, " but does not begin like ", name_of(named)));
}

}  // namespace

std::optional<MeshPath> parse_mesh_path(const std::filesystem::path& path) {
  std::filesystem::path name = path.filename();
  const bool gzipped = lower_case(name.extension().string()) == ".gz";
  if (gzipped) name = name.stem();
  const auto found = std::ranges::find(kExtensions, lower_case(name.extension().string()));
  if (found == kExtensions.end()) return std::nullopt;
  return MeshPath{static_cast<Format>(found - kExtensions.begin()), gzipped};
}

void throw_unknown_extension(const std::filesystem::path& path) {
  throw Error(joined(in_quotes(path.string()), " is of an unknown type; mesh files end in ", kMeshEndings));
}

namespace {

/// Hashes by the finaliser of splitmix64 (Steele, Lea & Flood 2014), which mixes every bit of a coordinate
/// into every bit of the hash.
std::uint64_t hash_of(const Eigen::Vector3d& point) {
  std::uint64_t hash = 0;
  for (const double x : point) {
    hash += std::bit_cast<std::uint64_t>(x) + 0x9e3779b97f4a7c15u;
    hash = (hash ^ (hash >> 30)) * 0xbf58476d1ce4e5b9u;
    hash = (hash ^ (hash >> 27)) * 0x94d049bb133111ebu;
    hash ^= hash >> 31;
  }
  return hash;
}

}  // namespace

std::size_t PointMerger::slot_of(const Eigen::Vector3d& point, std::uint64_t hash) const {
  // Linear probing; grow() keeps at least half of the slots free, so that a free one ends every search.
  std::size_t slot = hash & (slots_.size() - 1);
  while (slots_[slot] != 0 && points_[slots_[slot] - 1] != point) slot = (slot + 1) & (slots_.size() - 1);
  return slot;
}

void PointMerger::grow() {
  // Sizes are powers of two, since the low bits select a slot.
  slots_.assign(std::max<std::size_t>(1024, 4 * slots_.size()), 0);
  for (std::size_t i = 0; i < points_.size(); ++i)
    slots_[slot_of(points_[i], hash_of(points_[i]))] = static_cast<std::uint32_t>(i + 1);
}

std::uint32_t PointMerger::add(const Eigen::Vector3d& point) {
  if (2 * points_.size() >= slots_.size()) grow();
  const Eigen::Vector3d canonical = point.array() + 0.0;  // makes -0 to 0
  const std::uint64_t hash = hash_of(canonical);
  std::uint32_t& recent = recent_[hash & (recent_.size() - 1)];
  if (recent != 0 && points_[recent - 1] == canonical) return recent - 1;
  const std::size_t slot = slot_of(canonical, hash);
  if (slots_[slot] == 0) {
    points_.push_back(canonical);
    slots_[slot] = static_cast<std::uint32_t>(points_.size());
  }
  recent = slots_[slot];
  return recent - 1;
}

void MeshBuilder::fail_index(std::size_t polygon, std::int64_t corner) const {
  fail("polygon ", polygon, " refers to point ", corner, ", but there are ", mesh.points.size(),
       " points (both count from 0)");
}

void MeshBuilder::add_polygon(std::span<const std::int64_t> corners) {
  const std::size_t polygon = polygons_++;
  if (attributes_) attributes_->add_polygon(corners.size());
  for (const std::int64_t corner : corners) {
    // Points may follow the polygons that name them (in PLY and OBJ), so finish() checks the largest index.
    if (corner < 0 || corner > 0xffffffff) fail_index(polygon, corner);
    if (corner > largest_) largest_ = corner, polygon_of_largest_ = polygon;
  }
  const auto at = [&](std::size_t i) { return static_cast<std::uint32_t>(corners[i]); };
  if (corners.size() < 3) {
    ++dropped_;
  } else if (corners.size() == 4) {
    mesh.quads.push_back({at(0), at(1), at(2), at(3)});
  } else {
    // A fan for now; finish() replaces it by ears if needed, which are as many triangles.
    if (corners.size() > 4) fans_.push_back({polygon, mesh.triangles.size(), corners.size()});
    for (std::size_t i = 2; i < corners.size(); ++i) mesh.triangles.push_back({at(0), at(i - 1), at(i)});
  }
  if (!numbered_) return;
  std::vector<std::uint32_t>& numbers = corners.size() == 4 ? numbers_of_quads_ : numbers_of_triangles_;
  for (std::size_t i = 2; i < corners.size(); ++i) numbers.push_back(next_number_++);
}

void MeshBuilder::number_triangles() {
  // If all triangles come before the first quad, or there is one kind only, the order is that of
  // triangulated().
  if (numbers_of_quads_.empty() || numbers_of_quads_.front() == numbers_of_triangles_.size()) return;
  mesh.triangle_numbers = std::move(numbers_of_triangles_);
  mesh.triangle_numbers.insert(mesh.triangle_numbers.end(), numbers_of_quads_.begin(),
                               numbers_of_quads_.end());
}

void MeshBuilder::cut_concave_polygons() {
  std::size_t left = 0;
  std::vector<std::uint32_t> numbers;
  std::vector<Eigen::Vector3d> corners;
  for (const Fan& fan : fans_) {
    context_.check();
    // The corners, read back from the fan: its first two, then the last of each triangle.
    const std::span triangles = std::span(mesh.triangles).subspan(fan.first_triangle, fan.corners - 2);
    numbers = {triangles[0][0], triangles[0][1]};
    for (const Triangle& triangle : triangles) numbers.push_back(triangle[2]);
    corners.clear();
    for (const std::uint32_t number : numbers) corners.push_back(mesh.points[number]);
    if (is_fan(corners)) continue;
    // Ears replace the triangles of the fan; if none are found the fan stays.
    std::vector<Triangle> cut = clip_ears(corners, context_);
    left += cut.empty();
    for (std::size_t i = 0; i < cut.size(); ++i)
      triangles[i] = {numbers[cut[i][0]], numbers[cut[i][1]], numbers[cut[i][2]]};
    if (attributes_ && !cut.empty()) attributes_->cut_polygon(fan.polygon, std::move(cut));
  }
  if (left > 0)
    note(left,
         " concave polygons intersect themselves or repeat points too often; they were cut into fans, which "
         "may "
         "cover more");
}

void MeshBuilder::add_comment(std::string_view text) {
  TextCursor cursor(text, file_);
  cursor.skip_space();
  if (cursor.word() != "origin") return;
  Eigen::Vector3d origin;
  for (double& x : origin) {
    cursor.skip_space();
    // A foreign comment may begin with the same word.
    const std::optional<double> number = cursor.at_end() ? std::nullopt : cursor.number_if_any<double>();
    if (!number) return;
    x = *number;
  }
  cursor.skip_space();
  if (cursor.at_end() && origin.allFinite()) mesh.origin = origin;
}

void MeshBuilder::leave_out_points(const std::vector<bool>& left_out) {
  std::vector<std::size_t> kept;
  // The numbers of points that are left out are meaningless, and no polygon uses them.
  std::vector<std::uint32_t> numbers(mesh.points.size());
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    numbers[i] = static_cast<std::uint32_t>(kept.size());
    if (left_out[i]) continue;
    mesh.points[kept.size()] = mesh.points[i];
    kept.push_back(i);
  }
  mesh.points.resize(kept.size());
  const auto renumber = [&](auto& polygons) {
    for (auto& polygon : polygons)
      for (std::uint32_t& corner : polygon) corner = numbers[corner];
  };
  renumber(mesh.triangles);
  renumber(mesh.quads);
  if (attributes_) attributes_->keep_points(std::move(kept));
}

/// Leaves out unused points beyond single precision, which must not affect computations over all points.
/// Meshes are in single precision about an origin. @throws Error for a polygon's point that is not finite.
void MeshBuilder::check_points() {
  const auto fits = [](const Eigen::Vector3d& point) {
    return (point.array().abs() <= double(std::numeric_limits<float>::max())).all();  // false for NaN, too
  };
  if (std::ranges::all_of(mesh.points, fits)) return;
  std::vector<bool> left_out;
  for (const Eigen::Vector3d& point : mesh.points) left_out.push_back(!fits(point));
  const auto keep = [&](const auto& polygons) {
    for (const auto& polygon : polygons)
      for (const std::uint32_t corner : polygon) left_out[corner] = false;
  };
  keep(mesh.triangles);
  keep(mesh.quads);
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
    if (!left_out[i] && !mesh.points[i].allFinite())
      fail("point ", i, " (counting from 0) has a coordinate that is not a finite number");
  const auto count = std::ranges::count(left_out, true);
  if (count == 0) return;
  note(count,
       " points that no polygon uses were left out, because they have coordinates that are not finite "
       "numbers in single precision");
  leave_out_points(left_out);
}

MeshFile MeshBuilder::finish() {
  if (mesh.points.size() > 0xffffffff) fail("it has more than 2^32 points");
  if (largest_ >= static_cast<std::int64_t>(mesh.points.size())) fail_index(polygon_of_largest_, largest_);
  if (mesh.triangles.empty() && mesh.quads.empty()) fail("it holds no polygon");
  check_points();
  number_triangles();
  cut_concave_polygons();
  if (dropped_ > 0) note(dropped_, " polygons with fewer than three corners were dropped");
  if (attributes_) attributes_->finish(mesh, context_);
  return std::move(mesh);
}

void MeshBuilder::note_padding(std::string_view bytes) {
  if (!std::ranges::all_of(bytes.substr(without_padding(bytes).size()), is_space))
    note("zeros or Ctrl-Z behind the data were ignored");
}

MeshFile parse_mesh(std::string_view bytes, Format named, const std::string& file, RunContext& context,
                    const ReadOptions& options) {
  check_format(bytes, named, file);
  MeshBuilder builder(file, context, options);
  constexpr std::array<void (*)(std::string_view, MeshBuilder&), 7> readers = {
      read_ply, read_obj, read_off, read_stl, read_glb, read_gltf, read_three_mf};
  readers[static_cast<std::size_t>(named)](bytes, builder);
  return builder.finish();
}

}  // namespace mesh_formats

bool is_mesh_path(const std::filesystem::path& path) {
  return mesh_formats::parse_mesh_path(path).has_value();
}

MeshFile read_mesh_file(const std::filesystem::path& path, RunContext& context, const ReadOptions& options) {
  const Stage stage(context, "read");
  const std::optional<mesh_formats::MeshPath> named = mesh_formats::parse_mesh_path(path);
  // load_bytes() reports a missing file or a directory.
  if (!named && std::filesystem::is_regular_file(path)) mesh_formats::throw_unknown_extension(path);
  const std::string bytes = mesh_formats::load_bytes(path, context);
  return mesh_formats::parse_mesh(bytes, named->format, path.string(), context, options);
}

PolygonMesh read_mesh(const std::filesystem::path& path, RunContext& context, const ReadOptions& options) {
  MeshFile file = read_mesh_file(path, context, options);
  return about_file(path.string(), [&] { return to_polygon_mesh(std::move(file)); });
}

PolygonMesh to_polygon_mesh(const MeshFile& file) { return to_polygon_mesh(MeshFile(file)); }

PolygonMesh to_polygon_mesh(MeshFile&& file) {
  // Bounds of the polygons, since a stray point far away would cost all others precision.
  Bounds box;
  for (const Triangle& triangle : file.triangles)
    for (const std::uint32_t corner : triangle) box.add(file.points[corner]);
  for (const Quad& quad : file.quads)
    for (const std::uint32_t corner : quad) box.add(file.points[corner]);
  PolygonMesh mesh;
  mesh.origin = file.origin ? *file.origin : choose_origin(box);
  mesh.triangles = std::move(file.triangles);
  mesh.quads = std::move(file.quads);
  mesh.attributes = std::move(file.attributes);
  mesh.points.reserve(file.points.size());
  for (const Eigen::Vector3d& point : file.points) {
    const Eigen::Vector3f relative = (point - mesh.origin).cast<float>();
    if (!relative.allFinite())
      throw Error("the mesh has coordinates that are too large for single precision; scale it down");
    mesh.points.push_back(relative);
  }
  return mesh;
}

MeshFile to_mesh_file(const PolygonMesh& mesh) {
  MeshFile file;
  file.points.reserve(mesh.points.size());
  for (std::size_t i = 0; i < mesh.points.size(); ++i) file.points.push_back(mesh.world(i));
  file.triangles = mesh.triangles;
  file.quads = mesh.quads;
  file.attributes = mesh.attributes;
  // Left out only at 0, if a reader would choose it by default.
  if (mesh.origin != choose_origin(bounds(mesh)) || mesh.origin != Eigen::Vector3d::Zero())
    file.origin = mesh.origin;
  return file;
}

}  // namespace hermesh
