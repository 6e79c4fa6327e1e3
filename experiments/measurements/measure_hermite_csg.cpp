// The laws of Boolean algebra on Hermite data of every representation, and two real scans united.
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "algorithms/extraction/dual_contouring/dual_contouring.h"
#include "algorithms/hermite/combine.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/thesis/voxels/dense_hermite.h"
#include "experiments/measurements/measurements.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

// ---- Laws.

/// A few spheres, and boxes turned by 0.3° about an axis square to z, so that the upper faces lean into the
/// positive octant, where the thesis's layout takes normals for none, and the lower ones into the negative,
/// whence its complement turns them there.
AnalyticSurface random_solid(std::mt19937_64& random) {
  struct Part {
    Vector3d centre, half;
    bool box;
  };
  std::uniform_real_distribution<double> place(-14.0, 14.0), size(3.0, 9.0);
  std::vector<Part> parts(3 + random() % 4);
  for (Part& part : parts) {
    part.centre = Vector3d(place(random), place(random), place(random));
    part.half = Vector3d(size(random), size(random), size(random));
    part.box = random() % 2 == 0;
  }
  const Eigen::Matrix3d to_box =
      Eigen::AngleAxisd(-0.3 * std::numbers::pi / 180.0, Vector3d(-1, 1, 0).normalized()).matrix();
  const auto distance = [=](const Part& part, const Vector3d& p) {
    const Vector3d away = p - part.centre;
    return part.box ? ((to_box * away).cwiseAbs() - part.half).maxCoeff() : away.norm() - part.half.x();
  };
  const auto nearest = [=](const Vector3d& p) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < parts.size(); ++i)
      if (distance(parts[i], p) < distance(parts[best], p)) best = i;
    return parts[best];
  };
  return {[=](const Vector3d& p) { return distance(nearest(p), p); },
          [=](const Vector3d& p) -> Vector3d {
            const Part part = nearest(p);
            const Vector3d away = p - part.centre;
            if (!part.box) return away;
            const Vector3d local = to_box * away;
            int face = 0;
            (local.cwiseAbs() - part.half).maxCoeff(&face);
            return std::copysign(1.0, local[face]) * (to_box.transpose() * Vector3d::Unit(face));
          }};
}

FloatHermite sampled(const AnalyticSurface& solid, RunContext& context) {
  IndexToWorld lattice;
  lattice.offset = Vector3d(0.13, 0.29, 0.41);
  return sample_function(solid, lattice, {-26, -26, -26}, {26, 26, 26}, 1e-9, context);
}

/// Edges that are crossed in only one of them, or differently.
std::size_t differences(const FloatHermite& a, const FloatHermite& b) {
  std::size_t count_of = 0, in_both = 0;
  for (std::size_t i = 0; i < a.leaves.size(); ++i) {
    const SignLeaf* other = b.find(a.leaves[i].lower);
    if (!other) {
      count_of += a.crossings_of(i).size();
      continue;
    }
    const auto j = static_cast<std::size_t>(other - b.leaves.data());
    std::array<std::array<const EdgeCrossing*, 512>, 3> there{};
    const std::array<BlockMask, 3> edges = crossing_edges(*other);
    const EdgeCrossing* next = b.crossings_of(j).data();
    for (int axis = 0; axis < 3; ++axis)
      for_each_bit(edges[axis], [&](int sample) { there[axis][sample] = next++; });
    for_each_crossing(a, i, [&](int axis, int sample, const EdgeCrossing& crossing) {
      const EdgeCrossing* same = there[axis][sample];
      in_both += same != nullptr;
      count_of += !same || !(*same == crossing);
    });
  }
  return count_of + (b.crossings.size() - in_both);
}

/// Pairs of random solids, made when the first representation asks for them.
struct Pairs {
  const MeasurementInput& input;
  std::vector<std::array<FloatHermite, 2>> made = {};

  const std::vector<std::array<FloatHermite, 2>>& all() {
    std::mt19937_64 random(input.seed);
    while (made.size() < std::size_t(input.parameters.number("pairs")))
      made.push_back(
          {sampled(random_solid(random), input.context), sampled(random_solid(random), input.context)});
    return made;
  }
};

/// One representation's operations on the data of the two solids.
template <class Data, class Store, class Read>
void count_violations(const std::string& label, bool must_hold, Pairs& pairs, Store&& store, Read&& read,
                      std::vector<MeasuredRow>& rows) {
  if (!pairs.input.wants("laws", label)) return;
  RunContext& context = pairs.input.context;
  std::size_t involution = 0, de_morgan = 0, commutes = 0, idempotent = 0, self_difference = 0, crossings = 0;
  for (const auto& [first, second] : pairs.all()) {
    context.check();
    const Data a = store(first), b = store(second);
    const auto both = [&](Boolean boolean, const Data& x, const Data& y) {
      return combine(boolean, x, y, context);
    };
    const Data united = both(Boolean::unite, a, b);
    const FloatHermite plain_a = read(a), plain_union = read(united);
    crossings += plain_union.crossings.size();
    involution += differences(plain_a, read(complement(complement(a, context), context)));
    const Data by_complements =
        complement(both(Boolean::intersect, complement(a, context), complement(b, context)), context);
    de_morgan += differences(plain_union, read(by_complements));
    commutes += differences(plain_union, read(both(Boolean::unite, b, a)));
    idempotent += differences(plain_a, read(both(Boolean::unite, a, a)));
    self_difference += read(both(Boolean::subtract, a, a)).crossings.size();
  }
  MeasuredRow row{"laws", label};
  row.values = {{"pairs", pairs.made.size()},
                {"crossings", crossings},
                {"involution", involution},
                {"de_morgan", de_morgan},
                {"commutes", commutes},
                {"idempotent", idempotent},
                {"self_difference", self_difference}};
  if (must_hold && involution + de_morgan + commutes + idempotent + self_difference > 0)
    row.broken.push_back(label + ": a law does not hold");
  rows.push_back(std::move(row));
}

template <class Voxel>
void count_dense_violations(const std::string& label, bool must_hold, Pairs& pairs,
                            std::vector<MeasuredRow>& rows) {
  RunContext& context = pairs.input.context;
  count_violations<DenseHermite<Voxel>>(
      label, must_hold, pairs, [&](const FloatHermite& data) { return to_dense<Voxel>(data, context); },
      [&](const DenseHermite<Voxel>& data) { return to_sparse(data, context); }, rows);
}

std::vector<MeasuredRow> measure_laws(const MeasurementInput& input) {
  RunContext& context = input.context;
  Pairs pairs{input};
  std::vector<MeasuredRow> rows;
  count_violations<FloatHermite>(
      "sparse, float", true, pairs, [](const FloatHermite& data) { return data; },
      [](const FloatHermite& data) { return data; }, rows);
  count_violations<PackedHermite>(
      "sparse, packed", true, pairs,
      [&](const FloatHermite& data) { return pack(data, NormalCodeId::octahedral, context); },
      [&](const PackedHermite& data) { return unpack(data, context); }, rows);
  count_dense_violations<FloatVoxel>("voxels, float", true, pairs, rows);
  count_dense_violations<FixedVoxel>("voxels, fixed", true, pairs, rows);
  count_dense_violations<ThesisVoxel>("voxels, thesis (eq. 7.1)", false, pairs, rows);
  return rows;
}

// ---- Two scans.

/// `mesh` scaled and moved so that its box has the length of `to`'s and lies beside it by a third of that, on
/// the same origin and so on the same lattice.
PolygonMesh beside(const PolygonMesh& mesh, const PolygonMesh& to) {
  const Bounds own = bounds(mesh), other = bounds(to);
  const double scale = other.size().maxCoeff() / own.size().maxCoeff();
  const Vector3d centre = 0.5 * (own.lower + own.upper);
  const Vector3d target = 0.5 * (other.lower + other.upper) + Vector3d(other.size().maxCoeff() / 3.0, 0, 0);
  PolygonMesh result = mesh;
  result.origin = to.origin;
  for (auto& point : result.points)
    point = (scale * (point.cast<double>() + mesh.origin - centre) + target - to.origin).cast<float>();
  return result;
}

PackedHermite packed_of(const PolygonMesh& mesh, double voxel_size, const MeasurementInput& input) {
  const LevelSet level_set = voxelized(mesh, {.voxel_size = voxel_size}, input);
  return pack(sample_polygons(level_set, 0.0, mesh, input.context), NormalCodeId::octahedral, input.context);
}

MeasuredRow judged(const std::string& label, const PackedHermite& data, double voxel_size,
                   const MeasurementInput& input) {
  RunContext& context = input.context;
  const FloatHermite hermite = unpack(data, context);
  const PolygonMesh mesh = dual_contouring(view_of(hermite, context), {}, context);
  const Promises promises = find_variant(input.tables.extractors, "dual-contouring").promises;
  const auto& [report, check] = judge(to_mesh_file(mesh), promises, kPromisesAlone, context);
  MeasuredRow row{"scans", label};
  row.values = {{"crossings", data.crossings.size()},
                {"triangles", mesh.triangle_count()},
                {"boundary", report.boundary_edges},
                {"non_manifold_edges", report.non_manifold_edges},
                {"non_manifold_vertices", report.non_manifold_vertices},
                {"inconsistent", report.inconsistent_edges},
                {"self_intersections", report.self_intersections ? report.self_intersections->pairs : -1},
                {"components", report.components},
                {"volume", report.volume / std::pow(voxel_size, 3)}};
  for (const std::string& broken : check.broken) row.broken.push_back(label + ": " + broken);
  return row;
}

/// All of them if one is wanted, for volumes are set against one another.
std::vector<MeasuredRow> measure_scans(const MeasurementInput& input) {
  constexpr const char* kLabels[] = {"A", "B", "A ∪ B", "A ∩ B", "A \\ B", "B \\ A"};
  if (!input.wants_any("scans", kLabels)) return {};
  RunContext& context = input.context;
  const PolygonMesh first = input.tables.load(input.parameters.text("first"), context).mesh;
  const PolygonMesh second = beside(input.tables.load(input.parameters.text("second"), context).mesh, first);
  const double voxel_size = bounds(first).size().maxCoeff() / input.parameters.number("resolution");
  const PackedHermite a = packed_of(first, voxel_size, input), b = packed_of(second, voxel_size, input);
  const auto row = [&](const std::string& label, const PackedHermite& data) {
    return judged(label, data, voxel_size, input);
  };
  std::vector<MeasuredRow> rows = {row(kLabels[0], a),
                                   row(kLabels[1], b),
                                   row(kLabels[2], combine(Boolean::unite, a, b, context)),
                                   row(kLabels[3], combine(Boolean::intersect, a, b, context)),
                                   row(kLabels[4], combine(Boolean::subtract, a, b, context)),
                                   row(kLabels[5], combine(Boolean::subtract, b, a, context))};
  // Each volume except for the part between the surfaces in the cells along the seam.
  const auto volume = [&](int i) { return rows[std::size_t(i)].values["volume"].get<double>(); };
  rows[2].values["ledger"] = volume(2) + volume(3) - volume(0) - volume(1);
  rows[4].values["ledger"] = volume(4) + volume(3) - volume(0);
  rows[5].values["ledger"] = volume(5) + volume(3) - volume(1);
  return rows;
}

}  // namespace

std::vector<MeasuredRow> measure_hermite_csg(const MeasurementInput& input) {
  std::vector<MeasuredRow> rows = measure_laws(input);
  for (MeasuredRow& row : measure_scans(input)) rows.push_back(std::move(row));
  return rows;
}

}  // namespace hermesh
