#include "experiments/fracture/fracture_run.h"

#include <Eigen/Eigenvalues>
#include <chrono>
#include <cmath>
#include <numbers>

#include "algorithms/extraction/certified_collapse/manifold_dual_contouring.h"
#include "algorithms/extraction/dual_contouring/dual_contouring.h"
#include "reference/openvdb_fracture.h"

namespace hermesh {
namespace {

using Clock = std::chrono::steady_clock;
double since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

class Run {
 public:
  Run(const FractureObject& object, const MadeCutters& cutters, const FractureMethod& method,
      const HandOver& hand_over, RunContext& context)
      : object_(object), cutters_(cutters), method_(method), hand_over_(hand_over), context_(context) {}

  FractureSummary run() {
    const auto start = Clock::now();
    if (method_.name == "labelled")
      labelled();
    else if (method_.name == "thesis")
      thesis();
    else
      openvdb();
    summary_.seconds = since(start) - handing_over_;
    return std::move(summary_);
  }

 private:
  void finish(PieceOutput&& piece) {
    const auto start = Clock::now();
    piece.number = ++summary_.pieces;
    measure_piece(piece);
    hand_over_(std::move(piece));
    handing_over_ += since(start);
  }

  void labelled() {
    FractureOptions options = method_.options;
    options.tolerance = method_.tolerance;
    LabelledFracture fracture = labelled_pieces(
        object_.hermite, *cutters_.cutters, options, object_.source,
        [&](PieceOutput&& piece) { finish(std::move(piece)); }, context_);
    summary_.cutters = fracture.cutters;
    summary_.labelled = std::move(fracture);
  }

  void thesis() {
    thesis_fracture(
        object_.hermite, *cutters_.cutters,
        {.rule = method_.rule, .threshold = method_.tolerance * method_.tolerance},
        [&](ThesisPiece&& made) {
          if (made.mesh.empty()) return summary_.empty.push_back(made.name);
          finish(piece_of(std::move(made)));
        },
        context_);
  }

  void openvdb() {
    const Cutters& cutters = *cutters_.cutters;
    const auto begun = Clock::now();
    const std::vector<CutCode> codes =
        cutters_.meshes.empty() ? codes_within(object_.hermite, cutters, context_) : std::vector<CutCode>();
    handing_over_ += since(begun);
    // A cutter that is not a mesh is given as the polygons of its part of space; making them is not OpenVDB's
    // work.
    const auto polygons = [&](std::size_t k) {
      if (!cutters_.meshes.empty()) return cutters_.meshes[k].mesh;
      const auto start = Clock::now();
      const FloatHermite solid = solid_of_code(object_.hermite, cutters, codes[k], context_);
      PolygonMesh mesh = dual_contouring(view_of(solid, context_), {}, context_);
      handing_over_ += since(start);
      return mesh;
    };
    const std::size_t count = cutters_.meshes.empty() ? codes.size() : cutters_.meshes.size();
    std::vector<char> took(count);
    openvdb_fracture(
        object_.level_set, count, polygons, method_.tolerance,
        [&](OpenvdbFragment&& made) {
          if (made.mesh.empty()) return;
          if (made.cutter) took[*made.cutter] = 1;
          finish(piece_of(std::move(made)));
        },
        context_);
    for (std::size_t k = 0; k < count; ++k)
      if (!took[k]) summary_.empty.push_back(cutters.name_of(cutters_.meshes.empty() ? codes[k] : k));
  }

  template <class Made>
  static PieceOutput piece_of(Made&& made) {
    PieceOutput piece;
    piece.name = made.name;
    piece.mesh = std::move(made.mesh);
    piece.conversion_seconds = made.conversion_seconds;
    piece.csg_seconds = made.csg_seconds;
    piece.extraction_seconds = made.extraction_seconds;
    return piece;
  }

  const FractureObject& object_;
  const MadeCutters& cutters_;
  const FractureMethod& method_;
  const HandOver& hand_over_;
  RunContext& context_;
  FractureSummary summary_;
  double handing_over_ = 0.0;
};

}  // namespace

void check_method(const FractureMethod& method) {
  if (method.name != "labelled" && method.name != "thesis" && method.name != "openvdb")
    throw Error("there is no method '" + method.name + "'; there are labelled, thesis and openvdb");
  if (!(method.tolerance >= 0) || !std::isfinite(method.tolerance))
    throw Error("the tolerance must be a number of at least 0");
  if (method.name == "openvdb" && method.tolerance > 1)
    throw Error("the tolerance of openvdb is its adaptivity, from 0 to 1");
}

PolygonMesh uncut_mesh(const FractureObject& object, RunContext& context) {
  if (object.hermite.leaves.empty()) return {};
  return manifold_dual_contouring(view_of(object.hermite, context), {.tolerance = 0.0, .uniform = {}},
                                  nullptr, context);
}

double uncut_volume(const FractureObject& object, RunContext& context) {
  return mass_properties(uncut_mesh(object, context)).volume;
}

double reach_of_pieces(const FractureObject& object, const FractureMethod& method,
                       const FractureSummary& summary) {
  if (!summary.labelled || summary.labelled->gaps > 0) return 0.0;
  return (std::numbers::sqrt3 + method.tolerance) * object.hermite.placement.linear.operatorNorm();
}

FractureSummary run_fracture(const FractureObject& object, const MadeCutters& cutters,
                             const FractureMethod& method, const HandOver& hand_over, RunContext& context) {
  check_method(method);
  return Run(object, cutters, method, hand_over, context).run();
}

}  // namespace hermesh
