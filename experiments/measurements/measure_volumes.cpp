// Scans, fog and level sets of other programs through the extractors, with both treatments of the end of the data.

#include <array>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/io/mesh_file.h"
#include "algorithms/extraction/volume_ends.h"
#include "experiments/harness/cell.h"
#include "experiments/measurements/measurements.h"
#include "experiments/pictures/render.h"
#include "experiments/harness/run_cells.h"
#include "experiments/cases/volume_cases.h"
#include "validation/mesh_report.h"

namespace hermesh {
namespace {

/// Three isovalues; of whole-numbered data at least two that many samples have exactly.
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

/// Every n-th sample of a dense volume along each axis, for quick runs. Level sets and fog are left alone.
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

/// Who competes; add a name to have another.
constexpr std::array<const char*, 4> kExtractors = {"marching-cubes", "dual-contouring",
                                                         "manifold-dual-contouring", "openvdb"};

class Measurer {
 public:
  explicit Measurer(const MeasurementInput& input)
      : input_(input),
        repetitions_(int(input.parameters.number("repetitions"))),
        crossings_(input.parameters.is("self_intersections", "yes")),
        pixels_(int(input.parameters.number("pixels"))) {}

  std::vector<MeasuredRow> run() {
    for (const Entry& entry : kEntries) measure(entry);
    return std::move(rows_);
  }

 private:
  void measure(const Entry& entry) {
    const LoadedVolume loaded = load_volume(entry.volume, input_.context);
    const bool stand_in = loaded.origin.starts_with("stand-in");
    const LevelSet volume = thinned(loaded.volume, int(input_.parameters.number("every")));
    rows_.push_back({entry.table, "the volume", {{"origin", loaded.origin}, {"sha256", loaded.sha256.substr(0, 12)}}});
    rows_.back().values["samples"] = volume.active_voxels();
    for (const double isovalue : stand_in ? entry.of_stand_in : entry.isovalues) {
      Sheet sheet;
      for (const char* name : kExtractors)
        for (const Ends ends : {Ends::closed, Ends::open})
          add_row(entry, volume, find_variant(input_.tables.extractors, name), isovalue, ends, sheet);
      draw(entry, isovalue, sheet);
    }
  }

  void add_row(const Entry& entry, const LevelSet& volume, const Extractor& extractor, double isovalue, Ends ends,
               Sheet& sheet) {
    MeasuredRow row{entry.table, extractor.name};
    row.values["isovalue"] = isovalue;
    row.values["ends"] = ends == Ends::open ? "open" : "closed";
    EndedMesh ended;
    const auto once = [&] {
      input_.context.check();
      RunContext child = child_context(input_.context, false);
      const Options options(extractor.name, extractor.options, {});
      ended = extract_with_ends(
          extractor, {.level_set = volume, .isovalue = isovalue, .options = options, .context = child}, ends);
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
      judge(row, extractor, ended, ends);
      if (ends == Ends::closed) add_picture(sheet, extractor, ended.mesh);
    }
    rows_.push_back(std::move(row));
  }

  void judge(MeasuredRow& row, const Extractor& extractor, const EndedMesh& ended, Ends ends) {
    RunContext child = child_context(input_.context, false);
    const validation::MeshReport report = validation::judge(
        to_mesh_file(ended.mesh), {.self_intersections = crossings_, .libraries = false}, child);
    row.values["triangles"] = ended.mesh.triangle_count();
    row.values["open"] = report.boundary_edges;
    row.values["nm_edges"] = report.non_manifold_edges;
    row.values["nm_vertices"] = report.non_manifold_vertices;
    row.values["flipped"] = report.inconsistent_edges;
    row.values["components"] = report.components;
    if (report.self_intersections) row.values["crossing"] = report.self_intersections->pairs;
    const bool is_cut = ends == Ends::open && ended.ends.any();
    const auto expect = [&](bool promised, std::int64_t count, const char* what) {
      if (promised && count > 0) row.broken.push_back(std::to_string(count) + what);
    };
    expect(extractor.promises.closed && !is_cut, report.boundary_edges, " boundary edges");
    expect(extractor.promises.oriented, report.inconsistent_edges, " flipped edges");
    expect(extractor.promises.manifold, report.non_manifold_edges, " non-manifold edges");
    if (const auto& pairs = report.self_intersections)
      expect(extractor.promises.no_self_intersection, pairs->pairs, " self-intersecting pairs");
    // Where the surface only touches the plane of the cut, its boundary touches itself.
    expect(extractor.promises.manifold && !is_cut, report.non_manifold_vertices, " non-manifold vertices");
  }

  void add_picture(Sheet& sheet, const Extractor& extractor, const PolygonMesh& mesh) const {
    if (pixels_ == 0 || mesh.empty()) return;
    const Bounds box = bounds(mesh);
    sheet.frame.add(box.lower);
    sheet.frame.add(box.upper);
    sheet.pictures.push_back(
        {extractor.name, {readable(double(mesh.triangle_count())) + " triangles"}, [mesh] { return mesh; }});
  }

  void draw(const Entry& entry, double isovalue, Sheet& sheet) const {
    if (sheet.pictures.empty()) return;
    sheet.title = std::string(entry.volume) + " at the isovalue " + readable(isovalue);
    sheet.subtitle = "ends closed";
    sheet.viewpoint = entry.viewpoint;
    sheet.cell_pixels = pixels_;
    render_sheet(input_.out / (file_name(std::string(entry.volume) + "-" + readable(isovalue)) + ".png"), sheet,
                 input_.context);
  }

  const MeasurementInput& input_;
  int repetitions_;
  bool crossings_;
  int pixels_;
  std::vector<MeasuredRow> rows_;
};

std::vector<MeasuredRow> measure(const MeasurementInput& input) { return Measurer(input).run(); }

}  // namespace

Measurement volumes_measurement() {
  const std::vector<MeasuredColumn> columns = {
      {"origin", "origin", "where the volume comes from"},
      {"sha256", "sha256", "of its file, the beginning"},
      {"samples", "samples", "active samples"},
      {"isovalue", "isovalue", "value of the surface, in the units of the data"},
      {"ends", "ends", "treatment of the end of the data"},
      {"reached", "reached", "ends that the surface runs into, by the grid's axes"},
      {"triangles", "triangles", "a quad counting as two"},
      {"seconds", "time [s]", "median, ends included"},
      {"open", "open", "boundary edges"},
      {"nm_edges", "nm e", "non-manifold edges"},
      {"nm_vertices", "nm v", "non-manifold vertices"},
      {"flipped", "flipped", "inconsistently oriented edges"},
      {"components", "components", "connected components"},
      {"crossing", "crossing", "self-intersecting pairs of triangles"}};
  return {.name = "volumes",
          .summary = "scans, fog and level sets of other programs through the extractors",
          .parameters = {{"every", "1", "takes every n-th sample of dense volumes along each axis", {}, 1, 64},
                         {"repetitions", "3", "timed runs", {}, 1, 100},
                         {"self_intersections", "yes", "whether they are counted", {"yes", "no"}},
                         {"pixels", "300", "width of a picture; 0 draws none", {}, 0, 4000}},
          .tables = {{"ct", "CT of a head", "extractor", columns},
                     {"mri", "MRI of a brain", "extractor", columns},
                     {"fog", "fog", "extractor", columns},
                     {"level-set", "level set of a cube", "extractor", columns}},
          .measure = measure};
}

}  // namespace hermesh
