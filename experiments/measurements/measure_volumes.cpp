// Extraction of scans, fog and level sets of other programs, with both treatments of the end of the data.

#include <array>

#include "algorithms/core/level_set_grid.h"
#include "experiments/measurements/measurements.h"

namespace hermesh {
namespace {

/// Three isovalues; in whole-numbered data many samples equal at least two of them.
struct Entry {
  const char* table;
  const char* volume;
  std::array<double, 3> isovalues;
  std::array<double, 3> of_stand_in;
  Viewpoint viewpoint;
};

constexpr std::array<Entry, 4> kEntries = {{
    // Skin, bone, and dense bone.
    {"ct", "head-ct", {-200, 300, 1000.5}, {100, 300, 500.5}, {200.0, 65.0}},
    {"mri", "brain-mri", {30, 60, 90.5}, {100, 300, 500.5}, {120.0, 60.0}},
    {"fog", "smoke", {0.01, 0.1, 0.5}, {0.05, 0.25, 0.5}, {29.0, 20.0}},
    {"level-set", "cube-level-set", {-0.1, 0.0, 0.1}, {-2.0, 0.0, 2.0}, {29.0, 20.0}},
}};

/// Returns every n-th sample of a dense volume along each axis, for quick runs; level sets and fog unchanged.
LevelSet thinned(const LevelSet& volume, int every) {
  const openvdb::FloatGrid& grid = *volume.grid().grid;
  if (every == 1 || grid.getGridClass() != openvdb::GRID_UNKNOWN) return volume;
  const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  auto result = openvdb::FloatGrid::create(grid.background());
  const openvdb::Coord size = box.max() - box.min();
  const openvdb::Coord last(size.x() / every, size.y() / every, size.z() / every);
  for (const openvdb::Coord& at : openvdb::CoordBBox(openvdb::Coord(0), last)) {
    const openvdb::Coord from = box.min() + openvdb::Coord(at.x() * every, at.y() * every, at.z() * every);
    result->tree().setValueOn(at, grid.tree().getValue(from));
  }
  const openvdb::math::Transform::Ptr transform = grid.transform().copy();
  transform->preTranslate(box.min().asVec3d());
  transform->preScale(openvdb::Vec3d(every));
  result->setTransform(transform);
  return make_level_set(result);
}

constexpr std::array<const char*, 4> kExtractors = {"marching-cubes", "dual-contouring",
                                                    "manifold-dual-contouring", "openvdb"};

class VolumesMeasurer {
 public:
  explicit VolumesMeasurer(const MeasurementInput& input)
      : input_(input),
        repetitions_(int(input.parameters.number("repetitions"))),
        crossings_(input.parameters.is("self_intersections", "yes")),
        pixels_(int(input.parameters.number("pixels"))) {}

  std::vector<MeasuredRow> run() {
    for (const Entry& entry : kEntries) measure(entry);
    return std::move(rows_);
  }

 private:
  static constexpr const char* kVolumeLabel = "the volume";

  void measure(const Entry& entry) {
    if (!input_.wants(entry.table, kVolumeLabel) && !input_.wants_any(entry.table, kExtractors)) return;
    const LoadedVolume loaded = load_volume(entry.volume, input_.context);
    const bool stand_in = loaded.origin.starts_with("stand-in");
    const LevelSet volume = thinned(loaded.volume, int(input_.parameters.number("every")));
    rows_.push_back(
        {entry.table, kVolumeLabel, {{"origin", loaded.origin}, {"sha256", loaded.sha256.substr(0, 12)}}});
    rows_.back().values["samples"] = volume.active_voxels();
    for (const double isovalue : stand_in ? entry.of_stand_in : entry.isovalues) {
      Sheet sheet;
      for (const char* name : kExtractors)
        for (const Ends ends : {Ends::closed, Ends::open})
          if (input_.wants(entry.table, name))
            add_row(entry, volume,
                    {.chosen = choose(input_.tables.extractors, name), .isovalue = isovalue, .ends = ends},
                    sheet);
      draw(entry, isovalue, sheet);
    }
  }

  void add_row(const Entry& entry, const LevelSet& volume, const ExtractRecipe& recipe, Sheet& sheet) {
    MeasuredRow row{entry.table, recipe.chosen.extractor.name};
    row.values["isovalue"] = recipe.isovalue;
    row.values["ends"] = recipe.ends == Ends::open ? "open" : "closed";
    EndedMesh ended;
    const auto once = [&] {
      input_.context.check();
      RunContext child = child_context(input_.context, false);
      ended = extract(volume, nullptr, recipe, child);
    };
    std::vector<double> seconds;
    const auto failure = attempt([&] {
      once();
      for (int i = 0; i < repetitions_; ++i) seconds.push_back(timed(once));
    });
    if (failure) {
      row.broken.push_back(*failure);
    } else {
      row.values["seconds"] = median(seconds);
      row.values["reached"] = ended.ends.any() ? ended.ends.text() : "none";
      describe(row, recipe, ended);
      if (recipe.ends == Ends::closed) add_picture(sheet, row.label, ended.mesh);
    }
    rows_.push_back(std::move(row));
  }

  void describe(MeasuredRow& row, const ExtractRecipe& recipe, const EndedMesh& ended) const {
    RunContext child = child_context(input_.context, false);
    const auto& [report, check] = judge(to_mesh_file(ended.mesh), recipe.chosen.extractor.promises,
                                        crossings_ ? kPromisesAlone : kCounts, child,
                                        {.cut_open = recipe.ends == Ends::open && ended.ends.any()});
    row.values.update(Json{{"triangles", ended.mesh.triangle_count()},
                           {"open", report.boundary_edges},
                           {"nm_edges", report.non_manifold_edges},
                           {"nm_vertices", report.non_manifold_vertices},
                           {"flipped", report.inconsistent_edges},
                           {"components", report.components}});
    if (report.self_intersections) row.values["crossing"] = report.self_intersections->pairs;
    row.broken = check.broken;
  }

  void add_picture(Sheet& sheet, const std::string& extractor, const PolygonMesh& mesh) const {
    if (pixels_ == 0 || mesh.empty()) return;
    sheet.frame.add(bounds(mesh));
    sheet.pictures.push_back(
        {extractor, {readable(double(mesh.triangle_count())) + " triangles"}, [mesh] { return mesh; }});
  }

  void draw(const Entry& entry, double isovalue, Sheet& sheet) const {
    if (sheet.pictures.empty()) return;
    sheet.title = std::string(entry.volume) + " at the isovalue " + readable(isovalue);
    sheet.subtitle = "ends closed";
    sheet.viewpoint = entry.viewpoint;
    sheet.cell_pixels = pixels_;
    render_sheet(input_.out / (file_name(std::string(entry.volume) + "-" + readable(isovalue)) + ".png"),
                 sheet, input_.context);
  }

  const MeasurementInput& input_;
  int repetitions_;
  bool crossings_;
  int pixels_;
  std::vector<MeasuredRow> rows_;
};

}  // namespace

std::vector<MeasuredRow> measure_volumes(const MeasurementInput& input) {
  return VolumesMeasurer(input).run();
}

}  // namespace hermesh
