#include "experiments/columns.h"

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
      {"edge_mean", "edge mean [vx]", "mean distance from the input's sharp edges to the mesh, in voxels",
       "/report/features/edge_to_mesh/mean", Unit::kVoxel},
      {"edge_max", "edge max [vx]", "largest distance from the input's sharp edges to the mesh, in voxels",
       "/report/features/edge_to_mesh/max", Unit::kVoxel},
      {"corner_mean", "corner mean [vx]", "mean distance from the input's corners to the mesh, in voxels",
       "/report/features/corner_to_mesh/mean", Unit::kVoxel},
      {"corner_max", "corner max [vx]", "largest distance from the input's corners to the mesh, in voxels",
       "/report/features/corner_to_mesh/max", Unit::kVoxel},
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
      {"options", "options", "all options, the defaults included", "/variant/options"},
  };
  return table;
}

std::vector<std::string> column_names() {
  std::vector<std::string> names;
  for (const Column& column : all_columns()) names.push_back(column.name);
  return names;
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
