// hermesh validate: the judges' report of one mesh.
#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>

#include "experiments/cli/cli11.h"
#include "experiments/cli/pipeline/json_report.h"
#include "experiments/cli/report_text.h"
#include "experiments/cli/session.h"
#include "experiments/cli/validators.h"
#include "experiments/cli/voxelizing.h"
#include "validation/mesh_report.h"

namespace hermesh::cli {
namespace {

using validation::JudgeOptions;
using validation::MeshReport;

struct ValidateArguments {
  std::string mesh, reference, features, reference_quads = "better";
  std::string require;
  bool certify = false;
  std::int64_t samples = JudgeOptions().samples, solid_samples = JudgeOptions().solid_samples;
  double dihedral = JudgeOptions().dihedral_degrees, voxel_size = 0.0;
};

bool same_solid(const MeshReport& r) {
  return r.solid && r.solid->verdict == validation::SolidComparison::Verdict::same;
}
bool other_solid(const MeshReport& r) {
  return r.solid && r.solid->verdict == validation::SolidComparison::Verdict::differs;
}

using Requirement = std::pair<std::string, bool (*)(const MeshReport&)>;

const Requirement kRequirements[] = {
    {"closed", [](const MeshReport& r) { return r.closed(); }},
    {"manifold", [](const MeshReport& r) { return r.manifold(); }},
    {"oriented", [](const MeshReport& r) { return r.oriented(); }},
    {"watertight", [](const MeshReport& r) { return r.watertight(); }},
    {"solid", same_solid},
    {"no-self-intersection",
     [](const MeshReport& r) { return r.self_intersections && r.self_intersections->pairs == 0; }},
};

const Requirement& find_requirement(const std::string& name) {
  std::string names;
  for (const Requirement& requirement : kRequirements) {
    if (requirement.first == name) return requirement;
    names += (names.empty() ? "" : ", ") + requirement.first;
  }
  throw UsageError("--require knows no '" + name + "', only " + names);
}

/// The requirements named in a comma-separated list.
std::vector<Requirement> parse_requirements(const std::string& list) {
  std::vector<Requirement> requirements;
  std::istringstream names(list);
  for (std::string name; std::getline(names, name, ',');) requirements.push_back(find_requirement(name));
  return requirements;
}

bool names(const std::vector<Requirement>& requirements, const std::string& name) {
  return std::ranges::any_of(requirements, [&](const Requirement& r) { return r.first == name; });
}

std::optional<MeshFile> read_if_named(const std::string& file, RunContext& context) {
  if (file.empty()) return std::nullopt;
  return read_mesh_file(file, context);
}

int run_validate(const ValidateArguments& arguments, const CLI::App& command, Session& session) {
  const std::vector<Requirement> requirements = parse_requirements(arguments.require);
  if (arguments.certify && arguments.reference.empty())
    throw UsageError("--certify bounds the distance to a reference: name it with --reference");
  const bool watertight = names(requirements, "watertight"), solid = names(requirements, "solid");
  if (solid && arguments.reference.empty())
    throw UsageError("--require solid compares the mesh with a reference: name it with --reference");
  if (arguments.voxel_size > 0.0 && arguments.reference.empty())
    throw UsageError("--voxel-size says what explains a distance to a reference: name it with --reference");
  if (arguments.reference.empty() && arguments.features.empty())
    refuse_idle(command, {"--samples"}, "distances need a --reference");
  if (solid && arguments.solid_samples == 0) throw UsageError("--require solid needs --solid-samples");
  if (arguments.reference.empty())
    refuse_idle(command, {"--reference-quads", "--solid-samples"}, "it is about a --reference");
  if (arguments.features.empty()) refuse_idle(command, {"--dihedral"}, "sharp edges are those of --features");

  const MeshFile mesh = read_mesh_file(arguments.mesh, session.context);
  const auto reference = read_if_named(arguments.reference, session.context);
  const auto features = read_if_named(arguments.features, session.context);
  JudgeOptions options;
  options.reference = reference ? &*reference : nullptr;
  if (arguments.reference_quads == "as-given") options.reference_quads = validation::QuadRule::as_given;
  options.features = features ? &*features : nullptr;
  options.samples = arguments.samples;
  options.solid_samples = arguments.solid_samples;
  options.certify = arguments.certify;
  options.dihedral_degrees = arguments.dihedral;
  options.voxel_size = arguments.voxel_size;
  const MeshReport report = validation::judge(mesh, options, session.context);

  std::vector<std::string> unmet;
  for (const Requirement& requirement : requirements)
    if (!requirement.second(report)) unmet.push_back(requirement.first);
  // A watertight surface about something else is not what was meant by naming a reference. Where nobody can
  // tell what the reference encloses, only who asks for the solid asks too much.
  if (watertight && !solid && other_solid(report)) unmet.push_back("solid");
  const std::string name = session.inputs[0];
  session.report->beside = report_json(report, name, unmet);
  made(session, "sentences", report.sentences());
  made(session, "unmet_requirements", unmet);
  if (!session.json) std::cout << report_text(report, session.named(arguments.mesh), unmet);
  return unmet.empty() ? kDone : kNotMet;
}

}  // namespace

void add_validate(CLI::App& app, Session& session) {
  CLI::App* command =
      add_command(app, session, "validate", "Judge a mesh: topology, self-intersections, distances");
  auto arguments = std::make_shared<ValidateArguments>();
  command->add_option("MESH", arguments->mesh, kMeshIn)->required();
  add_files(*command, session, {.inputs = {&arguments->mesh}, .takes_many = true});
  command->add_option("--reference", arguments->reference, "Mesh to measure the distances to and from");
  command
      ->add_option("--reference-quads", arguments->reference_quads,
                   "How quads of the reference are cut for the distances: better (along the diagonal that "
                   "bends less, for "
                   "a file of another program) or as-given (from the first corner to the third, which is "
                   "what quads of "
                   "hermesh mean) (default: better)")
      ->check(CLI::IsMember({"better", "as-given"}));
  command->add_flag("--certify", arguments->certify,
                    "Bound the Hausdorff distances to the reference for certain");
  command->add_option("--features", arguments->features,
                      "Mesh whose sharp edges and corners should be there");
  command
      ->add_option("--dihedral", arguments->dihedral, "Least angle of a sharp edge, in degrees (default: 30)")
      ->check(CLI::Range(0.0, 180.0));
  command
      ->add_option(
          "--samples", arguments->samples,
          "Samples on each surface for the distances (default: " + std::to_string(arguments->samples) + ")")
      ->transform(whole_number(1, 1'000'000'000));
  command
      ->add_option("--solid-samples", arguments->solid_samples,
                   "Samples for the comparison of the solid with that of the --reference; 0: it is not "
                   "compared (default: " +
                       std::to_string(arguments->solid_samples) + ")")
      ->transform(whole_number(0, 1'000'000'000));
  command->add_option(
      "--require", arguments->require,
      "Exit with 3 unless the mesh is all of these, separated by commas: closed, manifold, oriented, "
      "watertight (all of these, no-self-intersection, and no component inside out), no-self-intersection, "
      "solid (bounds the solid of the --reference: no inner wall taken for an outer one, no part lost or "
      "added); "
      "with --reference, watertight asks that the solid is no other, too");
  command
      ->add_option(
          "--voxel-size", arguments->voxel_size,
          "Voxels that the mesh was made from: what lies within √3 of them of the reference is explained "
          "(default: three times the distance from the mesh to the reference)")
      ->check(CLI::PositiveNumber);
  add_json_option(*command, session);
  command->callback([arguments, command, &session] {
    session.command = [arguments, command, &session] { return run_validate(*arguments, *command, session); };
  });
}

}  // namespace hermesh::cli
