// hermesh validate: the judges' report of one mesh.
#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>

#include "experiments/cli/report_text.h"
#include "experiments/cli/session.h"
#include "validation/mesh_report.h"

namespace hermesh::cli {
namespace {

using validation::JudgeOptions;
using validation::MeshReport;

struct Arguments {
  std::string mesh, reference, features;
  std::string require;
  bool certify = false, json = false;
  std::int64_t samples = JudgeOptions().samples;
  double dihedral = JudgeOptions().dihedral_degrees;
};

using Requirement = std::pair<std::string, bool (*)(const MeshReport&)>;

const Requirement kRequirements[] = {
    {"closed", [](const MeshReport& r) { return r.closed(); }},
    {"manifold", [](const MeshReport& r) { return r.manifold(); }},
    {"oriented", [](const MeshReport& r) { return r.oriented(); }},
    {"watertight", [](const MeshReport& r) { return r.watertight(); }},
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

std::optional<MeshFile> read_if_named(const std::string& file, RunContext& context) {
  if (file.empty()) return std::nullopt;
  return read_mesh_file(file, context);
}

int run_validate(const Arguments& arguments, Session& session) {
  const std::vector<Requirement> requirements = parse_requirements(arguments.require);
  if (arguments.certify && arguments.reference.empty())
    throw UsageError("--certify bounds the distance to a reference: name it with --reference");

  const MeshFile mesh = read_mesh_file(arguments.mesh, session.context);
  const auto reference = read_if_named(arguments.reference, session.context);
  const auto features = read_if_named(arguments.features, session.context);
  JudgeOptions options;
  options.reference = reference ? &*reference : nullptr;
  options.features = features ? &*features : nullptr;
  options.samples = arguments.samples;
  options.certify = arguments.certify;
  options.dihedral_degrees = arguments.dihedral;
  const MeshReport report = validation::judge(mesh, options, session.context);

  std::vector<std::string> unmet;
  for (const Requirement& requirement : requirements)
    if (!requirement.second(report)) unmet.push_back(requirement.first);
  std::cout << (arguments.json ? report_json(report, arguments.mesh, unmet)
                               : report_text(report, arguments.mesh, unmet));
  return unmet.empty() ? kDone : kNotMet;
}

}  // namespace

void add_validate(CLI::App& app, Session& session) {
  CLI::App* command =
      add_command(app, session, "validate", "Judge a mesh: topology, self-intersections, distances");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("MESH", arguments->mesh, "Mesh: .ply .obj .off .stl, also with .gz")->required();
  command->add_option("--reference", arguments->reference, "Mesh to measure the distances to and from");
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
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1'000'000'000}));
  command->add_option(
      "--require", arguments->require,
      "Exit with 3 unless the mesh is all of these, separated by commas: closed, manifold, oriented, "
      "watertight, no-self-intersection");
  command->add_flag("--json", arguments->json, "Print JSON");
  command->callback([arguments, &session] {
    session.command = [arguments, &session] { return run_validate(*arguments, session); };
  });
}

}  // namespace hermesh::cli
