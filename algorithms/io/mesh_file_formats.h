// Parts shared by the readers of the mesh file formats. Private to algorithms/io/mesh_file*.cpp and
// algorithms/io/scenes.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "algorithms/io/mesh_file.h"
#include "algorithms/io/mesh_file_text.h"

namespace hermesh::mesh_formats {

enum class Format { ply, obj, off, stl, glb, gltf, three_mf };

struct MeshPath {
  Format format;
  bool gzipped;
};

/// Returns the format by extension, in letters of either case; nullopt for an unknown one.
std::optional<MeshPath> parse_mesh_path(const std::filesystem::path& path);
/// @throws Error that lists the known extensions.
[[noreturn]] void throw_unknown_extension(const std::filesystem::path& path);

/// Returns the whole file, unpacked if its first bytes are those of gzip (any number of members). @throws
/// Error if it cannot be read, is empty, damaged or does not fit into memory.
std::string load_bytes(const std::filesystem::path& path, const RunContext& context);
/// Returns the bytes of a regular file. @throws Error if it cannot be read.
std::string read_whole(const std::filesystem::path& path);
/// Returns half of the machine's memory in bytes, the limit of unpacked data: a few megabytes may unpack to
/// terabytes.
std::size_t memory_limit();
/// Checks the length that `packed` bytes unpack to, so far or in all. @throws Error that begins with `what`
/// if it exceeds memory_limit(), or both 256 MiB and 200 times the packed length: text of meshes packs to a
/// tenth, and only malicious data to less than a 200th.
void check_unpacked(std::uint64_t packed, std::uint64_t unpacked, const std::string& what);

/// Numbers points in the order in which they first occur; points that are equal in all three coordinates (−0
/// is 0) get one number.
class PointMerger {
 public:
  explicit PointMerger(std::vector<Eigen::Vector3d>& points) : points_(points) {}
  /// Returns the number of the point, which is appended to the points if it is new. It must not be NaN, which
  /// equals nothing.
  std::uint32_t add(const Eigen::Vector3d& point);

 private:
  void grow();
  std::size_t slot_of(const Eigen::Vector3d& point, std::uint64_t hash) const;
  std::vector<Eigen::Vector3d>& points_;
  /// Cache by the low bits of the hash: the latest point with these. Most corners repeat a recent point, and
  /// this table stays in the processor's cache when the other one has outgrown it.
  std::vector<std::uint32_t> recent_ = std::vector<std::uint32_t>(1 << 15, 0);
  std::vector<std::uint32_t> slots_;  ///< open addressing, number of a point plus one; 0 is free
};

/// The attributes of a file as columns of numbers, filled by a reader element by element in the order of the
/// file. Conversion to the types of MeshAttribute, missing values, names, and the order of the mesh are
/// handled here for all formats.
class AttributeTable {
 public:
  /// `file` is the name for messages, `required` as in ReadOptions.
  AttributeTable(std::string file, std::vector<std::string> required)
      : file_(std::move(file)), required_(std::move(required)) {}

  /// Adds a column and returns its number. Elements that have begun already get 0, or −1 in a column of whole
  /// numbers. A name that is taken gets the domain in front: "polygon-colour".
  std::size_t add(const std::string& name, AttributeDomain domain, int components, bool whole);
  void set_labels(std::size_t column, const std::vector<std::string>& labels);
  void reserve(AttributeDomain domain, std::size_t elements);
  /// Begins the next element of the domain, with values as in add() until set() replaces them.
  void begin(AttributeDomain domain);
  /// Sets a component of the newest element. A value that is not finite, or an integer beyond 32 bits, spoils
  /// the column.
  void set(std::size_t column, int component, double value);
  /// Marks a column that cannot be read and will be left out; the first reason counts.
  void spoil(std::size_t column, const std::string& reason);
  /// Calls spoil() for the value of the newest element; `what` ends the message, such as "is no number".
  void spoil_value(std::size_t column, const std::string& what);

  /// Counts a polygon of the file, even one that is dropped; its corners begin on their own.
  void add_polygon(std::size_t corners) { polygon_sizes_.push_back(static_cast<std::uint32_t>(corners)); }
  /// Declares that a polygon is cut into these triangles, by numbers of its corners, and not into a fan.
  /// Calls come in ascending order of polygons.
  void cut_polygon(std::size_t polygon, std::vector<Triangle> triangles) {
    cut_polygons_.emplace_back(polygon, std::move(triangles));
  }
  /// Restricts the mesh to these points of the file.
  void keep_points(std::vector<std::size_t> points) { kept_points_ = std::move(points); }

  /// Moves the attributes into the mesh, in its order, with polygons cut as MeshBuilder cuts them. Notes how
  /// many elements of an attribute got no value, and which attributes are left out. @throws Error if one of
  /// these is required.
  void finish(MeshFile& mesh, RunContext& context);

 private:
  struct Column {
    MeshAttribute result;
    std::size_t given = 0;     ///< number of elements with a value
    std::string spoiled = {};  ///< why it cannot be read; empty if it can
  };
  using Order = std::vector<std::size_t>;  ///< number in the file of each element of the mesh
  Order polygon_order() const;
  Order corner_order() const;
  void grow(Column& column);
  std::size_t& begun(AttributeDomain domain) { return begun_[static_cast<std::size_t>(domain)]; }
  std::size_t leave_out_spoiled(RunContext& context);

  std::string file_;
  std::vector<std::string> required_;
  std::vector<Column> columns_;
  std::array<std::vector<std::size_t>, 3> of_domain_;  ///< numbers of the columns of each domain
  std::array<std::size_t, 3> begun_{};                 ///< number of elements of each domain
  std::map<std::string, int> names_;                   ///< the last number that was appended to each name
  std::optional<Order> kept_points_;
  std::vector<std::uint32_t> polygon_sizes_;
  std::vector<std::pair<std::size_t, std::vector<Triangle>>> cut_polygons_;
};

/// Collects the points, polygons and attributes of a file, and checks them as a whole.
class MeshBuilder {
 public:
  MeshBuilder(std::string file, RunContext& context, const ReadOptions& options = {})
      : file_(std::move(file)), context_(context), numbered_(options.triangle_numbers) {
    if (options.attributes) attributes_.emplace(file_, options.required);
  }

  MeshFile mesh;

  const std::string& file() const { return file_; }
  RunContext& context() { return context_; }
  /// Returns the columns of attributes; null unless ReadOptions asked for attributes.
  AttributeTable* attributes() { return attributes_ ? &*attributes_ : nullptr; }

  /// Handles cancellation and progress at nearly no cost; to be called for every line, point or polygon.
  void tick(std::size_t done, std::size_t total) {
    if (++ticks_ % 65536 != 0) return;
    context_.check();
    context_.progress("read", total ? static_cast<double>(done) / static_cast<double>(total) : 0.0);
  }
  /// Adds a polygon of any number of corners, which count from 0 and may name later points. @throws Error for
  /// a corner that is not a 32-bit index.
  void add_polygon(std::span<const std::int64_t> corners);
  /// Takes the origin from a comment `origin x y z`; any other text is ignored.
  void add_comment(std::string_view text);
  /// Returns the mesh after checking indices, coordinates and counts. @throws Error if one of these is wrong.
  MeshFile finish();
  /// @throws Error about the file.
  template <class... Parts>
  [[noreturn]] void fail(const Parts&... what) const {
    throw Error(joined(in_quotes(file_), ": ", what...));
  }
  /// Notes a deviation that was tolerated, or a loss.
  template <class... Parts>
  void note(const Parts&... what) {
    context_.note(joined(in_quotes(file_), ": ", what...));
  }
  /// Notes padding at the end of these bytes, if it is more than white space.
  void note_padding(std::string_view bytes);

 private:
  [[noreturn]] void fail_index(std::size_t polygon, std::int64_t corner) const;
  void check_points();
  void leave_out_points(const std::vector<bool>& left_out);
  void number_triangles();
  void cut_concave_polygons();

  /// A polygon of more than four corners, which is a fan until all points are known.
  struct Fan {
    std::size_t polygon, first_triangle, corners;
  };
  std::string file_;
  RunContext& context_;
  std::optional<AttributeTable> attributes_;
  std::size_t ticks_ = 0, polygons_ = 0, dropped_ = 0, polygon_of_largest_ = 0;
  std::int64_t largest_ = -1;
  std::vector<Fan> fans_;
  bool numbered_;
  std::uint32_t next_number_ = 0;  ///< number of the next triangle, see MeshFile::triangle_numbers
  std::vector<std::uint32_t> numbers_of_triangles_, numbers_of_quads_;
};

/// Calls `work` with the three corners of each triangle, then of the two triangles of each quad.
template <class Mesh, class Work>
void for_each_triangle(const Mesh& mesh, Work&& work) {
  for (const auto& [a, b, c] : mesh.triangles) work(a, b, c);
  for (const auto& [a, b, c, d] : mesh.quads) work(a, b, c), work(a, c, d);
}

/// Reads the mesh in the bytes of a file whose name is of format `named`. @throws Error as read_mesh_file().
MeshFile parse_mesh(std::string_view bytes, Format named, const std::string& file, RunContext& context,
                    const ReadOptions& options = {});

// The parsers of the formats fill the builder. @throws Error that names the position in the file.

void read_ply(std::string_view bytes, MeshBuilder& builder);
void read_obj(std::string_view bytes, MeshBuilder& builder);
void read_off(std::string_view bytes, MeshBuilder& builder);
void read_stl(std::string_view bytes, MeshBuilder& builder);
/// Returns true if the bytes have the length of a binary STL file of the declared number of triangles: 84
/// bytes, then 50 for each triangle. No other format has exactly that length.
bool is_binary_stl(std::string_view bytes);
/// Returns true if the first line is "ply".
bool begins_like_ply(std::string_view bytes);
/// The first word of an OFF file.
struct OffKeyword {
  std::size_t length;  ///< the number of points may follow at once
  bool texture = false, colour = false, normal = false, four = false, any_dimension = false;
};
/// Returns the keyword that a word of an OFF file begins with, if it begins with one.
std::optional<OffKeyword> parse_off_keyword(std::string_view word);

}  // namespace hermesh::mesh_formats
