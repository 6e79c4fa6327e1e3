// How the samples of a volume are stored in a file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace hermesh {

enum class SampleType { uint8, int8, uint16, int16, uint32, int32, uint64, int64, float32, float64 };

/// Type of a stored number, and the order of its bytes.
struct SampleFormat {
  SampleType type = SampleType::uint8;
  bool big_endian = false;

  bool operator==(const SampleFormat&) const = default;
};

std::size_t size_of(SampleType type);      ///< bytes of a sample
std::string name_of(SampleFormat format);  ///< "int16le", "uint8"

/// Parses uint8, int8, uint16, int16, uint32, int32, uint64, int64, float32 or float64, with le (least
/// significant byte first; also where nothing follows) or be behind. @throws Error that lists what there is.
SampleFormat parse_sample_format(const std::string& name);

/// What became of samples on their way into single precision.
struct DecodeCounts {
  std::uint64_t not_finite = 0;  ///< NaN, infinite, or too large for single precision
  std::uint64_t rounded = 0;     ///< stored numbers that are no single precision
};

/// Decodes samples: value = slope · stored + intercept, in double precision, then rounded. `bytes` holds as
/// many samples as `values`. @returns counts over these samples.
DecodeCounts decode_samples(std::span<const unsigned char> bytes, SampleFormat format, double slope,
                            double intercept, std::span<float> values);

}  // namespace hermesh
