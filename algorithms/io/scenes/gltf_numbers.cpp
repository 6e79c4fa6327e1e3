#include "algorithms/io/scenes/gltf_numbers.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

namespace hermesh::mesh_formats {

namespace {

/// A number at any address, in the order of bytes that the format has on all machines.
template <class T>
T little_endian(const char* at) {
  std::array<char, sizeof(T)> bytes;
  std::memcpy(bytes.data(), at, sizeof(T));
  if constexpr (std::endian::native == std::endian::big) std::reverse(bytes.begin(), bytes.end());
  return std::bit_cast<T>(bytes);
}

}  // namespace

std::size_t size_of(std::size_t component) {
  switch (component) {
    case kByte:
    case kUnsignedByte:
      return 1;
    case kShort:
    case kUnsignedShort:
      return 2;
    case kUnsignedInt:
    case kFloat:
      return 4;
    default:
      return 0;
  }
}

double number_at(const char* at, std::size_t component) {
  switch (component) {
    case kByte:
      return little_endian<std::int8_t>(at);
    case kUnsignedByte:
      return little_endian<std::uint8_t>(at);
    case kShort:
      return little_endian<std::int16_t>(at);
    case kUnsignedShort:
      return little_endian<std::uint16_t>(at);
    case kUnsignedInt:
      return little_endian<std::uint32_t>(at);
    default:
      return little_endian<float>(at);
  }
}

double largest_of(std::size_t component) {
  return component == kByte           ? 127.0
         : component == kUnsignedByte ? 255.0
         : component == kShort        ? 32767.0
                                      : 65535.0;
}

}  // namespace hermesh::mesh_formats
