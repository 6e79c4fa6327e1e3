// Types of numbers in binary files: sizes, ranges, and conversion at any address and in either byte order.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <tuple>

namespace hermesh {

/// Types of stored numbers, the whole ones first.
enum class NumberType { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };

/// Calls `work` with a zero of the C++ type that `type` stands for, and returns its result.
template <class Work>
decltype(auto) with_type(NumberType type, Work&& work) {
  switch (type) {
    case NumberType::int8:
      return work(std::int8_t());
    case NumberType::uint8:
      return work(std::uint8_t());
    case NumberType::int16:
      return work(std::int16_t());
    case NumberType::uint16:
      return work(std::uint16_t());
    case NumberType::int32:
      return work(std::int32_t());
    case NumberType::uint32:
      return work(std::uint32_t());
    case NumberType::int64:
      return work(std::int64_t());
    case NumberType::uint64:
      return work(std::uint64_t());
    case NumberType::float32:
      return work(float());
    default:
      return work(double());
  }
}

inline bool is_whole(NumberType type) { return type < NumberType::float32; }
/// Returns the size in bytes.
inline std::size_t size_of(NumberType type) {
  return with_type(type, [](auto zero) { return sizeof zero; });
}
inline double largest_of(NumberType type) {
  return with_type(type, [](auto zero) { return double(std::numeric_limits<decltype(zero)>::max()); });
}

/// Returns true if numbers in this byte order have to be reversed on this machine.
constexpr bool is_swapped(bool big_endian) { return big_endian != (std::endian::native == std::endian::big); }

/// Returns the number at any address, its bytes reversed if `swapped`. By default it is little-endian.
template <class T>
T stored_number(const void* at, bool swapped = is_swapped(false)) {
  using Bits = std::tuple_element_t<
      std::bit_width(sizeof(T)) - 1,
      std::tuple<std::uint8_t, std::uint16_t, std::uint32_t, std::uint64_t>>;  // 1, 2, 4 or 8 bytes
  Bits bits;
  std::memcpy(&bits, at, sizeof bits);
  if constexpr (sizeof(T) == 2) bits = swapped ? __builtin_bswap16(bits) : bits;
  if constexpr (sizeof(T) == 4) bits = swapped ? __builtin_bswap32(bits) : bits;
  if constexpr (sizeof(T) == 8) bits = swapped ? __builtin_bswap64(bits) : bits;
  return std::bit_cast<T>(bits);
}

/// Returns the bytes that store a number, in little-endian order by default.
template <class T>
std::array<char, sizeof(T)> bytes_of_number(T value, bool swapped = is_swapped(false)) {
  return std::bit_cast<std::array<char, sizeof(T)>>(stored_number<T>(&value, swapped));
}

}  // namespace hermesh
