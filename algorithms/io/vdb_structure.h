// The structure of .vdb files, checked before OpenVDB reads them. Heavy (OpenVDB): include it from .cpp
// files.
//
// OpenVDB believes the lengths in a file: bloscFromStream() and unzipFromStream() of version 10 read as many
// bytes as a chunk says that it has, beyond the end of the buffer, and compare afterwards; strings are made
// as long as they claim to be; what is missing at a file's end is taken for zeros; the offsets of grids may
// lead back to themselves. So all of it is stepped through here, as OpenVDB will (tree/RootNode.h,
// InternalNode.h, LeafNode.h, io/Compression.h), and nothing is unpacked: every length must fit the file and
// what it is a length of. After that, what is left to trust is that zlib and Blosc write no more than they
// were told that there is room for, which both promise.
#pragma once

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "algorithms/core/openvdb_trees.h"

namespace hermesh {

/// A file's bytes, read from front to back or from a given place, and never beyond its end. Numbers are those
/// of the machine: little-endian, as .vdb files are.
class BoundedFile {
 public:
  /// Opens the file at `path`, which errors name. @throws Error if it cannot be read.
  explicit BoundedFile(std::filesystem::path path);

  std::uint64_t size() const { return size_; }
  std::uint64_t position() const { return position_; }
  /// Moves to a place, in bytes from the front. @throws Error for one behind the end.
  void seek(std::uint64_t position);
  /// Steps over bytes. @throws Error where fewer follow.
  void skip(std::uint64_t bytes);
  /// Copies the next bytes. @throws Error where fewer follow.
  void read(void* to, std::size_t bytes);
  template <class T>
  T number() {
    T value;
    read(&value, sizeof value);
    return value;
  }
  /// The string that follows, with its length of 32 bits before it. @throws Error where fewer bytes follow.
  std::string text();
  /// The next bytes, at most `at_most`; the position stays.
  std::string ahead(std::uint64_t at_most);
  /// @throws Error unless as many bytes follow.
  void need(std::uint64_t bytes) const;
  /// @throws Error that says that the file is damaged or truncated, and why.
  [[noreturn]] void damaged(std::string_view why) const;

 private:
  std::filesystem::path path_;
  std::ifstream in_;
  std::uint64_t size_ = 0, position_ = 0, buffer_start_ = 0;
  std::vector<char> buffer_;
};

/// What a file says of a grid before its data.
struct VdbDescriptor {
  std::string unique_name;  ///< as the file has it, with a number behind where several grids have one name
  std::string type;         ///< type of the tree, such as "Tree_float_5_4_3"
  std::string parent;       ///< unique name of the grid whose tree this one shares; empty: it has its own
  std::uint64_t start = 0, end = 0;  ///< where its data lie in the file, bytes
};

/// Steps through the structure of one file; see above for what is checked and why.
class VdbStructure {
 public:
  /// Reads the header, the file's metadata and the descriptors; of a file without offsets of grids (one that
  /// was written into a stream), which OpenVDB reads as a whole, it checks all trees.
  /// @throws Error for a file that is truncated, damaged, of a version that OpenVDB 10 does not read, or
  /// holds a grid of a type that is not registered, which OpenVDB cannot step over.
  explicit VdbStructure(const std::filesystem::path& path);

  const std::vector<VdbDescriptor>& grids() const { return grids_; }
  /// The grids that OpenVDB may take for the one of that name: one, or none, or those that share it.
  std::vector<const VdbDescriptor*> find(const std::string& name) const;
  /// Whether the grid's tree is of a type whose structure is known here; others must not be read.
  static bool is_known(const std::string& type);

  /// Checks what stands before the grid's tree: metadata and transform. @throws Error for damage.
  void check_metadata(const VdbDescriptor& grid);
  /// Checks all of the grid, and of the grid whose tree it shares. @returns bytes that the tree takes in
  /// memory.
  /// @throws Error for damage.
  double check_tree(const VdbDescriptor& grid);

 private:
  struct GridHead;
  VdbDescriptor read_descriptor();
  GridHead read_head();
  double walk(const VdbDescriptor& grid);

  std::unique_ptr<BoundedFile> file_;
  std::uint32_t version_ = 0;
  bool has_offsets_ = true;
  std::vector<VdbDescriptor> grids_;
};

}  // namespace hermesh
