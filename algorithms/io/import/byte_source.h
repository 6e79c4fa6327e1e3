// Bytes of a file from front to back, unpacked where the file is gzipped.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "algorithms/core/run_context.h"

namespace hermesh {

/// Reads a file from front to back, unpacked where it is gzipped.
class ByteSource {
 public:
  /// Opens a file. @throws Error for one that is missing, a folder, empty, or cannot be read.
  explicit ByteSource(std::filesystem::path path);
  ~ByteSource();
  ByteSource(const ByteSource&) = delete;
  ByteSource& operator=(const ByteSource&) = delete;

  bool gzipped() const { return gzipped_; }
  /// Upper bound of the bytes that the file holds: its size, or where it is gzipped the most that so many
  /// bytes unpack to.
  std::uint64_t at_most() const { return at_most_; }
  /// Bytes that were read so far, unpacked.
  std::uint64_t position() const { return position_; }

  /// Reads the next bytes. @throws Error for a file that ends before, or is damaged. @throws Cancelled.
  void read(std::span<unsigned char> bytes, const RunContext& context);
  /// Reads bytes and drops them. @throws Error and Cancelled as read() does.
  void skip(std::uint64_t bytes, const RunContext& context);
  /// Reads what is left and drops it, up to `limit` bytes; returns how many there were. @throws Error and
  /// Cancelled as read() does.
  std::uint64_t count_rest(std::uint64_t limit, const RunContext& context);

 private:
  std::size_t some(unsigned char* to, std::size_t bytes);
  [[noreturn]] void fail(const std::string& what) const;

  std::filesystem::path path_;
  gzFile file_ = nullptr;
  bool gzipped_ = false;
  std::uint64_t at_most_ = 0, position_ = 0;
};

}  // namespace hermesh
