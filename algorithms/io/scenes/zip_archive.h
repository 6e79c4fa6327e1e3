// ZIP archives as document packages use them, by minizip: members stored or deflated, the archive in memory.
// Private to algorithms/io.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "algorithms/io/mesh_file_formats.h"

namespace hermesh::mesh_formats {

/// Memory that minizip uses instead of a file, either to read `in` or to write `out`.
struct ZipStream {
  std::string_view in;
  std::string out;
  std::uint64_t at = 0;

  std::uint64_t size() const { return in.size() + out.size(); }
};

/// Reads the members of an archive in memory, one after the other.
class ZipArchive {
 public:
  /// Reads the directory. The bytes must outlive the archive. @throws Error if the directory is missing or
  /// damaged.
  ZipArchive(std::string_view bytes, const MeshBuilder& builder);

  /// Returns true if there is a member of this name, in letters of either case, with or without a leading
  /// slash.
  bool has(const std::string& name) const { return find(name) != nullptr; }
  /// Begins to unpack a member; it replaces the one before. @throws Error if it does not exist, is encrypted
  /// or packed by another method than deflate, if its length is impossible, or if check_unpacked() refuses
  /// the members opened so far.
  void open(const std::string& name);
  /// Unpacks the next bytes and returns their number: 0 at the end, where length and checksum have been
  /// compared with the directory. @throws Error if they differ, or if the data do not unpack.
  std::size_t read(std::span<char> room);
  /// Returns the length of the member as the directory declares it, and the number of bytes read so far.
  std::uint64_t size() const { return size_; }
  std::uint64_t done() const { return done_; }

 private:
  struct Entry {
    std::uint64_t position, number;
  };
  struct Close {
    void operator()(void* archive) const;
  };
  const Entry* find(std::string name) const;
  [[noreturn]] void fail(const std::string& what) const;

  const MeshBuilder& builder_;
  ZipStream stream_;
  std::unique_ptr<void, Close> archive_;
  std::map<std::string, Entry> entries_, lower_entries_;  ///< by name, and by name in small letters
  std::string shown_;                                     ///< the name of the open member, for messages
  bool is_open_ = false;
  std::uint64_t opened_ = 0, size_ = 0, done_ = 0;  ///< opened_: unpacked bytes of all members opened
};

/// Returns true if the bytes begin with the header of a member, or with the end of an empty archive.
bool begins_like_zip(std::string_view bytes);

/// Packs members into an archive whose times are all 1 January 1980, the earliest that ZIP has, so that the
/// same members give the same bytes.
class ZipWriter {
 public:
  ZipWriter();
  /// Begins the next member. `at_most` bounds its length: from 4 GiB on, its lengths take 64 bits, which not
  /// every reader knows.
  void begin(const std::string& name, double at_most);
  void write(std::string_view bytes);
  /// Returns the archive. It is built in memory, since the lengths of a member precede its data.
  std::string finish();

 private:
  struct Close {
    void operator()(void* archive) const;
  };
  ZipStream stream_;
  std::unique_ptr<void, Close> archive_;
};

}  // namespace hermesh::mesh_formats
