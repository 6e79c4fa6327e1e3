// NIfTI-1; see import_volume.h. The format: Cox et al., "A (sort of) new image data format standard:
// NIfTI-1", 2004, and the comments of nifti1.h. Numbers below are offsets into its header.
#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstring>

#include "algorithms/io/import/stored_samples.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kHeaderBytes = 348;

/// The path without .gz, and its extension in lower case.
std::pair<fs::path, std::string> unpacked_name(const fs::path& path) {
  const auto lower_extension = [](const fs::path& of) {
    std::string extension = of.extension().string();
    std::ranges::transform(extension, extension.begin(),
                           [](unsigned char c) { return char(std::tolower(c)); });
    return extension;
  };
  const fs::path name = lower_extension(path) == ".gz" ? fs::path(path).replace_extension() : path;
  return {name, lower_extension(name)};
}

/// The header as it lies in the file; numbers are turned to the order of bytes of this machine when they are
/// asked for.
class Header {
 public:
  Header(ByteSource& source, std::string file, const RunContext& context) : file_(std::move(file)) {
    source.read(bytes_, context);
    // The first number is the length of the header, 348, or 540 in NIfTI-2: read in both orders of bytes, it
    // tells the file's.
    const auto own = number<std::int32_t>(0);
    swap_ = true;
    const auto swapped = number<std::int32_t>(0);
    if (own == 540 || swapped == 540) fail("is NIfTI-2; convert it to NIfTI-1");
    if (own != int(kHeaderBytes) && swapped != int(kHeaderBytes)) fail("is not a NIfTI-1 file");
    swap_ = own != int(kHeaderBytes);
    check_magic();
  }

  template <class T>
  T number(std::size_t at) const {
    std::array<unsigned char, sizeof(T)> own;
    std::memcpy(own.data(), bytes_.data() + at, sizeof(T));
    if (swap_) std::reverse(own.begin(), own.end());
    return std::bit_cast<T>(own);
  }
  /// The number at `at`, in single precision. @throws Error where it is not finite; `what` is its name.
  double real(std::size_t at, const char* what) const {
    const float value = number<float>(at);
    if (!std::isfinite(value)) fail(std::string("is damaged: its ") + what + " is not a finite number");
    return double(value);
  }
  bool one_file() const { return bytes_[345] == '+'; }
  bool big_endian() const { return swap_ != (std::endian::native == std::endian::big); }
  const std::string& file() const { return file_; }
  [[noreturn]] void fail(const std::string& what) const { throw Error(file_ + " " + what); }

 private:
  void check_magic() const {
    const std::string magic(reinterpret_cast<const char*>(bytes_.data() + 344), 4);
    if (magic != std::string("n+1\0", 4) && magic != std::string("ni1\0", 4))
      fail("is of the older format ANALYZE 7.5 or damaged, not NIfTI-1; convert it");
  }

  std::string file_;
  std::array<unsigned char, kHeaderBytes> bytes_{};
  bool swap_ = false;
};

SampleFormat format_of(const Header& header, RunContext& context) {
  const int code = header.number<std::int16_t>(70), bits = header.number<std::int16_t>(72);
  // Codes of nifti1.h.
  constexpr std::array<std::pair<int, SampleType>, 10> kCodes = {{{2, SampleType::uint8},
                                                                  {4, SampleType::int16},
                                                                  {8, SampleType::int32},
                                                                  {16, SampleType::float32},
                                                                  {64, SampleType::float64},
                                                                  {256, SampleType::int8},
                                                                  {512, SampleType::uint16},
                                                                  {768, SampleType::uint32},
                                                                  {1024, SampleType::int64},
                                                                  {1280, SampleType::uint64}}};
  const auto found = std::ranges::find(kCodes, code, &std::pair<int, SampleType>::first);
  if (found == kCodes.end())
    header.fail("holds samples of the NIfTI type " + std::to_string(code) +
                ", which is not one real number of up to 64 bits; convert it to a scalar type");
  // bitpix repeats what the datatype says, and programs that convert volumes forget to change it.
  const int own_bits = 8 * int(size_of(found->second));
  if (bits != own_bits)
    context.note(header.file() + " says that samples of the NIfTI type " + std::to_string(code) + " have " +
                 std::to_string(bits) + " bits; the type decides: " + std::to_string(own_bits));
  return {found->second, header.big_endian()};
}

/// Sets the box's dimensions; axes beyond the third are frames. @returns how many boxes there are.
std::int64_t read_dims(const Header& header, StoredSamples& stored) {
  const int axes = header.number<std::int16_t>(40);
  if (axes < 1 || axes > 7)
    header.fail("is damaged: it says that it has " + std::to_string(axes) + " dimensions");
  std::int64_t frames = 1;
  for (int axis = 0; axis < axes; ++axis) {
    const std::int64_t dim = header.number<std::int16_t>(42 + 2 * static_cast<std::size_t>(axis));
    if (dim < 1)
      header.fail("is damaged: its dimension " + std::to_string(axis + 1) + " is " + std::to_string(dim));
    if (axis < 3)
      stored.dims[axis] = dim;
    else
      frames *= dim;  // at most 2^60
  }
  for (int axis = axes; axis < 3; ++axis) stored.dims[axis] = 1;
  return frames;
}

/// Length of the file's unit in millimeters.
double unit_of(const Header& header) {
  switch (header.number<std::uint8_t>(123) & 7) {
    case 1:
      return 1000.0;
    case 3:
      return 0.001;
    default:
      return 1.0;  // millimetres, or not said
  }
}

std::array<double, 3> voxel_sizes(const Header& header, RunContext& context) {
  std::array<double, 3> sizes;
  bool missing = false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // pixdim has a sign in some files; directions are a matter of the transforms.
    sizes[axis] = std::fabs(header.real(80 + 4 * axis, "size of voxels"));
    if (sizes[axis] == 0.0) missing = true, sizes[axis] = 1.0;
  }
  if (missing) context.note(header.file() + " does not say how large its voxels are; 1 was taken");
  return sizes;
}

/// The qform: a rotation as the last three numbers of a unit quaternion, times the sizes of voxels (method 2
/// of nifti1.h).
Eigen::Matrix4d quaternion_form(const Header& header, const std::array<double, 3>& sizes) {
  const double b = header.real(256, "qform"), c = header.real(260, "qform"), d = header.real(264, "qform");
  // What single precision rounds beyond a length of 1 is forgiven.
  const double rest = 1.0 - (b * b + c * c + d * d);
  if (rest < -1e-5) header.fail("is damaged: the quaternion of its qform is longer than 1");
  const double a = std::sqrt(std::max(0.0, rest));
  Eigen::Matrix3d turn;
  turn << a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c),  //
      2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b),      //
      2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - b * b - c * c;
  // qfac: −1 mirrors the third axis, which a rotation alone cannot.
  const double hand = header.number<float>(76) < 0.0f ? -1.0 : 1.0;
  Eigen::Matrix4d form = Eigen::Matrix4d::Identity();
  form.topLeftCorner<3, 3>() = turn * Eigen::Vector3d(sizes[0], sizes[1], hand * sizes[2]).asDiagonal();
  for (std::size_t axis = 0; axis < 3; ++axis)
    form(Eigen::Index(axis), 3) = header.real(268 + 4 * axis, "qform");
  return form;
}

/// The sform of the header; nothing where it is not finite.
std::optional<Eigen::Matrix4d> affine_form(const Header& header) {
  Eigen::Matrix4d form = Eigen::Matrix4d::Identity();
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 4; ++column)
      form(Eigen::Index(row), Eigen::Index(column)) = header.number<float>(280 + 16 * row + 4 * column);
  return form.allFinite() ? std::optional(form) : std::nullopt;
}

bool is_singular(const Eigen::Matrix4d& form) {
  const Eigen::Matrix3d linear = form.topLeftCorner<3, 3>();
  // Relative to the lengths of its columns, so that the unit of length does not matter.
  const double scale = linear.colwise().norm().prod();
  return !(scale > 0.0) || !(std::fabs(linear.determinant()) > 1e-6 * scale);
}

/// Index coordinates to millimeters by the sform, else the qform, else the sizes of voxels alone. Programs
/// write an sform of zeros, or one that is not finite, with a code that says that it counts; then the next
/// one does.
Eigen::Matrix4d transform_of(const Header& header, RunContext& context) {
  const bool has_qform = header.number<std::int16_t>(252) > 0;
  Eigen::Matrix4d form = Eigen::Matrix4d::Identity();
  bool found = false;
  if (header.number<std::int16_t>(254) > 0) {
    const std::optional<Eigen::Matrix4d> affine = affine_form(header);
    const bool empty = !affine || affine->topLeftCorner<3, 3>().isZero(0.0);
    if (affine) form = *affine;
    found = affine && !is_singular(form);
    if (!found && !empty && !has_qform) found = true;  // it is the complaint below
    if (!found)
      context.note(header.file() + " has an sform that is " + (empty ? "empty" : "singular") + "; its " +
                   (has_qform ? "qform was" : "sizes of voxels were") + " taken");
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

/// Moves the box on to the frame that is asked for. @throws Error where there is none.
void choose_frame(const Header& header, std::int64_t frames, std::uint64_t frame_bytes,
                  const ImportOptions& options, StoredSamples& stored, RunContext& context) {
  const std::int64_t frame = options.frame.value_or(0);
  if (frame < 0 || frame >= frames)
    header.fail("has no frame " + std::to_string(frame) + "; it has " + std::to_string(frames) +
                ", numbered from 0");
  // In double precision, since the product of a number of the user and a size may overflow 64 bits.
  if (double(frame) * double(frame_bytes) > 0x1p62) header.fail("is truncated: that frame cannot be in it");
  if (frames > 1 && !options.frame)
    context.note(header.file() + " holds " + std::to_string(frames) +
                 " frames; the first was taken (--frame N takes another)");
  stored.offset += static_cast<std::uint64_t>(frame) * frame_bytes;
}

/// The file of the same name with another extension, also gzipped.
fs::path companion(const fs::path& path, const char* extension) {
  // Where neither is there, the name without .gz is what the complaint names.
  fs::path beside = unpacked_name(path).first;
  beside.replace_extension(extension);
  std::error_code ignored;
  if (!fs::exists(beside, ignored) && fs::exists(beside.string() + ".gz", ignored))
    return beside.string() + ".gz";
  return beside;
}

std::uint64_t samples_offset(const Header& header) {
  const double offset = header.real(108, "offset of the samples");
  // In a file of its own the samples may begin at once; behind a header they cannot lie within it.
  const double least = header.one_file() ? double(kHeaderBytes) : 0.0;
  if (offset < least || offset > 0x1p40 || offset != std::floor(offset))
    header.fail("is damaged: its samples cannot start at byte " + std::to_string(offset));
  return static_cast<std::uint64_t>(offset);
}

}  // namespace

bool is_nifti_path(const fs::path& path) {
  const std::string extension = unpacked_name(path).second;
  return extension == ".nii" || extension == ".hdr" || extension == ".img";
}

LevelSet import_nifti(const fs::path& path, const ImportOptions& options, RunContext& context) {
  const fs::path header_path = unpacked_name(path).second == ".img" ? companion(path, ".hdr") : path;
  ByteSource first(header_path);
  const Header header(first, header_path.string(), context);
  StoredSamples stored{
      .file = header_path.string(), .format = format_of(header, context), .offset = samples_offset(header)};
  const std::int64_t frames = read_dims(header, stored);
  // scl_slope and scl_inter: value = slope · stored + intercept.
  const double slope = header.number<float>(112);
  if (!std::isfinite(slope))
    context.note(header.file() + " has a scl_slope that is not finite; its samples were not scaled");
  if (std::isfinite(slope) && slope != 0.0) {  // 0: the samples are not scaled
    stored.slope = slope;
    stored.intercept = header.real(116, "scl_inter");
  }
  stored.to_world = transform_of(header, context);
  // Of two files the header names neither: the samples lie in the one of the same name.
  std::optional<ByteSource> second;
  if (!header.one_file()) {
    stored.file = companion(header_path, ".img").string();
    second.emplace(stored.file);
  }
  ByteSource& source = second ? *second : first;
  // Twice: the first time for one frame, whose size the offset of the frame needs, the second time with that
  // offset.
  const std::uint64_t frame_bytes = check_stored(stored, source.at_most());
  choose_frame(header, frames, frame_bytes, options, stored, context);
  check_stored(stored, source.at_most());
  return read_stored(source, stored, options, context);
}

}  // namespace hermesh
