// What the parsers of the mesh file formats share. Private to algorithms/io/mesh_file*.cpp and
// algorithms/io/scenes.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "algorithms/io/mesh_file.h"
#include "algorithms/io/mesh_file_attributes.h"
#include "algorithms/io/mesh_file_text.h"

namespace hermesh::mesh_formats {

enum class Format { ply, obj, off, stl, glb, gltf, three_mf };

struct MeshPath {
  Format format;
  bool gzipped;
};

std::string_view name_of(Format format);  ///< "PLY"
/// Format by extension, in letters of either case; nullopt for an unknown one.
std::optional<MeshPath> parse_mesh_path(const std::filesystem::path& path);
/// @throws Error that lists the known extensions.
[[noreturn]] void throw_unknown_extension(const std::filesystem::path& path);

/// The whole file, unpacked if its first bytes say gzip (any number of members). @throws Error if it cannot
/// be read, is empty, damaged or does not fit into memory.
std::string load_bytes(const std::filesystem::path& path, const RunContext& context);
/// The bytes of a regular file as they are. @throws Error if it cannot be read.
std::string read_whole(const std::filesystem::path& path);
/// Half of the machine's memory, in bytes: the limit of what a file may unpack to, since one of a few
/// megabytes may unpack to terabytes.
std::size_t memory_limit();

/// How many times its own length, or this many bytes, a packed file may unpack to. Text of meshes packs to a
/// tenth, and only what was made to do harm to less than a 200th.
constexpr std::uint64_t kMostUnpackedRatio = 200, kMostUnpackedAnyway = std::uint64_t(1) << 28;
/// Checks the length that `packed` bytes unpack to, so far or in all. @throws Error that begins with `what`
/// if it is beyond those limits or memory_limit().
void check_unpacked(std::uint64_t packed, std::uint64_t unpacked, const std::string& what);

/// Gives points that are equal in all three coordinates (−0 is 0) one number, in the order in which they are
/// first seen.
class PointMerger {
 public:
  explicit PointMerger(std::vector<Eigen::Vector3d>& points) : points_(points) {}
  /// Number of the point, which is appended to the points if it is new. NaN equals nothing and must not come
  /// here.
  std::uint32_t add(const Eigen::Vector3d& point);

 private:
  void grow();
  std::size_t slot_of(const Eigen::Vector3d& point, std::uint64_t hash) const;
  std::vector<Eigen::Vector3d>& points_;
  /// Cache by the low bits of the hash: the latest point with these. Most corners repeat a point of a moment
  /// ago, and this table stays in the processor's cache when the other one has outgrown it.
  std::vector<std::uint32_t> recent_ = std::vector<std::uint32_t>(1 << 15, 0);
  std::vector<std::uint32_t> slots_;  ///< open addressing, number of a point plus one; 0 is free
};

/// Collects what a parser finds and checks it as a whole.
class MeshBuilder {
 public:
  MeshBuilder(std::string file, RunContext& context, const ReadOptions& options = {})
      : file_(std::move(file)), context_(context), numbered_(options.triangle_numbers) {
    if (options.attributes) attributes_.emplace(file_, options.required);
  }

  MeshFile mesh;

  const std::string& file() const { return file_; }
  RunContext& context() { return context_; }
  /// Collects the attributes; null where nobody asked for any.
  AttributeBuilder* attributes() { return attributes_ ? &*attributes_ : nullptr; }

  /// Cancellation and progress at next to no cost; to be called once for every line, point or polygon.
  void tick(std::size_t done, std::size_t total) {
    if (++ticks_ % 65536 != 0) return;
    context_.check();
    context_.progress("read", total ? static_cast<double>(done) / static_cast<double>(total) : 0.0);
  }
  /// Adds a polygon of any number of corners, which count from 0 and may name points that are still to come.
  /// @throws Error for a corner that no index of 32 bits can number.
  void add_polygon(std::span<const std::int64_t> corners);
  /// Takes over the origin from a comment `origin x y z`; any other text is ignored.
  void add_comment(std::string_view text);
  /// The mesh, once indices, coordinates and counts have been checked. @throws Error if one of these is
  /// wrong.
  MeshFile finish();
  /// @throws Error about the file.
  [[noreturn]] void fail(const std::string& what) const { throw Error(in_quotes(file_) + ": " + what); }
  /// Notes what was forgiven, or lost.
  void note(const std::string& what) { context_.note(in_quotes(file_) + ": " + what); }
  /// Notes that padding at the end of these bytes was passed over, where it is more than white space.
  void note_padding(std::string_view bytes) {
    if (has_odd_padding(bytes)) note("zeros or Ctrl-Z behind the data were passed over");
  }

 private:
  [[noreturn]] void fail_index(std::size_t polygon, std::int64_t corner) const;
  void check_points();
  void leave_out_points(const std::vector<bool>& left_out);
  void number_triangles();
  void cut_concave_polygons();

  /// A polygon of more than four corners, which is a fan until all points are there.
  struct Fan {
    std::size_t polygon, first_triangle, corners;
  };
  std::string file_;
  RunContext& context_;
  std::optional<AttributeBuilder> attributes_;
  std::size_t ticks_ = 0, polygons_ = 0, dropped_ = 0, polygon_of_largest_ = 0;
  std::int64_t largest_ = -1;
  std::vector<Fan> fans_;
  bool numbered_;
  std::uint32_t next_number_ = 0;  ///< number of the next triangle, see MeshFile::triangle_numbers
  std::vector<std::uint32_t> numbers_of_triangles_, numbers_of_quads_;
};

/// The mesh in the bytes of a file whose name is of format `named`. @throws Error as read_mesh_file() does.
MeshFile parse_mesh(std::string_view bytes, Format named, const std::string& file, RunContext& context,
                    const ReadOptions& options = {});

// The parsers of the formats hand what they find to the builder, and throw an Error that says where in the
// file.

void read_ply(std::string_view bytes, MeshBuilder& builder);
void read_obj(std::string_view bytes, MeshBuilder& builder);
void read_off(std::string_view bytes, MeshBuilder& builder);
void read_stl(std::string_view bytes, MeshBuilder& builder);
/// Whether the bytes have the length of a binary STL file of as many triangles as it declares: 84 bytes, then
/// 50 for each triangle. No other format has exactly that length.
bool is_binary_stl(std::string_view bytes);
/// Whether the first line is "ply".
bool begins_like_ply(std::string_view bytes);
/// The word that an OFF file begins with.
struct OffKeyword {
  std::size_t length;  ///< the count of points may follow at once
  bool texture = false, colour = false, normal = false, four = false, any_dimension = false;
};
/// The keyword that a word of an OFF file begins with; nullopt if it begins with none.
std::optional<OffKeyword> parse_off_keyword(std::string_view word);

}  // namespace hermesh::mesh_formats
