// Claims of chapters 2 to 4 of the thesis: shared vertices (§2.2), how common defective models are (§2.1),
// blocks (§3.1), the operations of the normal code and its look-up table (§4.1).
#include <unistd.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <unordered_map>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/hermite/normal_codes.h"
#include "experiments/cases/random_normals.h"
#include "experiments/measurements/measurements.h"

namespace hermesh {
namespace {

using Normal = std::array<float, 3>;

// ---- §2.1 and §2.2: models.

/// The scans among the cases with files; the others were modelled.
constexpr const char* kScans[] = {"dragon",           "bunny",        "happy-buddha",     "lucy",
                                  "armadillo",        "asian-dragon", "nefertiti",        "horse",
                                  "laurana",          "dragon-res2",  "rocker-arm",       "elephant",
                                  "many-small-holes", "thai-statue",  "happy-buddha-full"};
constexpr const char* kGroups[] = {"all", "scanned", "modelled"};

struct Census {
  std::size_t models = 0, closed = 0, manifold = 0, oriented = 0, clean = 0;
  void add(const validation::MeshReport& report) {
    ++models;
    closed += report.closed();
    manifold += report.manifold();
    oriented += report.oriented();
    clean += report.closed() && report.manifold() && report.oriented();
  }
};

void count_models(const MeasurementInput& input, std::vector<MeasuredRow>& rows) {
  const bool shares = input.wants_any("share", kGroups);
  std::array<Census, 3> groups;
  for (const CaseInfo& info : list_cases()) {
    const bool shown = input.wants("model", info.name);
    if (info.kind != "file" || (!shown && !shares) || !is_at_hand(info.name, input.context)) continue;
    input.context.progress(info.name, 0.0);
    const LoadedCase model = input.tables.load(info.name, input.context);
    if (model.mesh.empty()) continue;
    RunContext child = child_context(input.context, false);
    const validation::MeshReport report = judge(to_mesh_file(model.mesh), {}, kCounts, child).report;
    const bool scanned = std::ranges::find(kScans, info.name) != std::end(kScans);
    groups[0].add(report);
    groups[scanned ? 1 : 2].add(report);
    if (!shown) continue;
    const std::size_t corners = 3 * model.mesh.triangles.size() + 4 * model.mesh.quads.size();
    const double shared =
        double(sizeof(Eigen::Vector3f) * model.mesh.points.size() + sizeof(std::uint32_t) * corners);
    const double unshared = double(sizeof(Eigen::Vector3f) * corners);
    MeasuredRow row{"model", info.name};
    row.values = {{"scanned", scanned ? 1 : 0},
                  {"points", model.mesh.points.size()},
                  {"corners", corners},
                  {"shared_bytes", shared},
                  {"unshared_bytes", unshared},
                  {"saved_share", 1.0 - shared / unshared},
                  {"point_bytes_share", double(model.mesh.points.size()) / double(corners)},
                  {"closed", int(report.closed())},
                  {"manifold", int(report.manifold())},
                  {"oriented", int(report.oriented())},
                  {"open_edges", report.boundary_edges},
                  {"non_manifold_edges", report.non_manifold_edges},
                  {"non_manifold_vertices", report.non_manifold_vertices},
                  {"flipped_edges", report.inconsistent_edges}};
    rows.push_back(std::move(row));
  }
  for (std::size_t group = 0; group < groups.size(); ++group) {
    if (!input.wants("share", kGroups[group]) || groups[group].models == 0) continue;
    const auto share = [&](std::size_t part) { return double(part) / double(groups[group].models); };
    MeasuredRow row{"share", kGroups[group]};
    row.values = {{"models", groups[group].models},
                  {"closed_share", share(groups[group].closed)},
                  {"manifold_share", share(groups[group].manifold)},
                  {"oriented_share", share(groups[group].oriented)},
                  {"clean_share", share(groups[group].clean)}};
    rows.push_back(std::move(row));
  }
}

// ---- §4.1: operations.

struct Operations {
  std::size_t additions = 0, multiplications = 0, divisions = 0, roots = 0, lookups = 0;
};
/// Operations of the numbers below, which one thread uses.
Operations g_operations;

/// A number that counts its operations. The thesis does not count signs, rounding down and comparisons.
template <class Base>
struct Counted {
  Base value;
  friend Counted operator+(Counted a, Counted b) {
    return ++g_operations.additions, Counted{a.value + b.value};
  }
  friend Counted operator-(Counted a, Counted b) {
    return ++g_operations.additions, Counted{a.value - b.value};
  }
  friend Counted operator*(Counted a, Counted b) {
    return ++g_operations.multiplications, Counted{a.value * b.value};
  }
  friend Counted operator/(Counted a, Counted b) {
    return ++g_operations.divisions, Counted{a.value / b.value};
  }
};
using Real = Counted<float>;

Real root(Real a) { return ++g_operations.roots, Real{std::sqrt(a.value)}; }

/// Packs by equations 4.3 to 4.7 as printed, with a division and a product for each of two quotients; or
/// divides 126 by the sum first, like octant_slots::project() without the third component, which a code that
/// rounds down does not use.
std::uint16_t pack_counted(const Normal& n, bool as_printed) {
  const Real x{std::fabs(n[0])}, y{std::fabs(n[1])}, z{std::fabs(n[2])}, levels{126.0f};
  const Real sum = x + y + z;
  Real a, b;
  if (as_printed) {
    a = x / sum * levels, b = y / sum * levels;
  } else {
    const Real scale = levels / sum;
    a = x * scale, b = y * scale;
  }
  const std::uint32_t negative =
      std::uint32_t(n[0] < 0) << 15 | std::uint32_t(n[1] < 0) << 14 | std::uint32_t(n[2] < 0) << 13;
  return std::uint16_t(negative |
                       octant_slots::fold(std::uint32_t(int(a.value)), std::uint32_t(int(b.value))));
}
/// Unpacks by equations 4.9 to 4.13, with the weight from the table or by eq. 4.10.
Normal unpack_counted(std::uint16_t code, bool table) {
  const octant_slots::Components at = octant_slots::unfold(code);
  const Real a{float(at.a)}, b{float(at.b)}, c = Real{127.0f} - a - b;
  Real weight{};
  if (table) {
    ++g_operations.lookups;
    weight.value = octant_slots::kWeights<127>[code & octant_slots::kSlots];
  } else {
    weight = Real{1.0f} / root(a * a + b * b + c * c);
  }
  const Real x = a * weight, y = b * weight, z = c * weight;
  const std::uint32_t bits = code;
  return {octant_slots::with_sign(x.value, (bits & 0x8000u) << 16),
          octant_slots::with_sign(y.value, (bits & 0x4000u) << 17),
          octant_slots::with_sign(z.value, (bits & 0x2000u) << 18)};
}

constexpr const char* kOperations[] = {"pack, quotients as printed", "pack, one division", "unpack, table",
                                       "unpack, weight computed"};

/// Counts the operations of one call, and the results that differ from those of the code in use. That code's
/// own functions cannot be run on counted numbers: they work on the bits of floats, so loops over them become
/// vector code. The transcriptions above are compared with it.
void count_operations(const MeasurementInput& input, std::vector<MeasuredRow>& rows) {
  const std::vector<Normal> normals = random_normals(200'000, input.seed);
  for (std::size_t which = 0; which < std::size(kOperations); ++which) {
    if (!input.wants("operations", kOperations[which])) continue;
    std::size_t tried = 0, differing = 0;
    Operations first;
    bool constant = true;
    const auto after_call = [&](bool differs) {
      if (tried++ == 0) first = g_operations;
      constant &= std::memcmp(&first, &g_operations, sizeof first) == 0;
      differing += differs;
      g_operations = {};
    };
    g_operations = {};
    if (which < 2) {
      for (const Normal& normal : normals) {
        after_call(pack_counted(normal, which == 0) != ThesisNormalCode::pack(normal));
      }
    } else {
      for (std::uint32_t code = 0; code < 65'536; ++code) {
        const Normal found = unpack_counted(std::uint16_t(code), which == 2);
        after_call(found != ThesisNormalCode::unpack(std::uint16_t(code)));
      }
    }
    MeasuredRow row{"operations", kOperations[which]};
    row.values = {{"additions", first.additions}, {"multiplications", first.multiplications},
                  {"divisions", first.divisions}, {"roots", first.roots},
                  {"lookups", first.lookups},     {"tried", tried},
                  {"differing", differing}};
    constexpr std::array<std::array<int, 3>, 4> kPrinted = {{{2, 2, 1}, {2, 2, 1}, {2, 3, 0}, {4, 6, 1}}};
    row.values["printed_additions"] = kPrinted[which][0];
    row.values["printed_multiplications"] = kPrinted[which][1];
    row.values["printed_divisions"] = kPrinted[which][2];
    if (!constant) row.broken.push_back("the number of operations depends on the normal");
    if (which == 2 && differing > 0) row.broken.push_back("the transcription is not the code that is in use");
    rows.push_back(std::move(row));
  }
}

// ---- §4.1: the look-up table against the square root.

/// ThesisNormalCode::unpack() with a computed weight instead of the table.
Normal unpack_by_root(std::uint16_t code) {
  const octant_slots::Components at = octant_slots::unfold(code);
  const auto a = float(int(at.a)), b = float(int(at.b)), c = float(127 - int(at.a) - int(at.b));
  const float weight = 1.0f / std::sqrt(a * a + b * b + c * c);
  const std::uint32_t bits = code;
  return {octant_slots::with_sign(a * weight, (bits & 0x8000u) << 16),
          octant_slots::with_sign(b * weight, (bits & 0x4000u) << 17),
          octant_slots::with_sign(c * weight, (bits & 0x2000u) << 18)};
}

using UnpackLoop = void (*)(const std::uint16_t*, Normal*, std::size_t);
/// Unpacks an array, which a compiler vectorises if it can.
template <Normal (*unpack)(std::uint16_t)>
void over_array(const std::uint16_t* from, Normal* to, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) to[i] = unpack(from[i]);
}
/// Unpacks one by one; each code depends on the normal before it.
template <Normal (*unpack)(std::uint16_t)>
void one_by_one(const std::uint16_t* from, Normal* to, std::size_t n) {
  std::uint16_t turned = 0;
  for (std::size_t i = 0; i < n; ++i) {
    to[i] = unpack(std::uint16_t(from[i] ^ turned));
    turned = std::uint16_t(std::bit_cast<std::uint32_t>(to[i][0]) & 1u);
  }
}

constexpr const char* kUnpackings[] = {"table, over an array", "square root, over an array",
                                       "table, one by one", "square root, one by one"};

void time_lookup(const MeasurementInput& input, std::vector<MeasuredRow>& rows) {
  if (!input.wants_any("lookup", kUnpackings)) return;
  constexpr std::array<UnpackLoop, 4> kLoops = {
      over_array<ThesisNormalCode::unpack>, over_array<unpack_by_root>, one_by_one<ThesisNormalCode::unpack>,
      one_by_one<unpack_by_root>};
  constexpr std::size_t kCodes = 1 << 14;  // codes and normals together stay in the second-level cache
  constexpr int kRounds = 64;
  std::vector<std::uint16_t> codes;
  for (const Normal& normal : random_normals(kCodes, input.seed))
    codes.push_back(ThesisNormalCode::pack(normal));
  std::vector<Normal> normals(kCodes);
  std::vector<std::function<double()>> work;
  for (const UnpackLoop loop : kLoops)
    work.push_back([&, loop] {
      return timed([&] {
        for (int round = 0; round < kRounds; ++round) loop(codes.data(), normals.data(), codes.size());
      });
    });
  const auto seconds = race(work, int(input.parameters.number("repetitions")));
  double largest = 0.0;
  for (std::uint32_t code = 0; code < 65'536; ++code) {
    const Normal a = ThesisNormalCode::unpack(std::uint16_t(code)), b = unpack_by_root(std::uint16_t(code));
    for (int axis = 0; axis < 3; ++axis) largest = std::max(largest, double(std::abs(a[axis] - b[axis])));
  }
  for (std::size_t i = 0; i < seconds.size(); ++i) {
    const double scale = 1e9 / (double(kCodes) * kRounds);
    rows.push_back({"lookup",
                    kUnpackings[i],
                    {{"ns", scale * median(seconds[i])},
                     {"ns_shortest", scale * std::ranges::min(seconds[i])},
                     {"ratio", median(seconds[i | 1]) / median(seconds[i])},
                     {"largest_difference", largest}}});
  }
}

// ---- §3.1: the size of blocks.

/// The sum over all active voxels of their active neighbours' values, in whole units of 2⁻²⁰ voxel so that
/// the order of the sum does not matter; and the number of these neighbours.
struct NeighbourSum {
  std::int64_t sum = 0;
  std::size_t neighbours = 0;
  bool operator==(const NeighbourSum&) const = default;
  void add(float value, double scale) {
    sum += std::llround(double(value) * scale);
    ++neighbours;
  }
};
constexpr std::array<std::array<int, 3>, 6> kSteps = {
    {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};

struct BlockResult {
  std::vector<double> seconds;
  NeighbourSum sum;
  double bytes = 0.0;
};
/// `visit` adds the neighbours of all voxels to a sum.
template <class Visit>
BlockResult repeated(double bytes, int repetitions, Visit&& visit) {
  BlockResult result{.seconds = {}, .sum = {}, .bytes = bytes};
  for (int i = 0; i < repetitions; ++i) {
    result.sum = {};
    result.seconds.push_back(timed([&] { visit(result.sum); }));
  }
  return result;
}

/// A tree of the usual shape with other leaves.
template <int kLog2>
BlockResult through_tree(const openvdb::FloatGrid& source, double scale, int repetitions) {
  using Tree = typename openvdb::tree::Tree4<float, 5, 4, kLog2>::Type;
  Tree tree(source.background());
  {
    openvdb::tree::ValueAccessor<Tree> accessor(tree);
    for (auto value = source.cbeginValueOn(); value; ++value) accessor.setValue(value.getCoord(), *value);
  }
  return repeated(double(tree.memUsage()), repetitions, [&](NeighbourSum& sum) {
    const openvdb::tree::ValueAccessor<const Tree> accessor(tree);
    for (auto value = tree.cbeginValueOn(); value; ++value)
      for (const auto& [x, y, z] : kSteps) {
        float found = 0.0f;
        if (accessor.probeValue(value.getCoord().offsetBy(x, y, z), found)) sum.add(found, scale);
      }
  });
}

struct CoordHash {
  std::size_t operator()(const openvdb::Coord& c) const {
    std::uint64_t h = std::uint32_t(c.x()) * 0x9e3779b97f4a7c15u;
    h = (h ^ (h >> 29)) + std::uint32_t(c.y()) * 0xbf58476d1ce4e5b9u;
    h = (h ^ (h >> 31)) + std::uint32_t(c.z()) * 0x94d049bb133111ebu;
    return std::size_t(h ^ (h >> 30));
  }
};

/// A hash table of voxels, without blocks. They are visited in the order of the source's leaves, like those
/// of a tree.
BlockResult through_hash(const openvdb::FloatGrid& source, double scale, int repetitions) {
  std::unordered_map<openvdb::Coord, float, CoordHash> voxels;
  voxels.reserve(source.activeVoxelCount());
  for (auto value = source.cbeginValueOn(); value; ++value) voxels.emplace(value.getCoord(), *value);
  const double bytes =
      double(voxels.size()) * (sizeof(std::pair<openvdb::Coord, float>) + 2 * sizeof(void*)) +
      double(voxels.bucket_count()) * sizeof(void*);
  return repeated(bytes, repetitions, [&](NeighbourSum& sum) {
    for (auto value = source.cbeginValueOn(); value; ++value)
      for (const auto& [x, y, z] : kSteps)
        if (const auto found = voxels.find(value.getCoord().offsetBy(x, y, z)); found != voxels.end())
          sum.add(found->second, scale);
  });
}

/// One array over the box of the active voxels, NaN elsewhere.
BlockResult through_array(const openvdb::FloatGrid& source, double scale, int repetitions) {
  openvdb::CoordBBox box = source.evalActiveVoxelBoundingBox();
  box.expand(1);
  const openvdb::Coord size = box.dim();
  const auto at = [&](const openvdb::Coord& c) {
    const openvdb::Coord d = c - box.min();
    return (std::size_t(d.x()) * std::size_t(size.y()) + std::size_t(d.y())) * std::size_t(size.z()) +
           std::size_t(d.z());
  };
  std::vector<float> values(std::size_t(size.x()) * std::size_t(size.y()) * std::size_t(size.z()),
                            std::nanf(""));
  for (auto value = source.cbeginValueOn(); value; ++value) values[at(value.getCoord())] = *value;
  return repeated(double(values.size() * sizeof(float)), repetitions, [&](NeighbourSum& sum) {
    for (int x = box.min().x() + 1; x < box.max().x(); ++x)
      for (int y = box.min().y() + 1; y < box.max().y(); ++y)
        for (int z = box.min().z() + 1; z < box.max().z(); ++z) {
          const openvdb::Coord here(x, y, z);
          if (std::isnan(values[at(here)])) continue;
          for (const auto& [dx, dy, dz] : kSteps)
            if (const float found = values[at(here.offsetBy(dx, dy, dz))]; !std::isnan(found))
              sum.add(found, scale);
        }
  });
}

struct BlockKind {
  const char* label;
  int side;  ///< samples along a block; 0 for the array, which is one
  BlockResult (*run)(const openvdb::FloatGrid&, double, int);
};
constexpr std::array<BlockKind, 6> kBlocks = {{{"voxels in a hash table", 1, through_hash},
                                               {"blocks of 4³", 4, through_tree<2>},
                                               {"blocks of 8³", 8, through_tree<3>},
                                               {"blocks of 16³", 16, through_tree<4>},
                                               {"blocks of 32³", 32, through_tree<5>},
                                               {"one array", 0, through_array}}};

double cache_bytes(int name) {
  const long bytes = sysconf(name);
  return bytes > 0 ? double(bytes) : 0.0;
}

void time_blocks(const MeasurementInput& input, std::vector<MeasuredRow>& rows) {
  if (std::ranges::none_of(kBlocks, [&](const BlockKind& kind) { return input.wants("blocks", kind.label); }))
    return;
  const LoadedCase model = input.tables.load(input.parameters.text("case"), input.context);
  const LevelSet level_set =
      voxelized(model.mesh, {.resolution = input.parameters.number("resolution")}, input);
  const openvdb::FloatGrid& grid = *level_set.grid().grid;
  const double scale = double(1 << 20) / level_set.voxel_size();
  const int repetitions = std::max(1, int(input.parameters.number("repetitions")) / 3);
  std::optional<NeighbourSum> expected;
  for (const BlockKind& kind : kBlocks) {
    if (!input.wants("blocks", kind.label)) continue;
    input.context.check();
    const BlockResult result = kind.run(grid, scale, repetitions);
    if (!expected) expected = result.sum;
    MeasuredRow row{"blocks", kind.label};
    row.values = {
        {"side", kind.side},
        {"block_kib", kind.side > 0 ? std::pow(kind.side, 3) * 4.0 / 1024.0 : result.bytes / 1024.0},
        {"mebibytes", result.bytes / (1 << 20)},
        {"active", level_set.active_voxels()},
        {"ns", 1e9 * median(result.seconds) / (6.0 * double(level_set.active_voxels()))},
        {"ns_shortest", 1e9 * std::ranges::min(result.seconds) / (6.0 * double(level_set.active_voxels()))},
        {"level_1_kib", cache_bytes(_SC_LEVEL1_DCACHE_SIZE) / 1024.0},
        {"level_2_kib", cache_bytes(_SC_LEVEL2_CACHE_SIZE) / 1024.0}};
    if (!(result.sum == *expected)) row.broken.push_back("the neighbours are not those of the first");
    rows.push_back(std::move(row));
  }
}

}  // namespace

std::vector<MeasuredRow> measure_arithmetic(const MeasurementInput& input) {
  std::vector<MeasuredRow> rows;
  count_models(input, rows);
  count_operations(input, rows);
  time_lookup(input, rows);
  time_blocks(input, rows);
  return rows;
}

}  // namespace hermesh
