// Bytes of a file from front to back, unpacked where the file is gzipped.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "algorithms/core/run_context.h"

namespace hermesh {

class ByteSource {
 public:
  /// @throws Error for a file that is missing, a folder, empty, or cannot be read.
  explicit ByteSource(std::filesystem::path path);
  ~ByteSource();
  ByteSource(const ByteSource&) = delete;
  ByteSource& operator=(const ByteSource&) = delete;

  bool gzipped() const { return gzipped_; }
  /// More bytes than this are not in the file: its size, or where it is gzipped the most that so many bytes unpack to.
  std::uint64_t at_most() const { return at_most_; }
  std::uint64_t position() const { return position_; }

  /// The next bytes. @throws Error for a file that ends before, or is damaged; Cancelled
  void read(std::span<unsigned char> bytes, const RunContext& context);
  void skip(std::uint64_t bytes, const RunContext& context);
  /// Bytes that are left, at most `limit`. It reads them.
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
