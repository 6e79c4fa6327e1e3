#include "algorithms/io/import/sample_type.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <string_view>

#include "algorithms/core/error.h"
#include "algorithms/core/shown.h"

namespace hermesh {
namespace {

struct Entry {
  SampleType type;
  std::string_view name;
  std::size_t size;
};

// In the order of the enumeration, by which entry_of() looks up.
constexpr std::array<Entry, 10> kTypes = {{{SampleType::uint8, "uint8", 1},
                                           {SampleType::int8, "int8", 1},
                                           {SampleType::uint16, "uint16", 2},
                                           {SampleType::int16, "int16", 2},
                                           {SampleType::uint32, "uint32", 4},
                                           {SampleType::int32, "int32", 4},
                                           {SampleType::uint64, "uint64", 8},
                                           {SampleType::int64, "int64", 8},
                                           {SampleType::float32, "float32", 4},
                                           {SampleType::float64, "float64", 8}}};

const Entry& entry_of(SampleType type) { return kTypes[static_cast<std::size_t>(type)]; }

template <class T>
T stored_number(const unsigned char* bytes, bool swap) {
  // Samples lie at any address of the file, so their bytes are copied rather than read in place.
  std::array<unsigned char, sizeof(T)> own;
  std::memcpy(own.data(), bytes, sizeof(T));
  if (swap) std::reverse(own.begin(), own.end());
  return std::bit_cast<T>(own);
}

template <class T>
DecodeCounts decode(std::span<const unsigned char> bytes, bool swap, double slope, double intercept,
                    std::span<float> values) {
  DecodeCounts counts;
  // Where there is nothing to scale, stored numbers of up to 24 bits stay exact.
  const bool scaled = slope != 1.0 || intercept != 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const T stored = stored_number<T>(bytes.data() + i * sizeof(T), swap);
    // A double holds all but integers of 64 bits exactly, and those to 53 bits.
    const double number = static_cast<double>(stored);
    // Rounded once, from the scaled number in double precision; too large a number becomes infinite here.
    values[i] = static_cast<float>(scaled ? slope * number + intercept : number);
    counts.not_finite += !std::isfinite(values[i]);
    // What the file says is compared, not the scaled value: a slope that rounds is no loss of the conversion.
    // NaN differs from itself and is counted as not finite alone.
    if (static_cast<double>(static_cast<float>(number)) != number) counts.rounded += !std::isnan(number);
  }
  return counts;
}

}  // namespace

std::size_t size_of(SampleType type) { return entry_of(type).size; }

std::string name_of(SampleFormat format) {
  const Entry& entry = entry_of(format.type);
  // The name says the order of bytes wherever there is one, so that it means the same on every machine.
  return std::string(entry.name) + (entry.size == 1 ? "" : format.big_endian ? "be" : "le");
}

SampleFormat parse_sample_format(const std::string& name) {
  for (const Entry& entry : kTypes)
    // Without a suffix the order is that of nearly all machines, the least significant byte first.
    for (const std::string_view suffix : {"", "le", "be"})
      if (name == std::string(entry.name) + std::string(suffix))
        return {entry.type, suffix == "be" && entry.size > 1};  // a single byte has no order
  // The complaint lists names without suffixes, which would triple the list.
  std::string names;
  for (const Entry& entry : kTypes) names += (names.empty() ? "" : ", ") + std::string(entry.name);
  throw Error("there is no type of samples '" + shown(name) + "'; choose of " + names +
              ", with le or be behind for the order of the bytes");
}

DecodeCounts decode_samples(std::span<const unsigned char> bytes, SampleFormat format, double slope,
                            double intercept, std::span<float> values) {
  // Bytes are swapped where the order of the file is not that of the machine.
  const bool swap = format.big_endian != (std::endian::native == std::endian::big);
  // The type is chosen once for many samples, so that the loop over them has no branch on it.
  const auto as = [&]<class T>() { return decode<T>(bytes, swap, slope, intercept, values); };
  switch (format.type) {
    case SampleType::uint8:
      return as.operator()<std::uint8_t>();
    case SampleType::int8:
      return as.operator()<std::int8_t>();
    case SampleType::uint16:
      return as.operator()<std::uint16_t>();
    case SampleType::int16:
      return as.operator()<std::int16_t>();
    case SampleType::uint32:
      return as.operator()<std::uint32_t>();
    case SampleType::int32:
      return as.operator()<std::int32_t>();
    case SampleType::uint64:
      return as.operator()<std::uint64_t>();
    case SampleType::int64:
      return as.operator()<std::int64_t>();
    case SampleType::float32:
      return as.operator()<float>();
    case SampleType::float64:
      return as.operator()<double>();
  }
  return {};
}

}  // namespace hermesh
