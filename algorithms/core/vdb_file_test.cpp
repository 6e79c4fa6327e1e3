#include "algorithms/core/vdb_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/hermite/samplers.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;

class VdbFile : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("hermesh-vdb-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string error_of(const fs::path& path, const std::string& grid = "") {
    try {
      read_level_set(path, grid, context_);
    } catch (const Error& e) {
      return e.what();
    }
    return "no error";
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

  fs::path folder_;
  RunContext context_;
};

TEST_F(VdbFile, RoundTripKeepsValuesAndPlacement) {
  write_level_set(folder_ / "a.vdb", ramp(), context_);
  const LevelSet back = read_level_set(folder_ / "a.vdb", "", context_);
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
  openvdb::io::File((folder_ / "d.vdb").string()).write({grid});
  EXPECT_EQ(
      read_level_set(folder_ / "d.vdb", "", context_).grid().grid->tree().getValue(openvdb::Coord(1, 2, 3)),
      -0.125f);
}

TEST_F(VdbFile, HalfWholeNumbersAndTruthsBecomeFloat) {
  initialize_openvdb();
  const openvdb::Coord at(1, 2, 3);
  const auto value_of = [&](const openvdb::GridBase::Ptr& grid) {
    openvdb::io::File((folder_ / "g.vdb").string()).write({grid});
    return read_level_set(folder_ / "g.vdb", "", context_).grid().grid->tree().getValue(at);
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
  openvdb::io::File((folder_ / "s.vdb").string()).write({density, velocity});
  EXPECT_EQ(read_level_set(folder_ / "s.vdb", "", context_).grid().grid->getName(), "density");
  auto heat = density->deepCopy();
  heat->setName("heat");
  openvdb::io::File((folder_ / "t.vdb").string()).write({density, velocity, heat});
  EXPECT_NE(error_of(folder_ / "t.vdb").find("choose one with --grid"), std::string::npos);
}

TEST_F(VdbFile, ErrorsAreOneSentenceAboutTheFile) {
  EXPECT_NE(error_of(folder_ / "none.vdb").find("does not exist"), std::string::npos);
  EXPECT_NE(error_of(folder_).find("is a folder"), std::string::npos);
  std::ofstream(folder_ / "empty.vdb");
  EXPECT_NE(error_of(folder_ / "empty.vdb").find("is empty"), std::string::npos);
  std::ofstream(folder_ / "text.vdb") << "these are words and no volume";
  EXPECT_NE(error_of(folder_ / "text.vdb").find("is not a .vdb file"), std::string::npos);
  write_level_set(folder_ / "a.vdb", ramp(), context_);
  EXPECT_NE(error_of(folder_ / "a.vdb", "fog").find("no grid named 'fog'; it has sdf"), std::string::npos);
}

TEST_F(VdbFile, EveryTruncationIsRefused) {
  write_level_set(folder_ / "a.vdb", ramp(), context_);
  const auto size = fs::file_size(folder_ / "a.vdb");
  std::vector<std::uintmax_t> lengths{size - 1, size - 7, size - 20, size - 200};
  for (std::uintmax_t keep = 1; keep < size; keep += size / 40) lengths.push_back(keep);
  for (const std::uintmax_t keep : lengths) {
    fs::copy_file(folder_ / "a.vdb", folder_ / "cut.vdb", fs::copy_options::overwrite_existing);
    fs::resize_file(folder_ / "cut.vdb", keep);
    EXPECT_NE(error_of(folder_ / "cut.vdb"), "no error") << keep << " of " << size;
  }
}

// A flipped byte may be a size, and AddressSanitizer's operator new ends the process where the real one throws.
#ifndef __SANITIZE_ADDRESS__
TEST_F(VdbFile, EveryFlippedByteIsRefusedOrHarmless) {
  write_level_set(folder_ / "a.vdb", ramp(), context_);
  std::ifstream in(folder_ / "a.vdb", std::ios::binary);
  const std::string good((std::istreambuf_iterator<char>(in)), {});
  for (std::size_t at = 0; at < good.size(); at += 1 + good.size() / 300) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 0xff);
    std::ofstream(folder_ / "bad.vdb", std::ios::binary) << bad;
    error_of(folder_ / "bad.vdb");  // must not crash, hang or throw anything else
  }
}
#endif

TEST_F(VdbFile, ValuesThatAreNotFiniteAreNamed) {
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(1.0f);
  grid->setName("sdf");
  grid->tree().setValue(openvdb::Coord(4, 5, 6), std::nanf(""));
  openvdb::io::File((folder_ / "nan.vdb").string()).write({grid});
  EXPECT_NE(error_of(folder_ / "nan.vdb").find("not finite at index [4, 5, 6]"), std::string::npos);
}

}  // namespace
}  // namespace hermesh
