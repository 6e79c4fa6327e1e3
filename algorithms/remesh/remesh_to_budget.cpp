#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "algorithms/remesh/bounded_remesh.h"

namespace hermesh {
namespace {

/// Least error as a share of the extent, for up to 3e5 triangles: a mesh with this bound equals the polygons,
/// except for the rounding of single precision.
constexpr double kExact = 1e-5;
/// Errors, as shares of the extent, and most vertices of tries whose mesh is mostly exact if all parts are
/// plane. Large voxels suffice for these.
constexpr std::array<double, 3> kPlaneErrors = {6e-3, 1e-3, 1e-4};
constexpr double kPointsOfPlane = 1e5;
/// Largest share of the polygons' area that may be excepted: otherwise ever smaller errors would fit.
constexpr double kMostExcepted = 0.01;
/// Work that a try counts for if it throws.
constexpr double kWorkOfFailure = 3e5;

/// Runs tries and stores the best mesh, with the notes and statistics of its run.
class Tries {
 public:
  Tries(const PolygonMesh& mesh, std::size_t triangles, RunContext& context)
      : mesh_(mesh),
        triangles_(triangles),
        context_(context),
        notes_(context.notes.size()),
        figures_(context.figures.size()) {}

  enum class Outcome { fits, too_many, refused };

  /// Remeshes within the error. A failure counts as a try that did not fit, unless all fail.
  Outcome run(const BoundedRemeshOptions& options) {
    const Numbered numbered(context_, ++tries_);
    context_.notes.resize(notes_);
    context_.figures.resize(figures_);
    try {
      BoundedRemeshOptions limited = options;
      limited.most_work = kBudgetWork - work_;
      BoundedMesh made = bounded_remesh(mesh_, limited, context_);
      work_ += made.work;
      count_ = made.mesh.triangle_count();
      if (made.excepted_area() > kMostExcepted * made.area) return Outcome::refused;
      if (!made.unmet.empty()) {
        refused_ = std::move(made);
        return Outcome::refused;
      }
      if (count_ > triangles_) return Outcome::too_many;
      best_ = std::move(made);
      best_notes_ = context_.notes;
      best_figures_ = context_.figures;
      return Outcome::fits;
    } catch (const Error&) {
      work_ += kWorkOfFailure;
      failure_ = std::current_exception();
      return Outcome::refused;
    }
  }

  /// Returns the triangles of the last mesh.
  double count() const { return double(count_); }
  /// Returns the two-sided bound of the best mesh, which may be far below the requested error.
  double best_bound() const { return std::max(best_->to_surface, best_->from_surface); }
  bool has_best() const { return best_.has_value(); }
  bool is_out_of_work() const { return work_ > kBudgetWork; }

  /// Returns the best mesh, or a refused one. @throws Error
  BoundedMesh result() {
    if (best_) {
      context_.notes = std::move(best_notes_);
      context_.figures = std::move(best_figures_);
      return std::move(*best_);
    }
    if (refused_) return std::move(*refused_);
    if (failure_) std::rethrow_exception(failure_);
    throw Error("no mesh with at most " + std::to_string(triangles_) +
                " triangles was found that is within half of the polygons' extent of them; allow more");
  }

 private:
  /// While it exists, prefixes the names of stages in progress reports with the number of the try.
  class Numbered {
   public:
    Numbered(RunContext& context, int number) : context_(context), on_progress_(context.on_progress) {
      if (!on_progress_) return;
      context.on_progress = [this, prefix = "try " + std::to_string(number) + ": "](std::string_view stage,
                                                                                    double fraction) {
        on_progress_(prefix + std::string(stage), fraction);
      };
    }
    ~Numbered() { context_.on_progress = on_progress_; }
    Numbered(const Numbered&) = delete;
    Numbered& operator=(const Numbered&) = delete;

   private:
    RunContext& context_;
    std::function<void(std::string_view stage, double fraction)> on_progress_;
  };

  const PolygonMesh& mesh_;
  std::size_t triangles_, count_ = 0;
  int tries_ = 0;
  double work_ = 0.0;
  RunContext& context_;
  std::size_t notes_, figures_;  ///< numbers before the first try
  std::optional<BoundedMesh> best_, refused_;
  std::exception_ptr failure_;
  std::vector<std::string> best_notes_;
  std::vector<std::pair<std::string, double>> best_figures_;
};

}  // namespace

BoundedMesh remesh_to_budget(const PolygonMesh& mesh, std::size_t triangles,
                             const BoundedRemeshOptions& options, RunContext& context) {
  constexpr int kTries = 12;
  using Outcome = Tries::Outcome;
  const double extent = bounds(mesh).size().norm();
  const double exact = std::min(kExact, 3.0 / double(triangles)) * extent;
  // On a smooth surface the number of triangles is inversely proportional to the error; a sphere at 0.01 of
  // the extent needs several hundred.
  BoundedRemeshOptions now = options;
  now.error = std::clamp(3.0 * extent / double(triangles), 1e-5 * extent, 0.1 * extent);
  double too_small = 0.0, enough = std::numeric_limits<double>::infinity();
  Tries tries(mesh, triangles, context);
  double count_before = std::numeric_limits<double>::infinity(),
         error_before = 1.0;  // of the last try that fitted
  const auto run_plane = [&](double share) {
    BoundedRemeshOptions plane = options;
    plane.error = share * extent;
    plane.most_points = std::min(plane.most_points, kPointsOfPlane);
    return tries.run(plane);
  };
  // The polygons themselves may be few enough, and all parts plane.
  if (mesh.triangle_count() <= triangles)
    for (const double share : kPlaneErrors)
      if (run_plane(share) == Outcome::fits && tries.best_bound() <= exact) return tries.result();
  for (int i = 0; i < kTries && !tries.is_out_of_work(); ++i) {
    const Outcome outcome = tries.run(now);
    double count = tries.count();
    if (outcome == Outcome::refused) {
      if (tries.has_best()) break;
      // A larger error may succeed, because thin parts then need not show.
      too_small = now.error;
      if (too_small >= 0.5 * extent) break;
      now.error =
          std::min(std::isfinite(enough) ? std::sqrt(too_small * enough) : 2.0 * too_small, 0.5 * extent);
      continue;
    }
    if (outcome == Outcome::fits) {
      enough = now.error;
      // Unlike smooth surfaces, plane ones need the same number of triangles for any error.
      const bool may_be_plane = count * std::sqrt(now.error) < count_before * std::sqrt(error_before);
      if (may_be_plane && tries.best_bound() > exact && now.error > kPlaneErrors.back() * extent &&
          run_plane(kPlaneErrors.back()) == Outcome::fits) {
        enough = now.error = kPlaneErrors.back() * extent;
        // The same number for an error many times smaller: all parts are plane.
        if (std::exchange(count, tries.count()) == tries.count()) break;
      }
      if (tries.best_bound() <= exact || count >= 0.9 * double(triangles)) break;
      count_before = count, error_before = now.error;
    } else {
      too_small = now.error;
    }
    if (too_small >= 0.5 * extent) break;
    // Inverse proportion, within the interval that earlier tries leave; otherwise the interval's middle.
    double next = now.error * std::clamp(count / (0.95 * double(triangles)), 0.1, 10.0);
    if (next <= too_small || next >= enough)
      next = std::isfinite(enough) ? std::sqrt(too_small * enough) : 2.0 * too_small;
    if (too_small > 0.0 && enough / too_small < 1.02) break;
    now.error = std::clamp(next, exact, 0.5 * extent);
  }
  return tries.result();
}

}  // namespace hermesh
