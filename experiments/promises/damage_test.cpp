// Volumes and experiment files that something has damaged: an answer or a short sentence, never a crash, a
// hang or gigabytes.
#include "experiments/promises/damage.h"

#include <gtest/gtest.h>
#include <openvdb/io/Stream.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <openvdb/tools/LevelSetUtil.h>
#include <tbb/global_control.h>
#include <unistd.h>
#include <zlib.h>

#include <fstream>
#include <sstream>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/extraction/volume_attributes.h"
#include "algorithms/extraction/volume_ends.h"
#include "algorithms/hermite/hermite_file.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/io/grid_frame.h"
#include "algorithms/io/import/files_for_tests.h"
#include "algorithms/io/import/import_volume.h"
#include "algorithms/io/vdb_file.h"
#include "experiments/cases/cases.h"
#include "experiments/harness/measurement.h"
#include "experiments/variants.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;
using damage::Mutator;
using Files = std::vector<std::string>;

std::string bytes_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class Damage : public testing::Test {
 protected:
  Damage() : folder(fs::temp_directory_path() / ("hermesh-damage-" + std::to_string(::getpid()))) {
    fs::create_directories(folder);
    initialize_openvdb();
  }
  ~Damage() override { fs::remove_all(folder); }

  /// Expects all attempts to end as they should; `read` gets the number of one, and writes and reads the
  /// damaged file.
  static void expect_answers(int count, const std::function<void(int)>& read) {
    for (const std::string& failure : damage::failures(count, read)) ADD_FAILURE() << failure;
  }
  fs::path put(const std::string& name, const std::string& bytes) {
    std::ofstream(folder / name, std::ios::binary) << bytes;
    return folder / name;
  }

  void foreign(int count);
  void own(int count);
  void hermite(int count);
  void nifti(int count);
  void raw(int count);

  fs::path folder;
  // Child processes have no threads but the one that made them.
  tbb::global_control one_thread{tbb::global_control::max_allowed_parallelism, 1};
};
class Slow : public Damage {};

openvdb::FloatGrid::Ptr sphere() {
  const auto grid =
      openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(3.0f, openvdb::Vec3f(0.1f, 0.2f, 0.3f), 0.5f);
  grid->setName("sdf");
  return grid;
}

/// The sphere's values in a tree of another type.
template <class Grid, class Value>
typename Grid::Ptr converted(const char* name, Value&& value) {
  const auto from = sphere();
  auto grid = Grid::create(value(from->background()));
  for (auto it = from->cbeginValueOn(); it; ++it) grid->tree().setValue(it.getCoord(), value(*it));
  grid->setName(name);
  grid->setTransform(from->transform().copy());
  return grid;
}

openvdb::FloatGrid::Ptr frustum() {
  const auto grid = sphere()->deepCopy();
  grid->setTransform(openvdb::math::Transform::createFrustumTransform(
      openvdb::BBoxd(openvdb::Vec3d(-10), openvdb::Vec3d(10)), 0.5, 10.0, 0.3));
  return grid;
}

/// A grid with tiles at each depth, active and not.
openvdb::FloatGrid::Ptr tiled() {
  auto grid = openvdb::FloatGrid::create(0.0f);
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->fill(openvdb::CoordBBox::createCube(openvdb::Coord(-8), 24), 1.0f);
  grid->tree().addTile(1, openvdb::Coord(16, 0, 0), 0.7f, true);
  grid->tree().addTile(2, openvdb::Coord(256, 0, 0), 0.0f, false);
  grid->tree().addTile(3, openvdb::Coord(4096, 0, 0), 0.0f, false);
  grid->tree().setValue(openvdb::Coord(3, 3, 3), 0.2f);
  return grid;
}

std::string written(const openvdb::GridCPtrVec& grids, std::uint32_t compression, const fs::path& path) {
  openvdb::io::File file(path.string());
  file.setCompression(compression);
  file.write(grids);
  file.close();
  return bytes_of(path);
}

/// Files of other programs: types, compressions, grids that share a tree, and a stream without places of
/// grids.
Files foreign_files(const fs::path& path) {
  using namespace openvdb;
  const auto half = sphere();
  half->setSaveFloatAsHalf(true);
  const auto half_vectors = converted<Vec3SGrid>("v", [](float x) { return Vec3s(x, 1, -x); });
  half_vectors->setSaveFloatAsHalf(true);
  const auto shared = sphere();
  const auto instance = FloatGrid::create(shared->treePtr());
  instance->setName("other");
  const GridCPtrVec kinds[] = {{sphere()},
                               {half},
                               {tiled()},
                               {frustum()},
                               {shared, instance},
                               {half_vectors, tiled()},
                               {converted<DoubleGrid>("d", [](float x) { return double(x); })},
                               {converted<Int32Grid>("i", [](float x) { return Int32(1000 * x); })},
                               {converted<Int64Grid>("l", [](float x) { return Int64(1000 * x); })},
                               {converted<BoolGrid>("b", [](float x) { return x < 0; })},
                               {converted<MaskGrid>("m", [](float x) { return x < 0; })},
                               {converted<Vec3DGrid>("w", [](float x) { return Vec3d(x, 0, 1); }), sphere()}};
  Files files;
  for (const GridCPtrVec& grids : kinds)
    for (const std::uint32_t compression :
         {std::uint32_t(io::COMPRESS_BLOSC | io::COMPRESS_ACTIVE_MASK), std::uint32_t(io::COMPRESS_ZIP),
          std::uint32_t(io::COMPRESS_NONE), std::uint32_t(io::COMPRESS_ACTIVE_MASK)})
      files.push_back(written(grids, compression, path));
  std::ostringstream stream;
  io::Stream(stream).write({sphere(), tiled()});
  files.push_back(stream.str());
  return files;
}

/// Reads of a volume all that commands read.
void read_volume(const fs::path& path) {
  RunContext context;
  std::optional<Error> first;
  const auto attempt = [&](auto&& read) {
    try {
      read();
    } catch (const Error& error) {
      if (!first) first = error;
    }
  };
  attempt([&] { describe_vdb(path); });
  attempt([&] { read_grid_frame(path); });
  attempt([&] {
    const LevelSet level_set = read_level_set(path, "", context);
    const double isovalue = level_set.background() > 0.0 ? 0.0 : 0.5;
    for (const char* name : {"marching-cubes", "dual-contouring"}) {
      const Extractor extractor = find_variant(all_extractors(), name);
      EndedMesh ended = extract_with_ends(
          extractor, {level_set, isovalue, nullptr, Options(name, extractor.options, {}), context, nullptr},
          Ends::closed);
      sample_attributes(ended.mesh, path, {"all"}, context);
    }
  });
  attempt([&] { read_hermite(path, context); });
  if (first) throw *first;
}

void Damage::foreign(int count) {
  const Files whole = foreign_files(folder / "whole.vdb");
  for (const std::string& each : whole) {
    RunContext context;
    EXPECT_NO_THROW(describe_vdb(put("whole.vdb", each)));
  }
  expect_answers(count, [&](int i) { read_volume(put("a.vdb", Mutator(std::uint64_t(i))(whole))); });
}

/// The file with the checksum at its end made to fit again.
std::string resealed(std::string bytes) {
  if (bytes.size() < 100) return bytes;
  const std::size_t size = bytes.size() - 12;
  const auto crc = static_cast<std::uint32_t>(
      crc32(crc32(0, nullptr, 0), reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(size)));
  std::memcpy(bytes.data() + size, "hermesh\n", 8);
  std::memcpy(bytes.data() + size + 8, &crc, 4);
  return bytes;
}

void Damage::own(int count) {
  RunContext context;
  write_level_set(folder / "own.vdb", make_level_set(sphere()), context);
  Files whole{bytes_of(folder / "own.vdb")};
  write_level_set(folder / "own.vdb", make_level_set(tiled()), context);
  whole.push_back(bytes_of(folder / "own.vdb"));
  expect_answers(count, [&](int i) {
    const std::string damaged = Mutator(std::uint64_t(i))(whole);
    read_volume(put("a.vdb", i % 4 == 0 ? damaged : resealed(damaged)));
  });
}

void Damage::hermite(int count) {
  RunContext context;
  const FloatHermite exact = sample_level_set(make_level_set(sphere()), 0.0, context);
  Files whole;
  const auto keep = [&](const auto& data) {
    write_hermite(folder / "h.vdb", data, context);
    whole.push_back(bytes_of(folder / "h.vdb"));
  };
  keep(exact);
  keep(pack(exact, NormalCodeId::octahedral, context));
  keep(to_dense<FixedVoxel>(exact, context));
  keep(to_dense<DirectedVoxel>(exact, context));
  keep(to_dense<ThesisVoxel>(exact, context));
  expect_answers(count, [&](int i) {
    const std::string damaged = Mutator(std::uint64_t(i))(whole);
    read_volume(put("a.vdb", i % 4 == 0 ? damaged : resealed(damaged)));
  });
}

Files nifti_files() {
  std::vector<std::int16_t> values;
  for (int i = 0; i < 12 * 11 * 10; ++i) values.push_back(static_cast<std::int16_t>(i % 97));
  const NiftiBytes plain = NiftiBytes().dims({12, 11, 10}).type(4, 16).samples(values);
  NiftiBytes placed = NiftiBytes(true).dims({12, 11, 5, 2}).type(4, 16).samples(values);
  placed.put<std::int16_t>(252, 1).put<float>(264, 0.7f).put<float>(112, 0.5f).put<float>(116, 10.0f);
  return {plain.bytes(), placed.bytes(),
          NiftiBytes().dims({4, 4, 4}).type(64, 64).samples(std::vector<double>(64, 1.5)).bytes()};
}

void Damage::nifti(int count) {
  const Files whole = nifti_files();
  Files packed;
  for (const std::string& each : whole) {
    write_gzipped(folder / "whole.nii.gz", each);
    packed.push_back(bytes_of(folder / "whole.nii.gz"));
  }
  expect_answers(count, [&](int i) {
    RunContext context;
    Mutator mutate{std::uint64_t(i)};
    const bool gzipped = i % 3 == 0;
    const fs::path path = put(gzipped ? "a.nii.gz" : "a.nii", mutate(gzipped ? packed : whole));
    if (i % 3 == 1) write_gzipped(folder / "a.nii.gz", bytes_of(path));
    const LevelSet volume = import_nifti(i % 3 == 1 ? folder / "a.nii.gz" : path, {}, context);
    write_imported(folder / "a.vdb", volume, context);
    read_volume(folder / "a.vdb");
  });
}

void Damage::raw(int count) {
  const Files whole{nifti_files()[0].substr(352), std::string(3000, '\x10')};
  expect_answers(count, [&](int i) {
    RunContext context;
    std::mt19937_64 random{std::uint64_t(i)};
    const fs::path path = put("a.raw", Mutator(std::uint64_t(i))(whole));
    const auto size = static_cast<std::int64_t>(fs::file_size(path));
    RawLayout layout{.dims = {12, 11, 10}, .format = {SampleType(random() % 10), random() % 2 == 0}};
    if (random() % 2)
      layout.dims = {std::max<std::int64_t>(1, size / std::int64_t(size_of(layout.format.type))), 1, 1};
    if (random() % 4 == 0) layout.dims[random() % 3] = std::int64_t(random() >> (random() % 64));
    if (random() % 4 == 0) layout.offset = random() >> (random() % 64);
    if (random() % 4 == 0) layout.spacing[random() % 3] = std::bit_cast<double>(random());
    write_imported(folder / "a.vdb", import_raw(path, layout, {.replacement = 0.0f, .frame = {}}, context),
                   context);
  });
}

TEST_F(Damage, Volumes) { foreign(150), own(60), hermite(80), nifti(100), raw(100); }

constexpr int kMany = 5000;
TEST_F(Slow, ForeignVolumes) { foreign(kMany); }
TEST_F(Slow, OwnVolumes) { own(kMany); }
TEST_F(Slow, HermiteData) { hermite(kMany); }
TEST_F(Slow, Nifti) { nifti(kMany); }
TEST_F(Slow, RawSamples) { raw(kMany); }

}  // namespace
}  // namespace hermesh
