#include "algorithms/extraction/hermite_input.h"

#include <utility>

#include "algorithms/hermite/samplers.h"
#include "algorithms/hermite/solids.h"

namespace hermesh {
namespace {

FloatHermite sample(const ExtractionInput& input, const std::string& variant) {
  if (!wants_polygons(input)) return sample_level_set(input.level_set, input.isovalue, input.context);
  // The voxelizer may already have sampled exact crossings.
  if (input.hermite && input.isovalue == 0.0) return *input.hermite;
  const PolygonMesh& source =
      polygons_at_isovalue(input, variant + " was asked for exact Hermite data", "-o hermite=level-set");
  PolygonSampling sampling;
  FloatHermite hermite = sample_polygons(input.level_set, input.isovalue, source, input.context, &sampling);
  // An edge may change its sign without a polygon on it, if a sample's sign is not the polygons'
  // (samplers.h).
  if (const std::string note = missed_edges_note(sampling); !note.empty()) input.context.note(note);
  return hermite;
}

/// Moves the placement's origin to that of the world without moving samples: vertices in single precision are
/// then those of a file in single precision.
void about_world_origin(IndexToWorld& placement) {
  placement.offset += placement.origin;
  placement.origin.setZero();
}

std::vector<std::string> normal_code_names() {
  std::vector<std::string> names;
  for (const NormalCodeId id : kNormalCodes) names.emplace_back(name(id));
  return names;
}

}  // namespace

bool wants_polygons(const ExtractionInput& input) {
  const std::string& source = input.options.text("hermite");
  // If requested by name, they are wanted even if there are none, so that sampling reports the error.
  return source == "exact" || (source == "auto" && (input.source || input.hermite) && input.isovalue == 0.0);
}

const PolygonMesh& polygons_at_isovalue(const ExtractionInput& input, const std::string& asked,
                                        const std::string& instead) {
  if (!input.source) throw Error(asked + ", which need the polygons; use 'remesh', or " + instead);
  if (input.isovalue != 0.0)
    throw Error(asked +
                ", but the polygons lie at the isovalue 0 and not where it is asked to contour; use " +
                instead);
  return *input.source;
}

std::optional<PackedHermite> packed_hermite_input(const ExtractionInput& input, const std::string& variant) {
  if (parse_representation(input.options.text("representation")) != Representation::sparse)
    return std::nullopt;
  const NormalCodeId code = parse_normal_code(input.options.text("normals"));
  // From a level set each leaf is packed as soon as it is sampled, so that all floats never exist together.
  PackedHermite hermite = wants_polygons(input)
                              ? pack(sample(input, variant), code, input.context)
                              : sample_level_set_packed(input.level_set, input.isovalue, code, input.context);
  // Before any vertex is placed, so that proofs hold for the vertices of the file.
  if (input.written_in_single) about_world_origin(hermite.placement);
  Represented figures;
  figures.crossings = hermite.crossings.size();
  figures.bytes = hermite.memory_bytes();
  report_figures(figures, input.level_set, input.context);
  return hermite;
}

ThesisDense thesis_hermite_input(const ExtractionInput& input, const std::string& variant) {
  Represented figures;
  ThesisDense dense = [&] {
    const FloatHermite hermite = sample(input, variant);
    Stage stage(input.context, "store Hermite data");
    figures.crossings = hermite.crossings.size();
    return to_dense<ThesisVoxel>(hermite, input.context);
  }();
  if (input.written_in_single) about_world_origin(dense.placement);
  figures.bytes = dense.memory_bytes();
  report_size(figures, input.level_set, input.context);
  return dense;
}

FloatHermite hermite_input(const ExtractionInput& input, const std::string& variant, bool needs_normals) {
  const Representation representation = parse_representation(input.options.text("representation"));
  if (representation == Representation::directed && needs_normals)
    throw Error("directed distances have no normals to place points by; use -o placement=average with them");
  // The extractor gets the data with the losses of the representation.
  Represented data = through(representation, parse_normal_code(input.options.text("normals")),
                             sample(input, variant), input.context);
  if (input.written_in_single) about_world_origin(data.hermite.placement);
  report_figures(data, input.level_set, input.context);
  return std::move(data.hermite);
}

bool from_level_set_alone(const ExtractionInput& input) {
  return !wants_polygons(input) &&
         parse_representation(input.options.text("representation")) == Representation::sparse_float;
}

std::vector<OptionSpec> hermite_options() {
  return {
      {"hermite",
       "auto",
       "Hermite data 'exact' from the polygons, from the 'level-set', or 'auto': exact where the "
       "polygons are at hand",
       {"auto", "exact", "level-set"}},
      {"representation",
       "sparse-float",
       "how the Hermite data are kept: 'sparse-float', 'sparse' (4 bytes a crossing), or voxels: "
       "'dense-float' (52 "
       "bytes), 'fixed' (10), 'thesis' (10, as printed), 'directed' (12, no normals: with placement=average)",
       {"sparse-float", "sparse", "dense-float", "fixed", "thesis", "directed"}},
      {.name = "normals",
       .fallback = "octahedral",
       .help = "code of 16 bits for normals in 'sparse' and 'fixed'",
       .choices = normal_code_names(),
       .only_with = {"representation=sparse|fixed"}}};
}

}  // namespace hermesh
