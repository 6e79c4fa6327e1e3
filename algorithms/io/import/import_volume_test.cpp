#include "algorithms/io/import/import_volume.h"

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <numeric>

#include "algorithms/core/level_set.h"
#include "algorithms/core/level_set_grid.h"
#include "algorithms/io/import/files_for_tests.h"
#include "algorithms/io/test_mesh_files.h"
#include "algorithms/io/vdb_file.h"

namespace hermesh {
namespace import_volume_test {

namespace fs = std::filesystem;

class Import : public MeshFileTest {
 protected:
  LevelSet nifti(const std::string& bytes, const ImportOptions& options = {}) {
    write_bytes(folder / "a.nii", bytes);
    return import_nifti(folder / "a.nii", options, context);
  }
  /// Returns the error of importing the file, which must name it.
  std::string error_of(const std::string& bytes, const ImportOptions& options = {}) {
    const std::string error = error_in([&] { nifti(bytes, options); });
    EXPECT_TRUE(error.empty() || error.find("a.nii") != std::string::npos) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
    return error;
  }
  std::string raw_error(const RawLayout& layout) {
    return error_in([&] { import_raw(folder / "a.raw", layout, {}, context); });
  }
  static float at(const LevelSet& volume, int x, int y, int z) {
    return volume.grid().grid->tree().getValue(openvdb::Coord(x, y, z));
  }
  /// Returns the world position of sample (1, 2, 3).
  Eigen::Vector3d world(const NiftiBytes& file) {
    const openvdb::Vec3d p = nifti(file.bytes()).grid().grid->indexToWorld(openvdb::Vec3d(1, 2, 3));
    return {p.x(), p.y(), p.z()};
  }
  /// Imports the numbers 1 to 60 of a NIfTI type in both byte orders.
  template <class T>
  void expect_type(std::int16_t code) {
    std::vector<T> values(60);
    std::iota(values.begin(), values.end(), T(1));
    for (const bool big_endian : {false, true}) {
      SCOPED_TRACE(code);
      const LevelSet volume =
          nifti(NiftiBytes(big_endian).dims({3, 4, 5}).type(code, 8 * sizeof(T)).samples(values).bytes());
      ASSERT_EQ(volume.dimensions(), (std::array<int, 3>{3, 4, 5}));
      EXPECT_EQ(volume.active_voxels(), 60u);
      for (int i = 0; i < 60; ++i)
        ASSERT_EQ(at(volume, i % 3, i / 3 % 4, i / 12), float(i + 1)) << big_endian;
    }
  }
};

template <class T>
std::vector<T> counting(std::size_t count) {
  std::vector<T> values(count);
  std::iota(values.begin(), values.end(), T(1));
  return values;
}

NiftiBytes small(bool big_endian = false) {
  return NiftiBytes(big_endian).dims({3, 4, 5}).type(4, 16).samples(counting<std::int16_t>(60));
}

TEST_F(Import, EveryTypeInBothByteOrders) {
  expect_type<std::uint8_t>(2);
  expect_type<std::int16_t>(4);
  expect_type<std::int32_t>(8);
  expect_type<float>(16);
  expect_type<double>(64);
  expect_type<std::int8_t>(256);
  expect_type<std::uint16_t>(512);
  expect_type<std::uint32_t>(768);
  expect_type<std::int64_t>(1024);
  expect_type<std::uint64_t>(1280);
}

TEST_F(Import, NegativeAndScaledSamples) {
  const NiftiBytes file = NiftiBytes(true).dims({2, 1, 1}).type(4, 16).samples<std::int16_t>({-1000, 3000});
  const LevelSet plain = nifti(file.bytes());
  EXPECT_EQ(at(plain, 0, 0, 0), -1000.0f);
  const LevelSet scaled = nifti(NiftiBytes(file).put<float>(112, 0.5f).put<float>(116, 10.0f).bytes());
  EXPECT_EQ(at(scaled, 0, 0, 0), -490.0f);
  EXPECT_EQ(at(scaled, 1, 0, 0), 1510.0f);
  EXPECT_EQ(value_range(scaled), std::pair(-490.0f, 1510.0f));
  EXPECT_EQ(scaled.background(), double(std::nextafter(-490.0f, -1000.0f)));
}

TEST_F(Import, GzippedIsTheSame) {
  write_gzipped(folder / "a.nii.gz", small().bytes());
  const LevelSet volume = import_nifti(folder / "a.nii.gz", {}, context);
  EXPECT_EQ(at(volume, 2, 3, 4), 60.0f);
  EXPECT_EQ(volume.active_voxels(), 60u);
}

TEST_F(Import, HeaderAndSamplesInTwoFiles) {
  std::string header = small().put<float>(108, 0.0f).bytes();
  std::memcpy(header.data() + 344, "ni1", 4);
  write_bytes(folder / "b.hdr", header.substr(0, 348));
  write_gzipped(folder / "b.img.gz", header.substr(352));
  for (const char* name : {"b.hdr", "b.img.gz"})
    EXPECT_EQ(at(import_nifti(folder / name, {}, context), 2, 3, 4), 60.0f);
  fs::remove(folder / "b.img.gz");
  EXPECT_THROW(import_nifti(folder / "b.hdr", {}, context), Error);
}

TEST_F(Import, TransformIsSformThenQformThenSizes) {
  NiftiBytes file = small().put<float>(80, 2.0f).put<float>(84, 3.0f).put<float>(88, 4.0f);
  EXPECT_LT((world(file) - Eigen::Vector3d(2, 6, 12)).norm(), 1e-9);
  // A quarter turn about z, mirrored in z.
  const float half = std::sqrt(0.5f);
  file.put<std::int16_t>(252, 1).put<float>(264, half).put<float>(76, -1.0f).put<float>(268, 10.0f);
  EXPECT_LT((world(file) - Eigen::Vector3d(10 - 6, 2, -12)).norm(), 1e-5);
  file.put<std::int16_t>(254, 2);
  const float rows[12] = {0, 0, 5, 1, 1, 0, 0, 2, 0, -1, 0, 3};
  for (std::size_t i = 0; i < 12; ++i) file.put<float>(280 + 4 * i, rows[i]);
  EXPECT_LT((world(file) - Eigen::Vector3d(16, 3, 1)).norm(), 1e-9);
  file.put<std::uint8_t>(123, 1);  // metres
  EXPECT_LT((world(file) - Eigen::Vector3d(16, 3, 1) * 1000).norm(), 1e-6);
}

TEST_F(Import, TakesOneFrameOfSeveral) {
  NiftiBytes file = NiftiBytes().dims({3, 4, 5, 2}).type(2, 8).samples(counting<std::uint8_t>(120));
  EXPECT_EQ(at(nifti(file.bytes()), 0, 0, 0), 1.0f);
  ASSERT_EQ(context.notes.size(), 1u);
  expect_words(context.notes[0], "2 frames");
  EXPECT_EQ(at(nifti(file.bytes(), {.replacement = {}, .frame = 1}), 0, 0, 0), 61.0f);
  expect_words(error_of(file.bytes(), {.replacement = {}, .frame = 2}), "no frame 2; it has 2");
}

TEST_F(Import, EveryTruncationIsRefused) {
  const std::string whole = small().bytes();
  for (std::size_t size = 0; size < whole.size(); size += size < 360 ? 1 : 7)
    EXPECT_NE(error_of(whole.substr(0, size)), "") << size;
  write_gzipped(folder / "whole.gz", whole);
  std::ifstream in(folder / "whole.gz", std::ios::binary);
  const std::string packed((std::istreambuf_iterator<char>(in)), {});
  for (std::size_t size = 0; size < packed.size(); ++size)
    EXPECT_NE(error_of(packed.substr(0, size)), "") << size << " of " << packed.size();
}

TEST_F(Import, LyingDimensionsAreRefusedBeforeAnythingIsAllocated) {
  for (const std::vector<std::int16_t>& dims : {std::vector<std::int16_t>{32767, 32767, 32767},
                                                {3, 4, 6},
                                                {32767, 32767, 32767, 32767, 32767, 32767, 32767}})
    expect_words(error_of(small().dims(dims).bytes()), "too short for");
  expect_words(error_of(small().dims({3, -4, 5}).bytes()), "dimension 2 is -4");
  expect_words(error_of(small().dims({3, 0, 5}).bytes()), "dimension 2 is 0");
  expect_words(error_of(small().put<std::int16_t>(40, 8).bytes()), "8 dimensions");
  expect_words(error_of(small().put<std::int16_t>(40, 0).bytes()), "0 dimensions");
  write_gzipped(folder / "a.nii.gz", small().dims({32767, 32767, 32767}).bytes());
  EXPECT_THROW(import_nifti(folder / "a.nii.gz", {}, context), Error);
}

TEST_F(Import, DamagedHeadersAreNamed) {
  const float nan = std::nanf("");
  expect_words(error_of(small().type(128, 24).bytes()), "NIfTI type 128");
  expect_words(error_of(small().put<std::int32_t>(0, 540).bytes()), "NIfTI-2");
  expect_words(error_of(small().put<std::int32_t>(0, 347).bytes()), "not a NIfTI-1");
  expect_words(error_of(small().put<std::int32_t>(344, 0).bytes()), "ANALYZE");
  expect_words(error_of(small().put<float>(108, nan).bytes()), "offset of the samples");
  expect_words(error_of(small().put<float>(108, -352.0f).bytes()), "cannot start at");
  expect_words(error_of(small().put<float>(108, 1e12f).bytes()), "too short");
  expect_words(error_of(small().put<float>(112, 2.0f).put<float>(116, nan).bytes()), "scl_inter");
  expect_words(error_of(small().put<float>(80, nan).bytes()), "size of voxels");
  const NiftiBytes flat = small().put<std::int16_t>(254, 1).put<float>(280, 1.0f).put<float>(300, 1.0f);
  expect_words(error_of(flat.bytes()), "singular");
  expect_words(error_of(small().put<std::int16_t>(252, 1).put<float>(256, 2.0f).bytes()), "quaternion");
}

TEST_F(Import, TheTypeDecidesHowManyBitsASampleHas) {
  const LevelSet volume = nifti(small().type(4, 8).bytes());
  EXPECT_EQ(at(volume, 2, 3, 4), 60.0f);
  ASSERT_EQ(context.notes.size(), 1u);
  expect_words(context.notes[0], "have 8 bits; the type decides: 16");
}

TEST_F(Import, ASlopeThatIsNotFiniteScalesNothing) {
  for (const float slope : {std::nanf(""), std::numeric_limits<float>::infinity()}) {
    context.notes.clear();
    const LevelSet volume = nifti(small().put<float>(112, slope).put<float>(116, std::nanf("")).bytes());
    EXPECT_EQ(value_range(volume), std::pair(1.0f, 60.0f));
    EXPECT_EQ(context.notes.size(), 1u);
  }
}

TEST_F(Import, AnEmptySformGivesWayToTheNextTransform) {
  NiftiBytes file =
      small().put<float>(80, 2.0f).put<float>(84, 3.0f).put<float>(88, 4.0f).put<std::int16_t>(254, 1);
  EXPECT_LT((world(file) - Eigen::Vector3d(2, 6, 12)).norm(), 1e-9);  // the sizes of voxels
  EXPECT_EQ(context.notes.size(), 1u);
  // A half turn about z: (x, y) to (−x, −y), then a shift.
  file.put<std::int16_t>(252, 1).put<float>(264, 1.0f).put<float>(268, 10.0f);
  EXPECT_LT((world(file) - Eigen::Vector3d(10 - 2, -6, 12)).norm(), 1e-5);
  file.put<float>(280, std::nanf(""));  // not finite
  EXPECT_LT((world(file) - Eigen::Vector3d(10 - 2, -6, 12)).norm(), 1e-5);
  file.put<float>(280, 1.0f);  // singular
  EXPECT_LT((world(file) - Eigen::Vector3d(10 - 2, -6, 12)).norm(), 1e-5);
}

TEST_F(Import, NoByteOfTheHeaderDoesHarm) {
  const std::string whole = small().bytes();
  for (std::size_t at = 0; at < 352; ++at)
    for (const char value : {'\0', '\x7f', '\xff'}) {
      std::string changed = whole;
      changed[at] = value;
      error_of(changed);  // it is read or refused
    }
}

TEST_F(Import, SamplesThatAreNotFiniteAreRefusedOrReplaced) {
  const std::string bytes =
      NiftiBytes().dims({3, 1, 1}).type(64, 64).samples<double>({1.0, std::nan(""), 1e300}).bytes();
  expect_words(error_of(bytes), "2 samples that are NaN");
  const LevelSet volume = nifti(bytes, {.replacement = -7.0f, .frame = {}});
  EXPECT_EQ(at(volume, 0, 0, 0), 1.0f);
  EXPECT_EQ(at(volume, 1, 0, 0), -7.0f);
  EXPECT_EQ(at(volume, 2, 0, 0), -7.0f);
  EXPECT_FALSE(context.notes.empty());
}

TEST_F(Import, RawSamples) {
  std::string bytes = "head";
  for (int i = 0; i < 60; ++i) append_number(bytes, static_cast<std::int16_t>(i - 30), true);
  write_bytes(folder / "a.raw", bytes);
  write_gzipped(folder / "a.raw.gz", bytes);
  RawLayout layout{.dims = {3, 4, 5}, .format = {NumberType::int16, true}, .spacing = {1, 2, 3}, .offset = 4};
  for (const char* name : {"a.raw", "a.raw.gz"}) {
    const LevelSet volume = import_raw(folder / name, layout, {}, context);
    EXPECT_EQ(at(volume, 0, 0, 0), -30.0f);
    EXPECT_EQ(at(volume, 2, 3, 4), 29.0f);
    EXPECT_EQ(volume.grid().grid->indexToWorld(openvdb::Vec3d(1, 1, 1)), openvdb::Vec3d(1, 2, 3));
  }
  layout.offset = 0;
  expect_words(raw_error(layout), "goes on behind");
  layout.offset = 6;
  expect_words(raw_error(layout), "too short");
  layout.dims = {std::int64_t{1} << 30, std::int64_t{1} << 30, std::int64_t{1} << 30};
  expect_words(raw_error(layout), "too short");
  layout.dims = {0, 4, 5};
  expect_words(raw_error(layout), "each dimension");
  layout.spacing = {1, 0, 1};
  expect_words(raw_error(layout), "spacing");
  layout = {.dims = {3, 4, 4}, .format = {NumberType::int16, true}, .spacing = {1, 1, 1}, .offset = 4};
  EXPECT_THROW(import_raw(folder / "a.raw.gz", layout, {}, context), Error);
}

TEST_F(Import, RoundTripThroughVdbKeepsAllOfIt) {
  std::vector<std::uint8_t> values(20 * 9 * 17);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = i % 20 < 16 ? 7 : static_cast<std::uint8_t>(i % 251);
  const LevelSet made = nifti(NiftiBytes().dims({20, 9, 17}).type(2, 8).samples(values).bytes());
  write_imported(folder / "a.vdb", made, context);
  const LevelSet back = read_level_set(folder / "a.vdb", "", context);
  EXPECT_EQ(back.dimensions(), (std::array<int, 3>{20, 9, 17}));
  EXPECT_EQ(back.active_voxels(), values.size());
  for (int z = 0; z < 17; ++z)
    for (int y = 0; y < 9; ++y)
      for (int x = 0; x < 20; ++x)
        ASSERT_EQ(at(back, x, y, z), float(values[static_cast<std::size_t>(x + 20 * (y + 9 * z))]));
  EXPECT_EQ(back.background(), made.background());
  EXPECT_EQ(back.grid().grid->getName(), "volume");
  EXPECT_EQ(back.grid().grid->getMetadata<openvdb::StringMetadata>("hermesh_sample_type")->value(), "uint8");
  EXPECT_EQ(back.grid().grid->getMetadata<openvdb::FloatMetadata>("hermesh_maximum")->value(), 250.0f);
}

TEST(SampleFormat, NamesAreReadBack) {
  for (const char* name : {"uint8", "int8", "uint16le", "int16be", "uint32le", "int32be", "uint64le",
                           "int64be", "float32le", "float64be"})
    EXPECT_EQ(name_of(parse_sample_format(name)), name);
  EXPECT_EQ(parse_sample_format("float32"), (hermesh::SampleFormat{NumberType::float32, false}));
  for (const char* name : {"uint8le", "uint8be"}) EXPECT_EQ(name_of(parse_sample_format(name)), "uint8");
  for (const char* name : {"", "int", "int16xe", "float16"})
    EXPECT_THROW(parse_sample_format(name), Error) << name;
}

}  // namespace import_volume_test
}  // namespace hermesh
