// hermesh validate: the validation report of a mesh.
#include <algorithm>
#include <iostream>
#include <memory>
#include <sstream>

#include "experiments/cli/cli11.h"
#include "experiments/cli/conversions.h"
#include "validation/mesh_report.h"
#include "validation/report_json.h"

namespace hermesh::cli {
namespace {

using validation::CheckOptions;
using validation::MeshReport;

struct ValidateArguments {
  std::string mesh, reference, features, reference_quads = "better";
  std::string require;
  CheckOptions options = {};
};

// ---- The report as text.

void print(const std::string& name, const std::string& value) {
  constexpr std::size_t kNameWidth = 24;
  std::cout << name << std::string(name.size() < kNameWidth ? kNameWidth - name.size() : 1, ' ') << value
            << '\n';
}

void print_count(const std::string& name, std::int64_t value) { print(name, std::to_string(value)); }

/// Prints the number of defects of a kind and the locations of the first ones.
void print_defects(const std::string& name, std::int64_t count, const validation::Places& places) {
  print_count(name, count);
  for (std::size_t i = 0; i < places.points.size(); ++i) {
    std::string where = "at " + text(places.points[i]);
    if (i < places.polygons.size() && places.polygons[i][0] >= 0) {
      const auto& [first, second] = places.polygons[i];
      where += second < 0 ? ", polygon " + std::to_string(first)
                          : ", polygons " + std::to_string(first) + " and " + std::to_string(second);
    }
    print("", where);
  }
}

void print_counts(const MeshReport& report) {
  print_count("points", report.points);
  print_count("triangles", report.triangles);
  print_count("quads", report.quads);
  print_defects("boundary edges", report.boundary_edges, report.boundary_places);
  print_defects("non-manifold edges", report.non_manifold_edges, report.non_manifold_edge_places);
  print_defects("non-manifold vertices", report.non_manifold_vertices, report.non_manifold_vertex_places);
  print_defects("inconsistent edges", report.inconsistent_edges, report.inconsistent_places);
  if (report.inside_out_components)
    print_defects("components inside out", *report.inside_out_components, report.inside_out_places);
  print_defects("degenerate polygons", report.degenerate_polygons, report.degenerate_places);
  print_defects("duplicate polygons", report.duplicate_polygons, report.duplicate_places);
  print_count("isolated points", report.isolated_points);
  print_count("components", report.components);
  print_count("Euler characteristic", report.euler_characteristic);
  print("genus", report.genus ? text(*report.genus) : "none: not closed, manifold and oriented");
  if (const auto& pairs = report.self_intersections) {
    print_defects("intersecting pairs", pairs->pairs, pairs->places);
    if (pairs->pairs > 0)
      print("", std::to_string(pairs->disjoint) + " apart, " + std::to_string(pairs->vertex_sharing) +
                    " sharing a vertex, " + std::to_string(pairs->edge_sharing) + " sharing an edge");
  }
}

std::string estimate_text(const validation::Estimate& e) {
  return text(e.value) + ", between " + text(e.lower) + " and " + text(e.upper);
}

void print_solid(const validation::SolidComparison& solid) {
  print("symmetric difference", estimate_text(solid.difference));
  print("", "of it unexplained by a distance of " + text(solid.explained) + ": " +
                estimate_text(solid.unexplained));
  print("reference's solid", "volume " + estimate_text(solid.reference_volume));
  print("", "unknown volume " + estimate_text(solid.unknown_volume));
  print("", "outer boundary of area " + text(solid.reference_area) +
                (solid.possible_area > 0.0 ? " and perhaps " + text(solid.possible_area) : "") + " in " +
                std::to_string(solid.reference_components) + " components; the mesh: " +
                text(solid.mesh_area) + " in " + std::to_string(solid.mesh_components));
  print("wrong area of the mesh", estimate_text(solid.false_area));
  print("lost area", estimate_text(solid.lost_area));
}

std::string distances_text(const validation::Distances& distances) {
  return "max " + text(distances.max) + " at " + text(distances.worst) + ", mean " + text(distances.mean) +
         ", rms " + text(distances.rms) + ", " + std::to_string(distances.samples) + " samples";
}

void print_distances(const std::string& name, const std::optional<validation::Distances>& distances,
                     const std::optional<validation::HausdorffBound>& bound) {
  if (distances) print(name, distances_text(*distances));
  if (bound) print("", "from " + text(bound->lower) + " to " + text(bound->upper) + ", certified");
}

void print_measures(const MeshReport& report) {
  print("volume", text(report.volume));
  print("area", text(report.area));
  print("smallest angle", text(report.smallest_angle) + " degrees");
  print("worst aspect ratio", text(report.worst_aspect));
  print_distances("to the reference", report.to_reference, report.certified_to_reference);
  print_distances("from the reference", report.from_reference, report.certified_from_reference);
  if (report.solid) print_solid(*report.solid);
  if (const auto& features = report.features) {
    print("sharp edges", std::to_string(features->edges) + " of length " + text(features->edge_length) +
                             "; " + std::to_string(features->edges_excluded) +
                             " left out, part of a smooth blend");
    print("", distances_text(features->edge_to_mesh));
    print_count("sharp corners", features->corners);
    print("", distances_text(features->corner_to_mesh));
  }
  for (const validation::LibraryCounts& library : report.libraries) {
    print(library.library, !library.loaded                 ? "cannot load the mesh: " + library.refusal
                           : library.disagreements.empty() ? "agrees"
                                                           : "disagrees");
    for (const std::string& disagreement : library.disagreements) print("", disagreement);
  }
}

// ---- Requirements.

using Requirement = std::pair<std::string, bool (*)(const MeshReport&)>;
using Verdict = validation::SolidComparison::Verdict;

const Requirement kRequirements[] = {
    {"closed", [](const MeshReport& r) { return r.closed(); }},
    {"manifold", [](const MeshReport& r) { return r.manifold(); }},
    {"oriented", [](const MeshReport& r) { return r.oriented(); }},
    {"watertight", [](const MeshReport& r) { return r.watertight(); }},
    {"solid", [](const MeshReport& r) { return r.solid && r.solid->verdict == Verdict::same; }},
    {"no-self-intersection",
     [](const MeshReport& r) { return r.self_intersections && r.self_intersections->pairs == 0; }},
};

/// Returns the requirements named in a comma-separated list. @throws UsageError for an unknown name.
std::vector<Requirement> parse_requirements(const std::string& list) {
  std::vector<Requirement> requirements;
  std::istringstream stream(list);
  for (std::string name; std::getline(stream, name, ',');) {
    const auto found = std::ranges::find(kRequirements, name, &Requirement::first);
    if (found == std::end(kRequirements)) {
      std::string names;
      for (const auto& [known, holds] : kRequirements) names += (names.empty() ? "" : ", ") + known;
      throw UsageError("--require has no '" + name + "', only " + names);
    }
    requirements.push_back(*found);
  }
  return requirements;
}

std::optional<MeshFile> read_if_named(const std::string& file, Session& session) {
  if (file.empty()) return std::nullopt;
  MeshFile mesh = read_mesh_file(file, session.context);
  to_world_units(mesh, session);
  return mesh;
}

int run_validate(const ValidateArguments& arguments, const CLI::App& command, Session& session) {
  const std::vector<Requirement> requirements = parse_requirements(arguments.require);
  const auto required = [&](const char* name) {
    return std::ranges::find(requirements, name, &Requirement::first) != requirements.end();
  };
  CheckOptions options = arguments.options;
  if (arguments.reference.empty()) {
    if (options.certify) throw UsageError("--certify bounds the distance to a reference: pass --reference");
    if (required("solid"))
      throw UsageError("--require solid compares the mesh with a reference: pass --reference");
    refuse_idle(command, {"--voxel-size", "--reference-quads", "--solid-samples"}, "it needs --reference");
    if (arguments.features.empty()) refuse_idle(command, {"--samples"}, "distances need a --reference");
  }
  if (required("solid") && options.solid_samples == 0)
    throw UsageError("--require solid needs --solid-samples");
  if (arguments.features.empty()) refuse_idle(command, {"--dihedral"}, "sharp edges are those of --features");

  const MeshFile mesh = *read_if_named(arguments.mesh, session);
  const auto reference = read_if_named(arguments.reference, session);
  const auto features = read_if_named(arguments.features, session);
  options.reference = reference ? &*reference : nullptr;
  options.features = features ? &*features : nullptr;
  if (arguments.reference_quads == "as-given") options.reference_quads = validation::QuadRule::as_given;
  const MeshReport report = validation::check_mesh(mesh, options, session.context);

  std::vector<std::string> unmet;
  for (const auto& [name, holds] : requirements)
    if (!holds(report)) unmet.push_back(name);
  // With a reference a watertight surface must not bound another solid. An unknown solid of the reference
  // fails only the requirement `solid`.
  if (required("watertight") && !required("solid") && report.solid &&
      report.solid->verdict == Verdict::differs)
    unmet.push_back("solid");
  session.beside = validation::to_json(report);
  session.beside["mesh"] = session.inputs[0];
  session.beside["unmet_requirements"] = unmet;
  made(session, "sentences", report.sentences());
  made(session, "unmet_requirements", unmet);
  if (!session.json) {
    print("mesh", session.named(arguments.mesh));
    print_counts(report);
    print_measures(report);
    std::cout << '\n';
    for (const std::string& sentence : report.sentences()) std::cout << sentence << '\n';
    for (const std::string& name : unmet) std::cout << "Required but not met: " << name << ".\n";
  }
  return unmet.empty() ? kDone : kNotMet;
}

}  // namespace

void add_validate(CLI::App& app, Session& session) {
  CLI::App* command =
      add_command(app, session, "validate", "Validate a mesh: topology, self-intersections, distances");
  auto arguments = std::make_shared<ValidateArguments>();
  CheckOptions& options = arguments->options;
  command->add_option("MESH", arguments->mesh, kMeshIn)->required();
  add_files(*command, session, {.inputs = {&arguments->mesh}, .takes_many = true});
  command->add_option("--reference", arguments->reference, "Mesh to compare with");
  command
      ->add_option("--reference-quads", arguments->reference_quads,
                   "How quads of the reference are split for distances: better (default), along the diagonal "
                   "that bends less, for files of other programs, or as-given, from the first vertex to the "
                   "third, as in files of hermesh")
      ->check(CLI::IsMember({"better", "as-given"}));
  command->add_flag("--certify", options.certify,
                    "Certify bounds of the Hausdorff distances to the reference");
  command->add_option("--features", arguments->features,
                      "Mesh whose sharp edges and corners the mesh should reproduce");
  command
      ->add_option("--dihedral", options.dihedral_degrees,
                   "Smallest angle of a sharp edge, in degrees (default: 30)")
      ->check(CLI::Range(0.0, 180.0));
  command
      ->add_option(
          "--samples", options.samples,
          "Samples on each surface for the distances (default: " + std::to_string(options.samples) + ")")
      ->transform(whole_number(1, 1'000'000'000));
  command
      ->add_option("--solid-samples", options.solid_samples,
                   "Samples for the comparison of the solid with that of --reference; 0: no comparison "
                   "(default: " +
                       std::to_string(options.solid_samples) + ")")
      ->transform(whole_number(0, 1'000'000'000));
  command->add_option(
      "--require", arguments->require,
      "Exit with 3 unless the mesh has all of these properties, separated by commas: closed, manifold, "
      "oriented, no-self-intersection, watertight (all of these, and no component inside out), solid (bounds "
      "the solid of --reference: no inner wall is an outer one, no part is lost or added); with --reference, "
      "watertight also requires that the solid is not another one");
  command
      ->add_option("--voxel-size", options.voxel_size,
                   "Voxel size of the volume that the mesh was made from: differences within √3 voxels of "
                   "the reference are explained (default: three times the distance from the mesh to the "
                   "reference)")
      ->check(CLI::PositiveNumber);
  add_json_option(*command, session);
  set_work(*command, session,
           [arguments, command, &session] { return run_validate(*arguments, *command, session); });
}

}  // namespace hermesh::cli
