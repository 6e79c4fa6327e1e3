// Damaged volumes: a result or a short message, never a crash, a hang or gigabytes.
#include <gtest/gtest.h>
#include <openvdb/io/Stream.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <openvdb/tools/LevelSetUtil.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <tbb/global_control.h>
#include <unistd.h>
#include <zlib.h>

#include <array>
#include <bit>
#include <chrono>
#include <cstring>
#include <fstream>
#include <limits>
#include <random>
#include <sstream>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/extraction/volume_attributes.h"
#include "algorithms/extraction/volume_ends.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/io/grid_frame.h"
#include "algorithms/io/import/files_for_tests.h"
#include "algorithms/io/import/import_volume.h"
#include "algorithms/io/vdb_file.h"
#include "algorithms/thesis/voxels/hermite_file.h"
#include "experiments/variants.h"

namespace hermesh {
namespace damage_test {

namespace fs = std::filesystem;

constexpr std::size_t kLongestSentence = 300;  ///< bytes
constexpr double kLongestSeconds = 5.0;
constexpr long kMostGrowth = 1 << 20;  ///< KiB

/// Returns a value of /proc/self/status in KiB.
long status_of(const std::string& name) {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    long value = 0;
    if (word == name + ":" && status >> value) return value;
  }
  return 0;
}

/// Memory shared with the child processes.
struct Shared {
  int current;
  char wrong[600];
};

/// Returns the violation of attempt(i), "" if there is none.
std::string verdict(int i, const std::function<void(int)>& attempt) {
  std::ofstream("/proc/self/clear_refs") << "5";  // resets the peak
  const long before = status_of("VmRSS");
  const auto start = std::chrono::steady_clock::now();
  std::string wrong;
  try {
    attempt(i);
  } catch (const Error& error) {
    const std::string said = error.what();
    if (said.empty() || said.size() > kLongestSentence)
      wrong = "a sentence of " + std::to_string(said.size()) + " bytes: " + said;
    if (std::ranges::any_of(said, [](unsigned char c) { return c < 0x20 || c == 0x7f; }))
      wrong = "control characters: " + said;
  } catch (const std::exception& other) {
    wrong = std::string("an exception of another kind: ") + other.what();
  }
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  if (seconds.count() > kLongestSeconds) wrong += " " + std::to_string(seconds.count()) + " seconds";
  const long growth = status_of("VmHWM") - before;
  if (growth > kMostGrowth) wrong += " " + std::to_string(growth) + " KiB more memory";
  return wrong;
}

[[noreturn]] void work(int first, int count, const std::function<void(int)>& attempt, Shared& shared) {
  for (int i = first; i < count; ++i) {
    shared.current = i;
    alarm(30);
    const std::string wrong = verdict(i, attempt);
    if (wrong.empty()) continue;
    wrong.copy(shared.wrong, sizeof shared.wrong - 1);
    _exit(1);
  }
  _exit(0);
}

/// Calls attempt(0) to attempt(count − 1), which read damaged files, in child processes that may crash. An
/// attempt must return, or throw an Error of one short line without control characters, within five seconds
/// and without taking a GiB. Returns the violations, at most ten.
std::vector<std::string> failures(int count, const std::function<void(int)>& attempt) {
  auto* const shared = static_cast<Shared*>(
      mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
  std::vector<std::string> found;
  constexpr std::size_t kEnough = 10;
  for (int next = 0; next < count && found.size() < kEnough; next = shared->current + 1) {
    *shared = {next, ""};
    const pid_t child = fork();
    if (child == 0) work(next, count, attempt, *shared);
    int status = 0;
    waitpid(child, &status, 0);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) break;
    const std::string at = "attempt " + std::to_string(shared->current) + ": ";
    found.push_back(at + (WIFSIGNALED(status) ? "signal " + std::to_string(WTERMSIG(status))
                                              : std::string(shared->wrong)));
  }
  munmap(shared, sizeof(Shared));
  return found;
}

/// Changes bytes, cuts, exchanges numbers and inserts parts of other files; equal for equal seeds.
class Mutator {
 public:
  explicit Mutator(std::uint64_t seed) : random_(seed) {}

  /// Returns a file of `whole` with one to three changes.
  std::string operator()(const std::vector<std::string>& whole) {
    std::string bytes = whole[below(whole.size())];
    for (std::size_t left = 1 + below(3); left > 0 && !bytes.empty(); --left) switch (below(6)) {
        case 0:
          change_bytes(bytes);
          break;
        case 1:
          cut(bytes);
          break;
        case 2:
          exchange(bytes);
          break;
        case 3:
          splice(bytes, whole[below(whole.size())]);
          break;
        default:
          put_number(bytes);
      }
    return bytes;
  }

 private:
  std::size_t below(std::size_t end) { return end == 0 ? 0 : random_() % end; }
  void change_bytes(std::string& bytes) {
    for (std::size_t left = 1 + below(8); left > 0; --left) {
      char& byte = bytes[below(bytes.size())];
      byte = below(2) ? static_cast<char>(byte ^ (1 << below(8))) : static_cast<char>(random_());
    }
  }
  void cut(std::string& bytes) {
    const std::size_t at = below(bytes.size());
    if (below(2))
      bytes.resize(at);
    else
      bytes.erase(at, 1 + below(below(4) ? 16 : bytes.size()));
  }
  void put_number(std::string& bytes) {
    constexpr std::uint64_t kNumbers[] = {0,
                                          1,
                                          2,
                                          4,
                                          6,
                                          16,
                                          255,
                                          4096,
                                          0x7fffffff,
                                          0x80000000,
                                          0xffffffff,
                                          0x7ff8000000000000,
                                          0x8000000000000000,
                                          0xffffffffffffffff};
    std::uint64_t number = below(4) ? kNumbers[below(std::size(kNumbers))] : random_() >> below(64);
    if (below(5) == 0)
      number = std::bit_cast<std::uint32_t>(below(2) ? std::numeric_limits<float>::quiet_NaN() : 1e38f);
    if (below(4) == 0) number = ~number + 1;
    const std::size_t size = std::size_t{1} << below(4), at = below(bytes.size());
    for (std::size_t i = 0; i < size && at + i < bytes.size(); ++i)
      bytes[at + i] = static_cast<char>(number >> (8 * i));
  }
  void exchange(std::string& bytes) {
    const std::size_t size = std::size_t{1} << below(4);
    if (bytes.size() < 2 * size) return;
    const std::size_t a = below(bytes.size() - size), b = below(bytes.size() - size);
    for (std::size_t i = 0; i < size; ++i) std::swap(bytes[a + i], bytes[b + i]);
  }
  void splice(std::string& bytes, const std::string& other) {
    const std::size_t from = below(other.size()), length = 1 + below(below(3) ? 64 : other.size());
    const std::string part = other.substr(from, length);
    const std::size_t at = below(bytes.size());
    bytes.replace(at, below(2) ? part.size() : 0, part);
  }

  std::mt19937_64 random_;
};

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

  /// `read` gets the number of an attempt, and writes and reads the damaged file.
  static void expect_answers(int count, const std::function<void(int)>& read) {
    for (const std::string& failure : failures(count, read)) ADD_FAILURE() << failure;
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
  // Child processes have only the thread that made them.
  tbb::global_control one_thread{tbb::global_control::max_allowed_parallelism, 1};
};
class Slow : public Damage {};

openvdb::FloatGrid::Ptr sphere() {
  const auto grid =
      openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(3.0f, openvdb::Vec3f(0.1f, 0.2f, 0.3f), 0.5f);
  grid->setName("sdf");
  return grid;
}

/// Returns the sphere's values in a tree of another type.
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

/// Returns files of other programs: types, compressions, grids that share a tree, and a stream without grid
/// offsets.
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

/// Reads everything in a volume that commands read.
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

/// Returns the file with the checksum at its end corrected.
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
    RawLayout layout{.dims = {12, 11, 10}, .format = {NumberType(random() % 10), random() % 2 == 0}};
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

}  // namespace damage_test
}  // namespace hermesh
