#include "reference/level_set_judge.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <unordered_set>

#include "algorithms/core/level_set_grid.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using openvdb::Coord;

constexpr std::size_t kPlaces = 10;

Coord to_coord(const VoxelIndex& v) { return {v[0], v[1], v[2]}; }
Vector3d position(const VoxelIndex& v) { return {double(v[0]), double(v[1]), double(v[2])}; }
/// The reach (voxels) up to which a block's distances are exact: no voxel of a chosen block can be farther
/// away.
double block_reach(double band) { return band + 2.0 * 3.5 * std::sqrt(3.0) + 1.0; }

struct DrawnVoxel {
  VoxelIndex voxel;
  double distance;
};

/// Draws voxels about points that are spread evenly over the area, until enough of them lie within the band.
/// Equal seeds draw equal voxels; they are returned in the order of their indices.
class Draw {
 public:
  Draw(const DistanceOracle& surface, const VoxelSelection& selection)
      : surface_(surface), selection_(selection) {
    double sum = 0.0;
    for (const auto& [a, b, c] : surface.triangles())
      area_before_.push_back(sum += (b - a).cross(c - a).norm());
    random_.seed(selection.seed);
  }

  std::vector<DrawnVoxel> run(const RunContext& context) {
    std::vector<DrawnVoxel> drawn;
    std::int64_t within = 0;
    // A surface may have fewer voxels about it than were asked for; twenty rounds find nearly all of those.
    for (int round = 0; round < 20 && within < selection_.samples; ++round) {
      const std::size_t first = drawn.size();
      add_new(drawn);
      tbb::parallel_for(first, drawn.size(), [&](std::size_t i) {
        context.check();
        drawn[i].distance = surface_.distance(position(drawn[i].voxel));
      });
      for (std::size_t i = first; i < drawn.size(); ++i)
        within += drawn[i].distance < selection_.band ? 1 : 0;
    }
    std::sort(drawn.begin(), drawn.end(),
              [](const DrawnVoxel& a, const DrawnVoxel& b) { return a.voxel < b.voxel; });
    return drawn;
  }

 private:
  /// A random number in [0, 1). It is the same with every standard library, which the library's own
  /// distributions are not.
  double uniform() { return double(random_() >> 11) * 0x1p-53; }

  void add_new(std::vector<DrawnVoxel>& drawn) {
    const double half = selection_.band + 1.0;
    for (std::int64_t i = 0; i < selection_.samples; ++i) {
      const auto triangle =
          std::upper_bound(area_before_.begin(), area_before_.end(), uniform() * area_before_.back()) -
          area_before_.begin();
      const auto& [a, b, c] = surface_.triangles()[std::min(std::size_t(triangle), area_before_.size() - 1)];
      const double root = std::sqrt(uniform()), share = uniform();
      Vector3d p = (1.0 - root) * a + root * (1.0 - share) * b + root * share * c;
      for (int axis = 0; axis < 3; ++axis) p[axis] += half * (2.0 * uniform() - 1.0);
      const VoxelIndex voxel = {int(std::lround(p.x())), int(std::lround(p.y())), int(std::lround(p.z()))};
      if (seen_.insert(key(voxel)).second) drawn.push_back({voxel, 0.0});
    }
  }
  static std::uint64_t key(const VoxelIndex& v) {
    return (std::uint64_t(v[0] + (1 << 20)) << 42) ^ (std::uint64_t(v[1] + (1 << 20)) << 21) ^
           std::uint64_t(v[2] + (1 << 20));
  }

  const DistanceOracle& surface_;
  VoxelSelection selection_;
  std::vector<double> area_before_;
  std::mt19937_64 random_;
  std::unordered_set<std::uint64_t> seen_;
};

/// The statistics of a part of the voxels. Parts are added in their order, so that sums do not depend on the
/// threads.
struct Tally {
  std::int64_t compared = 0, coarse = 0, stray = 0;
  double squares = 0.0, max = 0.0;
  std::vector<VoxelFinding> off, strays, missing;

  void look(const VoxelIndex& voxel, double truth, double value, bool active, double exterior,
            double interior) {
    const double width = value < 0.0 ? interior : exterior;
    const VoxelFinding finding{voxel, truth, std::abs(value), active};
    if (!active) {
      if (truth < width - DistanceReport::kFine) missing.push_back(finding);
      return;
    }
    const double error = std::abs(finding.value - truth);
    ++compared;
    // A value that is not a number counts as the worst error.
    const bool fine = error <= DistanceReport::kFine;
    if (std::isfinite(error)) {
      squares += error * error;
      max = std::max(max, error);
    } else {
      max = std::numeric_limits<double>::infinity();
    }
    if (!fine) off.push_back(finding);
    if (!(error <= DistanceReport::kCoarse)) ++coarse;
    if (truth < width + DistanceReport::kFine) return;
    ++stray;
    if (strays.size() < kPlaces) strays.push_back(finding);
  }

  void add(const Tally& other) {
    compared += other.compared;
    coarse += other.coarse;
    stray += other.stray;
    squares += other.squares;
    max = std::max(max, other.max);
    for (auto list : {&Tally::off, &Tally::strays, &Tally::missing})
      (this->*list).insert((this->*list).end(), (other.*list).begin(), (other.*list).end());
  }
};

double error_of(const VoxelFinding& finding) { return std::abs(finding.value - finding.truth); }

/// Calls f(begin, end, tally) for parts of 0…n−1 in parallel and adds the tallies up.
template <class F>
Tally tally_parts(std::size_t n, std::size_t part, const RunContext& context, F&& f) {
  std::vector<Tally> tallies((n + part - 1) / part);
  tbb::parallel_for(std::size_t(0), tallies.size(), [&](std::size_t i) {
    context.check();
    f(i * part, std::min(n, (i + 1) * part), tallies[i]);
  });
  Tally total;
  for (const Tally& tally : tallies) total.add(tally);
  return total;
}

void check_placement(const openvdb::FloatGrid& grid, const Vector3d& origin) {
  const openvdb::Vec3d at = grid.transform().indexToWorld(openvdb::Vec3d(0.0));
  const double off = (Vector3d(at.x(), at.y(), at.z()) - origin).norm();
  if (off > 1e-9 * grid.voxelSize()[0] * std::max(1.0, origin.norm() / grid.voxelSize()[0]))
    throw Error(
        "the level set's samples do not lie at multiples of the voxel from the mesh's origin, so nothing "
        "can be said of its values");
}

}  // namespace

DistanceTruth::DistanceTruth(const DistanceOracle& surface, const WindingOracle& solid,
                             const VoxelSelection& selection, const RunContext& context)
    : surface_(surface), solid_(solid) {
  if (selection.samples > 0) {
    for (const DrawnVoxel& drawn : Draw(surface, selection).run(context))
      samples_.push_back({drawn.voxel, drawn.distance});
    return;
  }
  const std::vector<VoxelIndex> origins = surface.blocks_within(selection.band, context);
  blocks_.resize(origins.size());
  tbb::parallel_for(std::size_t(0), origins.size(), [&](std::size_t i) {
    context.check();
    const auto distances = block_distances(surface, origins[i], block_reach(selection.band));
    blocks_[i].origin = origins[i];
    std::transform(distances.begin(), distances.end(), blocks_[i].distance.begin(),
                   [](double d) { return float(d); });
  });
}

DistanceReport DistanceTruth::judge(const LevelSet& level_set, const Vector3d& origin, double exterior_band,
                                    double interior_band, const RunContext& context) const {
  const openvdb::FloatGrid& grid = *level_set.grid().grid;
  check_placement(grid, origin);
  const openvdb::FloatTree& tree = grid.tree();
  const double voxel_size = level_set.voxel_size();
  const auto look = [&](Tally& tally, const VoxelIndex& voxel, double truth) {
    const Coord at = to_coord(voxel);
    tally.look(voxel, truth, double(tree.getValue(at)) / voxel_size, tree.isValueOn(at), exterior_band,
               interior_band);
  };
  Tally total;
  if (!samples_.empty()) {
    total =
        tally_parts(samples_.size(), 4096, context, [&](std::size_t begin, std::size_t end, Tally& tally) {
          for (std::size_t i = begin; i < end; ++i) look(tally, samples_[i].voxel, samples_[i].distance);
        });
  } else {
    total = tally_parts(blocks_.size(), 16, context, [&](std::size_t begin, std::size_t end, Tally& tally) {
      for (std::size_t i = begin; i < end; ++i)
        for (int voxel = 0; voxel < kBlockVoxels; ++voxel) {
          const VoxelIndex& first = blocks_[i].origin;
          look(tally, {first[0] + (voxel >> 6), first[1] + (voxel >> 3 & 7), first[2] + (voxel & 7)},
               double(blocks_[i].distance[std::size_t(voxel)]));
        }
    });
    // Active voxels outside of the blocks are farther away than the band is wide.
    total.stray += std::int64_t(grid.activeVoxelCount()) - total.compared;
  }
  DistanceReport report;
  report.compared = total.compared;
  report.max = total.max;
  report.rms = total.compared ? std::sqrt(total.squares / double(total.compared)) : 0.0;
  report.fine = std::int64_t(total.off.size());
  report.coarse = total.coarse;
  report.stray = total.stray;
  classify(total.off, total.missing, report, context);
  const auto list = [&](const std::vector<VoxelFinding>& findings) {
    for (const VoxelFinding& finding : findings)
      if (report.places.size() < kPlaces) report.places.push_back(finding);
  };
  list(total.off);
  list(total.missing);
  list(total.strays);
  return report;
}

/// Classifies the findings by the location of their nearest point, and sorts them: those on the boundary
/// first, and among these the worst first.
void DistanceTruth::classify(std::vector<VoxelFinding>& off, std::vector<VoxelFinding>& missing,
                             DistanceReport& report, const RunContext& context) const {
  constexpr std::size_t kMost = 20'000;
  const auto thinned = [&](std::vector<VoxelFinding>& findings) {
    std::stable_sort(findings.begin(), findings.end(),
                     [](const VoxelFinding& a, const VoxelFinding& b) { return error_of(a) > error_of(b); });
    const std::size_t step = (findings.size() + kMost - 1) / kMost;
    std::vector<VoxelFinding> some;
    for (std::size_t i = 0; i < findings.size(); i += step) some.push_back(findings[i]);
    tbb::parallel_for(std::size_t(0), some.size(), [&](std::size_t i) {
      context.check();
      some[i].bounds_solid = solid_.bounds_solid(surface_, surface_.nearest_point(position(some[i].voxel)));
    });
    std::stable_partition(some.begin(), some.end(), [](const VoxelFinding& f) { return f.bounds_solid; });
    const std::size_t all = findings.size();
    findings = std::move(some);
    return all;
  };
  thinned(off);
  report.classified = std::int64_t(off.size());
  for (const VoxelFinding& finding : off) {
    ++(finding.bounds_solid ? report.on_boundary : report.on_inner_sheet);
    double& max = finding.bounds_solid ? report.on_boundary_max : report.on_inner_sheet_max;
    max = std::max(max, error_of(finding));
  }
  // Of a thinned list the shares are known, and the counts by them.
  const std::size_t all = thinned(missing);
  const auto inner = std::size_t(
      std::count_if(missing.begin(), missing.end(), [](const VoxelFinding& f) { return !f.bounds_solid; }));
  const double share = missing.empty() ? 0.0 : double(inner) / double(missing.size());
  report.missing_inner_sheet = std::llround(share * double(all));
  report.missing = std::int64_t(all) - report.missing_inner_sheet;
}

SignTruth::SignTruth(const DistanceOracle& surface, const WindingOracle& winding, SignOracle oracle,
                     const VoxelSelection& selection, const RunContext& context) {
  const auto keep = [&](double distance) { return distance > kNear && distance < selection.band; };
  if (selection.samples > 0) {
    std::vector<DrawnVoxel> drawn = Draw(surface, selection).run(context);
    std::erase_if(drawn, [&](const DrawnVoxel& d) { return !keep(d.distance); });
    std::vector<signed char> side(drawn.size());  // −1 inside, 1 outside, 0 undecided
    tbb::parallel_for(std::size_t(0), drawn.size(), [&](std::size_t i) {
      context.check();
      const Vector3d at = position(drawn[i].voxel);
      const DistanceOracle::Vote vote =
          oracle == SignOracle::kWinding ? DistanceOracle::Vote{} : surface.parity(at);
      const bool inside = oracle == SignOracle::kWinding ? winding.inside(at) : vote.inside();
      const bool decided = oracle != SignOracle::kUnanimousParity || vote.unanimous();
      side[i] = !decided ? 0 : inside ? -1 : 1;
    });
    for (std::size_t i = 0; i < drawn.size(); ++i)
      if (side[i] == 0)
        ++undecided_;
      else
        samples_.push_back({drawn[i].voxel, float(side[i] * drawn[i].distance)});
    return;
  }
  if (oracle != SignOracle::kParity) throw Error("the signs of all voxels can be judged by parity alone");
  const std::vector<VoxelIndex> origins = surface.blocks_within(selection.band, context);
  std::vector<std::vector<Sample>> found(origins.size());
  tbb::parallel_for(std::size_t(0), origins.size(), [&](std::size_t i) {
    context.check();
    const auto distances = block_distances(surface, origins[i], block_reach(selection.band));
    const auto inside = block_inside(origins[i], distances,
                                     [&](const Vector3d& place) { return surface.parity(place).inside(); });
    for (int v = 0; v < kBlockVoxels; ++v) {
      const auto at = std::size_t(v);
      if (!keep(distances[at])) continue;
      const VoxelIndex& o = origins[i];
      found[i].push_back({{o[0] + (v >> 6), o[1] + (v >> 3 & 7), o[2] + (v & 7)},
                          float(inside[at] ? -distances[at] : distances[at])});
    }
  });
  for (const std::vector<Sample>& part : found) samples_.insert(samples_.end(), part.begin(), part.end());
}

SignReport SignTruth::judge(const LevelSet& level_set) const {
  const openvdb::FloatGrid& grid = *level_set.grid().grid;
  const auto accessor = grid.getConstAccessor();
  SignReport report;
  report.undecided = undecided_;
  for (const Sample& sample : samples_) {
    const bool inside = sample.signed_distance < 0.0f;
    const float value = accessor.getValue(to_coord(sample.voxel));
    ++(inside ? report.inside : report.outside);
    if ((value < 0.0f) == inside) continue;
    ++(inside ? report.wrong_inside : report.wrong_outside);
    if (report.places.size() < kPlaces)
      report.places.push_back({sample.voxel, double(sample.signed_distance),
                               double(value) / level_set.voxel_size(),
                               accessor.isValueOn(to_coord(sample.voxel)), true});
  }
  return report;
}

}  // namespace hermesh
