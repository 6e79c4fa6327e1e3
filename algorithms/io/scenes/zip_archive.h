// ZIP archives as packages of documents use them: members stored or deflated, in one file. Private to
// algorithms/io.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "algorithms/io/mesh_file_formats.h"

namespace hermesh::mesh_formats {

/// The directory of an archive in memory, whose bytes must outlive it.
class ZipArchive {
 public:
  /// @throws Error if the directory is missing or damaged.
  ZipArchive(std::string_view bytes, const MeshBuilder& builder);

  /// Whether there is a member of this name, in letters of either case, with or without a slash in front.
  bool has(std::string_view name) const { return find(name) != nullptr; }
  /// The unpacked bytes of a member. @throws Error if there is none, if it is encrypted or packed by another
  /// method than deflate, or if its length or its checksum is wrong.
  std::string member(std::string_view name) const;

 private:
  struct Entry {
    std::string name;  ///< in small letters
    std::uint32_t flags, method, checksum;
    std::uint64_t packed, size, offset;
  };
  const Entry* find(std::string_view name) const;
  void read_entry(std::uint64_t& at);
  std::string_view packed_bytes(const Entry& entry) const;
  std::uint64_t number(std::uint64_t at, int bytes) const;

  std::string_view bytes_;
  const MeshBuilder& builder_;
  std::vector<Entry> entries_;
};

/// Whether the bytes begin as an archive does.
bool begins_like_zip(std::string_view bytes);

/// Packs members into an archive whose times are all the earliest that ZIP can say, so that the same members
/// give the same bytes. Packed members wait in memory, because the lengths come before them.
class ZipWriter {
 public:
  ZipWriter();
  ~ZipWriter();
  ZipWriter(const ZipWriter&) = delete;
  ZipWriter& operator=(const ZipWriter&) = delete;

  /// Begins a member, which ends where the next one begins.
  void begin(std::string name);
  /// Adds bytes to the member. @throws Error beyond 4 GB, packed or not: the lengths have 32 bits.
  void add(std::string_view bytes);
  /// Ends the archive. @returns its pieces, in order
  std::vector<std::string> finish();

 private:
  struct Impl;
  void end_member();
  Impl* impl_;
};

}  // namespace hermesh::mesh_formats
