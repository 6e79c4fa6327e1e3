#include "algorithms/voxelization/outputs/lost_surface.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <vector>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/search/triangle_tree.h"
#include "algorithms/voxelization/distance/index_soup.h"
#include "algorithms/voxelization/hermesh_voxelizer.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

constexpr double kMostPlaces = 200'000;      ///< if every triangle is larger than its share
constexpr std::size_t kMostProbes = 20'000;  ///< lost points whose thickness is measured
constexpr std::size_t kTrianglesPerTask = 4096;
constexpr double kReach = 2.0;          ///< voxels: the largest distance of an opposite wall
constexpr double kOff = 1e-4;           ///< voxels: start of the segment to it
constexpr double kSameDistance = 1e-3;  ///< voxels: tolerance of a sample's distance to the point's polygon
constexpr double kNoWall = 1e-3;        ///< voxels: the least thickness of a wall that could be preserved

/// A point of the surface without a change of sign around it.
struct LostPlace {
  Vector3d at, normal;  ///< voxels; of unit length
};

/// The result for a part of the triangles.
struct Part {
  double area = 0.0, lost_area = 0.0;  ///< voxels²
  std::vector<LostPlace> places;
};

/// One run of find_lost_surface(). It works in voxels of the grid.
class Search {
 public:
  Search(const PolygonMesh& mesh, const LevelSet& level_set, bool boundary_distances,
         const RunContext& context)
      : mesh_(mesh),
        triangles_(triangulated(mesh)),
        grid_(*level_set.grid().grid),
        voxel_size_(level_set.voxel_size()),
        scale_(1.0 / voxel_size_),
        boundary_distances_(boundary_distances),
        context_(context) {
    const openvdb::Vec3d origin =
        grid_.transform().worldToIndex(openvdb::Vec3d(mesh.origin.x(), mesh.origin.y(), mesh.origin.z()));
    origin_ = {origin.x(), origin.y(), origin.z()};
  }

  LostSurface run() {
    // The area that a point represents: a voxel², or more if there would be too many points.
    const double share = std::max(1.0, total_area() / kMostPlaces);
    std::vector<Part> parts((triangles_.size() + kTrianglesPerTask - 1) / kTrianglesPerTask);
    tbb::parallel_for(std::size_t(0), parts.size(), [&](std::size_t i) {
      context_.check();
      auto samples = grid_.getConstUnsafeAccessor();
      for (std::size_t t = i * kTrianglesPerTask;
           t < std::min(triangles_.size(), (i + 1) * kTrianglesPerTask); ++t)
        look(Facet(corner(t, 0), corner(t, 1), corner(t, 2)), share, samples, parts[i]);
    });
    LostSurface result;
    // One thread adds up the parts of fixed size: the sums are the same at any thread count.
    std::vector<LostPlace> places;
    for (const Part& part : parts) {
      result.area += part.area * voxel_size_ * voxel_size_;
      result.lost_area += part.lost_area * voxel_size_ * voxel_size_;
      places.insert(places.end(), part.places.begin(), part.places.end());
    }
    if (!places.empty()) find_thinnest(places, result);
    return result;
  }

 private:
  using Samples = openvdb::FloatGrid::ConstUnsafeAccessor;

  /// Returns a corner in voxels of the grid.
  Vector3d corner(std::size_t triangle, std::size_t i) const {
    return origin_ + scale_ * mesh_.points[triangles_[triangle][i]].cast<double>();
  }

  /// Returns the area of the mesh in voxels², summed by parts of a fixed size.
  double total_area() const {
    std::vector<double> area((triangles_.size() + kTrianglesPerTask - 1) / kTrianglesPerTask, 0.0);
    tbb::parallel_for(std::size_t(0), area.size(), [&](std::size_t i) {
      for (std::size_t t = i * kTrianglesPerTask;
           t < std::min(triangles_.size(), (i + 1) * kTrianglesPerTask); ++t) {
        const auto [a, b, c] = triangles_[t];
        const Facet facet(mesh_.points[a].cast<double>(), mesh_.points[b].cast<double>(),
                          mesh_.points[c].cast<double>());
        area[i] += 0.5 * facet.normal().norm();
      }
    });
    return std::accumulate(area.begin(), area.end(), 0.0) / (voxel_size_ * voxel_size_);
  }

  /// Classifies points of a triangle: its middle, or the points of Roberts' sequence R2, which fill it evenly
  /// whatever their number.
  void look(const Facet& facet, double share, Samples& samples, Part& part) const {
    const Vector3d normal = facet.normal();
    const double area = 0.5 * normal.norm();
    if (!(area > 0.0)) return;
    const auto count = static_cast<std::uint64_t>(std::ceil(area / share));
    const double weight = area / double(count);
    for (std::uint64_t i = 0; i < count; ++i) {
      double u = 1.0 / 3.0, v = 1.0 / 3.0;
      if (count > 1) {
        u = std::fmod(0.5 + double(i) * 0.7548776662466927, 1.0);
        v = std::fmod(0.5 + double(i) * 0.5698402909980532, 1.0);
        // The far half of the parallelogram folds onto the triangle.
        if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
      }
      const Vector3d at =
          facet.corner[0] + u * (facet.corner[1] - facet.corner[0]) + v * (facet.corner[2] - facet.corner[0]);
      const Verdict verdict = look_around(at, samples);
      if (verdict == Verdict::inner) continue;
      part.area += weight;
      if (verdict == Verdict::kept) continue;
      part.lost_area += weight;
      part.places.push_back({at, normal / (2.0 * area)});
    }
  }

  /// A point is shown by the level set, lost, or within the solid.
  enum class Verdict { kept, lost, inner };

  /// Classifies a point by the samples of its cell and of the ring of cells around it.
  Verdict look_around(const Vector3d& at, Samples& samples) const {
    const openvdb::Coord cell(int(std::floor(at.x())), int(std::floor(at.y())), int(std::floor(at.z())));
    // Two thirds of the cells have their corners in one leaf.
    const bool is_in_one_leaf = (cell.x() & 7) != 7 && (cell.y() & 7) != 7 && (cell.z() & 7) != 7;
    if (const auto* leaf = samples.probeConstLeaf(cell); leaf && is_in_one_leaf) {
      const float* values = leaf->buffer().data() + leaf->coordToOffset(cell);
      const bool inside = values[0] < 0.0f;
      for (const int next : {1, 8, 9, 64, 65, 72, 73})
        if ((values[next] < 0.0f) != inside) return Verdict::kept;
    }
    const bool inside = samples.getValue(cell) < 0.0f;
    const auto differs = [&](int low, int high) {
      for (int x = low; x <= high; ++x)
        for (int y = low; y <= high; ++y)
          for (int z = low; z <= high; ++z)
            if ((samples.getValue(cell.offsetBy(x, y, z)) < 0.0f) != inside) return true;
      return false;
    };
    // Samples −1 to 2 on each axis include all within a voxel of the point.
    if (differs(0, 1) || differs(-1, 2)) return Verdict::kept;
    if (!inside) return Verdict::lost;
    if (!boundary_distances_) return Verdict::inner;
    // No sample is deeper than its distance to the point, if the polygon bounds the solid.
    for (int i = 0; i < 8; ++i) {
      const openvdb::Coord sample = cell.offsetBy(i & 1, i >> 1 & 1, i >> 2);
      const double away = (Vector3d(sample.x(), sample.y(), sample.z()) - at).norm();
      if (-samples.getValue(sample) / voxel_size_ > away + kSameDistance) return Verdict::inner;
    }
    return Verdict::lost;
  }

  /// Measures the gaps at an even share of the lost points, and stores the least.
  void find_thinnest(const std::vector<LostPlace>& places, LostSurface& result) const {
    const std::size_t step = (places.size() + kMostProbes - 1) / kMostProbes;
    std::vector<LostPlace> probes;
    for (std::size_t i = 0; i < places.size(); i += step) probes.push_back(places[i]);
    const std::vector<Triangle> about = triangles_about(probes);
    const TriangleTree tree(mesh_.points, about, 1.0 / voxel_size_);
    std::vector<double> thickness(probes.size(), kReach);
    tbb::parallel_for(std::size_t(0), probes.size(), [&](std::size_t i) {
      context_.check();
      // A wall's other side is behind the point, a gap's in front of it.
      for (const double side : {-1.0, 1.0})
        thickness[i] = std::min(thickness[i], gap(tree, probes[i].at - origin_, side * probes[i].normal));
    });
    // The first of equal ones, independent of the thread schedule.
    const auto least = std::min_element(thickness.begin(), thickness.end());
    if (*least >= kReach) return;
    const Vector3d& at = probes[std::size_t(least - thickness.begin())].at;
    const openvdb::Vec3d world = grid_.transform().indexToWorld(openvdb::Vec3d(at.x(), at.y(), at.z()));
    result.thinnest_at = {world.x(), world.y(), world.z()};
    result.thickness = *least * voxel_size_;
  }

  /// Returns the triangles that may be within reach of one of the points: a tree of all triangles would take
  /// longer than the search if little is lost.
  std::vector<Triangle> triangles_about(const std::vector<LostPlace>& places) const {
    // Cells as long as the reach: a triangle within reach of a point, and no longer than the reach, has all
    // corners within two cells of the point's.
    const auto cell_of = [](const Vector3d& at) {
      return openvdb::Coord(int(std::floor(at.x() / kReach)), int(std::floor(at.y() / kReach)),
                            int(std::floor(at.z() / kReach)));
    };
    openvdb::MaskTree cells;
    for (const LostPlace& place : places) {
      const openvdb::Coord cell = cell_of(place.at);
      cells.fill(openvdb::CoordBBox(cell.offsetBy(-2), cell.offsetBy(2)), true);
    }
    std::vector<std::uint8_t> near(mesh_.points.size());
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, near.size(), kTrianglesPerTask), [&](const auto& range) {
          const openvdb::tree::ValueAccessor<const openvdb::MaskTree> marked(cells);
          for (std::size_t i = range.begin(); i < range.end(); ++i)
            near[i] = marked.isValueOn(cell_of(origin_ + scale_ * mesh_.points[i].cast<double>()));
        });
    std::vector<Triangle> result;
    const auto longest = static_cast<float>(kReach * voxel_size_);
    for (const Triangle& t : triangles_) {
      const Eigen::Vector3f &a = mesh_.points[t[0]], &b = mesh_.points[t[1]], &c = mesh_.points[t[2]];
      // A triangle longer than a cell may be near a point with all corners far from it.
      const bool is_long = (a.cwiseMax(b).cwiseMax(c) - a.cwiseMin(b).cwiseMin(c)).maxCoeff() > longest;
      if (near[t[0]] | near[t[1]] | near[t[2]] | is_long) result.push_back(t);
    }
    return result;
  }

  /// Returns the distance in voxels from the point along a unit vector to the next triangle, at most kReach.
  /// Starts a little off the point, so that its own triangle does not count.
  static double gap(const TriangleTree& tree, const Vector3d& place, const Vector3d& along) {
    const Vector3d from = place + kOff * along, to = place + kReach * along;
    constexpr double kMargin = 1e-6;  // above the rounding of the boxes
    double nearest = 1.0;
    tree.for_each_near(
        from.cwiseMin(to).array() - kMargin, from.cwiseMax(to).array() + kMargin, [&](std::uint32_t t) {
          const double part =
              meeting(from, to, Facet(tree.corner(t, 0), tree.corner(t, 1), tree.corner(t, 2)));
          if (part >= 0.0) nearest = std::min(nearest, part);
        });
    return kOff + nearest * (kReach - kOff);
  }

  const PolygonMesh& mesh_;
  const std::vector<Triangle> triangles_;
  const openvdb::FloatGrid& grid_;
  double voxel_size_, scale_;
  Vector3d origin_;  ///< of the mesh, in voxels of the grid
  bool boundary_distances_;
  const RunContext& context_;
};

std::string short_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

}  // namespace

LostSurface find_lost_surface(const PolygonMesh& mesh, const LevelSet& level_set,
                              bool distances_are_to_the_boundary, const RunContext& context) {
  // Distances without sign, and fog, have no changes of sign.
  if (mesh.triangle_count() == 0 || level_set.grid().grid->getGridClass() != openvdb::GRID_LEVEL_SET)
    return {};
  return Search(mesh, level_set, distances_are_to_the_boundary, context).run();
}

bool leaves_out_inner_polygons(const Voxelizer& voxelizer) { return voxelizer.voxelize == hermesh_voxelizer; }

std::string lost_surface_note(const LostSurface& lost, double voxel_size) {
  if (!(lost.lost_area > 0.0)) return {};
  std::string note = short_text(100.0 * lost.share()) +
                     " % of the area of the polygons that bound the solid has no surface within a voxel of " +
                     short_text(voxel_size) + ": walls or gaps that are thinner";
  if (!(lost.thickness > 0.0)) return note;
  note += "; the thinnest place found is " + short_text(lost.thickness) + " thick, at (" +
          short_text(lost.thinnest_at.x()) + ", " + short_text(lost.thinnest_at.y()) + ", " +
          short_text(lost.thinnest_at.z()) + ")";
  // Where polygons nearly touch, as at the tips of needles, no practical voxel size separates them.
  if (lost.thickness < kNoWall * voxel_size) return note;
  // Rounded down, for a wall exactly a voxel thick is the thinnest that is preserved.
  const double digit = std::pow(10.0, std::floor(std::log10(lost.thickness)) - 2.0);
  return note + ", and voxels of " + short_text(std::floor(lost.thickness / digit) * digit) +
         " would keep it";
}

void note_lost_surface(const PolygonMesh& mesh, const LevelSet& level_set, const Voxelizer& voxelizer,
                       RunContext& context) {
  const LostSurface lost = find_lost_surface(mesh, level_set, leaves_out_inner_polygons(voxelizer), context);
  context.figure("lost_surface_share", lost.share());
  context.figure("lost_surface_thickness", lost.thickness);
  const std::string note = lost_surface_note(lost, level_set.voxel_size());
  if (!note.empty()) context.note(note);
}

}  // namespace hermesh
