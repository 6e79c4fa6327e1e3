// Digests of the program's outputs: show that a change preserves every byte, and that neither the number of
// threads nor the SIMD instruction set matters. `hermesh compare` compares two runs.
#include <tbb/global_control.h>

#include <cstdlib>

#include "algorithms/fracture/cutter_words.h"
#include "algorithms/hermite/solids.h"
#include "algorithms/lattice/simd/simd_level.h"
#include "algorithms/remesh/thin_parts.h"
#include "algorithms/variants.h"
#include "algorithms/voxelization/outputs/volume_outputs.h"
#include "experiments/fracture/fracture_run.h"
#include "experiments/harness/facts.h"
#include "experiments/measurements/measurements.h"

namespace hermesh {
namespace {

using Given = GivenOptions;

/// A setting in which the work must give the same digest.
struct DigestWay {
  std::string name;
  int threads = 2;
  std::optional<SimdLevel> level = {};  ///< none: the highest
};

/// Sets the SIMD level during its lifetime.
class ChosenLevel {
 public:
  explicit ChosenLevel(const std::optional<SimdLevel>& level) {
    if (const char* value = std::getenv(kVariable)) before_ = value;
    if (level) setenv(kVariable, std::string(name(*level)).c_str(), 1);
  }
  ~ChosenLevel() { before_ ? setenv(kVariable, before_->c_str(), 1) : unsetenv(kVariable); }
  ChosenLevel(const ChosenLevel&) = delete;
  ChosenLevel& operator=(const ChosenLevel&) = delete;

 private:
  static constexpr const char* kVariable = "HERMESH_SIMD";
  std::optional<std::string> before_;
};

/// Numbers of threads and SIMD levels change together, which shows in fewer runs that all of them give the
/// same.
std::vector<DigestWay> digest_ways(const Options& parameters) {
  std::vector<std::optional<SimdLevel>> levels = {{}};
  if (parameters.is("simd", "all")) {
    const std::vector<SimdLevel> available = available_simd_levels();
    const SimdLevel chosen = chosen_simd_level();
    for (auto level = available.rbegin(); level != available.rend(); ++level)
      if (*level < chosen) levels.push_back(*level);
  }
  std::vector<int> threads = {2};
  if (parameters.is("threads", "1 2 7")) threads = {2, 1, 7};
  std::vector<DigestWay> result;
  for (std::size_t i = 0; i < std::max(levels.size(), threads.size()); ++i) {
    const int count = threads[std::min(i, threads.size() - 1)];
    const std::optional<SimdLevel> level = levels[std::min(i, levels.size() - 1)];
    result.push_back({std::to_string(count) + " threads" + (level ? " and " + std::string(name(*level)) : ""),
                      count, level});
  }
  return result;
}

/// Returns a number other than the fallback that leads to other code or another result.
std::string other_number(const OptionSpec& spec) {
  const double usual = std::stod(spec.fallback);
  const double candidates[] = {3.0 * usual, spec.maximum > 1e6 ? 7.0 : 0.5, 0.5 * usual, spec.minimum};
  for (const double candidate : candidates)
    if (candidate != usual && candidate >= spec.minimum && candidate <= spec.maximum)
      return readable(candidate);
  return spec.fallback;
}

/// Returns the defaults, and each option individually at its other choices or at another number, with the
/// options that it requires.
template <class Variant>
std::vector<Given> variations(const Variant& variant) {
  std::vector<Given> result = {{}};
  for (const OptionSpec& spec : variant.options) {
    std::vector<std::string> values = spec.choices;
    if (values.empty()) values.push_back(other_number(spec));
    for (const std::string& value : values) {
      if (value == spec.fallback) continue;
      Given given = {{spec.name, value}};
      for (const std::string& condition : spec.only_with) {
        const auto [option, choices] = parse_option(condition);
        given[option] = choices.substr(0, choices.find('|'));
      }
      result.push_back(given);
    }
  }
  return result;
}

std::string text(const Given& given) {
  std::string result;
  for (const auto& [name, value] : given) result += " " + name + "=" + value;
  return result;
}

class Digests {
 public:
  explicit Digests(const MeasurementInput& input) : input_(input), ways_(digest_ways(input.parameters)) {}

  std::vector<MeasuredRow> run() {
    const std::string choice = input_.parameters.text("cases");
    std::vector<std::string> names = {choice};
    if (choice == "few") names = {"torus", "cad-part"};
    if (choice == "all") names = files();
    for (const double resolution : numbers_in(input_.parameters.text("resolutions")))
      for (const std::string& name : names) {
        input_.context.progress(name + " at " + readable(resolution), 0.0);
        name_ = name, resolution_ = resolution;
        mesh_.reset();
        level_set_.reset();
        level_sets();
        volumes();
        meshes();
        hermite();
        solids();
        pieces();
      }
    return {};
  }

 private:
  static std::vector<std::string> files() {
    std::vector<std::string> names;
    for (const CaseInfo& info : list_cases())
      if (info.kind == "file" && info.name != "thai-statue")  // a stand-in of nine million triangles
        names.push_back(info.name);
    return names;
  }

  /// Returns ours, and OpenVDB's if references are wanted.
  template <class Variant>
  std::vector<Variant> wanted(std::span<const Variant> ours, const std::vector<Variant>& all) const {
    std::vector<Variant> result(ours.begin(), ours.end());
    if (references()) result.push_back(find_variant(all, "openvdb"));
    return result;
  }
  bool references() const { return input_.parameters.is("references", "yes"); }

  // Made when a row needs them, so that a filter saves the rest.
  const PolygonMesh& mesh() {
    RunContext child = child_context(input_.context, false);
    if (!mesh_) mesh_ = input_.tables.load(name_, child).mesh;
    return *mesh_;
  }
  double voxel_size() { return bounds(mesh()).size().maxCoeff() / resolution_; }
  const LevelSet& level_set() {
    RunContext child = child_context(input_.context, false);
    if (!level_set_) level_set_ = voxelized(mesh(), "hermesh", {}, 3.0, child);
    return *level_set_;
  }

  LevelSet voxelized(const PolygonMesh& mesh, const std::string& name, const Given& options, double band,
                     RunContext& context) {
    return voxelize(mesh,
                    {.chosen = choose(input_.tables.voxelizers, name, options),
                     .voxel_size = voxel_size(),
                     .exterior_band = band,
                     .interior_band = band},
                    context);
  }

  void level_sets() {
    for (const Voxelizer& voxelizer : wanted(our_voxelizers(), input_.tables.voxelizers)) {
      for (const Given& given : variations(voxelizer))
        row("level set: " + voxelizer.name + text(given),
            [&](RunContext& child) { return digest(voxelized(mesh(), voxelizer.name, given, 3.0, child)); });
      row("level set: " + voxelizer.name + ", bands of 6",
          [&](RunContext& child) { return digest(voxelized(mesh(), voxelizer.name, {}, 6.0, child)); });
    }
  }

  void volumes() {
    row("volumes", [&](RunContext& child) {
      const VolumeRequest request =
          parse_volume_request("sdf,triangle-id,closest-point,fog,hermite,attributes");
      const VolumeOutputs made = make_volume_outputs(mesh(), {.voxel_size = voxel_size()}, request, child);
      std::string all;
      for (const openvdb::GridBase::Ptr& grid : made.grids) all += digest(*grid) + " ";
      return digest_of_text(all + digest(*made.hermite));
    });
  }

  void meshes() {
    for (const Extractor& extractor : wanted(our_extractors(), input_.tables.extractors)) {
      std::vector<Given> all = variations(extractor);
      if (extractor.name == "manifold-dual-contouring") all.push_back({{"tolerance", "0"}});
      if (extractor.name == "certified-octree") {
        all.push_back({{"tolerance", "1"}});
        all.push_back({{"flatness", "0.05"}});
      }
      if (extractor.name == "adaptive-dual-contouring")
        all.push_back({{"representation", "sparse-float"}, {"threshold", "1"}});
      for (const Given& given : all)
        row("mesh: " + extractor.name + text(given), [&](RunContext& child) {
          const ExtractRecipe recipe{.chosen = choose(input_.tables.extractors, extractor.name, given)};
          return digest(extract(level_set(), &mesh(), recipe, child).mesh);
        });
    }
  }

  void hermite() {
    row("hermite: from polygons",
        [&](RunContext& child) { return digest(sample_polygons(level_set(), 0.0, mesh(), child)); });
    row("hermite: from the level set",
        [&](RunContext& child) { return digest(sample_level_set(level_set(), 0.25 * voxel_size(), child)); });
  }

  /// Combines the model with itself, moved by a third of its size.
  void solids() {
    for (const auto& [name, boolean] : {std::pair("union", Boolean::unite),
                                        {"intersection", Boolean::intersect},
                                        {"difference", Boolean::subtract}})
      row("solid: " + std::string(name), [&, boolean](RunContext& child) {
        PolygonMesh other = mesh();
        const Eigen::Vector3f shift = (0.3 * bounds(other).size()).cast<float>();
        for (Eigen::Vector3f& point : other.points) point += shift;
        const SharedLattice lattice = shared_lattice(mesh(), other, voxel_size());
        const auto sampled = [&](const PolygonMesh& solid) {
          const auto sample = [&](const PolygonMesh& framed) {
            return solid_of(framed, voxelized(framed, "hermesh", {}, 3.0, child), ThinRule::drop, child)
                .solid;
          };
          return sample_solid(solid, lattice, sample);
        };
        const CombinedSolid made = combine(boolean, sampled(mesh()), sampled(other), child);
        return digest_of_text(digest(made.level_set) + digest(made.hermite));
      });
  }

  void pieces() {
    struct Break {
      const char *cutters, *method;
      double tolerance;
      ThesisFractureOptions::Rule rule = ThesisFractureOptions::Rule::printed;
    };
    std::vector<Break> all = {
        {"voronoi:8", "labelled", 0.0}, {"chunks:8", "labelled", 0.0},
        {"planes:2", "labelled", 0.0},  {"voronoi:8", "labelled", 0.2},
        {"voronoi:4", "thesis", 0.1},   {"voronoi:4", "thesis", 0.1, ThesisFractureOptions::Rule::repaired}};
    if (references()) all.push_back({"voronoi:4", "openvdb", 0.0});
    for (const Break& each : all)
      row("pieces: " + std::string(each.method) + " " + each.cutters +
              " tolerance=" + readable(each.tolerance) +
              (each.rule == ThesisFractureOptions::Rule::repaired ? " repaired" : ""),
          [&](RunContext& child) {
            const FractureObject object{sample_polygons(level_set(), 0.0, mesh(), child), level_set(),
                                        &mesh()};
            CutterChoices choices;
            choices.seed = input_.seed;
            const MadeCutters made =
                make_cutters(parse_cutters(each.cutters), object.hermite, choices, child);
            std::vector<PolygonMesh> meshes;
            run_fracture(
                object, made,
                {.name = each.method, .tolerance = each.tolerance, .options = {}, .rule = each.rule},
                [&](PieceOutput&& piece) { meshes.push_back(std::move(piece.mesh)); }, child);
            return digest(meshes);
          });
  }

  /// Emits the digest or the error message, and settings in which it differs.
  void row(const std::string& what, const std::function<std::string(RunContext&)>& make) {
    const std::string label = name_ + ", " + what;
    if (!input_.wants("digests", label)) return;
    std::string first;
    std::vector<std::string> broken;
    for (const DigestWay& way : ways_) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(way.threads));
      const ChosenLevel level(way.level);
      RunContext child = child_context(input_.context, false);
      std::string made;
      if (const auto failure = attempt([&] { made = make(child); })) made = "failed: " + *failure;
      if (first.empty())
        first = made;
      else if (made != first)
        broken.push_back("with " + way.name + " the digest is " + made);
    }
    const Json values = {{"resolution", int(resolution_)}, {"digest", first}, {"ways", ways_.size()}};
    input_.emit({{"digests", label, values, broken}});
  }

  const MeasurementInput& input_;
  const std::vector<DigestWay> ways_;
  std::string name_;
  double resolution_ = 0.0;
  std::optional<PolygonMesh> mesh_;
  std::optional<LevelSet> level_set_;  ///< by the default voxelizer
};

}  // namespace

std::vector<MeasuredRow> measure_digests(const MeasurementInput& input) { return Digests(input).run(); }

}  // namespace hermesh
