#include "experiments/harness/columns.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace hermesh {

using Unit = Column::Unit;

std::span<const Column> all_columns() {
  static const std::vector<Column> table = {
      {"points", "points", "points of the mesh", "/report/points"},
      {"triangles", "triangles", "triangles, a quad counting as two", "/triangle_count"},
      {"quads", "quads", "quads among the polygons", "/report/quads"},
      {"seconds", "time [s]", "median extraction time", "/seconds/median"},
      {"seconds_min", "min [s]", "shortest extraction time", "/seconds/minimum"},
      {"repetitions", "runs", "timed extractions", "/seconds/repetitions"},
      {"time_over_openvdb", "÷ openvdb",
       "median time divided by that of openvdb in the same run; below 1 is faster", "/time_over_openvdb"},
      {"ns_per_voxel", "ns/voxel", "median time in nanoseconds per active voxel",
       "/nanoseconds_per_active_voxel"},
      {"peak_mib", "peak [MiB]", "peak resident memory beyond that before the extraction, the mesh included",
       "/peak_bytes", Unit::kMebibyte},
      {"process_seconds", "process [s]",
       "time of an outside program's whole process, its start and its reading and writing of files included",
       "/figures/process_seconds"},
      {"process_peak_mib", "process [MiB]", "peak resident memory of that process", "/figures/process_peak_bytes",
       Unit::kMebibyte},
      {"bytes_per_voxel", "B/voxel", "that peak in bytes per active voxel", "/bytes_per_active_voxel"},
      {"boundary", "open", "boundary edges", "/report/boundary_edges"},
      {"non_manifold_edges", "nm e", "non-manifold edges", "/report/non_manifold_edges"},
      {"non_manifold_vertices", "nm v", "non-manifold vertices", "/report/non_manifold_vertices"},
      {"inconsistent", "flipped", "inconsistently oriented edges", "/report/inconsistent_edges"},
      {"degenerate", "degen.", "degenerate polygons", "/report/degenerate_polygons"},
      {"duplicate", "dupl.", "duplicate polygons", "/report/duplicate_polygons"},
      {"self_intersections", "crossing", "self-intersecting pairs of triangles",
       "/report/self_intersecting_pairs"},
      {"components", "comp.", "connected components", "/report/components"},
      {"genus", "genus", "genus, where the mesh is closed, manifold and oriented", "/report/genus"},
      {"to_max", "to max [vx]", "largest distance from the mesh to the input, in voxels",
       "/report/to_reference/max", Unit::kVoxel},
      {"to_mean", "to mean [vx]", "mean distance from the mesh to the input, in voxels",
       "/report/to_reference/mean", Unit::kVoxel},
      {"to_rms", "to rms [vx]", "root mean square distance from the mesh to the input, in voxels",
       "/report/to_reference/rms", Unit::kVoxel},
      {"from_max", "from max [vx]", "largest distance from the input to the mesh, in voxels",
       "/report/from_reference/max", Unit::kVoxel},
      {"from_mean", "from mean [vx]", "mean distance from the input to the mesh, in voxels",
       "/report/from_reference/mean", Unit::kVoxel},
      {"from_rms", "from rms [vx]", "root mean square distance from the input to the mesh, in voxels",
       "/report/from_reference/rms", Unit::kVoxel},
      {"to_uniform_rms", "to unif. rms [vx]",
       "root mean square distance from the mesh to the method's own uniform one, in voxels", "/to_uniform/rms",
       Unit::kVoxel},
      {"to_uniform_max", "to unif. max [vx]", "largest distance from the mesh to the method's own uniform one, in voxels",
       "/to_uniform/max", Unit::kVoxel},
      {"from_uniform_max", "from unif. max [vx]", "largest distance from that to the mesh, in voxels",
       "/from_uniform/max", Unit::kVoxel},
      {"normal_mean", "normal mean [°]", "mean angle between the mesh's normals and those of the input nearest to them",
       "/report/normals_to_reference/mean"},
      {"normal_rms", "normal rms [°]", "root mean square of that angle", "/report/normals_to_reference/rms"},
      {"hermite_mib", "Hermite [MiB]", "memory of the Hermite data that the mesh was made from", "/figures/hermite_bytes",
       Unit::kMebibyte},
      {"hermite_bytes_per_crossing", "B/crossing", "that in bytes per edge crossing",
       "/figures/hermite_bytes_per_crossing"},
      {"hermite_bytes_per_voxel", "B/band voxel", "that in bytes per active voxel of the level set",
       "/figures/hermite_bytes_per_voxel"},
      {"lost_crossings", "lost", "edge crossings that the representation of the Hermite data lost",
       "/figures/lost_crossings"},
      {"escaped", "escaped", "points outside the cell or region that they stand for", "/figures/escaped"},
      {"largest_escape", "escape max [vx]", "how far such a point is outside at most, in voxels",
       "/figures/largest_escape"},
      {"quads_step_0", "quads, one level", "quads around edges whose regions all have one level",
       "/figures/quads_step_0"},
      {"triangles_step_0", "triangles, one level", "triangles around edges whose regions all have one level",
       "/figures/triangles_step_0"},
      {"edge_mean", "edge mean [vx]", "mean distance from the input's sharp edges to the mesh, in voxels",
       "/report/features/edge_to_mesh/mean", Unit::kVoxel},
      {"edge_max", "edge max [vx]", "largest distance from the input's sharp edges to the mesh, in voxels",
       "/report/features/edge_to_mesh/max", Unit::kVoxel},
      {"corner_mean", "corner mean [vx]", "mean distance from the input's corners to the mesh, in voxels",
       "/report/features/corner_to_mesh/mean", Unit::kVoxel},
      {"corner_max", "corner max [vx]", "largest distance from the input's corners to the mesh, in voxels",
       "/report/features/corner_to_mesh/max", Unit::kVoxel},
      {"solid", "solid", "whether the mesh bounds the solid of the input, within √3 voxels: same, differs, or unknown of the input",
       "/report/solid/verdict"},
      {"solid_difference", "△ [%]",
       "volume of the symmetric difference of the two solids, of the input's volume, where both are known",
       "/report/solid/difference_percent"},
      {"smallest_angle", "angle [°]", "smallest angle of a triangle", "/report/smallest_angle"},
      {"worst_aspect", "aspect", "worst aspect ratio of a triangle, 1 for an equilateral one",
       "/report/worst_aspect"},
      {"promises", "promises",
       "what the variant guarantees (c closed, m manifold, o oriented, i free of self-intersections), and "
       "whether it held",
       "/promise_letters"},
      {"judge_seconds", "judged [s]", "time that the judges took", "/judge_seconds"},
      {"voxelize_seconds", "voxelize [s]", "median voxelization time", "/voxelization/seconds/median"},
      {"voxelize_peak_mib", "vx. peak [MiB]", "peak resident memory of the voxelization",
       "/voxelization/peak_bytes", Unit::kMebibyte},
      {"active_voxels", "active voxels", "active voxels of the level set", "/voxelization/active_voxels"},
      {"grid_mib", "grid [MiB]", "memory of the level set's tree", "/voxelization/memory_bytes",
       Unit::kMebibyte},
      {"lost_surface", "lost area", "share of the bounding polygons' area that has no surface within a voxel",
       "/voxelization/lost_surface/share"},
      {"dimensions", "voxels", "dimensions of the active voxels' box", "/voxelization/dimensions_text"},
      {"voxel", "voxel", "voxel size, in the units of the case's entry", "/nominal_voxel_size"},
      {"swept", "value", "value of the parameter that the table's title names", "/sweep/value"},
      {"published_seconds", "published [s]", "the time that the source of the experiment printed",
       "/published_seconds"},
      {"openvdb_over_time", "× openvdb",
       "how many times as fast as openvdb with its default options in the same run", "/openvdb_over_time"},
      {"cpu_seconds", "CPU [s]", "median CPU time of all threads", "/cpu_seconds"},
      {"cpu_us_per_triangle", "CPU µs/tri.", "that in microseconds per triangle",
       "/cpu_microseconds_per_triangle"},
      {"ns_per_triangle", "ns/tri.", "median time in nanoseconds per triangle", "/nanoseconds_per_triangle"},
      {"peak_over_allowed", "peak ÷ allowed",
       "peak memory divided by 1.5 times the finished grid plus 8 bytes a triangle", "/peak_over_allowed"},
      {"peak_over_openvdb", "peak ÷ openvdb", "peak memory divided by openvdb's in the same run",
       "/peak_over_openvdb"},
      {"fingerprint", "fingerprint", "hash of the tree's leaves and tiles", "/voxelization/fingerprint"},
      {"judged_voxels", "judged", "active voxels whose value was compared with the true distance",
       "/accuracy/compared"},
      {"error_max", "max [vx]", "largest error of a magnitude, in voxels", "/accuracy/max"},
      {"error_rms", "rms [vx]", "root mean square error of the magnitudes, in voxels", "/accuracy/rms"},
      {"off_fine", "> 1e-4", "voxels whose magnitude is off by more than 1e-4 voxel", "/accuracy/off_fine"},
      {"off_coarse", "> 0.05", "voxels whose magnitude is off by more than 0.05 voxel",
       "/accuracy/off_coarse"},
      {"off_classified", "asked",
       "of the voxels off by more than 1e-4: those of which it was asked whether their nearest point lies on "
       "the "
       "solid's boundary",
       "/accuracy/classified"},
      {"off_boundary", "bound.", "of these, those where it does", "/accuracy/on_boundary"},
      {"off_boundary_max", "bound. max [vx]", "the largest error of those, in voxels",
       "/accuracy/on_boundary_max"},
      {"off_inner", "inner", "those where it lies on a sheet inside the solid", "/accuracy/on_inner_sheet"},
      {"off_inner_max", "inner max [vx]", "the largest error of those, in voxels",
       "/accuracy/on_inner_sheet_max"},
      {"stray", "stray", "active voxels beyond the band's width", "/accuracy/stray"},
      {"missing", "missing", "inactive voxels within the band's width about the solid's boundary",
       "/accuracy/missing"},
      {"missing_inner", "missing inner", "the same about sheets inside the solid",
       "/accuracy/missing_inner_sheet"},
      {"signs_judged", "signs",
       "voxels of the band whose sign was judged, all beyond 1e-3 voxel from the surface", "/signs/judged"},
      {"wrong_signs", "wrong", "of these, those with the wrong sign", "/signs/wrong"},
      {"wrong_share", "wrong share", "their share", "/signs/wrong_share"},
      {"wrong_inside_share", "wrong in", "share of wrong signs among the voxels inside",
       "/signs/wrong_inside_share"},
      {"wrong_outside_share", "wrong out", "share of wrong signs among the voxels outside",
       "/signs/wrong_outside_share"},
      {"undecided", "undecided", "voxels whose rays disagree, not judged", "/signs/undecided"},
      {"surface_components", "comp.", "connected components of the surface by marching cubes",
       "/surface_components"},
      {"options", "options", "all options, the defaults included", "/variant/options"},
  };
  return table;
}

std::vector<std::string> column_names() {
  std::vector<std::string> names;
  for (const Column& column : all_columns()) names.push_back(column.name);
  return names;
}

std::vector<Column> own_columns(const Json& row) {
  std::vector<Column> columns;
  const Json* own = find(row, "/table/columns");
  if (!own) return columns;
  for (const Json& column : *own)
    columns.push_back({column.at("name"), column.at("header"), column.at("meaning"),
                       "/values/" + column.at("name").get<std::string>()});
  return columns;
}

const Json* find(const Json& row, const std::string& pointer) {
  const Json::json_pointer at(pointer);
  return row.contains(at) && !row.at(at).is_null() ? &row.at(at) : nullptr;
}

double number_at(const Json& row, const std::string& pointer) {
  const Json* value = find(row, pointer);
  return value && value->is_number() ? value->get<double>() : 0.0;
}

std::string text_at(const Json& row, const std::string& pointer) {
  const Json* value = find(row, pointer);
  return !value ? "" : value->is_string() ? value->get<std::string>() : value->dump();
}

Json value_of(const Column& column, const Json& row) {
  const Json* value = find(row, column.pointer);
  if (!value) return nullptr;
  if (column.unit == Unit::kVoxel) return value->get<double>() / number_at(row, "/voxel_size");
  if (column.unit == Unit::kMebibyte) return value->get<double>() / (1 << 20);
  return *value;
}

std::string cell_text(const Column& column, const Json& row) {
  const Json value = value_of(column, row);
  if (value.is_number()) return readable(value.get<double>());
  return value.is_string() ? value.get<std::string>() : "–";
}

std::string readable(double value) {
  if (!std::isfinite(value)) return std::isnan(value) ? "nan" : value > 0 ? "inf" : "-inf";
  std::array<char, 64> text{};
  if (std::abs(value) < 999.5 && value != std::round(value)) {
    std::snprintf(text.data(), text.size(), "%.3g", value);
    return text.data();
  }
  std::snprintf(text.data(), text.size(), "%.0f", value);
  std::string digits = text.data();
  for (int at = static_cast<int>(digits.size()) - 3; at > (digits[0] == '-' ? 1 : 0); at -= 3)
    digits.insert(static_cast<std::size_t>(at), 1, ',');
  return digits;
}

}  // namespace hermesh
