#include "algorithms/remesh/bounded_remesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <utility>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"
#include "algorithms/core/run_context.h"
#include "algorithms/extraction/certified_collapse/certified_decimation.h"
#include "algorithms/extraction/certified_mesh.h"
#include "algorithms/extraction/embedded_mesh/uniform_mesh.h"
#include "algorithms/hermite/hermite_view.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/lattice/memory_estimate.h"
#include "algorithms/remesh/exception_balls.h"
#include "algorithms/remesh/manifold_polygons.h"
#include "algorithms/remesh/two_sided_proof.h"
#include "algorithms/remesh/voxel_size.h"
#include "algorithms/voxelization/voxelize.h"

namespace hermesh {
namespace {

// Shares of the error. A uniform mesh within kUniform of it leaves the rest to the collapses; vertices of
// both surfaces only approximate their distance, which kUnseen allows for.
constexpr double kUniform = 0.6, kUsed = 0.97, kUnseen = 1.1;
/// In errors: the largest distance of vertices, and the one beyond which distances are not distinguished.
constexpr double kNear = 0.85, kFarthest = 4.0;
/// Voxels of the first attempt that looks for thin parts and, by default, the smallest, in errors.
constexpr double kFirstVoxel = 1.5, kSmallestVoxel = 0.125;
/// Larger voxels, for plane or smooth shapes, are tried if they are this many times as large; the number of
/// attempts in which nearly all positions are near, and the next size in those of the last.
constexpr double kWorthLarger = 2.0, kNextLarger = 0.8;
constexpr int kLargerTries = 4;
/// Share of the error that the uniform mesh of such voxels may use up in the mean: it costs about as large a
/// share of additional triangles. The number of its vertices that are tested first.
constexpr double kLittle = 0.02;
constexpr std::size_t kTestedFirst = 1000;
/// Fewest voxels along the longest side, so that there is something to collapse.
constexpr double kFewestVoxels = 16.0;
/// Largest unit of length for the collapses of the polygons themselves, in errors: the slack of their proof
/// is kDistanceSlack units.
constexpr double kLargestUnit = 4.0;
/// Size of the pieces of triangles that meet others, up to which it is not known whether they bound the
/// solid, in errors.
constexpr double kUncertain = 0.125;
/// Next voxel size, as a share of the last, if vertices did not show which parts are too far.
constexpr double kFinerBetween = 0.6;
/// Least tolerance when a mesh is collapsed again, in errors, and the share of triangles left that makes
/// another time worth it.
constexpr double kLeastShare = 0.02, kWorthAgain = 0.95;
/// Least useful tolerance, in voxels.
constexpr double kLeastTolerance = 0.02;
/// Memory of a vertex of the uniform mesh until it is written, bytes.
constexpr double kBytesOfPoint = 400.0;
/// Number of times that tolerances are lowered before voxels are made smaller, and their factor.
constexpr int kLowerings = 3;
constexpr float kLowering = 0.4f;
/// Largest voxels with shells within the error, in errors: shells are at most about 1.75 voxels away.
constexpr double kShellVoxel = 0.5;
/// Share of the excepted area from which on smaller voxels are not worth another attempt.
constexpr double kWorthFiner = 0.75;

/// Area of the holes, as a share of the polygons', from which on these are open sheets and no solid.
constexpr double kOpenSheet = 0.1;

/// A mesh to collapse, first the uniform one at a voxel size, and the surface that it approximates.
struct Attempt {
  double voxel_size;
  std::shared_ptr<const SolidSurface> surface;
  FilePoints file;
  FineMesh fine;                             ///< index space
  std::vector<Eigen::Vector3f> file_points;  ///< world units relative to the placement's origin
  Eigen::Vector3d offset;                    ///< of the placement's origin from the input's, world units

  /// Returns a vertex in the frame of the input's origin.
  Eigen::Vector3d place(std::size_t point) const { return offset + file_points[point].cast<double>(); }
  std::vector<Eigen::Vector3f> in_file(const std::vector<Eigen::Vector3d>& points) const {
    std::vector<Eigen::Vector3f> result(points.size());
    std::transform(points.begin(), points.end(), result.begin(),
                   [&](const auto& p) { return file.in_file(p); });
    return result;
  }
};

class BoundedRemesher {
 public:
  BoundedRemesher(const PolygonMesh& mesh, const BoundedRemeshOptions& options, RunContext& context)
      : mesh_(mesh),
        options_(options),
        context_(context),
        longest_(bounds(mesh).size().maxCoeff()),
        // By any other rule the inside is unknown away from the samples, and no polygon is free.
        proof_(mesh, options.error, options.signs == SignRule::winding_number,
               options.thin == ThinRule::keep) {
    for (const Triangle& t : triangulated(mesh)) area_ += area(mesh.points, t);
  }

  BoundedMesh run() {
    result_.error = options_.error;
    result_.over_holes = options_.over_holes;
    if (try_polygons()) return finished();
    result_.voxel_size =
        std::min(std::max(kFirstVoxel * options_.error, smallest_voxel()), longest_ / kFewestVoxels);
    if (try_larger(result_.voxel_size)) return finished();
    while (!try_at(result_.voxel_size) && result_.unmet.empty()) ++result_.rounds;
    if (!result_.unmet.empty()) result_.mesh = {};
    return finished();
  }

  /// Returns the mesh of a bound with exceptions, after run() has returned `refused`; that if there is none.
  BoundedMesh run_with_exceptions(BoundedMesh refused) {
    const std::size_t notes = context_.notes.size();
    result_ = refused;
    result_.unmet.clear();
    double before = std::numeric_limits<double>::infinity();
    // All shells around thin parts of larger voxels are far, and comparing them takes most of the time.
    const double first = options_.thin == ThinRule::keep
                             ? std::min(tried_, std::max(kShellVoxel * options_.error, smallest_voxel()))
                             : tried_;
    for (double voxel_size = first;; voxel_size = std::max(kFinerBetween * voxel_size, smallest_voxel())) {
      context_.notes.resize(notes);
      const std::optional<Attempt> made = attempt(voxel_size);
      const bool is_last = voxel_size <= smallest_voxel();
      if (!made && is_last) return refused;
      if (!made) continue;
      const SurfaceDistance surface(made->surface->points, made->surface->triangles);
      const SurfaceDistance uniform(made->file_points, made->fine.triangles());
      const std::vector<Far> far = compare(*made, surface, uniform, true).far;
      const double excepted = std::transform_reduce(far.begin(), far.end(), 0.0, std::plus<>(),
                                                    [](const Far& piece) { return piece.area; });
      if (!is_last && excepted > 0.0 && excepted < kWorthFiner * std::exchange(before, excepted)) continue;
      result_.voxel_size = voxel_size;
      note_surface(*made);
      excepted_.emplace(far, options_.error);
      std::vector<double> apart = apart_at_points(*made, surface, 1);
      far_points(*made, uniform, apart);
      collapse_all(*made, surface, apart);
      name_exceptions(*made);
      return finished();
    }
  }

 private:
  /// Returns true if the polygons are already a valid mesh of the solid, or become one when few triangles
  /// that meet others are collapsed. The whole error is then left to the collapses. Lengths are measured in a
  /// power of two, so that vertices are exact.
  ///
  /// A triangle, or piece of one, that meets no other has the solid behind it everywhere if it has so next to
  /// its middle. The few small pieces that do meet others may be inside the solid in part. So distances of
  /// the mesh are measured to the former only, and both kinds have to be near the mesh.
  bool try_polygons() {
    // A file in single precision would move vertices that are relative to an origin.
    if (options_.through_volume || proof_.turns().empty() ||
        (options_.written_in_single && !mesh_.origin.isZero()))
      return false;
    const auto polygons = [&] {
      const Stage stage(context_, "test polygons");
      return manifold_polygons(mesh_, proof_.turns(), context_);
    }();
    if (!polygons) return false;
    const bool is_embedded = polygons->is_embedded();
    std::vector<Eigen::Vector3f> points = polygons->points;
    std::vector<Triangle> certain = pieces_apart(*polygons, kUncertain * options_.error, points);
    std::erase_if(certain, [&](const Triangle& t) { return !proof_.bounds_solid(points, t); });
    const std::vector<std::uint32_t> largest = largest_of_patch(*polygons);
    std::map<std::uint32_t, bool> bounds;  // by largest triangle of a patch
    for (std::size_t t = 0; t < largest.size(); ++t) {
      if (largest[t] == FineMesh::kNone) continue;
      const auto [patch, is_new] = bounds.try_emplace(largest[t]);
      if (is_new) patch->second = proof_.bounds_solid(points, polygons->triangles[largest[t]]);
      if (patch->second) certain.push_back(polygons->triangles[t]);
      if (!patch->second && is_embedded) return false;
    }
    if (certain.empty()) return false;
    const ManifoldPolygons mesh = is_embedded ? *polygons : untangled(*polygons, context_);
    if (!mesh.is_embedded()) return false;
    const double unit =
        std::exp2(std::floor(std::log2(std::min(polygons->mean_edge, kLargestUnit * options_.error))));
    const FilePoints file({.linear = unit * Eigen::Matrix3d::Identity(), .origin = mesh_.origin});
    const Attempt now{unit,
                      std::make_shared<const SolidSurface>(
                          SolidSurface{polygons->points, polygons->triangles, {}, area_, 0.0}),
                      file,
                      FineMesh(scaled(mesh.points, unit), mesh.triangles, context_),
                      mesh.points,
                      Eigen::Vector3d::Zero()};
    count_work(double(polygons->points.size()));
    const SurfaceDistance surface(points, certain);
    std::vector<double> apart(mesh.points.size(), 0.0);
    if (!is_embedded) {
      apart = apart_around_points(now, surface);
      const SurfaceDistance fine(mesh.points, mesh.triangles);
      if (!far_points(now, fine, apart).empty()) return false;
    }
    if (!collapse_all(now, surface, apart).empty()) return false;
    if (!is_embedded && !is_solid(result_.mesh)) return false;
    if (!is_embedded)
      context_.note(std::to_string(polygons->pairs.size()) +
                    " pairs of polygons intersect, and were collapsed within the error");
    result_.voxel_size = 0.0;
    note_surface(now);
    return true;
  }

  /// Returns true if a mesh is embedded, and each of its shells has the inside behind it.
  bool is_solid(const PolygonMesh& mesh) const {
    const TwoSidedProof sides(mesh, options_.error, true, false);
    if (!std::ranges::all_of(sides.turns(), [](std::int8_t turn) { return turn == 1; })) return false;
    const auto made = manifold_polygons(mesh, sides.turns(), context_);
    return made && made->is_embedded() && std::ranges::all_of(largest_of_patch(*made), [&](std::uint32_t t) {
             return sides.bounds_solid(made->points, made->triangles[t]);
           });
  }

  /// Returns true if the bound was reached with larger voxels than `first`, as for plane and smooth parts,
  /// where the uniform mesh leaves nearly all of the error to the collapses. An attempt at twice the voxel
  /// size takes a quarter of the time. A failure here is not final: smaller voxels may show parts that larger
  /// ones do not.
  bool try_larger(double first) {
    const OneProgress progress(context_, "try larger voxels");
    const std::size_t notes = context_.notes.size();
    const double largest = longest_ / kFewestVoxels, smallest = kWorthLarger * first;
    int tries = 0;
    for (double voxel_size = largest; voxel_size > smallest && tries < kLargerTries;) {
      progress.update(std::log(largest / voxel_size) / std::log(largest / smallest));
      // Notes of an attempt that fails are dropped; the one that succeeds repeats them.
      context_.notes.resize(notes);
      const std::optional<Attempt> made = attempt(voxel_size);
      if (!made) {
        voxel_size *= 0.5;
        continue;
      }
      const SurfaceDistance surface(made->surface->points, made->surface->triangles);
      std::vector<double> apart;
      if (const double used = share_used(*made, surface, apart); used > kLittle) {
        // Halving the voxels divides the distance of a smooth surface by four.
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

  /// Returns the share of the error that a uniform mesh uses up in the mean over its vertices. `apart`
  /// becomes apart_around_points(), unless some vertices and triangles show that the share is more than
  /// kLittle.
  double share_used(const Attempt& now, const SurfaceDistance& surface, std::vector<double>& apart) {
    double used = mean_share(apart_at_points(now, surface, 1 + now.file_points.size() / kTestedFirst));
    if (used <= kLittle)
      used = mean_share(apart_in_triangles(now, surface, 1 + now.fine.triangles().size() / kTestedFirst));
    if (used > kLittle) return used;
    apart = apart_around_points(now, surface);
    return mean_share(apart);
  }

  /// Returns true if the bound is reached from a uniform mesh whose mean distance uses up little of the
  /// error.
  bool reaches(const Attempt& now, const SurfaceDistance& surface, std::vector<double>& apart) {
    if (std::ranges::max(apart) > kNear * options_.error) return false;
    const SurfaceDistance uniform(now.file_points, now.fine.triangles());
    return far_points(now, uniform, apart).empty() && far_between_points(now, surface, uniform).empty() &&
           collapse_all(now, surface, apart).empty();
  }

  /// Returns true if the bound was reached with voxels of this size. If not, result_.voxel_size is the next
  /// size, or result_.unmet has the reason why there is none.
  bool try_at(double voxel_size) {
    const std::optional<Attempt> made = attempt(voxel_size);
    if (!made) {
      // There is no mesh, so it is far from all polygons.
      const std::vector<Triangle> all = triangulated(mesh_);
      std::vector<Far> far;
      for (std::uint32_t t = 0; t < all.size(); ++t)
        far.push_back({(mesh_.points[all[t][0]].cast<double>() + mesh_.points[all[t][1]].cast<double>() +
                        mesh_.points[all[t][2]].cast<double>()) /
                           3.0,
                       std::numeric_limits<double>::infinity(), true, t});
      choose_voxel(voxel_size, mesh_.points, all, 0.5, far);
      return false;
    }
    const Attempt& now = *made;
    note_surface(now);
    const SurfaceDistance surface(now.surface->points, now.surface->triangles),
        uniform(now.file_points, now.fine.triangles());
    std::vector<double> apart = apart_at_points(now, surface, 1);
    double factor = kFinerBetween;
    // Vertices give a fast approximation. If the uniform mesh itself is too far between them, no tolerance
    // helps, and the collapses and their proof, which take most of the time, are omitted.
    std::vector<Far> far = far_points(now, uniform, apart);
    if (!far.empty()) {
      factor = std::clamp(kUniform * options_.error / std::ranges::max(far, {}, &Far::distance).distance,
                          0.35, 0.7);
    } else if (far = far_between_points(now, surface, uniform); far.empty()) {
      far = collapse_all(now, surface, apart);
      if (far.empty()) return true;
    }
    if (!add_holes(now, far))
      choose_voxel(voxel_size, now.surface->points, now.surface->triangles, factor, far);
    return false;
  }

  void note_surface(const Attempt& now) {
    result_.hole_area = now.surface->cap_area;
    result_.left_out_area = std::max(0.0, area_ - now.surface->area);
    surface_ = now.surface;
  }

  BoundedMesh finished() {
    result_.area = area_;
    if (result_.unmet.empty()) result_.topology = topology_of(surface_->points, surface_->triangles);
    return std::move(result_);
  }

  /// Completes the exceptions of the result, which have positions relative to the polygons' origin.
  void name_exceptions(const Attempt& now) {
    const bool has_caps = !options_.over_holes && !now.surface->caps.empty();
    std::optional<SurfaceDistance> caps;
    if (has_caps) caps.emplace(now.surface->points, now.surface->caps);
    for (UnmetPlace& ball : result_.excepted) {
      if (caps && caps->at(ball.place, ball.distance) < ball.distance) ball.why = Unmet::hole;
      ball.place += mesh_.origin;
    }
  }

  /// Returns the uniform mesh at a voxel size; none if it is empty.
  std::optional<Attempt> attempt(double voxel_size) {
    tried_ = voxel_size;
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
    if (!volume.is_signed) {
      volume.boundary = {mesh_.points, triangulated(mesh_), {}};
      volume.boundary.ids.resize(volume.boundary.triangles.size());
      std::iota(volume.boundary.ids.begin(), volume.boundary.ids.end(), 0);
    }
    // Vertices in single precision are then those of such a file.
    if (options_.written_in_single) {
      hermite.placement.offset += hermite.placement.origin;
      hermite.placement.origin.setZero();
    }
    const auto view = view_of(hermite, context_);
    const FilePoints file(hermite.placement);
    UniformMesh uniform = uniform_mesh(view, {}, file, context_);
    // Thin parts take the time of three meshes, and of four vertices for each polygon.
    count_work(double(uniform.points.size()) * (made.thin ? 3.0 : 1.0) +
               (made.thin ? 4.0 * double(mesh_.triangle_count()) : 0.0));
    Attempt result{voxel_size,
                   std::make_shared<const SolidSurface>(surface_of(
                       std::move(volume.boundary),
                       keeps_thin ? std::span<const std::int8_t>() : proof_.turns(), options_.over_holes)),
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

  /// Returns the distances of every `step`-th vertex of a mesh from the surface; world units, at most
  /// kFarthest errors.
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

  /// Returns the same for triangles: the largest distance of their middles and those of their sides.
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

  /// Returns by vertex the largest of its distance and those of the triangles around it.
  std::vector<double> apart_around_points(const Attempt& now, const SurfaceDistance& surface) {
    std::vector<double> apart = apart_at_points(now, surface, 1);
    const std::vector<double> within = apart_in_triangles(now, surface, 1);
    for (std::size_t t = 0; t < within.size(); ++t)
      for (const std::uint32_t p : now.fine.triangles()[t]) apart[p] = std::max(apart[p], within[t]);
    return apart;
  }

  /// Returns the vertices of mesh and surface that are too far from the other for the collapses. `apart`,
  /// from apart_at_points(), becomes the distance that counts at each vertex: the largest of the triangles
  /// around it and of the surface vertices nearest to these.
  std::vector<Far> far_points(const Attempt& now, const SurfaceDistance& uniform,
                              std::vector<double>& apart) {
    const Stage stage(context_, "compare");
    const double most = kFarthest * options_.error;
    std::vector<Far> far;
    const double limit = kNear * options_.error;
    for (std::size_t i = 0; i < apart.size(); ++i)
      if (apart[i] > limit) far.push_back({now.place(i), apart[i], false});

    // In the other direction, each vertex of the surface counts at the corners of the nearest uniform
    // triangle.
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
        if (proof_.bounds_nothing(*now.surface, place)) continue;
        far.push_back(place);
      }
      if (nearest[i].triangle == TriangleTree::kNone) continue;
      for (const std::uint32_t p : now.fine.triangles()[nearest[i].triangle])
        own[p] = std::max(own[p], distance);
    }
    // The interior of a triangle is hardly farther away than its corners.
    apart = own;
    for (const Triangle& t : now.fine.triangles()) {
      const double largest = std::max({own[t[0]], own[t[1]], own[t[2]]});
      for (const std::uint32_t p : t) apart[p] = std::max(apart[p], largest);
    }
    return far;
  }

  /// Returns positions where the uniform mesh and the surface are farther apart than the error.
  std::vector<Far> far_between_points(const Attempt& now, const SurfaceDistance& surface,
                                      const SurfaceDistance& uniform) const {
    return compare(now, surface, uniform, false).far;
  }
  TwoSidedDistance compare(const Attempt& now, const SurfaceDistance& surface, const SurfaceDistance& uniform,
                           bool lists_pieces) const {
    const Stage stage(context_, "compare between points");
    return proof_.compare(now.file_points, now.fine.triangles(), now.offset, *now.surface, surface, uniform,
                          Wanted::any_bound, lists_pieces, context_);
  }

  /// Collapses with the rest of the error, again as long as that is worth it. Returns the positions where the
  /// first time fails, or none, with the mesh in the result. With exceptions it does not fail.
  std::vector<Far> collapse_all(const Attempt& uniform, const SurfaceDistance& surface,
                                const std::vector<double>& apart) {
    constexpr std::size_t kAny = std::numeric_limits<std::size_t>::max();
    CertifiedMesh mesh;
    std::vector<Far> far =
        collapse(uniform, surface, tolerances(uniform, apart, 0.0), mesh, excepted_.has_value(), kAny);
    if (!far.empty()) return far;
    // The result may be collapsed again, because the proof is against the polygons each time. Two thirds of
    // the vertices that the first collapses leave on plane parts can be removed; of a scan next to none.
    while (true) {
      const auto few = std::size_t(kWorthAgain * double(mesh.triangles.size()));
      const BoundedMesh before = result_;
      const Attempt now{uniform.voxel_size,
                        uniform.surface,
                        uniform.file,
                        FineMesh(mesh.points, mesh.triangles, context_),
                        uniform.in_file(mesh.points),
                        uniform.offset};
      const std::vector<float> rest = tolerances(now, apart_around_points(now, surface), kLeastShare);
      if (!collapse(now, surface, rest, mesh, false, few).empty() || mesh.triangles.size() > few) {
        const double work = result_.work;
        result_ = before;
        result_.work = work;
        break;
      }
      result_.rounds = before.rounds;
    }
    return far;
  }

  /// Returns the rest of the error at each vertex, voxels, and at least a share of it.
  std::vector<float> tolerances(const Attempt& now, const std::vector<double>& apart, double least) const {
    std::vector<float> tolerance(apart.size());
    for (std::size_t i = 0; i < apart.size(); ++i)
      tolerance[i] = float(std::max(least * options_.error, kUsed * options_.error - kUnseen * apart[i]) /
                           now.voxel_size);
    return tolerance;
  }

  /// Collapses and proves. Returns the positions where the proof fails, or none, with `mesh` and the result
  /// set; nothing is proved, and neither set, if more than `most` triangles are left.
  /// @param excepts_rest true if positions that fail at last are exceptions, too
  std::vector<Far> collapse(const Attempt& now, const SurfaceDistance& surface, std::vector<float> tolerance,
                            CertifiedMesh& mesh, bool excepts_rest, std::size_t most) {
    // The mesh is then within the error by the triangle inequality, as far as the tolerances are right.
    std::vector<Far> far;
    CertifiedMesh coarse;
    for (int lowerings = 0; lowerings <= kLowerings; ++lowerings, ++result_.rounds) {
      coarse = decimate_certified(now.fine, tolerance, {}, now.file, context_);
      count_work(double(now.fine.points().size()));
      if (coarse.triangles.size() > most) return {};
      far = prove(now, surface, coarse);
      if (far.empty() || !lower_around(now, far, tolerance)) break;
    }
    if (excepts_rest) far.clear();
    // Only this mesh, proved in the precision of the file, is written.
    if (far.empty()) {
      result_.mesh.origin = now.file.placement().origin;
      result_.mesh.points = now.in_file(coarse.points);
      result_.mesh.triangles = coarse.triangles;
      mesh = std::move(coarse);
    }
    return far;
  }

  /// Compares the mesh with the surface in both directions. Returns positions where the error may be
  /// exceeded. With exceptions, those of the result become all such positions, and those near the ones of the
  /// uniform mesh are not returned.
  std::vector<Far> prove(const Attempt& now, const SurfaceDistance& surface, const CertifiedMesh& coarse) {
    const Stage stage(context_, "prove");
    const std::vector<Eigen::Vector3f> points = now.in_file(coarse.points);
    TwoSidedDistance proved = proof_.compare(points, coarse.triangles, now.offset, *now.surface, surface,
                                             SurfaceDistance(points, coarse.triangles), Wanted::small_bound,
                                             excepted_.has_value(), context_);
    result_.to_surface = proved.to_surface;
    result_.from_surface = proved.from_surface;
    result_.free_area = proved.free_area;
    if (!excepted_) return std::move(proved.far);
    result_.excepted = ExceptionBalls(proved.far, options_.error).list();
    std::erase_if(proved.far, [&](const Far& piece) { return excepted_->nearly_contain(piece); });
    return std::move(proved.far);
  }

  /// Lowers the tolerance around positions. Returns false if it is useless at one of them already or, with
  /// exceptions, at all of them.
  bool lower_around(const Attempt& now, const std::vector<Far>& far, std::vector<float>& tolerance) {
    const TriangleTree triangles(now.file_points, now.fine.triangles(), 1.0);
    std::vector<std::uint8_t> lowered(tolerance.size(), 0);
    bool everywhere = true, somewhere = false;
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
      const bool useful = largest > kLeastTolerance;
      everywhere = everywhere && useful;
      somewhere = somewhere || useful;
    }
    for (std::size_t i = 0; i < tolerance.size(); ++i)
      if (lowered[i]) tolerance[i] *= kLowering;
    return excepted_ ? somewhere : everywhere;
  }

  /// Adds the positions at which a hole is closed, where smaller voxels would not help. Returns true if there
  /// are any.
  bool add_holes(const Attempt& now, const std::vector<Far>& far) {
    if (!options_.over_holes && !now.surface->caps.empty()) {
      const SurfaceDistance caps(now.surface->points, now.surface->caps);
      for (const Far& f : far)
        if (!f.of_surface && f.distance > options_.error && caps.at(f.place, f.distance) < f.distance)
          add(Unmet::hole, f);
    }
    sort_unmet();
    return !result_.unmet.empty();
  }

  /// Sets the next voxel size, or the positions that are unmet at the smallest.
  void choose_voxel(double voxel_size, std::span<const Eigen::Vector3f> points,
                    std::span<const Triangle> triangles, double factor, const std::vector<Far>& far) {
    const NextVoxel next =
        next_voxel(voxel_size, smallest_voxel(), factor, SurfaceDistance(points, triangles), far,
                   options_.error, kOffSurface * bounds(mesh_).size().norm());
    result_.voxel_size = next.size;
    if (next.is_smaller) return;
    result_.thickness = next.thickness;
    for (const Far& f : next.too_thin) add(Unmet::thin, f);
    sort_unmet();
  }

  /// Returns the smallest voxels that the options and the memory allow: a surface intersects about one and a
  /// half cells for each square of a voxel's side.
  double smallest_voxel() const {
    const double allowed =
        options_.smallest_voxel > 0.0 ? options_.smallest_voxel : kSmallestVoxel * options_.error;
    const double room = double(available_memory().value_or(std::uint64_t(1) << 62)) / kBytesOfPoint;
    return std::max(allowed, std::sqrt(1.5 * area_ / std::min(options_.most_points, room)));
  }

  void add(Unmet why, const Far& f) { result_.unmet.push_back({why, mesh_.origin + f.place, f.distance}); }

  void sort_unmet() {
    constexpr std::size_t kMost = 10;
    std::ranges::stable_sort(result_.unmet, std::greater<>(), &UnmetPlace::distance);
    if (result_.unmet.size() > kMost) result_.unmet.resize(kMost);
  }

  const PolygonMesh& mesh_;
  const BoundedRemeshOptions& options_;
  RunContext& context_;
  const double longest_;  ///< side of the input's box, world units
  const TwoSidedProof proof_;
  double area_ = 0.0;
  double tried_ = 0.0;  ///< voxel size of the last attempt
  std::optional<ExceptionBalls>
      excepted_;  ///< exceptions of the uniform mesh; none: exceptions are not permitted
  std::shared_ptr<const SolidSurface> surface_;  ///< of the last attempt
  BoundedMesh result_;
};

}  // namespace

BoundedMesh bounded_remesh(const PolygonMesh& mesh, const BoundedRemeshOptions& options,
                           RunContext& context) {
  if (!(options.error > 0.0) || !std::isfinite(options.error))
    throw Error("the error must be a finite number above 0");
  if (mesh.empty()) throw Error("there are no polygons to remesh");
  const std::size_t notes = context.notes.size();
  BoundedRemesher remesher(mesh, options, context);
  BoundedMesh made = remesher.run();
  const bool has_hole =
      std::ranges::any_of(made.unmet, [](const UnmetPlace& p) { return p.why == Unmet::hole; });
  if (has_hole && options.thin == ThinRule::keep && options.signs == SignRule::winding_number &&
      made.hole_area > kOpenSheet * made.area) {
    // Open parts then enclose nothing, and become shells. A solid with small holes would become one, too.
    BoundedRemeshOptions open = options;
    open.signs = SignRule::flood_fill;
    context.notes.resize(notes);
    BoundedMesh shell = BoundedRemesher(mesh, open, context).run();
    if (shell.unmet.empty()) return shell;
  }
  if (made.unmet.empty() || !options.except_thin) return made;
  context.notes.resize(notes);
  return remesher.run_with_exceptions(std::move(made));
}

}  // namespace hermesh
