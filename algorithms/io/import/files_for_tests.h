// NIfTI files for tests.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "algorithms/io/stored_number.h"

namespace hermesh {

/// Appends a number in either byte order.
template <class T>
void append_number(std::string& bytes, T value, bool big_endian = false) {
  const auto own = bytes_of_number(value, is_swapped(big_endian));
  bytes.append(own.data(), own.size());
}

/// A NIfTI-1 file of one part; offsets are those of nifti1.h.
class NiftiBytes {
 public:
  explicit NiftiBytes(bool big_endian = false) : big_endian_(big_endian), bytes_(352, '\0') {
    put<std::int32_t>(0, 348);
    put<float>(108, 352.0f);
    for (std::size_t axis = 0; axis < 8; ++axis) put<float>(76 + 4 * axis, 1.0f);
    std::memcpy(bytes_.data() + 344, "n+1", 4);
    bytes_[123] = 2;  // millimetres
  }
  NiftiBytes& dims(const std::vector<std::int16_t>& dims) {
    put<std::int16_t>(40, static_cast<std::int16_t>(dims.size()));
    for (std::size_t i = 0; i < dims.size(); ++i) put<std::int16_t>(42 + 2 * i, dims[i]);
    return *this;
  }
  NiftiBytes& type(std::int16_t code, std::int16_t bits) {
    put(70, code);
    put(72, bits);
    return *this;
  }
  template <class T>
  NiftiBytes& put(std::size_t at, T value) {
    std::string number;
    append_number(number, value, big_endian_);
    bytes_.replace(at, number.size(), number);
    return *this;
  }
  template <class T>
  NiftiBytes& samples(const std::vector<T>& values) {
    for (const T value : values) append_number(bytes_, value, big_endian_);
    return *this;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  bool big_endian_;
  std::string bytes_;
};

inline void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

inline void write_gzipped(const std::filesystem::path& path, const std::string& bytes) {
  const gzFile file = gzopen(path.c_str(), "wb6");
  gzwrite(file, bytes.data(), static_cast<unsigned>(bytes.size()));
  gzclose(file);
}

}  // namespace hermesh
