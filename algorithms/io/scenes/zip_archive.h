// ZIP archives as packages of documents use them, by libzip: members stored or deflated, in one file. Private
// to algorithms/io.
#pragma once

#include <zip.h>

#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "algorithms/io/mesh_file_formats.h"
#include "algorithms/io/scenes/scene_files.h"

namespace hermesh::mesh_formats {

/// An archive of the library's, which goes without being written.
struct DiscardZip {
  void operator()(zip_t* archive) const { zip_discard(archive); }
};
using Zip = std::unique_ptr<zip_t, DiscardZip>;

/// A member of an archive that is being unpacked from front to back. The archive must outlive it.
class ZipMember {
 public:
  /// Unpacks the next bytes. @returns how many there are; 0 at the end, and then length and checksum are what
  /// the directory says. @throws Error if they are not, or if the data do not unpack.
  std::size_t read(std::span<char> room);
  /// Length that the directory declares, and how much of it was read.
  std::uint64_t size() const { return size_; }
  std::uint64_t done() const { return done_; }

 private:
  friend class ZipArchive;
  struct Close {
    void operator()(zip_file_t* file) const { zip_fclose(file); }
  };
  [[noreturn]] void fail(int code) const;

  const MeshBuilder* builder_;
  std::string shown_;  ///< the name, for sentences
  std::unique_ptr<zip_file_t, Close> file_;
  std::uint64_t size_ = 0, done_ = 0;
};

/// An archive in memory, whose bytes must outlive it.
class ZipArchive {
 public:
  /// @throws Error if the directory is missing or damaged.
  ZipArchive(std::string_view bytes, const MeshBuilder& builder);

  /// Whether there is a member of this name, in letters of either case, with or without a slash in front.
  bool has(const std::string& name) const { return find(name) >= 0; }
  /// Begins to unpack a member. @throws Error if there is none, if it is encrypted or packed by another
  /// method than deflate, or if its length cannot be right or check_unpacked() refuses all that were opened.
  ZipMember open(const std::string& name);

 private:
  zip_int64_t find(std::string name) const;
  void check(const zip_stat_t& entry, const std::string& shown);

  std::uint64_t bytes_;       ///< of the whole file
  std::uint64_t opened_ = 0;  ///< unpacked length of the members that were opened
  const MeshBuilder& builder_;
  Zip archive_;
};

/// Whether the bytes begin as an archive does.
bool begins_like_zip(std::string_view bytes);

/// Packs members into an archive whose times are all the earliest that ZIP can say, so that the same members
/// give the same bytes.
class ZipWriter {
 public:
  /// Gives the bytes of a member piece by piece, each of which stays until the next call; an empty one at the
  /// end.
  using Pieces = std::function<std::string_view()>;

  /// Adds a member of so many bytes, which are asked for when the archive is written.
  void add(std::string name, std::uint64_t size, Pieces pieces);
  void add(std::string name, std::string bytes);
  /// Packs the members in their order, and hands the archive to `out`. It waits in memory, since each
  /// member's lengths come before it. @throws Error where there is none of that, and whatever the members
  /// throw.
  void write(const ByteSink& out);

 private:
  struct Member {
    std::string name;
    std::uint64_t size;
    Pieces pieces;
    std::string_view rest = {};  ///< of the piece that was given last
    std::exception_ptr thrown = {};
  };
  static zip_int64_t answer(void* member, void* data, zip_uint64_t size, zip_source_cmd_t command);
  static zip_int64_t give(Member& member, char* room, std::uint64_t size);
  void pack(zip_source_t* target);

  std::vector<Member> members_;
};

}  // namespace hermesh::mesh_formats
