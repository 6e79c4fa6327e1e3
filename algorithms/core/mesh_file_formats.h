// What the parsers of the mesh file formats share. Private to algorithms/core/mesh_file*.cpp.
#pragma once

#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "algorithms/core/mesh_file.h"
#include "algorithms/core/mesh_file_attributes.h"

namespace hermesh::mesh_formats {

enum class Format { ply, obj, off, stl };

struct MeshPath {
  Format format;
  bool gzipped;
};

std::string_view name_of(Format format);  ///< "PLY"
/// Format by extension, in any case of letters. nullopt for an unknown one.
std::optional<MeshPath> parse_mesh_path(const std::filesystem::path& path);
/// In quotation marks, for sentences.
inline std::string in_quotes(std::string_view text) {
  std::string result = "'";
  result += text;
  return result += "'";
}
/// The Error that lists the known extensions.
[[noreturn]] void throw_unknown_extension(const std::filesystem::path& path);

/// The whole file, unpacked if its first bytes say gzip (any number of members). @throws Error
std::string load_bytes(const std::filesystem::path& path, const RunContext& context);

/// Points that are equal in all three coordinates (-0 is 0), numbered in the order in which they are first
/// seen.
class PointMerger {
 public:
  explicit PointMerger(std::vector<Eigen::Vector3d>& points) : points_(points) {}
  std::uint32_t add(const Eigen::Vector3d& point);

 private:
  void grow();
  std::size_t slot_of(const Eigen::Vector3d& point, std::uint64_t hash) const;
  std::vector<Eigen::Vector3d>& points_;
  /// By the low bits of the hash, the latest point with them. Most corners repeat a point of a moment ago,
  /// and this table stays in the processor's cache when the other one has outgrown it.
  std::vector<std::uint32_t> recent_ = std::vector<std::uint32_t>(1 << 15, 0);
  std::vector<std::uint32_t> slots_;  ///< open addressing, number of a point plus one; 0 is free
};

/// Collects what a parser finds and checks it as a whole.
class MeshBuilder {
 public:
  MeshBuilder(std::string file, RunContext& context, const ReadOptions& options = {})
      : file_(std::move(file)), context_(context) {
    if (options.attributes) attributes_.emplace(file_);
  }

  MeshFile mesh;

  const std::string& file() const { return file_; }
  RunContext& context() { return context_; }
  /// Null where nobody asked for attributes.
  AttributeBuilder* attributes() { return attributes_ ? &*attributes_ : nullptr; }

  /// Once for every line, point or polygon: cancellation and progress at next to no cost.
  void tick(std::size_t done, std::size_t total) {
    if (++ticks_ % 65536 != 0) return;
    context_.check();
    context_.progress("read", total ? static_cast<double>(done) / static_cast<double>(total) : 0.0);
  }
  /// Corners count from 0.
  void add_polygon(std::span<const std::int64_t> corners);
  /// Text of a comment: takes over `origin x y z`.
  void add_comment(std::string_view text);
  /// The mesh, once indices, coordinates and counts have been checked. @throws Error
  MeshFile finish();
  [[noreturn]] void fail(const std::string& what) const { throw Error(in_quotes(file_) + ": " + what); }

 private:
  [[noreturn]] void fail_index(std::size_t polygon, std::int64_t corner) const;
  void cut_concave_polygons();

  /// Of more than four corners; a fan until all points are there.
  struct Fan {
    std::size_t polygon, first_triangle, corners;
  };
  std::string file_;
  RunContext& context_;
  std::optional<AttributeBuilder> attributes_;
  std::size_t ticks_ = 0, polygons_ = 0, dropped_ = 0, polygon_of_largest_ = 0;
  std::int64_t largest_ = -1;
  std::vector<Fan> fans_;
};

inline bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }
inline bool is_space(char c) { return c == '\n' || is_blank(c); }

/// Reads text from front to back; independent of the locale. Complaints name the line.
class TextCursor {
 public:
  TextCursor(std::string_view text, std::string file, std::size_t start = 0)
      : begin_(text.data()), at_(begin_ + start), end_(begin_ + text.size()), file_(std::move(file)) {
    if (text.substr(start).starts_with("\xEF\xBB\xBF")) at_ += 3;  // byte order mark
  }

  bool at_end() const { return at_ == end_; }
  bool at_line_end() const { return at_ == end_ || *at_ == '\n'; }
  char peek() const { return at_ == end_ ? '\0' : *at_; }
  void advance() { ++at_; }
  std::size_t offset() const { return static_cast<std::size_t>(at_ - begin_); }
  std::size_t remaining() const { return static_cast<std::size_t>(end_ - at_); }

  void skip_space() {
    while (at_ != end_ && is_space(*at_)) ++at_;
  }
  void skip_blanks() {
    while (at_ != end_ && is_blank(*at_)) ++at_;
  }
  void skip_word() {
    while (at_ != end_ && !is_space(*at_)) ++at_;
  }
  std::string_view word() {
    const char* const start = at_;
    skip_word();
    return {start, static_cast<std::size_t>(at_ - start)};
  }
  /// What is left of the line, without its end; moves behind that.
  std::string_view rest_of_line() {
    const char* const start = at_;
    const void* const newline = std::memchr(at_, '\n', remaining());
    const char* stop = newline ? static_cast<const char*>(newline) : end_;
    at_ = newline ? stop + 1 : end_;
    while (stop != start && is_blank(stop[-1])) --stop;
    return {start, static_cast<std::size_t>(stop - start)};
  }

  /// The number that starts here; what ends it is not looked at.
  template <class T>
  [[gnu::always_inline]] T leading_number(const char* what) {
    const char* start = at_;
    if (start != end_ && *start == '+') ++start;
    T value{};
    auto [stop, status] = std::from_chars(start, end_, value);
    if constexpr (std::is_floating_point_v<T>) {
      // Too large and too small look the same here; long double tells them apart, and its overflow is
      // infinity.
      long double wide = HUGE_VALL;
      if (status == std::errc::result_out_of_range) {
        std::from_chars(start, end_, wide);
        value = static_cast<T>(wide);
        status = std::errc();
      }
    }
    if (status != std::errc()) fail_number(what);
    at_ = stop;
    return value;
  }
  /// The number that is the next word. Inlined by order: a seventh of the time that text takes.
  template <class T>
  [[gnu::always_inline]] T number(const char* what) {
    const char* const start = at_;
    const T value = leading_number<T>(what);
    if (at_ != end_ && !is_space(*at_)) {
      at_ = start;
      fail_number(what);
    }
    return value;
  }

  [[noreturn]] void fail(const std::string& what) const;

 private:
  [[noreturn]] void fail_number(const char* what);
  const char *begin_, *at_, *end_;
  std::string file_;
};

/// The mesh in the bytes of a file that is named as of this format. @throws Error
MeshFile parse_mesh(std::string_view bytes, Format named, const std::string& file, RunContext& context,
                    const ReadOptions& options = {});

void read_ply(std::string_view bytes, MeshBuilder& builder);
void read_obj(std::string_view bytes, MeshBuilder& builder);
void read_off(std::string_view bytes, MeshBuilder& builder);
void read_stl(std::string_view bytes, MeshBuilder& builder);
/// 84 bytes, then 50 for each triangle: no other format has exactly that length.
bool is_binary_stl(std::string_view bytes);
/// True for the first word of an OFF file, colours and normals included.
bool is_off_keyword(std::string_view word);

}  // namespace hermesh::mesh_formats
