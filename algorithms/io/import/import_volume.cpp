// Import of scalar volumes. NIfTI-1: Cox et al., "A (sort of) new image data format standard: NIfTI-1", 2004,
// and the comments of nifti1.h.
#include "algorithms/io/import/import_volume.h"

#include <openvdb/tools/Prune.h>
#include <zlib.h>

#include <Eigen/LU>
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <limits>
#include <span>
#include <vector>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"
#include "algorithms/io/mesh_file_text.h"
#include "algorithms/io/vdb_archive.h"
#include "algorithms/lattice/memory_estimate.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;
using mesh_formats::joined, mesh_formats::three_digits;

/// Reads a file from front to back, unpacked if it is gzipped.
class ByteSource {
 public:
  /// Opens a file. @throws Error if it is missing, a directory, empty, or cannot be read.
  explicit ByteSource(fs::path path) : path_(std::move(path)) {
    std::error_code ignored;
    const fs::file_status status = fs::status(path_, ignored);
    if (!fs::exists(status)) fail("does not exist");
    if (fs::is_directory(status)) fail("is a folder; name a file in it");
    if (!fs::is_regular_file(status)) fail("is not a regular file");
    std::ifstream in(path_, std::ios::binary);
    if (!in) fail("cannot be read: ", std::strerror(errno));
    const std::uint64_t size = fs::file_size(path_);
    if (size == 0) fail("is empty");
    std::array<char, 2> magic{};
    in.read(magic.data(), magic.size());
    gzipped_ = magic == std::array{'\x1f', '\x8b'};
    // Deflate codes at most 258 bytes by two bits.
    at_most_ = gzipped_ ? size * 1032 : size;
    file_ = gzopen(path_.c_str(), "rb");  // reads files that are not gzipped unchanged
    if (!file_) fail("cannot be read: ", std::strerror(errno));
    gzbuffer(file_, 1 << 18);
  }
  ~ByteSource() {
    if (file_) gzclose_r(file_);
  }
  ByteSource(const ByteSource&) = delete;
  ByteSource& operator=(const ByteSource&) = delete;

  bool gzipped() const { return gzipped_; }
  /// Returns an upper bound of the unpacked bytes, by which the claims of a header can be refused.
  std::uint64_t at_most() const { return at_most_; }
  /// Returns the number of unpacked bytes that were read.
  std::uint64_t position() const { return position_; }

  /// Reads the next bytes. @throws Error for a file that ends before, or is damaged. @throws Cancelled.
  void read(std::span<unsigned char> bytes, const RunContext& context) {
    while (!bytes.empty()) {
      const std::size_t got = some(bytes, context);
      if (got == 0) fail("is truncated: it ends after ", position_, " bytes, ", bytes.size(), " too early");
      bytes = bytes.subspan(got);
    }
  }
  /// Skips bytes by reading them, as gzip requires. @throws Error and Cancelled like read().
  void skip(std::uint64_t bytes, const RunContext& context) {
    std::vector<unsigned char> ignored(std::min<std::uint64_t>(bytes, kLargestRead));
    while (bytes > 0) {
      const std::uint64_t part = std::min<std::uint64_t>(bytes, ignored.size());
      read(std::span(ignored).first(part), context);
      bytes -= part;
    }
  }
  /// True if the file has no more bytes. @throws Error and Cancelled like read().
  bool at_end(const RunContext& context) {
    unsigned char byte;
    return some({&byte, 1}, context) == 0;
  }

 private:
  /// Reads at most 16 MiB, so that a cancelled run ends soon; returns 0 at the end.
  std::size_t some(std::span<unsigned char> to, const RunContext& context) {
    context.check();
    const int got = gzread(file_, to.data(), static_cast<unsigned>(std::min(to.size(), kLargestRead)));
    int status = Z_OK;
    gzerror(file_, &status);
    // zlib reports a buffer error if the gzip data end too early.
    if (got >= 0 && status == Z_BUF_ERROR) fail("is truncated: its gzip data break off");
    if (got < 0 || (status != Z_OK && status != Z_STREAM_END))
      fail("is damaged: its gzip data do not unpack");
    position_ += static_cast<std::uint64_t>(got);
    return static_cast<std::size_t>(got);
  }
  template <class... Parts>
  [[noreturn]] void fail(const Parts&... what) const {
    throw Error(joined(path_.string(), " ", what...));
  }

  static constexpr std::size_t kLargestRead = std::size_t{1} << 24;
  fs::path path_;
  gzFile file_ = nullptr;
  bool gzipped_ = false;
  std::uint64_t at_most_ = 0, position_ = 0;
};

/// A box of samples in a file, x fastest, then y, then z.
struct StoredSamples {
  std::string file;  ///< name of the file with the samples, for messages
  std::array<std::int64_t, 3> dims{};
  SampleFormat format;
  std::uint64_t offset = 0;  ///< of the first sample in the file, unpacked bytes
  double slope = 1.0, intercept = 0.0;
  /// Index coordinates to millimeters, applied to columns.
  Eigen::Matrix4d to_world = Eigen::Matrix4d::Identity();
};

constexpr std::array<const char*, 10> kTypeNames = {"int8",   "uint8", "int16",  "uint16",  "int32",
                                                    "uint32", "int64", "uint64", "float32", "float64"};

/// Numbers of samples that lose information in single precision.
struct DecodeCounts {
  std::uint64_t not_finite = 0;  ///< NaN, infinite, or too large for single precision
  std::uint64_t rounded = 0;     ///< stored numbers that are not exact in single precision
};

/// Decodes samples: value = slope · stored + intercept, in double precision, then rounded.
void decode(std::span<const unsigned char> bytes, const StoredSamples& stored, std::span<float> values,
            DecodeCounts& counts) {
  const bool swapped = is_swapped(stored.format.big_endian);
  // Without scaling, stored numbers of up to 24 bits stay exact.
  const bool scaled = stored.slope != 1.0 || stored.intercept != 0.0;
  with_type(stored.format.type, [&](auto zero) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto number =
          static_cast<double>(stored_number<decltype(zero)>(bytes.data() + i * sizeof zero, swapped));
      values[i] = static_cast<float>(scaled ? stored.slope * number + stored.intercept : number);
      counts.not_finite += !std::isfinite(values[i]);
      // The stored number counts, not the scaled one. NaN is counted as not finite only.
      if (static_cast<double>(static_cast<float>(number)) != number) counts.rounded += !std::isnan(number);
    }
  });
}

using Leaf = openvdb::FloatTree::LeafNodeType;

/// Reads the samples in the order of the file, x fastest. `decode` writes a part of them, given by the bytes,
/// the number of the first sample, and the values.
template <class Value, class Decode>
std::vector<Value> read_samples(ByteSource& source, const StoredSamples& stored, RunContext& context,
                                Decode&& decode) {
  source.skip(stored.offset - source.position(), context);
  const std::size_t size = size_of(stored.format.type);
  const std::size_t count = static_cast<std::size_t>(stored.dims[0] * stored.dims[1] * stored.dims[2]);
  // A million samples at a time, so that the stored bytes need little memory.
  constexpr std::size_t kPart = std::size_t{1} << 20;
  std::vector<unsigned char> bytes(std::min(count, kPart) * size);
  // Grows with the samples read, so that a gzipped file that claims too much ends before memory does.
  std::vector<Value> values;
  while (values.size() < count) {
    const std::size_t first = values.size(), part = std::min(kPart, count - first);
    const auto packed = std::span(bytes).first(part * size);
    source.read(packed, context);
    values.resize(first + part);
    decode(packed, first, std::span(values).subspan(first));
    context.progress("read volume", static_cast<double>(values.size()) / static_cast<double>(count));
  }
  return values;
}

/// Reads the samples as floats, in the order of the file, x fastest.
std::vector<float> read_values(ByteSource& source, const StoredSamples& stored, const ImportOptions& options,
                               RunContext& context) {
  DecodeCounts counts;
  std::vector<float> values =
      read_samples<float>(source, stored, context,
                          [&](std::span<const unsigned char> packed, std::size_t, std::span<float> part) {
                            decode(packed, stored, part, counts);
                          });
  if (counts.not_finite > 0 && !options.replacement)
    throw Error(joined(stored.file, " holds ", counts.not_finite,
                       " samples that are NaN, infinite or too large for single precision; replace them with "
                       "--replace-nan VALUE"));
  if (counts.not_finite > 0) {
    for (float& value : values)
      if (!std::isfinite(value)) value = *options.replacement;
    context.note(
        joined(counts.not_finite, " samples of ", stored.file, " that are not finite were replaced"));
  }
  if (counts.rounded > 0)
    context.note(joined(counts.rounded, " samples of ", stored.file, " were rounded to single precision"));
  return values;
}

/// Reads the samples as labels, in the order of the file. @throws Error for a sample that is no label
std::vector<std::int32_t> read_labels(ByteSource& source, const StoredSamples& stored,
                                      const ImportOptions& options, RunContext& context) {
  const bool swapped = is_swapped(stored.format.big_endian);
  const auto refuse = [&](double value, std::size_t number) {
    const auto n = static_cast<std::int64_t>(number);
    const std::int64_t x = n % stored.dims[0], y = n / stored.dims[0] % stored.dims[1],
                       z = n / (stored.dims[0] * stored.dims[1]);
    throw Error(joined(stored.file, " holds the value ", value, " at sample (", x, ", ", y, ", ", z,
                       "), which is not a label (a whole number from 0 to 2147483647); import it without "
                       "--labels, or round its samples first"));
  };
  return read_samples<std::int32_t>(
      source, stored, context,
      [&](std::span<const unsigned char> packed, std::size_t first, std::span<std::int32_t> part) {
        with_type(stored.format.type, [&](auto zero) {
          for (std::size_t i = 0; i < part.size(); ++i) {
            const auto number =
                static_cast<double>(stored_number<decltype(zero)>(packed.data() + i * sizeof zero, swapped));
            double value = stored.slope * number + stored.intercept;
            if (!std::isfinite(value) && options.replacement) value = double(*options.replacement);
            if (!(value >= 0.0 && value <= 2147483647.0 && value == std::floor(value)))
              refuse(value, first + i);
            part[i] = static_cast<std::int32_t>(value);
          }
        });
      });
}

/// Notes if integer samples look like labels: few values, nearly all equal to the next along x.
void note_likely_labels(const std::vector<float>& values, const StoredSamples& stored, float lowest,
                        float highest, RunContext& context) {
  constexpr float kMostLabel = 65535.0f;
  constexpr std::size_t kMostValues = 256;
  constexpr double kMostChanges = 0.2;
  const bool is_integer =
      stored.format.type != NumberType::float32 && stored.format.type != NumberType::float64;
  if (!is_integer || lowest != 0.0f || highest > kMostLabel || stored.slope != std::floor(stored.slope) ||
      stored.intercept != std::floor(stored.intercept))
    return;
  std::vector<bool> found(static_cast<std::size_t>(highest) + 1);
  std::size_t changes = 0, kinds = 0;
  float before = -1.0f;
  for (const float value : values) {
    if (value == before) continue;
    ++changes;
    before = value;
    if (!found[static_cast<std::size_t>(value)]) ++kinds, found[static_cast<std::size_t>(value)] = true;
  }
  if (kinds < 3 || kinds > kMostValues || double(changes) > kMostChanges * double(values.size())) return;
  context.note(joined(stored.file, " looks like a label map, with ", kinds - 1,
                      " labels; pass --labels to extract the boundary of each"));
}

/// Returns the next lower number in single precision; near 0 the next normal one, since denormal numbers may
/// be flushed to 0.
float just_below(float value) {
  const float next = std::nextafter(value, -std::numeric_limits<float>::infinity());
  return std::fabs(next) < std::numeric_limits<float>::min() ? -std::numeric_limits<float>::min() : next;
}

using LabelLeaf = openvdb::Int32Tree::LeafNodeType;

/// Makes a leaf of labels, or null if it holds none; the background is inactive.
LabelLeaf* make_leaf(const std::vector<std::int32_t>& values, const std::array<std::int64_t, 3>& dims,
                     const openvdb::Coord& lower) {
  auto leaf = std::make_unique<LabelLeaf>(lower, 0, false);
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 8; ++z) {
        const std::int64_t i = lower.x() + x, j = lower.y() + y, k = lower.z() + z;
        if (i >= dims[0] || j >= dims[1] || k >= dims[2]) continue;
        const std::int32_t label = values[static_cast<std::size_t>(i + dims[0] * (j + dims[1] * k))];
        if (label != 0) leaf->setValueOn(static_cast<openvdb::Index>(64 * x + 8 * y + z), label);
      }
  return leaf->isEmpty() ? nullptr : leaf.release();
}

/// Makes a leaf of the samples; those beyond the box are background and inactive.
Leaf* make_leaf(const std::vector<float>& values, const std::array<std::int64_t, 3>& dims,
                const openvdb::Coord& lower, float background) {
  Leaf* leaf = new Leaf(lower, background, false);
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 8; ++z) {
        const std::int64_t i = lower.x() + x, j = lower.y() + y, k = lower.z() + z;
        if (i >= dims[0] || j >= dims[1] || k >= dims[2]) continue;
        // In a leaf z runs fastest, in the file x.
        const auto offset = static_cast<openvdb::Index>(64 * x + 8 * y + z);
        leaf->setValueOn(offset, values[static_cast<std::size_t>(i + dims[0] * (j + dims[1] * k))]);
      }
  return leaf;
}

/// Makes a grid of the leaves that make_leaf(first sample) returns for the blocks of the box.
template <class Grid, class MakeLeaf>
typename Grid::Ptr make_grid(const StoredSamples& stored, typename Grid::ValueType background,
                             RunContext& context, MakeLeaf&& make_leaf) {
  std::array<std::size_t, 3> blocks;
  for (int axis = 0; axis < 3; ++axis) blocks[axis] = static_cast<std::size_t>((stored.dims[axis] + 7) / 8);
  // Leaves are filled in parallel and added to the tree one by one.
  std::vector<std::unique_ptr<typename Grid::TreeType::LeafNodeType>> leaves(blocks[0] * blocks[1] *
                                                                             blocks[2]);
  parallel_blocks(leaves.size(), context, [&](std::size_t i) {
    const openvdb::Coord lower(static_cast<int>(8 * (i / (blocks[1] * blocks[2]))),
                               static_cast<int>(8 * (i / blocks[2] % blocks[1])),
                               static_cast<int>(8 * (i % blocks[2])));
    leaves[i].reset(make_leaf(lower));
  });
  auto grid = Grid::create(background);
  for (auto& leaf : leaves)
    if (leaf) grid->tree().addLeaf(leaf.release());
  openvdb::tools::prune(grid->tree());  // exactly constant regions only
  return grid;
}

/// Sets the transform and the metadata of an imported grid. @throws Error for a transform that OpenVDB
/// refuses
void describe(openvdb::GridBase& grid, const StoredSamples& stored) {
  openvdb::math::Mat4d matrix;  // transposed, since OpenVDB multiplies row vectors
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) matrix(row, column) = stored.to_world(column, row);
  try {
    grid.setTransform(openvdb::math::Transform::createLinearTransform(matrix));
  } catch (const openvdb::Exception&) {  // it checks the determinant, whatever the unit of length
    throw Error(joined(stored.file,
                       " has voxels that are too small or too flat for OpenVDB; scale its transform up"));
  }
  grid.setGridClass(openvdb::GRID_UNKNOWN);
  grid.insertMeta("hermesh_source",
                  openvdb::StringMetadata(std::filesystem::path(stored.file).filename().string()));
  grid.insertMeta("hermesh_sample_type", openvdb::StringMetadata(name_of(stored.format)));
}

/// Returns the bytes of the samples. @throws Error for dimensions below 1 or beyond index coordinates, for
/// more than `at_most` bytes in all, and for more memory than is available; nothing is allocated.
std::uint64_t check_stored(const StoredSamples& stored, std::uint64_t at_most) {
  constexpr std::int64_t kMost = std::int64_t{1} << 30;
  const std::string claim = std::to_string(stored.dims[0]) + " x " + std::to_string(stored.dims[1]) + " x " +
                            std::to_string(stored.dims[2]) + " samples of " + name_of(stored.format);
  for (const std::int64_t dim : stored.dims)
    if (dim < 1 || dim > kMost)
      throw Error(joined(stored.file, " cannot hold ", claim, ": each dimension must be from 1 to 2^30"));
  // In double precision, since products of numbers up to 2^30 overflow integers.
  const double bytes = double(stored.dims[0]) * double(stored.dims[1]) * double(stored.dims[2]) *
                       double(size_of(stored.format.type));
  if (bytes + double(stored.offset) > double(at_most))
    throw Error(joined(stored.file, " is too short for ", claim, " behind ", stored.offset,
                       " bytes; it is truncated, or the dimensions are wrong"));
  // The peak: the floats, the leaves, and the old array of a growing vector.
  const double needed = bytes / double(size_of(stored.format.type)) * 3.0 * sizeof(float);
  if (const auto available = available_memory(); available && needed > double(*available))
    throw Error(joined(stored.file, " would need about ", three_digits(needed / 0x1p30), " GiB, and ",
                       three_digits(double(*available) / 0x1p30),
                       " GiB are available; crop or resample it first"));
  return static_cast<std::uint64_t>(bytes);
}

/// Reads the samples from the source, which is at or before the first, into a grid as in import_volume.h.
/// @throws Error for a source that ends early or is damaged, for samples that are not finite unless they are
/// replaced, and for a transform that OpenVDB refuses. @throws Cancelled.
LevelSet read_stored(ByteSource& source, const StoredSamples& stored, const ImportOptions& options,
                     RunContext& context) {
  const Stage stage(context, "read volume");
  initialize_openvdb();
  const std::vector<float> values = read_values(source, stored, options, context);
  const auto [lowest, highest] = std::ranges::minmax_element(values);
  // Below every sample, so that space beyond the box is outside at any isovalue, and 0 for a mask that fills
  // its image.
  const float background = *lowest > 0.0f ? 0.0f : just_below(*lowest);
  if (!std::isfinite(background))
    throw Error(joined(stored.file, " holds the lowest number of single precision; rescale its samples"));
  note_likely_labels(values, stored, *lowest, *highest, context);
  const auto grid = make_grid<openvdb::FloatGrid>(
      stored, background, context,
      [&](const openvdb::Coord& lower) { return make_leaf(values, stored.dims, lower, background); });
  describe(*grid, stored);
  grid->setName("volume");
  grid->insertMeta("hermesh_minimum", openvdb::FloatMetadata(*lowest));
  grid->insertMeta("hermesh_maximum", openvdb::FloatMetadata(*highest));
  return make_level_set(grid);
}

constexpr std::size_t kHeaderBytes = 348;

/// Returns the path without .gz, and its extension in lower case.
std::pair<fs::path, std::string> unpacked_name(const fs::path& path) {
  const auto lower_extension = [](const fs::path& of) {
    return mesh_formats::lower_case(of.extension().string());
  };
  const fs::path name = lower_extension(path) == ".gz" ? fs::path(path).replace_extension() : path;
  return {name, lower_extension(name)};
}

/// The header of a NIfTI file. Positions of numbers are those of nifti1.h, in bytes.
class NiftiHeader {
 public:
  NiftiHeader(ByteSource& source, std::string file, const RunContext& context) : file_(std::move(file)) {
    source.read(bytes_, context);
    // The first number, the length of the header, shows the byte order. It is 540 in NIfTI-2.
    const auto own = stored_number<std::int32_t>(bytes_.data(), false),
               swapped = stored_number<std::int32_t>(bytes_.data(), true);
    if (own == 540 || swapped == 540) fail("is NIfTI-2; convert it to NIfTI-1");
    if (own != int(kHeaderBytes) && swapped != int(kHeaderBytes)) fail("is not a NIfTI-1 file");
    swap_ = own != int(kHeaderBytes);
    const std::string_view magic(reinterpret_cast<const char*>(bytes_.data() + 344), 4);
    if (magic != std::string_view("n+1\0", 4) && magic != std::string_view("ni1\0", 4))
      fail("is of the older format ANALYZE 7.5 or damaged, not NIfTI-1; convert it");
  }

  template <class T>
  T number(std::size_t at) const {
    return stored_number<T>(bytes_.data() + at, swap_);
  }
  /// Returns the float at `at`, called `what`. @throws Error if it is not finite.
  double real(std::size_t at, const char* what) const {
    const float value = number<float>(at);
    if (!std::isfinite(value)) fail("is damaged: its ", what, " is not a finite number");
    return double(value);
  }
  bool one_file() const { return bytes_[345] == '+'; }
  bool big_endian() const { return swap_ == is_swapped(true); }
  const std::string& file() const { return file_; }
  template <class... Parts>
  [[noreturn]] void fail(const Parts&... what) const {
    throw Error(joined(file_, " ", what...));
  }

 private:
  std::string file_;
  std::array<unsigned char, kHeaderBytes> bytes_{};
  bool swap_ = false;
};

SampleFormat format_of(const NiftiHeader& header, RunContext& context) {
  const int code = header.number<std::int16_t>(70), bits = header.number<std::int16_t>(72);
  // Codes of nifti1.h.
  constexpr std::array<std::pair<int, NumberType>, 10> kCodes = {{{2, NumberType::uint8},
                                                                  {4, NumberType::int16},
                                                                  {8, NumberType::int32},
                                                                  {16, NumberType::float32},
                                                                  {64, NumberType::float64},
                                                                  {256, NumberType::int8},
                                                                  {512, NumberType::uint16},
                                                                  {768, NumberType::uint32},
                                                                  {1024, NumberType::int64},
                                                                  {1280, NumberType::uint64}}};
  const auto found = std::ranges::find(kCodes, code, &std::pair<int, NumberType>::first);
  if (found == kCodes.end())
    header.fail("holds samples of the NIfTI type ", code,
                ", which is not one real number of up to 64 bits; convert it to a scalar type");
  // Programs that convert volumes forget to change bitpix, which is redundant.
  const int own_bits = 8 * int(size_of(found->second));
  if (bits != own_bits)
    context.note(joined(header.file(), " states that samples of the NIfTI type ", code, " have ", bits,
                        " bits; the type decides: ", own_bits));
  return {found->second, header.big_endian()};
}

/// Sets the dimensions of the box; axes beyond the third are frames, whose number it returns.
std::int64_t read_dims(const NiftiHeader& header, StoredSamples& stored) {
  const int axes = header.number<std::int16_t>(40);
  if (axes < 1 || axes > 7) header.fail("is damaged: it declares ", axes, " dimensions");
  std::int64_t frames = 1;
  for (int axis = 0; axis < axes; ++axis) {
    const std::int64_t dim = header.number<std::int16_t>(42 + 2 * static_cast<std::size_t>(axis));
    if (dim < 1) header.fail("is damaged: its dimension ", axis + 1, " is ", dim);
    if (axis < 3)
      stored.dims[axis] = dim;
    else
      frames *= dim;  // at most 2^60
  }
  for (int axis = axes; axis < 3; ++axis) stored.dims[axis] = 1;
  return frames;
}

/// Returns the length of the file's unit in millimeters, the default unit.
double unit_of(const NiftiHeader& header) {
  const int unit = header.number<std::uint8_t>(123) & 7;
  return unit == 1 ? 1000.0 : unit == 3 ? 0.001 : 1.0;
}

std::array<double, 3> voxel_sizes(const NiftiHeader& header, RunContext& context) {
  std::array<double, 3> sizes;
  bool missing = false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // Some files have negative sizes, but transforms define directions.
    sizes[axis] = std::fabs(header.real(80 + 4 * axis, "size of voxels"));
    if (sizes[axis] == 0.0) missing = true, sizes[axis] = 1.0;
  }
  if (missing) context.note(joined(header.file(), " does not state the size of its voxels; 1 was taken"));
  return sizes;
}

/// Returns the qform: a rotation as the last three numbers of a unit quaternion, times the sizes of voxels
/// (method 2 of nifti1.h).
Eigen::Matrix4d quaternion_form(const NiftiHeader& header, const std::array<double, 3>& sizes) {
  const double b = header.real(256, "qform"), c = header.real(260, "qform"), d = header.real(264, "qform");
  // Rounding to single precision may exceed a length of 1.
  const double rest = 1.0 - (b * b + c * c + d * d);
  if (rest < -1e-5) header.fail("is damaged: the quaternion of its qform is longer than 1");
  const double a = std::sqrt(std::max(0.0, rest));
  Eigen::Matrix3d turn;
  turn << a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c),  //
      2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b),      //
      2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - b * b - c * c;
  // qfac: −1 mirrors the third axis.
  const double hand = header.number<float>(76) < 0.0f ? -1.0 : 1.0;
  Eigen::Matrix4d form = Eigen::Matrix4d::Identity();
  form.topLeftCorner<3, 3>() = turn * Eigen::Vector3d(sizes[0], sizes[1], hand * sizes[2]).asDiagonal();
  for (std::size_t axis = 0; axis < 3; ++axis)
    form(Eigen::Index(axis), 3) = header.real(268 + 4 * axis, "qform");
  return form;
}

/// Returns the sform of the header, if it is finite.
std::optional<Eigen::Matrix4d> affine_form(const NiftiHeader& header) {
  Eigen::Matrix4d form = Eigen::Matrix4d::Identity();
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 4; ++column)
      form(Eigen::Index(row), Eigen::Index(column)) = header.number<float>(280 + 16 * row + 4 * column);
  return form.allFinite() ? std::optional(form) : std::nullopt;
}

bool is_singular(const Eigen::Matrix4d& form) {
  const Eigen::Matrix3d linear = form.topLeftCorner<3, 3>();
  // Relative to the lengths of its columns, so that the unit of length has no effect.
  const double scale = linear.colwise().norm().prod();
  return !(scale > 0.0) || !(std::fabs(linear.determinant()) > 1e-6 * scale);
}

/// Returns the transform of index coordinates to millimeters: the sform, else the qform, else the sizes of
/// voxels. An sform of zeros, or one that is not finite, is skipped, since some programs write it as valid.
Eigen::Matrix4d transform_of(const NiftiHeader& header, RunContext& context) {
  const bool has_qform = header.number<std::int16_t>(252) > 0;
  Eigen::Matrix4d form = Eigen::Matrix4d::Identity();
  bool found = false;
  if (header.number<std::int16_t>(254) > 0) {
    const std::optional<Eigen::Matrix4d> affine = affine_form(header);
    const bool empty = !affine || affine->topLeftCorner<3, 3>().isZero(0.0);
    if (affine) form = *affine;
    found = affine && !is_singular(form);
    if (!found && !empty && !has_qform) found = true;  // refused below
    if (!found)
      context.note(joined(header.file(), " has an sform that is ", (empty ? "empty" : "singular"), "; its ",
                          (has_qform ? "qform was" : "sizes of voxels were"), " taken"));
  }
  if (!found) {
    const std::array<double, 3> sizes = voxel_sizes(header, context);
    form = Eigen::Matrix4d::Identity();
    if (has_qform)
      form = quaternion_form(header, sizes);
    else
      for (int axis = 0; axis < 3; ++axis) form(axis, axis) = sizes[axis];
  }
  if (is_singular(form))
    header.fail("has a singular transform, which puts all voxels into a plane; set its sform or qform");
  form.topRows<3>() *= unit_of(header);
  return form;
}

/// Moves the box to the requested frame. @throws Error if it does not exist.
void choose_frame(const NiftiHeader& header, std::int64_t frames, std::uint64_t frame_bytes,
                  const ImportOptions& options, StoredSamples& stored, RunContext& context) {
  const std::int64_t frame = options.frame.value_or(0);
  if (frame < 0 || frame >= frames)
    header.fail("has no frame ", frame, "; it has ", frames, ", numbered from 0");
  // In double precision, since the product may overflow 64 bits.
  if (double(frame) * double(frame_bytes) > 0x1p62) header.fail("is truncated: that frame cannot be in it");
  if (frames > 1 && !options.frame)
    context.note(
        joined(header.file(), " holds ", frames, " frames; the first was taken (--frame N takes another)"));
  stored.offset += static_cast<std::uint64_t>(frame) * frame_bytes;
}

/// Returns the file of the same name with another extension, possibly gzipped. If neither exists, the name is
/// the one without .gz.
fs::path companion(const fs::path& path, const char* extension) {
  fs::path beside = unpacked_name(path).first;
  beside.replace_extension(extension);
  std::error_code ignored;
  if (!fs::exists(beside, ignored) && fs::exists(beside.string() + ".gz", ignored))
    return beside.string() + ".gz";
  return beside;
}

std::uint64_t samples_offset(const NiftiHeader& header) {
  const double offset = header.real(108, "offset of the samples");
  // Samples in a file of their own may begin at 0, others only behind the header.
  const double least = header.one_file() ? double(kHeaderBytes) : 0.0;
  if (offset < least || offset > 0x1p40 || offset != std::floor(offset))
    header.fail("is damaged: its samples cannot start at byte ", offset);
  return static_cast<std::uint64_t>(offset);
}

/// Opens a NIfTI file and returns work(source, stored), for which the source is at or before the samples.
template <class Work>
auto with_nifti(const fs::path& path, const ImportOptions& options, RunContext& context, Work&& work) {
  const fs::path header_path = unpacked_name(path).second == ".img" ? companion(path, ".hdr") : path;
  ByteSource first(header_path);
  const NiftiHeader header(first, header_path.string(), context);
  StoredSamples stored{
      .file = header_path.string(), .format = format_of(header, context), .offset = samples_offset(header)};
  const std::int64_t frames = read_dims(header, stored);
  // scl_slope and scl_inter: value = slope · stored + intercept.
  const double slope = header.number<float>(112);
  if (!std::isfinite(slope))
    context.note(joined(header.file(), " has a scl_slope that is not finite; its samples were not scaled"));
  if (std::isfinite(slope) && slope != 0.0) {  // 0: the samples are not scaled
    stored.slope = slope;
    stored.intercept = header.real(116, "scl_inter");
  }
  stored.to_world = transform_of(header, context);
  std::optional<ByteSource> second;
  if (!header.one_file()) {
    stored.file = companion(header_path, ".img").string();
    second.emplace(stored.file);
  }
  ByteSource& source = second ? *second : first;
  // First for one frame, then with the offset of the frame, which depends on its size.
  const std::uint64_t frame_bytes = check_stored(stored, source.at_most());
  choose_frame(header, frames, frame_bytes, options, stored, context);
  check_stored(stored, source.at_most());
  return work(source, stored);
}

/// Opens raw samples and returns work(source, stored).
template <class Work>
auto with_raw(const fs::path& path, const RawLayout& layout, RunContext& context, Work&& work) {
  ByteSource source(path);
  StoredSamples stored{
      .file = path.string(), .dims = layout.dims, .format = layout.format, .offset = layout.offset};
  for (int axis = 0; axis < 3; ++axis) {
    if (!(std::isfinite(layout.spacing[axis]) && layout.spacing[axis] > 0.0))
      throw Error("the spacing of samples must be three finite numbers above 0");
    stored.to_world(axis, axis) = layout.spacing[axis];
  }
  const std::uint64_t bytes = check_stored(stored, source.at_most());
  const auto too_long = [&] {
    return Error(joined(stored.file, " goes on behind ", layout.offset, " + ", bytes,
                        " bytes, where the last sample should end; check --dims, --type and --offset"));
  };
  // The length of gzip data is known only at their end.
  if (!source.gzipped() && source.at_most() != layout.offset + bytes) throw too_long();
  auto result = work(source, stored);
  if (!source.at_end(context)) throw too_long();
  return result;
}

}  // namespace

/// The grid behind ImportedLabels.
struct LabelGrid {
  openvdb::Int32Grid::ConstPtr grid;
};

namespace {

/// Reads the samples from the source, which is at or before the first, as labels.
ImportedLabels read_stored_labels(ByteSource& source, const StoredSamples& stored,
                                  const ImportOptions& options, RunContext& context) {
  const Stage stage(context, "read volume");
  initialize_openvdb();
  const std::vector<std::int32_t> values = read_labels(source, stored, options, context);
  ImportedLabels result{};
  std::int32_t last = 0;
  std::uint64_t* count = nullptr;
  for (const std::int32_t label : values) {
    if (label == 0) continue;
    if (!count || label != last) last = label, count = &result.samples[static_cast<std::uint32_t>(label)];
    ++*count;
  }
  if (result.samples.empty()) throw Error(joined(stored.file, " holds no label: all of its samples are 0"));
  const auto grid = make_grid<openvdb::Int32Grid>(
      stored, 0, context, [&](const openvdb::Coord& lower) { return make_leaf(values, stored.dims, lower); });
  describe(*grid, stored);
  grid->setName("labels");
  for (int axis = 0; axis < 3; ++axis) result.dims[axis] = static_cast<int>(stored.dims[axis]);
  result.voxel_size = std::cbrt(std::abs(stored.to_world.topLeftCorner<3, 3>().determinant()));
  result.grid = std::make_shared<const LabelGrid>(LabelGrid{grid});
  return result;
}

}  // namespace

bool is_nifti_path(const fs::path& path) {
  const std::string extension = unpacked_name(path).second;
  return extension == ".nii" || extension == ".hdr" || extension == ".img";
}

LevelSet import_nifti(const fs::path& path, const ImportOptions& options, RunContext& context) {
  return with_nifti(path, options, context, [&](ByteSource& source, const StoredSamples& stored) {
    return read_stored(source, stored, options, context);
  });
}

ImportedLabels import_nifti_labels(const fs::path& path, const ImportOptions& options, RunContext& context) {
  return with_nifti(path, options, context, [&](ByteSource& source, const StoredSamples& stored) {
    return read_stored_labels(source, stored, options, context);
  });
}

LevelSet import_raw(const fs::path& path, const RawLayout& layout, const ImportOptions& options,
                    RunContext& context) {
  return with_raw(path, layout, context, [&](ByteSource& source, const StoredSamples& stored) {
    return read_stored(source, stored, options, context);
  });
}

ImportedLabels import_raw_labels(const fs::path& path, const RawLayout& layout, const ImportOptions& options,
                                 RunContext& context) {
  return with_raw(path, layout, context, [&](ByteSource& source, const StoredSamples& stored) {
    return read_stored_labels(source, stored, options, context);
  });
}

void write_imported(const fs::path& path, const ImportedLabels& labels, RunContext& context) {
  const Stage stage(context, "write volume");
  write_grids(path, {labels.grid->grid});
}

void write_imported(const fs::path& path, const LevelSet& volume, RunContext& context) {
  const Stage stage(context, "write volume");
  write_grids(path, {volume.grid().grid});
}

std::string name_of(SampleFormat format) {
  const char* const suffix = size_of(format.type) == 1 ? "" : format.big_endian ? "be" : "le";
  return std::string(kTypeNames[static_cast<std::size_t>(format.type)]) + suffix;
}

SampleFormat parse_sample_format(const std::string& name) {
  std::string names;
  for (std::size_t i = 0; i < kTypeNames.size(); ++i) {
    const auto type = static_cast<NumberType>(i);
    for (const std::string suffix : {"", "le", "be"})
      if (name == kTypeNames[i] + suffix) return {type, suffix == "be" && size_of(type) > 1};
    names += std::string(i == 0 ? "" : ", ") + kTypeNames[i];
  }
  throw Error(joined("unknown type of samples '", shown(name), "'; choose one of ", names,
                     ", with suffix le or be for the byte order"));
}

}  // namespace hermesh
