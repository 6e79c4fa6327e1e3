#include "algorithms/io/vdb_file.h"

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

#include <cstring>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/io/test_mesh_files.h"

namespace hermesh {
namespace vdb_file_test {

namespace fs = std::filesystem;

class VdbFile : public MeshFileTest {
 protected:
  LevelSet read(const char* name, const std::string& grid = "") {
    return read_level_set(folder / name, grid, context);
  }
  std::string error_of(const fs::path& path, const std::string& grid = "") {
    return error_in([&] { read_level_set(path, grid, context); });
  }
  void write_plain(const char* name, const openvdb::GridCPtrVec& grids) const {
    openvdb::io::File((folder / name).string()).write(grids);
  }

  static LevelSet ramp() {
    initialize_openvdb();
    auto grid = openvdb::FloatGrid::create(3.0f);
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(0.25));
    for (int x = -3; x <= 3; ++x)
      grid->tree().setValue(openvdb::Coord(x, 0, 0), 0.25f * static_cast<float>(x));
    return make_level_set(grid);
  }
};

TEST_F(VdbFile, RoundTripKeepsValuesAndPlacement) {
  write_level_set(folder / "a.vdb", ramp(), context);
  const LevelSet back = read("a.vdb");
  EXPECT_EQ(back.active_voxels(), 7u);
  EXPECT_DOUBLE_EQ(back.voxel_size(), 0.25);
  EXPECT_EQ(back.background(), 3.0);
  EXPECT_EQ(back.grid().grid->tree().getValue(openvdb::Coord(-2, 0, 0)), -0.5f);
  EXPECT_EQ(back.grid().grid->getName(), "sdf");
}

TEST_F(VdbFile, DoubleGridsBecomeFloat) {
  initialize_openvdb();
  auto grid = openvdb::DoubleGrid::create(2.0);
  grid->setName("density");
  grid->tree().setValue(openvdb::Coord(1, 2, 3), -0.125);
  write_plain("d.vdb", {grid});
  EXPECT_EQ(read("d.vdb").grid().grid->tree().getValue(openvdb::Coord(1, 2, 3)), -0.125f);
}

TEST_F(VdbFile, HalfWholeNumbersAndTruthsBecomeFloat) {
  initialize_openvdb();
  const openvdb::Coord at(1, 2, 3);
  const auto value_of = [&](const openvdb::GridBase::Ptr& grid) {
    write_plain("g.vdb", {grid});
    return read("g.vdb").grid().grid->tree().getValue(at);
  };
  auto half = openvdb::FloatGrid::create(2.0f);
  half->tree().setValue(at, -0.125f);
  half->setSaveFloatAsHalf(true);
  EXPECT_EQ(value_of(half), -0.125f);
  auto whole = openvdb::Int32Grid::create(0);
  whole->tree().setValue(at, -7);
  EXPECT_EQ(value_of(whole), -7.0f);
  auto wide = openvdb::Int64Grid::create(0);
  wide->tree().setValue(at, 1000000);
  EXPECT_EQ(value_of(wide), 1e6f);
  auto truth = openvdb::BoolGrid::create(false);
  truth->tree().setValue(at, true);
  EXPECT_EQ(value_of(truth), 1.0f);
  auto mask = openvdb::MaskGrid::create(false);
  mask->tree().setValueOn(at);
  mask->tree().addTile(2, openvdb::Coord(128, 0, 0), true, true);
  EXPECT_EQ(value_of(mask), 1.0f);
  const LevelSet from_mask = read("g.vdb");
  EXPECT_EQ(from_mask.active_voxels(), 1u + 128 * 128 * 128);
  EXPECT_EQ(from_mask.grid().grid->tree().getValue(openvdb::Coord(200, 5, 6)), 1.0f);
  EXPECT_EQ(from_mask.grid().grid->tree().getValue(openvdb::Coord(2, 2, 3)), 0.0f);
  EXPECT_EQ(from_mask.background(), 0.0);
  auto vectors = openvdb::Vec3SGrid::create();
  vectors->tree().setValue(at, openvdb::Vec3s(1));
  EXPECT_THROW(value_of(vectors), Error);
  auto huge = openvdb::DoubleGrid::create(0.0);
  huge->tree().setValue(at, 1e300);
  EXPECT_THROW(value_of(huge), Error);
}

TEST_F(VdbFile, TheOnlyScalarGridNeedsNoName) {
  initialize_openvdb();
  auto density = openvdb::FloatGrid::create(0.0f);
  density->tree().setValue(openvdb::Coord(0), 0.5f);
  density->setName("density");
  auto velocity = openvdb::Vec3SGrid::create();
  velocity->setName("velocity");
  write_plain("s.vdb", {density, velocity});
  EXPECT_EQ(read("s.vdb").grid().grid->getName(), "density");
  auto heat = density->deepCopy();
  heat->setName("heat");
  write_plain("t.vdb", {density, velocity, heat});
  expect_words(error_of(folder / "t.vdb"), "choose one with --grid");
}

TEST_F(VdbFile, ErrorsAreOneSentenceAboutTheFile) {
  expect_words(error_of(folder / "none.vdb"), "does not exist");
  expect_words(error_of(folder), "is a folder");
  std::ofstream(folder / "empty.vdb");
  expect_words(error_of(folder / "empty.vdb"), "is empty");
  std::ofstream(folder / "text.vdb") << "these are words and no volume";
  expect_words(error_of(folder / "text.vdb"), "is not a .vdb file");
  write_level_set(folder / "a.vdb", ramp(), context);
  expect_words(error_of(folder / "a.vdb", "fog"), "no grid named 'fog'; it has sdf");
}

TEST_F(VdbFile, EveryTruncationIsRefused) {
  write_level_set(folder / "a.vdb", ramp(), context);
  const auto size = fs::file_size(folder / "a.vdb");
  std::vector<std::uintmax_t> lengths{size - 1, size - 7, size - 20, size - 200};
  for (std::uintmax_t keep = 1; keep < size; keep += size / 40) lengths.push_back(keep);
  for (const std::uintmax_t keep : lengths) {
    fs::copy_file(folder / "a.vdb", folder / "cut.vdb", fs::copy_options::overwrite_existing);
    fs::resize_file(folder / "cut.vdb", keep);
    EXPECT_NE(error_of(folder / "cut.vdb"), "") << keep << " of " << size;
  }
}

// A flipped byte may be a size, and AddressSanitizer's operator new ends the process where the real one
// throws.
#ifndef __SANITIZE_ADDRESS__
TEST_F(VdbFile, EveryFlippedByteIsRefusedOrHarmless) {
  write_level_set(folder / "a.vdb", ramp(), context);
  const std::string good = bytes_of(folder / "a.vdb");
  for (std::size_t at = 0; at < good.size(); at += 1 + good.size() / 300) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 0xff);
    write("bad.vdb", bad);
    error_of(folder / "bad.vdb");  // must not crash, hang or throw anything else
  }
}
#endif

// Files of other programs have no checksum, and OpenVDB trusts every length in them.
TEST_F(VdbFile, LengthsThatDoNotFitAreRefused) {
  initialize_openvdb();
  for (const std::uint32_t compression :
       {std::uint32_t(openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK),
        std::uint32_t(openvdb::io::COMPRESS_ZIP)}) {
    auto grid = openvdb::FloatGrid::create(1.0f);
    grid->setName("sdf");
    for (int i = 0; i < 300; ++i)
      grid->tree().setValue(openvdb::Coord(i % 8, i / 8 % 8, i / 64), 0.01f * float(i));
    openvdb::io::File file((folder / "long.vdb").string());
    file.setCompression(compression);
    file.write({grid});
    file.close();
    const std::string good = bytes_of(folder / "long.vdb");
    // The last block of values is preceded by its length in 64 bits, several times the largest value of a
    // byte.
    int refused = 0;
    for (std::size_t at = good.size() - 2100; at + 8 < good.size(); ++at) {
      std::int64_t length = 0;
      std::memcpy(&length, good.data() + at, sizeof length);
      if (length != std::int64_t(good.size() - at - 8)) continue;
      for (const std::int64_t claimed :
           {-length, std::int64_t{-4096}, length + 1, std::int64_t{1} << 40, std::int64_t{0}}) {
        std::string bad = good;
        std::memcpy(bad.data() + at, &claimed, sizeof claimed);
        write("bad.vdb", bad);
        expect_words(error_of(folder / "bad.vdb"), "is damaged or truncated");
        ++refused;
      }
    }
    EXPECT_EQ(refused, 5) << compression;
  }
}

TEST_F(VdbFile, GridsThatShareATreeAndStreamsAreRead) {
  initialize_openvdb();
  const openvdb::FloatGrid::Ptr first =
      openvdb::ConstPtrCast<openvdb::FloatGrid>(ramp().grid().grid)->deepCopy();
  const auto second = openvdb::FloatGrid::create(first->treePtr());
  first->setName("a"), second->setName("b");
  second->setTransform(openvdb::math::Transform::createLinearTransform(2.0));
  write_plain("shared.vdb", {first, second});
  EXPECT_EQ(read("shared.vdb", "b").active_voxels(), 7u);
  EXPECT_DOUBLE_EQ(read("shared.vdb", "b").voxel_size(), 2.0);
  {
    std::ofstream out(folder / "stream.vdb", std::ios::binary);
    openvdb::io::Stream(out).write({first});
  }
  EXPECT_EQ(read("stream.vdb").active_voxels(), 7u);
}

/// Grids of points have leaves of another structure; OpenVDB knows the type, so they can be stepped over.
TEST_F(VdbFile, GridsOfOtherTypesAreDescribedAndNotRead) {
  const std::string type = "Tree_float_5_4_3", other = "Tree_ptidx32_5_4_3";
  write_plain("p.vdb", {ramp().grid().grid});
  std::string bytes = bytes_of(folder / "p.vdb");
  const std::size_t at = bytes.find(type);
  ASSERT_NE(at, std::string::npos);
  bytes[at - 4] = static_cast<char>(other.size());
  bytes.replace(at, type.size(), other);
  for (std::size_t i = 0; i < 3; ++i) {  // where the grid, its values and its end are, behind an empty name
    std::int64_t place = 0;
    char* const stored = bytes.data() + at + other.size() + 4 + 8 * i;
    std::memcpy(&place, stored, sizeof place);
    place += std::int64_t(other.size() - type.size());
    std::memcpy(stored, &place, sizeof place);
  }
  write("p.vdb", bytes);
  const auto grids = describe_vdb(folder / "p.vdb");
  ASSERT_EQ(grids.size(), 1u);
  EXPECT_FALSE(grids[0].is_read);
  EXPECT_EQ(grids[0].value_type, other);
  expect_words(error_of(folder / "p.vdb"), "a scalar grid is needed");
}

TEST_F(VdbFile, ATransformThatCannotBeInvertedIsRefused) {
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(1.0f);
  grid->setName("sdf");
  grid->tree().setValue(openvdb::Coord(0), 0.5f);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.3));
  write_plain("t.vdb", {grid});
  std::string bytes = bytes_of(folder / "t.vdb");
  const double scale = 0.3, wrong = std::nan("");
  const std::size_t at = bytes.find(std::string(reinterpret_cast<const char*>(&scale), sizeof scale));
  ASSERT_NE(at, std::string::npos);
  std::memcpy(bytes.data() + at, &wrong, sizeof wrong);
  write("t.vdb", bytes);
  expect_words(error_of(folder / "t.vdb"), "transform");
}

TEST_F(VdbFile, ValuesThatAreNotFiniteAreNamed) {
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(1.0f);
  grid->setName("sdf");
  grid->tree().setValue(openvdb::Coord(4, 5, 6), std::nanf(""));
  write_plain("nan.vdb", {grid});
  expect_words(error_of(folder / "nan.vdb"), "not finite at index [4, 5, 6]");
}

}  // namespace vdb_file_test
}  // namespace hermesh
