// Solids into pieces.
#include "hermesh/fracture.h"

#include <algorithm>
#include <cmath>

#include "algorithms/core/run_context.h"
#include "algorithms/fracture/cutter_words.h"
#include "algorithms/fracture/piece_output.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/thesis/thesis_fracture.h"
#include "packages/cpp/inside.h"

namespace hermesh::v1 {
namespace {

void check(const FractureOptions& options) {
  const auto one_of = [](const std::string& value, std::initializer_list<const char*> words) {
    return std::ranges::find(words, value) != words.end();
  };
  require(one_of(options.method, {"labelled", "thesis"}),
          "there is no method '" + options.method + "'; there are labelled and thesis");
  require(options.tolerance >= 0.0 && std::isfinite(options.tolerance),
          "the tolerance must be a number of at least 0");
  require(one_of(options.rule, {"printed", "repaired"}),
          "the rule is printed or repaired, not '" + options.rule + "'");
  require(one_of(options.hermite, {"auto", "exact", "level-set"}),
          "hermite is auto, exact or level-set, not '" + options.hermite + "'");
  require(options.roughness >= 0.0 && options.roughness <= 1.0, "the roughness must be a number from 0 to 1");
  require(options.mesh_scale > 0.0 && std::isfinite(options.mesh_scale),
          "the scale of scattered meshes must be a number above 0");
  require(options.min_volume >= 0.0 && options.min_volume <= 1e15,
          "the smallest volume must be a number from 0 to 1e15 voxels");
  const double radius = options.impact_radius.value_or(1.0);
  require(radius > 0.0 && std::isfinite(radius), "the radius of the impact must be a number above 0");
  require(!options.impact_radius || options.impact,
          "the radius of the impact has no effect: there is no impact");
  require(!options.impact || !options.density,
          "the impact has no effect: the density determines the scattered positions");
  require(options.cutters.empty() != options.meshes.empty(), "give exactly one of cutters and meshes");
}

/// Returns the cutters of the options. `copies` holds polygons that the specification points to.
CutterSpec spec_of(const FractureOptions& options, std::vector<PolygonMesh>& copies) {
  if (options.meshes.empty()) return parse_cutters(options.cutters);
  CutterSpec spec;
  spec.kind = CutterSpec::Kind::meshes;
  copies.resize(options.meshes.size());
  for (std::size_t i = 0; i < options.meshes.size(); ++i) {
    const CutterMesh& cutter = options.meshes[i];
    spec.files.push_back({cutter.name, cutter.copies, &Inside::sampled(cutter.mesh, copies[i])});
  }
  return spec;
}

std::array<double, 9> by_rows(const Eigen::Matrix3d& matrix) {
  std::array<double, 9> rows;
  for (int i = 0; i < 9; ++i) rows[i] = matrix(i / 3, i % 3);
  return rows;
}

/// Breaks an object with these Hermite data; `polygons` are those that were sampled, null for a volume.
Fracture broken(const FloatHermite& hermite, const PolygonMesh* polygons, const FractureOptions& options,
                RunContext& context) {
  require(!hermite.leaves.empty(),
          "the object has no inside at this voxel size, so there is nothing to break");
  std::vector<PolygonMesh> copies;
  CutterChoices choices;
  choices.seed = options.seed;
  choices.roughness = options.roughness;
  choices.mesh_scale = options.mesh_scale;
  if (options.impact)
    choices.impact = Eigen::Vector3d((*options.impact)[0], (*options.impact)[1], (*options.impact)[2]);
  choices.impact_radius = options.impact_radius.value_or(0.0);
  if (options.density) choices.density = Inside::level_set(options.density);
  const MadeCutters cutters = make_cutters(spec_of(options, copies), hermite, choices, context);

  Fracture result;
  const auto hand_over = [&](PieceOutput&& made) {
    measure_piece(made);
    Piece piece;
    piece.name = std::move(made.name);
    piece.mesh = Inside::mesh(std::move(made.mesh));
    piece.volume = made.mass.volume;
    piece.area = made.mass.area;
    piece.centre_of_mass = {made.mass.centre.x(), made.mass.centre.y(), made.mass.centre.z()};
    piece.inertia = by_rows(made.mass.inertia);
    piece.neighbours = std::move(made.neighbours);
    result.pieces.push_back(std::move(piece));
  };
  Stopwatch watch;
  if (options.method == "labelled") {
    hermesh::FractureOptions labelled;
    labelled.tolerance = options.tolerance;
    labelled.placement.linear_crossings = !polygons || options.hermite == "level-set";
    labelled.split = options.split;
    labelled.least_samples = static_cast<std::uint64_t>(options.min_volume);
    const LabelledFracture fracture =
        labelled_pieces(hermite, *cutters.cutters, labelled, polygons, hand_over, context);
    for (const CutterRecord& record : fracture.cutters)
      if (record.state != CutterRecord::State::cuts) context.note(record.name + " " + in_words(record.state));
  } else {
    const ThesisFractureOptions thesis = {.rule = options.rule == "repaired"
                                                      ? ThesisFractureOptions::Rule::repaired
                                                      : ThesisFractureOptions::Rule::printed,
                                          .threshold = options.tolerance * options.tolerance};
    thesis_fracture(
        hermite, *cutters.cutters, thesis,
        [&](ThesisPiece&& made) {
          if (made.mesh.empty()) return context.note(made.name + ": nothing");
          PieceOutput piece;
          piece.name = std::move(made.name);
          piece.mesh = std::move(made.mesh);
          hand_over(std::move(piece));
        },
        context);
  }
  result.seconds = watch.seconds();
  require(!result.pieces.empty(), "no piece has a surface, nothing was written");
  return result;
}

}  // namespace

Fracture fracture(const Mesh& mesh, const VoxelizeOptions& voxelizing, const FractureOptions& options,
                  Context& context) {
  return run(context, [&](RunContext& inner) {
    check(options);
    PolygonMesh copy;
    const PolygonMesh& polygons = Inside::sampled(mesh, copy);
    MadeSolid made = make_solid(polygons, recipe_of(polygons, voxelizing), inner);
    const FloatHermite hermite = options.hermite == "level-set"
                                     ? sample_level_set(made.solid.level_set, 0.0, inner)
                                     : std::move(made.solid.hermite);
    return broken(hermite, &polygons, options, inner);
  });
}

Fracture fracture(const Volume& level_set, const FractureOptions& options, Context& context) {
  return run(context, [&](RunContext& inner) {
    check(options);
    require(options.hermite != "exact", "hermite=exact needs polygons, not a volume");
    const LevelSet inside = Inside::level_set(level_set);
    return broken(sample_level_set(inside, 0.0, inner), nullptr, options, inner);
  });
}

}  // namespace hermesh::v1
