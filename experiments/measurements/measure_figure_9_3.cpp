// Figure 9.3 of the thesis: a cloud of polygons, its level set and its fog volumes (§5.6).
#include <cmath>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/voxelization/hermesh_voxelizer.h"
#include "algorithms/voxelization/outputs/volume_outputs.h"
#include "experiments/measurements/measurements.h"
#include "experiments/pictures/fog.h"
#include "experiments/pictures/slice.h"

namespace hermesh {
namespace {

/// The ramp at the border of the fog: its width in voxels and its side of the surface.
struct Border {
  double voxels;
  bool both_sides;
  std::string label() const {
    return readable(voxels) + (both_sides ? " voxels, both sides" : " voxels, inside");
  }
};
constexpr std::array<Border, 4> kBorders = {{{1, false}, {4, false}, {8, false}, {8, true}}};

struct Cloud {
  LevelSet level_set, fog;
  double seconds = 0.0;
};

Cloud make_cloud(const PolygonMesh& mesh, const Border& border, double voxel_size, RunContext& context) {
  VoxelizeOptions options;
  options.voxel_size = voxel_size;
  options.interior_band = border.voxels;
  options.exterior_band = border.both_sides ? border.voxels : 3.0;
  VolumeRequest request;
  request.sdf = request.fog = true;
  request.fog_exterior = border.both_sides;
  Cloud cloud;
  VolumeOutputs outputs;
  cloud.seconds = timed([&] { outputs = make_volume_outputs(mesh, options, request, context); });
  for (const openvdb::GridBase::Ptr& grid : outputs.grids)
    (grid->getName() == "fog" ? cloud.fog : cloud.level_set) =
        make_level_set(openvdb::gridPtrCast<openvdb::FloatGrid>(grid));
  return cloud;
}

/// Sums over a fog, and its deviations from §5.6: 1 inside beyond the ramp, 0 outside of it, linear between.
MeasuredRow describe(const std::string& label, const Border& border, const Cloud& cloud) {
  const openvdb::FloatGrid& fog = *cloud.fog.grid().grid;
  const openvdb::FloatGrid& sdf = *cloud.level_set.grid().grid;
  const double voxel = cloud.fog.voxel_size();
  const double outer = border.both_sides ? border.voxels : 0.0;
  std::size_t full = 0, partial = 0, wrong = 0;
  double mass = 0.0, steepest = 0.0;
  auto distances = sdf.getConstAccessor();
  auto densities = fog.getConstAccessor();
  for (auto value = fog.cbeginValueOn(); value; ++value) {
    const auto count = static_cast<std::size_t>(value.getVoxelCount());
    mass += double(count) * *value;
    (*value >= 1.0f ? full : partial) += count;
    const openvdb::Coord at = value.getCoord();
    const double distance = std::clamp(distances.getValue(at) / voxel, -border.voxels, outer);
    if (std::abs(*value - (outer - distance) / (outer + border.voxels)) > 1e-5) wrong += count;
    if (count == 1)
      for (int axis = 0; axis < 3; ++axis) {
        openvdb::Coord next = at;
        ++next[axis];
        steepest = std::max(steepest, std::abs(double(*value) - densities.getValue(next)));
      }
  }
  std::size_t inside = 0;
  for (auto value = sdf.cbeginValueAll(); value; ++value)
    if (*value < 0.0f) inside += value.getVoxelCount();
  const double cube = voxel * voxel * voxel;
  MeasuredRow row{"fog", label};
  row.values = {{"border", border.voxels},
                {"full", full},
                {"partial", partial},
                {"mass", mass * cube},
                {"solid", double(inside) * cube},
                {"steepest", steepest},
                {"wrong", wrong},
                {"seconds", cloud.seconds}};
  if (wrong > 0) row.broken.push_back("densities are not those of the ramp");
  // A density changes by a voxel's distance over the ramp's width, and distance by no more than a voxel.
  if (steepest > 1.0 / (border.voxels + outer) + 1e-5)
    row.broken.push_back("the ramp is steeper than its width says");
  return row;
}

}  // namespace

std::vector<MeasuredRow> measure_figure_9_3(const MeasurementInput& input) {
  std::vector<MeasuredRow> rows;
  if (std::ranges::none_of(kBorders,
                           [&](const Border& border) { return input.wants("fog", border.label()); }))
    return rows;
  const double resolution = input.parameters.number("resolution");
  const int pixels = int(input.parameters.number("pixels"));
  const LoadedCase model = input.tables.load_changed("sphere-cluster",
                                                     {{"spheres", input.parameters.number("puffs")},
                                                      {"spread", input.parameters.number("spread")},
                                                      {"seed", double(input.seed)}},
                                                     input.context);
  const Bounds box = bounds(model.mesh);
  const double longest = box.size().maxCoeff(), voxel_size = longest / resolution;
  const Camera camera = make_camera(20.0, 12.0);
  View view{.centre = 0.5 * (box.lower + box.upper),
            .world_width = 1.45 * longest,
            .width = pixels,
            .height = pixels};
  view.occlusion_radius = 0.1 * longest;
  const FogLook look{.extinction = input.parameters.number("optical_depth") / longest};
  PanelSheet sheet;
  if (pixels > 0)
    sheet.panels.push_back({"polygons",
                            {std::to_string(model.mesh.triangle_count()) + " triangles of " +
                             readable(input.parameters.number("puffs")) + " spheres"},
                            RayScene(model.mesh).render(camera, view, input.context)});
  for (const Border& border : kBorders) {
    if (!input.wants("fog", border.label())) continue;
    const Cloud cloud = make_cloud(model.mesh, border, voxel_size, input.context);
    MeasuredRow row = describe(border.label(), border, cloud);
    row.values["triangles"] = model.mesh.triangle_count();
    if (pixels > 0) {
      if (sheet.panels.size() == 1) {
        const SliceFrame frame = slice_frame(cloud.level_set, 2, 0.5, 3);
        sheet.panels.push_back(
            {"level set",
             {"a slice; " + std::to_string(cloud.level_set.active_voxels()) + " voxels in the band"},
             draw_slice(cloud.level_set, frame, pixels)});
      }
      const FogScene scene(cloud.fog, input.context);
      sheet.panels.push_back({"fog, ramp of " + border.label(),
                              {std::to_string(row.values["full"].get<std::size_t>()) + " voxels of 1, " +
                               std::to_string(row.values["partial"].get<std::size_t>()) + " on the ramp"},
                              scene.render(camera, view, look, input.context)});
    }
    rows.push_back(std::move(row));
  }
  if (pixels == 0) return rows;
  sheet.title =
      "Figure 9.3: a cloud, from polygons by a level set to fog, " + readable(resolution) + " voxels";
  sheet.subtitle =
      "generated spheres stand in for the thesis's cloud; light is absorbed along parallel rays, " +
      readable(input.parameters.number("optical_depth")) + " optical depths across the cloud";
  sheet.columns = 3;
  draw_panels(input.out / ("figure-9-3-" + readable(resolution) + ".png"), std::move(sheet));
  return rows;
}

}  // namespace hermesh
