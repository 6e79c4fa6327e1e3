// The structure of .vdb files, checked before OpenVDB reads them. Heavy (OpenVDB): include it from .cpp
// files.
//
// OpenVDB trusts the lengths in a file: bloscFromStream() and unzipFromStream() of version 10 read as many
// bytes as a chunk claims, beyond the end of the buffer, and compare afterwards; strings are allocated with
// the claimed length; data missing at the end of a file are zeros; the offsets of grids may form cycles. So
// this code steps through the file as OpenVDB does (tree/RootNode.h, InternalNode.h, LeafNode.h,
// io/Compression.h) without unpacking: every length must fit the file and its contents. After that, only zlib
// and Blosc have to be trusted not to write beyond the given buffer, which both guarantee.
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "algorithms/core/openvdb_trees.h"

namespace hermesh {

/// Reads a file from any position and never beyond its end. Numbers are those of the machine: little-endian,
/// as .vdb files are.
class BoundedFile {
 public:
  /// @throws Error if the file cannot be read.
  explicit BoundedFile(std::filesystem::path path);

  std::uint64_t position() const { return position_; }
  /// Moves to a position in bytes from the front. @throws Error for one behind the end.
  void seek(std::uint64_t position);
  /// Skips bytes. @throws Error if fewer follow.
  void skip(std::uint64_t bytes);
  /// Copies the next bytes. @throws Error if fewer follow.
  void read(void* to, std::size_t bytes);
  template <class T>
  T number() {
    T value;
    read(&value, sizeof value);
    return value;
  }
  /// Reads a string behind its length of 32 bits. @throws Error if fewer bytes follow.
  std::string text();
  /// Returns the next bytes, at most `at_most`, without moving.
  std::string ahead(std::uint64_t at_most);
  /// @throws Error if fewer bytes follow.
  void need(std::uint64_t bytes) const;
  /// @throws Error that the file is damaged or truncated, with the reason.
  [[noreturn]] void damaged(std::string_view why) const;

 private:
  std::filesystem::path path_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  std::uint64_t size_ = 0, position_ = 0;
};

/// Description of a grid in front of its data.
struct VdbDescriptor {
  std::string unique_name;  ///< as in the file, followed by a number if several grids have one name
  std::string type;         ///< type of the tree, such as "Tree_float_5_4_3"
  std::string parent;       ///< unique name of the grid whose tree this one shares; empty: it has its own
  std::uint64_t start = 0, end = 0;  ///< of its data in the file, bytes
};

/// Checks the structure of one file, see above.
class VdbStructure {
 public:
  /// Reads the header, the file's metadata and the descriptors. OpenVDB reads a file without offsets of grids
  /// (one that was written into a stream) as a whole, so all its trees are checked here.
  /// @throws Error for a file that is truncated, damaged, of a version that OpenVDB 10 does not read, or
  /// holds a grid of an unregistered type, which OpenVDB cannot skip.
  explicit VdbStructure(const std::filesystem::path& path);

  const std::vector<VdbDescriptor>& grids() const { return grids_; }
  /// Returns the grids that OpenVDB may take for the one of that name: one, none, or those that share it.
  std::vector<const VdbDescriptor*> find(const std::string& name) const;
  /// Returns true if the structure of this type of tree is known here; others must not be read.
  static bool is_known(const std::string& type);

  /// Checks the metadata and the transform of a grid. @throws Error for damage.
  void check_metadata(const VdbDescriptor& grid);
  /// Checks a grid completely, and the grid whose tree it shares. Returns the bytes of the tree in memory.
  /// @throws Error for damage.
  double check_tree(const VdbDescriptor& grid);

 private:
  struct GridHead;
  VdbDescriptor read_descriptor();
  GridHead read_head();
  double walk(const VdbDescriptor& grid);

  BoundedFile file_;
  std::uint32_t version_ = 0;
  bool has_offsets_ = true;
  std::vector<VdbDescriptor> grids_;
};

}  // namespace hermesh
