#include "algorithms/remesh/bounded_remesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <utility>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/one_progress.h"
#include "algorithms/core/parallel.h"
#include "algorithms/extraction/certified_collapse/certified_decimation.h"
#include "algorithms/extraction/certified_mesh.h"
#include "algorithms/extraction/embedded_mesh/uniform_mesh.h"
#include "algorithms/hermite/hermite_view.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/lattice/memory_estimate.h"
#include "algorithms/remesh/solid_surface.h"
#include "algorithms/remesh/wall_width.h"
#include "algorithms/search/surface_distance.h"
#include "algorithms/voxelization/inside/oriented_winding.h"
#include "algorithms/voxelization/voxelize.h"

namespace hermesh {
namespace {

// Shares of the error. A uniform mesh that is within kUniform of it leaves the collapses the rest; points of
// both surfaces tell only nearly how far these are apart, which kUnseen allows for.
constexpr double kUniform = 0.6, kUsed = 0.97, kUnseen = 1.1;
/// In errors: what points may be apart at most, and from where on distances are not told apart.
constexpr double kNear = 0.85, kFarthest = 4.0;
/// Voxels of the first try that looks for what is thin and, where nobody says so, the smallest, in errors.
constexpr double kFirstVoxel = 1.5, kSmallestVoxel = 0.125;
/// How much larger voxels must be than these to be worth a try, for shapes that are plane or smooth; how many
/// tries there are in which all but a few places are near, and the voxels of the next one, in those of this
/// one.
constexpr double kWorthLarger = 2.0, kNextLarger = 0.8;
constexpr int kLargerTries = 4;
/// Share of the error that such a voxel's uniform mesh may use up in the mean: triangles are about as many
/// more.
constexpr double kLittle = 0.02;
/// Points of it that are asked first whether it does.
constexpr std::size_t kAskedFirst = 1000;
/// Voxels along the longest side at least, so that there is something to collapse.
constexpr double kFewestVoxels = 16.0;
/// Voxels of the next try where points did not tell what is too far, in those of this one.
constexpr double kFinerBetween = 0.6;
/// Least tolerance of what is collapsed again, in errors, and the triangles that must be left of it for
/// another time.
constexpr double kLeastShare = 0.02, kWorthAgain = 0.95;
/// A tolerance that was lowered below this many voxels is of no more use.
constexpr double kLeastTolerance = 0.02;
/// Memory that a point of the uniform mesh takes until it is written, bytes.
constexpr double kBytesOfPoint = 400.0;
/// How often tolerances are lowered before voxels are made smaller.
constexpr int kLowerings = 3;
constexpr float kLowering = 0.4f;
/// Voxels that a wall has to be thick so that a mesh may show it, and the voxel that is tried for a
/// thickness.
constexpr double kThinVoxels = 2.0, kVoxelOfThickness = 0.9;
/// Places at most that are asked how thick the surface is there.
constexpr std::size_t kMostAsked = 500;
/// Radius of the pieces of polygons that are asked whether they bound something, in errors.
constexpr double kFreePiece = 1.0 / 16.0;
/// How far from a polygon its sides are looked at, in extents of the polygons: what is thinner is rounding.
constexpr double kOffSurface = 1e-6;
/// The first limit that is tried, and what is added to the largest distance that was met, in errors.
constexpr double kFirstLimit = 0.8, kLimitStep = 0.02;

/// A mesh to collapse, first the uniform one at a voxel size, and the surface that it stands for.
struct Attempt {
  double voxel_size;
  std::shared_ptr<const SolidSurface> surface;
  FilePoints file;
  FineMesh fine;                             ///< index space
  std::vector<Eigen::Vector3f> file_points;  ///< world units relative to the placement's origin
  Eigen::Vector3d offset;                    ///< of the placement's origin from the mesh's, world units

  /// A point of the uniform mesh in the frame of the input's origin.
  Eigen::Vector3d place(std::size_t point) const { return offset + file_points[point].cast<double>(); }
  std::vector<Eigen::Vector3f> in_file(const std::vector<Eigen::Vector3d>& points) const {
    std::vector<Eigen::Vector3f> result(points.size());
    std::transform(points.begin(), points.end(), result.begin(),
                   [&](const auto& p) { return file.in_file(p); });
    return result;
  }
};

/// A place, in the frame of the mesh's origin, where the surfaces are farther apart than they should be.
struct Far {
  Eigen::Vector3d place;
  double distance;
  bool of_surface;         ///< it lies on the polygons' surface, else on the mesh
  std::uint32_t triangle;  ///< of that surface
};

class BoundedRemesher {
 public:
  BoundedRemesher(const PolygonMesh& mesh, const BoundedRemeshOptions& options, RunContext& context)
      : mesh_(mesh),
        options_(options),
        context_(context),
        longest_(bounds(mesh).size().maxCoeff()),
        extent_(bounds(mesh).size().norm()) {
    for (const Triangle& t : triangulated(mesh)) area_ += area(mesh.points, t);
  }

  BoundedMesh run() {
    // By any other rule what is inside is not known away from the samples, and no polygon is free.
    if (options_.signs == SignRule::winding_number) {
      winding_.emplace(IndexSoup(mesh_, 1.0));
      turns_ = winding_->orientation().turns;
    }
    result_.error = options_.error;
    result_.over_holes = options_.over_holes;
    result_.voxel_size =
        std::min(std::max(kFirstVoxel * options_.error, smallest_voxel()), longest_ / kFewestVoxels);
    if (try_larger(result_.voxel_size)) return std::move(result_);
    while (!try_at(result_.voxel_size) && result_.unmet.empty()) ++result_.rounds;
    if (!result_.unmet.empty()) result_.mesh = {};
    return std::move(result_);
  }

 private:
  /// Whether the bound was reached with larger voxels than `first`, which is so where their uniform mesh
  /// already leaves the collapses nearly all of the error: of plane parts and smooth ones. A try with twice
  /// the voxels costs a quarter. Nothing is refused here: what larger voxels do not show, smaller ones may.
  bool try_larger(double first) {
    const OneProgress progress(context_, "try larger voxels");
    const std::size_t notes = context_.notes.size();
    const double largest = longest_ / kFewestVoxels, smallest = kWorthLarger * first;
    int tries = 0;
    for (double voxel_size = largest; voxel_size > smallest && tries < kLargerTries;) {
      progress.update(std::log(largest / voxel_size) / std::log(largest / smallest));
      // What a try that fails had to say is no news to the user, and the one that counts says it again.
      context_.notes.resize(notes);
      const std::optional<Attempt> made = attempt(voxel_size);
      if (!made) {
        voxel_size *= 0.5;
        continue;
      }
      const SurfaceDistance surface(made->surface->points, made->surface->triangles);
      std::vector<double> apart;
      if (const double used = share_used(*made, surface, apart); used > kLittle) {
        // Halved voxels bring a smooth surface four times as near.
        voxel_size *= std::clamp(std::sqrt(kLittle / used), 0.1, 0.7);
        continue;
      }
      if (reaches(*made, surface, apart)) {
        result_.voxel_size = voxel_size;
        note_surface(*made);
        return true;
      }
      voxel_size *= kNextLarger;
      ++tries;
    }
    context_.notes.resize(notes);
    result_.rounds = 0;
    return false;
  }

  /// The share of the error that a uniform mesh uses up in the mean over its points. `apart` says by point
  /// how far the surface is from it and from the triangles around it; where the share is more than kLittle,
  /// some points and triangles may have said so, and it is empty.
  double share_used(const Attempt& now, const SurfaceDistance& surface, std::vector<double>& apart) {
    double used = mean_share(apart_at_points(now, surface, 1 + now.file_points.size() / kAskedFirst));
    if (used <= kLittle)
      used = mean_share(apart_in_triangles(now, surface, 1 + now.fine.triangles().size() / kAskedFirst));
    if (used > kLittle) return used;
    apart = apart_around_points(now, surface);
    return mean_share(apart);
  }

  /// Whether the bound is reached from a uniform mesh that uses up little of the error in the mean.
  bool reaches(const Attempt& now, const SurfaceDistance& surface, std::vector<double>& apart) {
    if (std::ranges::max(apart) > kNear * options_.error) return false;
    const SurfaceDistance uniform(now.file_points, now.fine.triangles());
    return look(now, uniform, apart).empty() && far_between_points(now, surface, uniform).empty() &&
           collapse_all(now, surface, apart).empty();
  }

  /// Whether the bound was reached with voxels of this size. If not, result_.voxel_size is the size to try
  /// next, or result_.unmet says why there is none.
  bool try_at(double voxel_size) {
    std::optional<Attempt> made = attempt(voxel_size);
    if (!made) return smaller(voxel_size);
    const Attempt& now = *made;
    note_surface(now);
    const SurfaceDistance surface(now.surface->points, now.surface->triangles),
        uniform(now.file_points, now.fine.triangles());
    std::vector<double> apart = apart_at_points(now, surface, 1);
    if (const std::vector<Far> far = look(now, uniform, apart); !far.empty()) {
      double worst = 0.0;
      for (const Far& f : far) worst = std::max(worst, f.distance);
      if (explained(now, far)) return false;
      return smaller(voxel_size, *now.surface, std::clamp(kUniform * options_.error / worst, 0.35, 0.7), far);
    }
    // Points tell nearly, and at once. Where the uniform mesh itself is too far between them, no tolerance
    // helps, and collapses and their proof, which take most of the time, would be for nothing.
    if (const std::vector<Far> far = far_between_points(now, surface, uniform); !far.empty()) {
      if (explained(now, far)) return false;
      return smaller(voxel_size, *now.surface, kFinerBetween, far);
    }
    const std::vector<Far> far = collapse_all(now, surface, apart);
    if (far.empty()) return true;
    if (explained(now, far)) return false;
    return smaller(now.voxel_size, *now.surface, kFinerBetween, far);
  }

  void note_surface(const Attempt& now) {
    result_.hole_area = now.surface->cap_area;
    result_.left_out_area = std::max(0.0, area_ - now.surface->area);
  }

  /// Voxels and their uniform mesh; none if that is empty.
  std::optional<Attempt> attempt(double voxel_size) {
    Voxelization volume =
        voxelize(mesh_, {.voxel_size = voxel_size, .signs = options_.signs, .boundary = true}, context_);
    const bool keeps_thin = options_.thin == ThinRule::keep;
    if (!volume.is_signed && !keeps_thin)
      throw Error(
          "the polygons give no inside that a distance could be measured to (a note says why); give a sheet "
          "a thickness with hermesh voxelize --signs unsigned and hermesh extract --isovalue");
    const LevelSet level_set = make_level_set(volume.distance);
    PolygonSolid made = solid_of(mesh_, level_set, options_.thin, context_);
    FloatHermite& hermite = made.solid.hermite;
    result_.thin = made.thin;
    if (hermite.crossings.empty()) return std::nullopt;
    if (!volume.is_signed) volume.boundary = all_polygons();
    // Points in single precision are then those that such a file holds.
    if (options_.written_in_single) {
      hermite.placement.offset += hermite.placement.origin;
      hermite.placement.origin.setZero();
    }
    const auto view = view_of(hermite, context_);
    const FilePoints file(hermite.placement);
    UniformMesh uniform = uniform_mesh(view, {}, file, context_);
    // Thin parts take about as long as three times the mesh, and as four vertices for each polygon.
    count_work(double(uniform.points.size()) * (made.thin ? 3.0 : 1.0) +
               (made.thin ? 4.0 * double(mesh_.triangle_count()) : 0.0));
    Attempt result{voxel_size,
                   std::make_shared<const SolidSurface>(
                       surface_of(std::move(volume.boundary),
                                  keeps_thin ? std::span<const std::int8_t>() : turns_, options_.over_holes)),
                   file,
                   FineMesh(std::move(uniform.points),
                            all_triangles(std::move(uniform.triangles), uniform.quads), context_),
                   {},
                   file.placement().origin - mesh_.origin};
    if (result.surface->triangles.empty()) return std::nullopt;
    result.file_points = result.in_file(result.fine.points());
    return result;
  }

  void count_work(double work) {
    result_.work += work;
    if (result_.work > options_.most_work)
      throw Error(
          "the bound is not reached within the work that is allowed; allow a larger error or more triangles");
  }

  BoundaryTriangles all_polygons() const {
    BoundaryTriangles all{mesh_.points, triangulated(mesh_), {}};
    all.ids.resize(all.triangles.size());
    std::iota(all.ids.begin(), all.ids.end(), 0);
    return all;
  }

  /// How far the points of a mesh are from the surface, or every `step`-th of them; world units, kFarthest
  /// errors where it is more.
  std::vector<double> apart_at_points(const Attempt& now, const SurfaceDistance& surface, std::size_t step) {
    const Stage stage(context_, "compare");
    std::vector<double> apart((now.file_points.size() + step - 1) / step);
    parallel_blocks(apart.size(), context_, [&](std::size_t i) {
      apart[i] = surface.at(now.place(i * step), kFarthest * options_.error);
    });
    return apart;
  }
  double mean_share(const std::vector<double>& apart) const {
    return std::accumulate(apart.begin(), apart.end(), 0.0) / (double(apart.size()) * options_.error);
  }

  /// How far the triangles of a mesh are from the surface at most, in their middles and those of their sides,
  /// or every `step`-th of them; as apart_at_points() says it.
  std::vector<double> apart_in_triangles(const Attempt& now, const SurfaceDistance& surface,
                                         std::size_t step) {
    const Stage stage(context_, "compare");
    const std::vector<Triangle>& triangles = now.fine.triangles();
    std::vector<double> apart((triangles.size() + step - 1) / step);
    parallel_blocks(apart.size(), context_, [&](std::size_t i) {
      const Triangle& t = triangles[i * step];
      const Eigen::Vector3d a = now.place(t[0]), b = now.place(t[1]), c = now.place(t[2]);
      for (const Eigen::Vector3d& p : {Eigen::Vector3d((a + b + c) / 3.0), Eigen::Vector3d((a + b) / 2.0),
                                       Eigen::Vector3d((b + c) / 2.0), Eigen::Vector3d((c + a) / 2.0)})
        apart[i] = std::max(apart[i], surface.at(p, kFarthest * options_.error));
    });
    return apart;
  }

  /// How far the points of a mesh and the triangles around each of them are from the surface at most, as
  /// those two say it.
  std::vector<double> apart_around_points(const Attempt& now, const SurfaceDistance& surface) {
    std::vector<double> apart = apart_at_points(now, surface, 1);
    const std::vector<double> within = apart_in_triangles(now, surface, 1);
    for (std::size_t t = 0; t < within.size(); ++t)
      for (const std::uint32_t p : now.fine.triangles()[t]) apart[p] = std::max(apart[p], within[t]);
    return apart;
  }

  /// Where points of the surfaces are farther apart than the collapses can do with. `apart`, as of
  /// apart_at_points(), becomes what counts at each point: what is farthest of the triangles around it and of
  /// the surface nearest to these.
  std::vector<Far> look(const Attempt& now, const SurfaceDistance& uniform, std::vector<double>& apart) {
    const Stage stage(context_, "compare");
    const double most = kFarthest * options_.error;
    std::vector<Far> far;
    const double limit = kNear * options_.error;
    for (std::size_t i = 0; i < apart.size(); ++i)
      if (apart[i] > limit)
        far.push_back({now.place(i), apart[i], false, now.fine.around(std::uint32_t(i))[0]});

    // The other way, each place of the surface counts at the corners of the uniform triangle that is nearest.
    std::vector<std::uint8_t> used(now.surface->points.size(), 0);
    std::vector<std::uint32_t> one(used.size(), 0);
    for (std::uint32_t t = 0; t < now.surface->triangles.size(); ++t)
      for (const std::uint32_t p : now.surface->triangles[t]) used[p] = 1, one[p] = t;
    std::vector<NearestTriangle> nearest(used.size(), NearestTriangle{0.0, TriangleTree::kNone});
    parallel_blocks(used.size(), context_, [&](std::size_t i) {
      if (used[i])
        nearest[i] = uniform.tree().nearest(now.surface->points[i].cast<double>() - now.offset, most * most);
    });
    std::vector<double> own = apart;
    for (std::size_t i = 0; i < used.size(); ++i) {
      if (!used[i]) continue;
      const double distance = std::sqrt(nearest[i].squared);
      if (distance > limit) {
        const Far place{now.surface->points[i].cast<double>(), distance, true, one[i]};
        if (bounds_nothing(*now.surface, place)) continue;
        far.push_back(place);
      }
      if (nearest[i].triangle == TriangleTree::kNone) continue;
      for (const std::uint32_t p : now.fine.triangles()[nearest[i].triangle])
        own[p] = std::max(own[p], distance);
    }
    // A triangle's own places are no farther away than its corners, or not by much.
    apart = own;
    for (const Triangle& t : now.fine.triangles()) {
      const double largest = std::max({own[t[0]], own[t[1]], own[t[2]]});
      for (const std::uint32_t p : t) apart[p] = std::max(apart[p], largest);
    }
    return far;
  }

  /// Where triangles of the uniform mesh are farther from the surface than the error, or those of the surface
  /// from it.
  std::vector<Far> far_between_points(const Attempt& now, const SurfaceDistance& surface,
                                      const SurfaceDistance& uniform) const {
    const Stage stage(context_, "compare between points");
    std::vector<Far> far;
    const double error = options_.error;
    const auto to = surface.hold(now.file_points, now.offset, now.fine.triangles(), error, context_, {},
                                 Wanted::any_bound);
    for (const FarTriangle& f : to.far) far.push_back({f.place + now.offset, f.distance, false, f.triangle});
    const auto from = uniform.hold(now.surface->points, -now.offset, now.surface->triangles, error, context_,
                                   free_pieces(), Wanted::any_bound);
    for (const FarTriangle& f : from.far) far.push_back({f.place, f.distance, true, f.triangle});
    return far;
  }

  /// Collapses with what is left of the error, again as long as that is worth it: the places where the first
  /// time fails, or none and the mesh in the result.
  std::vector<Far> collapse_all(const Attempt& uniform, const SurfaceDistance& surface,
                                const std::vector<double>& apart) {
    CertifiedMesh mesh;
    std::vector<Far> far = collapse(uniform, surface, tolerances(uniform, apart, 0.0), mesh);
    if (!far.empty()) return far;
    // What is reached may be collapsed like what it came from, for the proof is against the polygons each
    // time. Cubes and passes leave points on plane parts where two thirds may go; of a scan next to none are
    // left.
    for (bool is_worth_it = true; is_worth_it;) {
      const BoundedMesh before = result_;
      const Attempt now{uniform.voxel_size,
                        uniform.surface,
                        uniform.file,
                        FineMesh(mesh.points, mesh.triangles, context_),
                        uniform.in_file(mesh.points),
                        uniform.offset};
      if (!collapse(now, surface, tolerances(now, apart_around_points(now, surface), kLeastShare), mesh)
               .empty()) {
        const double work = result_.work;
        result_ = before;
        result_.work = work;
        break;
      }
      result_.rounds = before.rounds;
      is_worth_it = double(mesh.triangles.size()) < kWorthAgain * double(before.mesh.triangle_count());
    }
    return far;
  }

  /// What is left of the error at each point, voxels, and at least a share of it.
  std::vector<float> tolerances(const Attempt& now, const std::vector<double>& apart, double least) const {
    std::vector<float> tolerance(apart.size());
    for (std::size_t i = 0; i < apart.size(); ++i)
      tolerance[i] = float(std::max(least * options_.error, kUsed * options_.error - kUnseen * apart[i]) /
                           now.voxel_size);
    return tolerance;
  }

  /// Collapses, and the proof: the places where it fails, or none, and what came of it in `mesh` and in the
  /// result.
  std::vector<Far> collapse(const Attempt& now, const SurfaceDistance& surface, std::vector<float> tolerance,
                            CertifiedMesh& mesh) {
    // A place of the mesh is then within the error by the triangle inequality, as far as the tolerances are
    // right.
    std::vector<Far> far;
    for (int lowerings = 0; lowerings <= kLowerings; ++lowerings, ++result_.rounds) {
      CertifiedMesh coarse = decimate_certified(now.fine, tolerance, {}, now.file, context_);
      count_work(double(now.fine.points().size()));
      far = prove(now, surface, coarse);
      // Nothing is written but what was proved just now, as the file will hold it.
      if (far.empty()) {
        result_.mesh.origin = now.file.placement().origin;
        result_.mesh.points = now.in_file(coarse.points);
        result_.mesh.triangles = coarse.triangles;
        mesh = std::move(coarse);
        break;
      }
      if (!lower_around(now, far, tolerance)) break;
    }
    return far;
  }

  /// What of the polygons need not be near: pieces that bound nothing.
  FreePieces free_pieces() const {
    if (!winding_) return {};
    return {.is_free = [this](const std::array<Eigen::Vector3d, 3>& piece) { return bounds_nothing(piece); },
            .radius = kFreePiece * options_.error};
  }

  /// Holds the mesh against the surface, both ways; the places where it is too far away, or may be.
  std::vector<Far> prove(const Attempt& now, const SurfaceDistance& surface, const CertifiedMesh& coarse) {
    const Stage stage(context_, "prove");
    const std::vector<Eigen::Vector3f> points = now.in_file(coarse.points);
    const DistanceFromSurface to = hold(surface, points, now.offset, coarse.triangles, {});
    const SurfaceDistance mesh(points, coarse.triangles);
    // Polygons that have the same on both sides are not part of the surface; each piece of them that is not
    // near is asked.
    const DistanceFromSurface from =
        hold(mesh, now.surface->points, -now.offset, now.surface->triangles, free_pieces());
    result_.to_surface = to.upper;
    result_.from_surface = from.upper;
    result_.free_area = from.free_area;
    std::vector<Far> far;
    for (const FarTriangle& f : to.far)
      far.push_back({f.place + now.offset, f.distance, false, coarse.fine_triangle[f.triangle]});
    for (const FarTriangle& f : from.far) far.push_back({f.place, f.distance, true, f.triangle});
    return far;
  }

  /// SurfaceDistance::hold() with the smallest limit, to some hundredths of the error, that holds and is no
  /// larger than that.
  DistanceFromSurface hold(const SurfaceDistance& to, std::span<const Eigen::Vector3f> points,
                           const Eigen::Vector3d& offset, std::vector<Triangle> triangles,
                           const FreePieces& free) const {
    DistanceFromSurface all;
    std::vector<std::uint32_t> numbers(triangles.size());
    std::iota(numbers.begin(), numbers.end(), 0u);
    double limit = kFirstLimit * options_.error;
    while (true) {
      const bool is_last = limit >= options_.error;
      if (is_last) limit = options_.error;
      // Before the last limit nothing is free, for what is far then may still be near enough.
      DistanceFromSurface now =
          to.hold(points, offset, triangles, limit, context_, is_last ? free : FreePieces{});
      all.upper = std::max(all.upper, now.upper);
      all.free_area += now.free_area;
      for (FarTriangle& f : now.far) f.triangle = numbers[f.triangle];
      if (is_last || now.far.empty()) {
        all.far = std::move(now.far);
        return all;
      }
      // Only what was too far for this limit is held against the next.
      std::vector<Triangle> left;
      double farthest = limit;
      std::vector<std::uint32_t> left_numbers;
      for (const FarTriangle& f : now.far) {
        left_numbers.push_back(f.triangle);
        farthest = std::max(farthest, f.distance);
      }
      for (std::size_t i = 0, k = 0; i < numbers.size() && k < left_numbers.size(); ++i)
        if (numbers[i] == left_numbers[k]) left.push_back(triangles[i]), ++k;
      triangles = std::move(left);
      numbers = std::move(left_numbers);
      limit = farthest + kLimitStep * options_.error;
    }
  }

  /// Lowers the tolerance around the places. False if it is next to nothing at one of them already.
  bool lower_around(const Attempt& now, const std::vector<Far>& far, std::vector<float>& tolerance) {
    const TriangleTree triangles(now.file_points, now.fine.triangles(), 1.0);
    std::vector<std::uint8_t> lowered(tolerance.size(), 0);
    bool useful = true;
    for (const Far& f : far) {
      const Eigen::Vector3d reach = Eigen::Vector3d::Constant(options_.error + 2.0 * now.voxel_size);
      const Eigen::Vector3d p = f.place - now.offset;
      float largest = 0.0f;
      triangles.for_each_near(p - reach, p + reach, [&](std::uint32_t t) {
        for (const std::uint32_t corner : now.fine.triangles()[t]) {
          lowered[corner] = 1;
          largest = std::max(largest, tolerance[corner]);
        }
      });
      useful = useful && largest > kLeastTolerance;
    }
    for (std::size_t i = 0; i < tolerance.size(); ++i)
      if (lowered[i]) tolerance[i] *= kLowering;
    return useful;
  }

  /// Whether the solid is on both sides of a piece of a polygon, or on neither, in the frame of the mesh's
  /// origin.
  bool bounds_nothing(const std::array<Eigen::Vector3d, 3>& piece) const {
    const Eigen::Vector3d normal = (piece[1] - piece[0]).cross(piece[2] - piece[0]).normalized();
    if (!normal.allFinite() || normal.isZero()) return true;  // it has no area
    const Eigen::Vector3d middle = (piece[0] + piece[1] + piece[2]) / 3.0,
                          step = kOffSurface * extent_ * normal;
    const bool before = winding_->number().at(middle + step) > 0.5,
               behind = winding_->number().at(middle - step) > 0.5;
    // A sheet with nothing on either side is thickened where thin parts are kept.
    return before == behind && (before || options_.thin != ThinRule::keep);
  }
  /// Whether a triangle of the surface bounds nothing beside one of its corners.
  bool bounds_nothing(const SolidSurface& surface, const Far& at) const {
    if (!winding_) return false;
    const Triangle& t = surface.triangles[at.triangle];
    std::array<Eigen::Vector3d, 3> piece;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d from_corner = surface.points[t[i]].cast<double>() - at.place;
      // On the edges of the triangle normals do not mean what they say, so the piece is a small one beside
      // the corner.
      piece[i] =
          at.place +
          std::min(1.0, kFreePiece * options_.error / std::max(from_corner.norm(), 1e-300)) * from_corner;
    }
    return bounds_nothing(piece);
  }

  /// Says so if smaller voxels would not help, for a hole is closed there.
  bool explained(const Attempt& now, const std::vector<Far>& far) {
    if (!options_.over_holes && !now.surface->caps.empty()) {
      const SurfaceDistance caps(now.surface->points, now.surface->caps);
      for (const Far& f : far)
        if (!f.of_surface && f.distance > options_.error && caps.at(f.place, f.distance) < f.distance)
          add(Unmet::hole, f);
    }
    sort_unmet();
    return !result_.unmet.empty();
  }

  void add(Unmet why, const Far& f) { result_.unmet.push_back({why, mesh_.origin + f.place, f.distance}); }

  void sort_unmet() {
    constexpr std::size_t kMost = 10;
    std::stable_sort(result_.unmet.begin(), result_.unmet.end(),
                     [](const UnmetPlace& a, const UnmetPlace& b) { return a.distance > b.distance; });
    if (result_.unmet.size() > kMost) result_.unmet.resize(kMost);
  }

  /// Asks for smaller voxels where there was no mesh at all, from which all polygons are far.
  bool smaller(double voxel_size) {
    const SolidSurface all{mesh_.points, triangulated(mesh_), {}};
    std::vector<Far> far;
    for (std::uint32_t t = 0; t < all.triangles.size(); ++t)
      far.push_back({middle(all, t), std::numeric_limits<double>::infinity(), true, t});
    return smaller(voxel_size, all, 0.5, far);
  }

  /// The voxels for which there may be as many points as allowed: a surface crosses some one and a half cells
  /// for each square of a voxel's side.
  double smallest_voxel() const {
    const double allowed =
        options_.smallest_voxel > 0.0 ? options_.smallest_voxel : kSmallestVoxel * options_.error;
    // What the machine has left is a limit, too, whatever is allowed.
    const double room = double(available_memory().value_or(std::uint64_t(1) << 62)) / kBytesOfPoint;
    return std::max(allowed, std::sqrt(1.5 * area_ / std::min(options_.most_points, room)));
  }

  /// Asks for smaller voxels: as small as what is far is thin, or `factor` of what they were where nothing
  /// is. Gives up where these would be too many.
  bool smaller(double voxel_size, const SolidSurface& of, double factor, const std::vector<Far>& far) {
    const SurfaceDistance surface(of.points, of.triangles);
    const double smallest = smallest_voxel();
    // Most of what is far is next to more of it, so that an even sample tells how thin it is. A twentieth of
    // that may be thinner: a wedge is as thin as can be at its edge, and only there.
    std::vector<std::pair<double, std::size_t>> thick;
    for (std::size_t i = 0; i < far.size(); i += 1 + far.size() / kMostAsked)
      if (const double found = thickness_to_show(surface, far[i]); std::isfinite(found))
        thick.emplace_back(found, i);
    std::sort(thick.begin(), thick.end());
    const double thinnest =
        thick.empty() ? std::numeric_limits<double>::infinity() : thick[thick.size() / 20].first;
    // Voxels that are as thick as the thinnest wall show it wherever samples fall into it, or nearly.
    const bool is_thin = std::isfinite(thinnest), is_hopeless = is_thin && kThinVoxels * thinnest < smallest;
    if (is_thin) factor = std::clamp(kVoxelOfThickness * thinnest / voxel_size, 0.2, 0.7);
    if (!is_hopeless && voxel_size > 1.1 * smallest) {
      result_.voxel_size = std::max(smallest, factor * voxel_size);
      return false;
    }
    result_.voxel_size = smallest;
    // What is thicker than that is shown, and not what keeps the bound from being reached.
    const bool is_too_thin = is_thin && kVoxelOfThickness * thinnest < smallest;
    result_.thickness = is_too_thin ? thinnest : 0.0;
    if (is_too_thin)
      add(Unmet::thin, far[thick[thick.size() / 20].second]);
    else
      for (const Far& f : far) add(Unmet::thin, f);
    sort_unmet();
    return false;
  }

  /// The width that voxels have to show for a place to be near; infinity for a place of the mesh, and for
  /// what is near.
  double thickness_to_show(const SurfaceDistance& surface, const Far& at) const {
    if (!at.of_surface || at.distance <= options_.error) return std::numeric_limits<double>::infinity();
    return width_to_show(surface.tree(), at.triangle, at.place, options_.error, kOffSurface * extent_);
  }

  const PolygonMesh& mesh_;
  const BoundedRemeshOptions& options_;
  RunContext& context_;
  double longest_, extent_, area_ = 0.0;  ///< world units
  std::optional<OrientedWinding> winding_;
  std::vector<std::int8_t> turns_;
  BoundedMesh result_;
};

}  // namespace

BoundedMesh bounded_remesh(const PolygonMesh& mesh, const BoundedRemeshOptions& options,
                           RunContext& context) {
  if (!(options.error > 0.0) || !std::isfinite(options.error))
    throw Error("the error must be a finite number above 0");
  if (mesh.empty()) throw Error("there are no polygons to remesh");
  const std::size_t notes = context.notes.size();
  BoundedMesh made = BoundedRemesher(mesh, options, context).run();
  const bool has_hole =
      std::ranges::any_of(made.unmet, [](const UnmetPlace& p) { return p.why == Unmet::hole; });
  if (!has_hole || options.thin != ThinRule::keep || options.signs != SignRule::winding_number) return made;
  // What is open encloses nothing, then, and becomes a shell.
  BoundedRemeshOptions open = options;
  open.signs = SignRule::flood_fill;
  context.notes.resize(notes);
  BoundedMesh shell = BoundedRemesher(mesh, open, context).run();
  return shell.unmet.empty() ? shell : made;
}

}  // namespace hermesh
