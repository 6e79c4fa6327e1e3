#include "algorithms/thesis/voxels/hermite_file.h"

#include <gtest/gtest.h>
#include <openvdb/io/File.h>
#include <openvdb/tools/Prune.h>
#include <unistd.h>

#include <fstream>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/hermite/test_lattice.h"
#include "algorithms/io/vdb_file.h"
#include "algorithms/thesis/voxels/dense_tree.h"

namespace hermesh {
namespace hermite_file_test {

namespace fs = std::filesystem;
using openvdb::BoolGrid;
using openvdb::Coord;
using openvdb::Int32Grid;

class HermiteFile : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("hermesh-hermite-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path path(const std::string& name = "a.vdb") const { return folder_ / name; }
  AnyHermite read(const std::string& name = "a.vdb") { return read_hermite(path(name), context_); }
  std::string error_of(const fs::path& file) {
    try {
      read_hermite(file, context_);
    } catch (const Error& e) {
      return e.what();
    }
    return "no error";
  }

  /// A placement that mirrors and shears, with numbers that decimals do not have.
  static IndexToWorld odd_placement() {
    IndexToWorld placement;
    placement.linear << -0.1, 0.03, 0, 0, 0.2, 0, 0.01, 0, 1.0 / 3;
    placement.offset = {0.7, -0.3, 1.0 / 7};
    placement.origin = {1e5 + 0.1, -2e5, 3};
    placement.base = {800, -16, 0};
    return placement;
  }
  /// Every crossing has a tag of its own.
  PackedHermite some_packed(NormalCodeId code = NormalCodeId::nearest, std::uint32_t seed = 1) {
    std::mt19937 random(seed);
    PackedHermite packed = pack(to_sparse(sample_solid(random_blobs(random))), code, context_);
    for (std::size_t i = 0; i < packed.crossings.size(); ++i)
      packed.crossings[i].offset_and_tag =
          static_cast<std::uint16_t>(packed.crossings[i].offset() | (i % 64) << 10);
    packed.placement = odd_placement();
    return packed;
  }
  template <class Voxel>
  DenseHermite<Voxel> some_dense(std::uint32_t seed = 1) {
    std::mt19937 random(seed);
    FloatHermite hermite = to_sparse(sample_solid(random_blobs(random)));
    hermite.placement = odd_placement();
    return to_dense<Voxel>(hermite, context_, NormalCodeId::nearest);
  }

  /// Writes `packed`, lets `change` have its grids, and gives the error of reading them.
  template <class Change>
  std::string error_after(Change&& change) {
    write_hermite(path(), some_packed(), context_);
    openvdb::io::File file(path().string());
    file.open(false);
    const auto signs = openvdb::gridPtrCast<BoolGrid>(file.readGrid("hermite_signs"));
    const auto crossings = openvdb::gridPtrCast<Int32Grid>(file.readGrid("hermite_crossings"));
    file.close();
    change(*signs, *crossings);
    openvdb::io::File(path("changed.vdb").string()).write({signs, crossings});
    return error_of(path("changed.vdb"));
  }

  fs::path folder_;
  RunContext context_;
};

bool contains(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

void expect_same_placement(const IndexToWorld& a, const IndexToWorld& b) {
  EXPECT_EQ(a.linear, b.linear);
  EXPECT_EQ(a.offset, b.offset);
  EXPECT_EQ(a.origin, b.origin);
  EXPECT_EQ(a.base, b.base);
}

TEST_F(HermiteFile, PackedDataComeBackBitByBit) {
  for (const NormalCodeId code : kNormalCodes) {
    const PackedHermite written = some_packed(code, 7 + static_cast<std::uint32_t>(code));
    write_hermite(path(), written, context_);
    const AnyHermite back = read();
    EXPECT_TRUE(same(std::get<PackedHermite>(back), written));
    expect_same_placement(std::get<PackedHermite>(back).placement, written.placement);
    const HermiteSummary summary = summary_of(back);
    EXPECT_EQ(summary.representation, "packed");
    EXPECT_EQ(summary.normal_code, name(code));
    EXPECT_EQ(summary.crossings, written.crossings.size());
  }
}

TEST_F(HermiteFile, AComplementComesBackToo) {
  std::mt19937 random(3);
  auto lattice = sample_solid(random_blobs(random));
  for (char& sign : lattice.signs) sign = !sign;
  lattice.outermost = true;
  const PackedHermite written = pack(to_sparse(lattice), NormalCodeId::octahedral, context_);
  write_hermite(path(), written, context_);
  EXPECT_TRUE(same(std::get<PackedHermite>(read()), written));
}

TEST_F(HermiteFile, NothingComesBackAsNothing) {
  for (const bool outermost : {false, true}) {
    PackedHermite nothing;
    nothing.outermost_inside = outermost;
    write_hermite(path(), nothing, context_);
    EXPECT_TRUE(same(std::get<PackedHermite>(read()), nothing));
    FloatHermite no_floats;
    no_floats.outermost_inside = outermost;
    write_hermite(path(), no_floats, context_);
    EXPECT_TRUE(same(to_float(read(), context_), no_floats));
  }
}

TEST_F(HermiteFile, FloatDataComeBackBitByBit) {
  std::mt19937 random(4);
  FloatHermite written = to_sparse(sample_solid(random_blobs(random)));
  written.placement = odd_placement();
  write_hermite(path(), written, context_);
  const AnyHermite back = read();
  EXPECT_TRUE(same(to_float(back, context_), written));
  expect_same_placement(std::get<FloatDense>(back).placement, written.placement);
}

template <class Voxel>
class DenseHermiteFile : public HermiteFile {};
using AllVoxels = testing::Types<FloatVoxel, DirectedVoxel, ThesisVoxel, FixedVoxel>;
TYPED_TEST_SUITE(DenseHermiteFile, AllVoxels);

TYPED_TEST(DenseHermiteFile, ComesBackVoxelByVoxel) {
  const DenseHermite<TypeParam> written = this->template some_dense<TypeParam>();
  write_hermite(this->path(), written, this->context_);
  const AnyHermite back = this->read();
  const auto& read = std::get<DenseHermite<TypeParam>>(back);
  expect_same_placement(read.placement, written.placement);
  const auto &a = written.grid->tree(), &b = read.grid->tree();
  EXPECT_TRUE(a.hasSameTopology(b));
  auto at = a.cbeginValueAll(), bt = b.cbeginValueAll();
  for (; at && bt; ++at, ++bt) ASSERT_TRUE(*at == *bt && at.isValueOn() == bt.isValueOn());
  EXPECT_FALSE(at || bt);

  const HermiteSummary summary = summary_of(back);
  EXPECT_EQ(summary.representation, TypeParam::type_name);
  EXPECT_EQ(summary.crossings, written.crossings());
  EXPECT_EQ(summary.normal_code == "none",
            (std::is_same_v<TypeParam, FloatVoxel>) || (std::is_same_v<TypeParam, DirectedVoxel>));
}

TYPED_TEST(DenseHermiteFile, IsDescribedAsAGrid) {
  write_hermite(this->path(), this->template some_dense<TypeParam>(), this->context_);
  const std::vector<GridSummary> grids = describe_vdb(this->path());
  ASSERT_EQ(grids.size(), 1u);
  EXPECT_EQ(grids[0].name, "hermite");
  EXPECT_NE(grids[0].value_type.find(TypeParam::type_name), std::string::npos);
  EXPECT_GT(grids[0].active_voxels, 0u);
  const double sides[] = {std::sqrt(0.0101), std::sqrt(0.0409), 1.0 / 3};
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(grids[0].voxel_size[axis], sides[axis], 1e-10);
}

// The header's description of the packed file, read only with OpenVDB.
TEST_F(HermiteFile, PackedFilesAreAsDescribed) {
  const auto lattice = sample_solid(ball(12, 12, 12, 9.3));
  const PackedHermite written = pack(to_sparse(lattice), NormalCodeId::octahedral, context_);
  write_hermite(path(), written, context_);
  openvdb::io::File file(path().string());
  file.open(false);
  const auto signs = openvdb::gridPtrCast<BoolGrid>(file.readGrid("hermite_signs"));
  const auto crossings = openvdb::gridPtrCast<Int32Grid>(file.readGrid("hermite_crossings"));
  ASSERT_TRUE(signs && crossings);
  lattice.for_each_sample([&](int x, int y, int z) {
    bool crossed = false;
    for (int axis = 0; axis < 3; ++axis)
      crossed |= lattice.inside(x, y, z) != lattice.successor(axis, x, y, z);
    ASSERT_EQ(signs->tree().getValue(Coord(x, y, z)), lattice.inside(x, y, z));
    ASSERT_EQ(signs->tree().isValueOn(Coord(x, y, z)), crossed);
  });
  const std::size_t held = written.crossings.size();
  ASSERT_GT(held, 512u);
  EXPECT_EQ(crossings->activeVoxelCount(), held);
  for (std::size_t n = 0; n < held; ++n) {
    const int in = static_cast<int>(n % 512);
    const Coord place(static_cast<int>(8 * (n / 512)) + in / 64, in / 8 % 8, in % 8);
    const auto bits = static_cast<std::uint32_t>(crossings->tree().getValue(place));
    ASSERT_EQ(bits & 0xffff, written.crossings[n].normal);
    ASSERT_EQ((bits >> 16) & 1023, written.crossings[n].offset());
  }
}

TEST_F(HermiteFile, PruningAPackedFileChangesNothing) {
  PackedHermite packed = some_packed();
  for (PackedCrossing& crossing : packed.crossings) crossing = {4711, 511};  // whole leaves of equal values
  write_hermite(path(), packed, context_);
  openvdb::io::File file(path().string());
  file.open(false);
  const auto signs = openvdb::gridPtrCast<BoolGrid>(file.readGrid("hermite_signs"));
  const auto crossings = openvdb::gridPtrCast<Int32Grid>(file.readGrid("hermite_crossings"));
  file.close();
  openvdb::tools::prune(signs->tree());
  openvdb::tools::prune(crossings->tree());
  EXPECT_LE(crossings->tree().leafCount(), 1u);
  openvdb::io::File(path("pruned.vdb").string()).write({signs, crossings});
  EXPECT_TRUE(same(std::get<PackedHermite>(read("pruned.vdb")), packed));
}

TEST_F(HermiteFile, AMovedTransformMovesTheData) {
  const std::string none = error_after([](BoolGrid& signs, Int32Grid&) {
    signs.setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  });
  EXPECT_EQ(none, "no error");
  const IndexToWorld placement = std::get<PackedHermite>(read("changed.vdb")).placement;
  EXPECT_EQ(placement.linear, (0.5 * Eigen::Matrix3d::Identity()).eval());
  EXPECT_EQ(placement.offset + placement.origin, Eigen::Vector3d::Zero());
}

TEST_F(HermiteFile, OtherFilesAreRefusedInOneSentence) {
  EXPECT_NE(error_of(path("none.vdb")).find("does not exist"), std::string::npos);
  EXPECT_NE(error_of(folder_).find("is a folder"), std::string::npos);
  std::ofstream(path("text.vdb")) << "these are words and no volume";
  EXPECT_NE(error_of(path("text.vdb")).find("is not a .vdb file"), std::string::npos);
  const auto density = openvdb::FloatGrid::create();
  density->setName("density");
  openvdb::io::File(path("fog.vdb").string()).write({density});
  EXPECT_NE(error_of(path("fog.vdb")).find("fog.vdb: there are no Hermite data, but the grids density"),
            std::string::npos);
  density->setName("hermite");
  openvdb::io::File(path("other.vdb").string()).write({density});
  EXPECT_NE(error_of(path("other.vdb")).find("values of another type"), std::string::npos);
}

TEST_F(HermiteFile, ContradictionsInTheMetadataAreNamed) {
  const auto with = [&](const char* key, auto&& metadata) {
    return error_after([&](BoolGrid& signs, Int32Grid&) {
      signs.removeMeta(key);
      signs.insertMeta(key, metadata);
    });
  };
  EXPECT_TRUE(contains(with("hermesh_hermite_version", openvdb::Int32Metadata(2)),
                       "of version 2, this program reads version 1"));
  EXPECT_TRUE(contains(with("hermesh_hermite_version", openvdb::FloatMetadata(1)), "does not say"));
  EXPECT_TRUE(contains(with("hermesh_normal_code", openvdb::StringMetadata("morse")),
                       "there is no normal code \"morse\""));
  EXPECT_TRUE(contains(with("hermesh_normal_code", openvdb::StringMetadata("thesis")), "two codes"));
  EXPECT_TRUE(
      contains(with("hermesh_normals", openvdb::StringMetadata("inwards")), "normals of another kind"));
  EXPECT_TRUE(contains(error_after([](BoolGrid& signs, Int32Grid&) { signs.removeMeta("hermesh_normals"); }),
                       "does not say"));
}

TEST_F(HermiteFile, ContradictionsInTheGridsAreNamed) {
  EXPECT_EQ(error_after([](BoolGrid&, Int32Grid&) {}), "no error");
  EXPECT_TRUE(
      contains(error_after([](BoolGrid&, Int32Grid& crossings) { crossings.tree().setValueOff(Coord(0)); }),
               "crossing edges, or other crossings than the first"));
  EXPECT_TRUE(contains(error_after([](BoolGrid&, Int32Grid& crossings) {
                         crossings.tree().setValueOff(Coord(0));
                         crossings.tree().setValueOn(Coord(-1, 0, 0), 1);
                       }),
                       "or other crossings than the first"));
  EXPECT_TRUE(contains(error_after([](BoolGrid&, Int32Grid& crossings) {
                         crossings.tree().setValueOn(Coord(0, 0, 1), 1023 << 16);
                       }),
                       "out of range"));
  // A sample whose sign is reversed far from the surface makes six crossing edges.
  EXPECT_TRUE(contains(
      error_after([](BoolGrid& signs, Int32Grid&) { signs.tree().setValueOff(Coord(500, 3, 3), true); }),
      "but their signs have"));
  EXPECT_TRUE(contains(error_after([](BoolGrid& signs, Int32Grid&) {
                         signs.tree().addTile(1, Coord(512, 0, 0), true, false);
                       }),
                       "change their sign between blocks"));
  EXPECT_TRUE(contains(error_after([](BoolGrid& signs, Int32Grid&) {
                         signs.tree().addTile(3, Coord(8192, 0, 0), true, false);
                       }),
                       "change their sign between blocks"));
  // OpenVDB refuses a transform that cannot be inverted, but not one whose translation is not finite.
  EXPECT_NE(error_after([](BoolGrid& signs, Int32Grid&) {
              openvdb::Mat4R nowhere = openvdb::Mat4R::identity();
              nowhere(3, 0) = std::nan("");
              signs.setTransform(std::make_shared<openvdb::math::Transform>(
                  openvdb::math::MapBase::Ptr(new openvdb::math::AffineMap(nowhere))));
            }),
            "no error");
}

TEST_F(HermiteFile, NumbersThatAreNoneAreRefused) {
  FloatDense dense = some_dense<FloatVoxel>();
  const auto grid = dense.grid->deepCopy();
  auto it = grid->tree().beginValueOn();
  FloatVoxel voxel = *it;
  for (int axis = 0; axis < 3; ++axis)
    if (voxel.crosses(axis)) voxel.set(axis, {std::nanf(""), {1, 0, 0}});
  it.setValue(voxel);
  dense.grid = grid;
  write_hermite(path(), dense, context_);
  EXPECT_NE(error_of(path()).find("none of theirs"), std::string::npos);
}

/// A file of `kind` that is small enough to be damaged at many positions.
class DamagedHermiteFile : public HermiteFile, public testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override {
    HermiteFile::SetUp();
    const FloatHermite hermite = to_sparse(sample_solid(ball(4, 4, 4, 3.3), -8, 24));
    const std::string kind = GetParam();
    if (kind == "packed") write_hermite(path(), pack(hermite, NormalCodeId::nearest, context_), context_);
    if (kind == "fixed") write_hermite(path(), to_dense<FixedVoxel>(hermite, context_), context_);
    if (kind == "thesis") write_hermite(path(), to_dense<ThesisVoxel>(hermite, context_), context_);
    if (kind == "directed") write_hermite(path(), to_dense<DirectedVoxel>(hermite, context_), context_);
    if (kind == "float") write_hermite(path(), hermite, context_);
    EXPECT_EQ(error_of(path()), "no error");
  }
};

TEST_P(DamagedHermiteFile, EveryTruncationIsRefused) {
  const auto size = fs::file_size(path());
  std::vector<std::uintmax_t> lengths{size - 1, size - 7, size - 20, size - 200};
  for (std::uintmax_t keep = 1; keep < size; keep += 1 + size / 40) lengths.push_back(keep);
  for (const std::uintmax_t keep : lengths) {
    fs::copy_file(path(), path("cut.vdb"), fs::copy_options::overwrite_existing);
    fs::resize_file(path("cut.vdb"), keep);
    EXPECT_NE(error_of(path("cut.vdb")), "no error") << keep << " of " << size;
  }
}

TEST_P(DamagedHermiteFile, EveryFlippedByteIsRefused) {
  std::ifstream in(path(), std::ios::binary);
  const std::string good((std::istreambuf_iterator<char>(in)), {});
  for (std::size_t at = 0; at < good.size(); at += 1 + good.size() / 200) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 0xff);
    std::ofstream(path("bad.vdb"), std::ios::binary) << bad;
    EXPECT_NE(error_of(path("bad.vdb")), "no error") << at;
  }
}

INSTANTIATE_TEST_SUITE_P(All, DamagedHermiteFile,
                         testing::Values("packed", "fixed", "thesis", "directed", "float"),
                         [](const auto& kind) { return std::string(kind.param); });

}  // namespace hermite_file_test
}  // namespace hermesh
