#include "experiments/cli/adaptivity.h"

#include <sstream>
#include <vector>

#include "algorithms/extraction/explain.h"
#include "algorithms/extraction/frustum.h"
#include "algorithms/io/vdb_file.h"
#include "experiments/cli/cli11.h"

namespace hermesh::cli {
namespace {

constexpr int kFrustumResolution = 84;

constexpr const char* kFrustumForm =
    "\"px,py,pz lx,ly,lz angle aspect near far\", and \"ux,uy,uz\" for up behind them unless it is 0,1,0";

/// The vector that is written "1,2,3".
Eigen::Vector3d read_vector(const std::string& word) {
  std::istringstream stream(word);
  Eigen::Vector3d result;
  char comma[2] = {',', ','};
  stream >> result[0] >> comma[0] >> result[1] >> comma[1] >> result[2];
  if (!stream || stream.peek() != EOF || comma[0] != ',' || comma[1] != ',')
    throw Error("'" + word + "' is not three numbers with commas between them");
  return result;
}

double read_number(const std::string& word) {
  std::istringstream stream(word);
  double result = 0.0;
  if (!(stream >> result) || stream.peek() != EOF) throw Error("'" + word + "' is not a number");
  return result;
}

Frustum read_frustum(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  if (words.size() != 6 && words.size() != 7) throw Error(std::string("it must be ") + kFrustumForm);
  Frustum frustum;
  frustum.position = read_vector(words[0]);
  frustum.look_at = read_vector(words[1]);
  frustum.field_of_view = read_number(words[2]);
  frustum.aspect = read_number(words[3]);
  frustum.near = read_number(words[4]);
  frustum.far = read_number(words[5]);
  if (words.size() == 7) frustum.up = read_vector(words[6]);
  return frustum;
}

AdaptivityField::Outside read_outside(const std::string& name) {
  if (name == "everywhere") return AdaptivityField::Outside::everywhere;
  return name == "nothing" ? AdaptivityField::Outside::nothing : AdaptivityField::Outside::simplify;
}

/// Reads the mask or the scale of a field from a file. What is wrong with it is said here, where its file
/// is known, and before the work.
LevelSet read_part(const std::string& file, LevelSet AdaptivityField::*part, AdaptivityField::Outside outside,
                   Session& session) {
  return about_file(file, [&] {
    AdaptivityField field{.mask = {}, .outside = outside, .scale = {}};
    field.*part = read_level_set(file, "", session.context);
    FieldEvaluator(&field, IndexToWorld());
    return field.*part;
  });
}

}  // namespace

void add_adaptivity_options(CLI::App& command, AdaptivityArguments& arguments) {
  CLI::Option_group* group =
      command.add_option_group("Where an adaptive extractor keeps its bound (see also --outside)");
  CLI::Option* mask =
      group->add_option("--mask", arguments.mask,
                        "A .vdb that says where: in a level set where it is negative, in any other scalar "
                        "grid where it differs from the background");
  group
      ->add_option("--frustum", arguments.frustum,
                   std::string("Instead of a mask what a camera sees: ") + kFrustumForm +
                       "; position, point looked at, vertical angle in degrees, width over height, planes in "
                       "world units")
      ->excludes(mask);
  group
      ->add_option("--frustum-resolution", arguments.frustum_resolution,
                   "Voxels along the longest side of the frustum's mask (default: 84)")
      ->check(CLI::Range(8, 4096));
  group
      ->add_option(
          "--outside", arguments.outside,
          "Outside the mask 'simplify' (the default) merges as far as the topology allows "
          "(manifold-dual-contouring: up to 8 voxels), 'nothing' makes no polygons, so that the "
          "mesh is open, with a boundary that may touch itself, and 'everywhere' keeps the bound there, too")
      ->check(CLI::IsMember({"everywhere", "simplify", "nothing"}));
  group->add_option(
      "--tolerance-grid", arguments.tolerance_grid,
      "A .vdb whose values, none of them negative, scale the extractor's bound; beyond its data the "
      "background does");
}

std::optional<AdaptivityField> read_adaptivity(const AdaptivityArguments& arguments,
                                               const Extractor& extractor, Session& session) {
  const bool has_mask = !arguments.mask.empty() || !arguments.frustum.empty();
  if (!arguments.outside.empty() && !has_mask) throw UsageError("--outside needs --mask or --frustum");
  if (arguments.frustum_resolution && arguments.frustum.empty())
    throw UsageError("--frustum-resolution needs --frustum");
  if (!has_mask && arguments.tolerance_grid.empty()) return std::nullopt;
  as_usage([&] { check_adaptive(extractor); });
  AdaptivityField field;
  field.outside = !has_mask ? AdaptivityField::Outside::everywhere
                            : read_outside(arguments.outside.empty() ? "simplify" : arguments.outside);
  if (!arguments.mask.empty())
    field.mask = read_part(arguments.mask, &AdaptivityField::mask, field.outside, session);
  if (!arguments.frustum.empty()) {
    try {
      field.mask = frustum_mask(read_frustum(arguments.frustum),
                                arguments.frustum_resolution.value_or(kFrustumResolution), session.context);
    } catch (const Error& error) {
      throw UsageError(std::string("--frustum: ") + error.what());
    }
  }
  if (!arguments.tolerance_grid.empty())
    field.scale = read_part(arguments.tolerance_grid, &AdaptivityField::scale, field.outside, session);
  return field;
}

}  // namespace hermesh::cli
