// What the commands share that make meshes of volumes.
#pragma once

#include <string>
#include <vector>

#include "algorithms/core/variant.h"
#include "algorithms/io/mesh_file.h"
#include "experiments/cli/session.h"
#include "experiments/pipeline.h"

namespace hermesh::cli {

struct ExtractorArguments {
  std::string extractor;             ///< set by add_extractor_options()
  std::vector<std::string> options;  ///< key=value
};

void add_extractor_options(CLI::App& command, ExtractorArguments& arguments, const std::string& fallback);

/// Looks the extractor up and checks its options. @throws UsageError for a name or an option that there is
/// not.
ChosenExtractor choose_extractor(const ExtractorArguments& arguments);

void print_extracted(Session& session, const PolygonMesh& mesh, const std::string& extractor, double seconds);

/// Notes that a mesh has many more components than the polygons that it was made from, in time and memory
/// that are linear in both. A few more are nothing that a note is worth: polygons that cross are one solid,
/// or several.
void note_components(const PolygonMesh& polygons, const PolygonMesh& mesh, Session& session);

/// Writes the mesh, with the unit of its coordinates if --units says it and the format has a place for it.
void write_output(const std::string& path, const PolygonMesh& mesh, Session& session);
/// Measures how much of the visible surface of the polygons the mesh does not show
/// (validation/visible_loss.h), and notes it. Returns true if the share is at most `max_loss`. @param
/// voxel_size world units
bool check_visible_loss(const PolygonMesh& polygons, const PolygonMesh& mesh, double voxel_size,
                        double max_loss, Session& session);

/// Writes the mesh as write_output() does; from then on a signal is too late.
void save(const std::string& path, const PolygonMesh& mesh, Session& session);

}  // namespace hermesh::cli
