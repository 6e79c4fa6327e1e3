#include "algorithms/voxelization/voxelize.h"

#include <openvdb/tools/SignedFloodFill.h>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"
#include "algorithms/lattice/grid_placement.h"
#include "algorithms/lattice/memory_estimate.h"
#include "algorithms/lattice/sample_side.h"
#include "algorithms/voxelization/distance/band.h"
#include "algorithms/voxelization/distance/wide_band.h"
#include "algorithms/voxelization/inside/boundary_distances.h"
#include "algorithms/voxelization/inside/signs.h"

namespace hermesh {
namespace {

/// In a band wider than `kWideBand` voxels, triangles search only the voxels within `kNearBand`, which the
/// blocks next to theirs contain, and each voxel beyond searches its triangle (wide_band.h).
constexpr double kWideBand = 16.0, kNearBand = 6.0;

/// If the surface runs through samples, the other end of a crossed edge is a whole voxel away from it: not
/// below the width of a band of one voxel, but with a sign that only a leaf can store. In voxels, plus a hair
/// (sample_side.h).
constexpr double kEndOfEdge = 1.001;

/// Widths of the band in world units.
struct Widths {
  float exterior, interior;
  float least;        ///< distance of a voxel inside that lies on the surface
  float end_of_edge;  ///< see kEndOfEdge

  Widths(const BandWidths& band, double voxel_size)
      : exterior(float(band.exterior * voxel_size)),
        interior(float(band.interior * voxel_size)),
        least(float(kLeastDepth * voxel_size)),
        end_of_edge(float(kEndOfEdge * voxel_size)) {}
};

/// Signs a leaf of distances, and deactivates the voxels beyond the width of their side. Returns true if the
/// leaf is still needed: it has an active voxel, or one that may be the end of a crossed edge.
bool sign_leaf(FloatLeaf& leaf, const BlockMask& inside, const Widths& widths,
               const kernels::Kernels& kernels) {
  // A wider band has such ends among its active voxels.
  const float* values = leaf.buffer().data();
  const bool has_end = std::min(widths.exterior, widths.interior) < widths.end_of_edge &&
                       *std::min_element(values, values + FloatLeaf::SIZE) <= widths.end_of_edge;
  FloatLeaf::NodeMaskType mask = leaf.getValueMask();
  kernels.apply_signs(inside.data(), widths.exterior, widths.interior, widths.least, leaf.buffer().data(),
                      &mask.getWord<openvdb::Index64>(0));
  leaf.setValueMask(mask);
  return has_end || !leaf.isEmpty();
}

/// Returns a mesh, in world units relative to the origin, of triangles in voxels, each with points of its
/// own.
PolygonMesh to_mesh(const std::vector<TriangleCorners>& triangles, double voxel_size) {
  PolygonMesh mesh;
  for (const TriangleCorners& t : triangles) {
    const std::uint32_t n = std::uint32_t(mesh.points.size());
    for (const Eigen::Vector3d& corner : Facet(t).corner)
      mesh.points.push_back(corner.cast<float>() * float(voxel_size));
    mesh.triangles.push_back({n, n + 1, n + 2});
  }
  return mesh;
}

/// Adds the distances to the caps of the holes, and the blocks that are near caps only.
void add_caps(Signs& signs, double voxel_size, double reach, const BlockTable& table, Band& band,
              RunContext& context) {
  // The caps are a mesh with blocks of its own. If the mesh has a leaf, too, the two bands merge, and a voxel
  // keeps its nearest triangle even if the cap is nearer.
  const PolygonMesh caps = to_mesh(signs.caps, voxel_size);
  const IndexSoup soup(caps, voxel_size);
  TriangleBins bins(soup, reach, context);
  Band near_caps = compute_band(soup, bins, {.reach = reach, .voxel_size = voxel_size}, context);
  for (std::size_t i = 0; i < near_caps.blocks.size(); ++i) {
    if (!near_caps.leaves[i]) continue;
    const std::uint32_t known = table.find(near_caps.blocks[i]);
    if (known != BlockTable::kNone && band.leaves[known]) {
      FloatLeaf& cap = *near_caps.leaves[i];
      FloatLeaf::NodeMaskType mask = cap.getValueMask();
      lower_distances(*band.leaves[known], cap.buffer().data(), &mask.getWord<openvdb::Index64>(0));
      continue;
    }
    // A block of the table without a voxel near the mesh exists twice from now on; only the new entry has a
    // leaf.
    band.leaves.push_back(std::move(near_caps.leaves[i]));
    band.blocks.push_back(near_caps.blocks[i]);
    signs.inside.push_back(known != BlockTable::kNone ? BlockMask(signs.inside[known])
                                                      : signs.beyond.at(near_caps.blocks[i]));
    if (!band.nearest.empty()) {
      band.nearest.push_back(std::make_unique<LeafTriangles>());
      band.nearest.back()->fill(-1);
    }
  }
}

/// Returns the grid of the nearest triangles; its active voxels are those of the band's leaves.
openvdb::Int32Grid::Ptr assemble_nearest(const Band& band) {
  using IntLeaf = openvdb::Int32Tree::LeafNodeType;
  const auto grid = openvdb::Int32Grid::create(-1);
  for (std::size_t i = 0; i < band.leaves.size(); ++i) {
    if (!band.leaves[i] || band.leaves[i]->isEmpty()) continue;
    auto leaf = std::make_unique<IntLeaf>(band.leaves[i]->origin(), -1, false);
    leaf->setValueMask(band.leaves[i]->getValueMask());
    for (auto value = leaf->beginValueOn(); value; ++value) value.setValue((*band.nearest[i])[value.pos()]);
    grid->tree().addLeaf(leaf.release());
  }
  grid->setName("triangle-id");
  return grid;
}

/// Returns the grid of the distances. Moves the leaves out of the band.
openvdb::FloatGrid::Ptr assemble_distance(Band& band, const Widths& widths, bool is_signed) {
  const auto grid = openvdb::FloatGrid::create(widths.exterior);
  for (std::unique_ptr<FloatLeaf>& leaf : band.leaves)
    if (leaf) grid->tree().addLeaf(leaf.release());
  grid->setName(is_signed ? "sdf" : "udf");
  if (!is_signed) return grid;
  // The leaves are signed already, so the fill starts above them (level 1): it gives tiles between leaves the
  // sign and the width of their side.
  openvdb::tools::signedFloodFillWithValues(grid->tree(), widths.exterior, -widths.interior, true, 1, 1);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return grid;
}

/// The parts of the boundary that differ from the mesh.
struct Boundary {
  bool is_signed = false;  ///< false when there is no inside
  InteriorFaces sheets;
  std::vector<TriangleCorners> caps;
};

/// Finds the sides and makes `band` signed. The order matters: the caps come after the interior faces, which
/// replaces distances by those to the mesh only; the signs last, when every distance is the least.
Boundary sign(const IndexSoup& soup, SignRule rule, const BandWork& work, TriangleBins& bins,
              const Widths& widths, Band& band, RunContext& context) {
  const Stage stage(context, "signs");
  Signs signs = find_signs(soup, rule, bins, band, work.reach, context);
  if (!signs.usable) return {};
  Boundary boundary{.is_signed = true,
                    .sheets = leave_out_interior_faces(soup, bins, signs, work, band, context),
                    .caps = {}};
  if (!signs.caps.empty()) add_caps(signs, work.voxel_size, work.reach, bins.blocks(), band, context);
  const kernels::Kernels& kernels = chosen_kernels<kernels::Kernels>();
  parallel_blocks(band.leaves.size(), context, [&](std::size_t i) {
    std::unique_ptr<FloatLeaf>& leaf = band.leaves[i];
    if (leaf && !sign_leaf(*leaf, signs.inside[i], widths, kernels)) leaf.reset();
  });
  boundary.caps = std::move(signs.caps);
  return boundary;
}

/// Returns the mesh's triangles without the inner ones, the outer pieces of those, and the caps of its holes.
BoundaryTriangles boundary_triangles(const IndexSoup& soup, const Boundary& boundary) {
  BoundaryTriangles result;
  result.points = soup.mesh().points;
  for (std::uint32_t t = 0; t < soup.size(); ++t) {
    if (std::ranges::binary_search(boundary.sheets.triangles, t)) continue;
    result.triangles.push_back(soup.triangle(t));
    result.ids.push_back(std::int32_t(t));
  }
  const auto add = [&](const PolygonMesh& mesh, const std::vector<std::uint32_t>& parents) {
    const std::uint32_t first = std::uint32_t(result.points.size());
    result.points.insert(result.points.end(), mesh.points.begin(), mesh.points.end());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const auto [a, b, c] = mesh.triangles[i];
      result.triangles.push_back({first + a, first + b, first + c});
      result.ids.push_back(parents.empty() ? -1 : std::int32_t(parents[i]));
    }
  };
  add(boundary.sheets.pieces, boundary.sheets.parents);
  add(to_mesh(boundary.caps, 1.0 / soup.scale()), {});
  return result;
}

Voxelization voxelize_within(const PolygonMesh& mesh, const VoxelizeOptions& options, const BandWidths& near,
                             RunContext& context) {
  const BandWidths wide{options.exterior_band, options.interior_band};
  const double width = std::max(near.exterior, near.interior);
  const BandWork work{.reach = options.signs == SignRule::none ? width : std::max(width, kEndOfEdge),
                      .voxel_size = options.voxel_size,
                      .nearest = options.nearest};
  const IndexSoup soup(mesh, options.voxel_size);
  std::optional<TriangleBins> bins;
  {
    const Stage stage(context, "triangles to blocks");
    bins.emplace(soup, work.reach, context);
  }
  Band band;
  {
    const Stage stage(context, "distances");
    band = compute_band(soup, *bins, work, context);
  }
  Boundary boundary;
  if (options.signs != SignRule::none) {
    boundary = sign(soup, options.signs, work, *bins, Widths(near, options.voxel_size), band, context);
  }
  // Their memory is free before the tree grows.
  bins.reset();
  Voxelization result;
  result.is_signed = boundary.is_signed;
  {
    const Stage stage(context, "tree");
    // First, because the distances take the leaves.
    if (options.nearest) result.nearest = assemble_nearest(band);
    result.distance = assemble_distance(band, Widths(wide, options.voxel_size), result.is_signed);
  }
  // Without signs `near` has the requested widths.
  const bool is_wider = result.is_signed && (wide.exterior > near.exterior || wide.interior > near.interior);
  if (is_wider || (options.boundary && result.is_signed))
    result.boundary = boundary_triangles(soup, boundary);
  if (is_wider) {
    const Stage stage(context, "wide band");
    band = {};
    widen_band(result.boundary, options.voxel_size, near, wide, *result.distance, result.nearest.get(),
               context);
    if (!options.boundary) result.boundary = {};
  }
  result.distance->setTransform(transform_at(mesh.origin, options.voxel_size));
  if (result.nearest) result.nearest->setTransform(transform_at(mesh.origin, options.voxel_size));
  return result;
}

// The caller has checked the value, so any other value, or an input without options, is "auto".
SignRule sign_rule(const Options& options) {
  if (options.is("signs", "flood-fill")) return SignRule::flood_fill;
  if (options.is("signs", "winding-number")) return SignRule::winding_number;
  if (options.is("signs", "unsigned")) return SignRule::none;
  if (options.is("signs", "auto-sheets")) return SignRule::automatic_sheets;
  return SignRule::automatic;
}

}  // namespace

std::vector<OptionSpec> hermesh_voxelizer_options() {
  return {
      {.name = "signs",
       .fallback = "auto",
       .help =
           "inside is what infinity cannot reach, or what the polygons wind around; auto floods, and winds "
           "where the flood leaks in; auto-sheets does not wind where that would close large holes",
       .choices = {"auto", "auto-sheets", "flood-fill", "winding-number", "unsigned"}}};
}

VoxelizeOptions voxelize_options(const VoxelizationInput& input) {
  return {.voxel_size = input.voxel_size,
          .exterior_band = input.exterior_band,
          .interior_band = input.interior_band,
          .signs = sign_rule(input.options)};
}

LevelSet hermesh_voxelizer(const VoxelizationInput& input) {
  return make_level_set(voxelize(input.mesh, voxelize_options(input), input.context).distance);
}

Voxelization voxelize(const PolygonMesh& mesh, const VoxelizeOptions& options, RunContext& context) {
  check_voxelization_fits(mesh, options.voxel_size, options.exterior_band, options.interior_band);
  initialize_openvdb();
  // Without an inside all space is outside, and as wide as the exterior band.
  VoxelizeOptions outside_only = options;
  outside_only.signs = SignRule::none;
  outside_only.interior_band = options.exterior_band;
  const BandWidths wide{options.exterior_band, options.interior_band}, exterior{wide.exterior, wide.exterior};
  if (options.signs == SignRule::none) return voxelize_within(mesh, outside_only, exterior, context);
  const bool is_wide = std::max(wide.exterior, wide.interior) > kWideBand;
  const BandWidths near =
      is_wide ? BandWidths{std::min(wide.exterior, kNearBand), std::min(wide.interior, kNearBand)} : wide;
  Voxelization result = voxelize_within(mesh, options, near, context);
  // If no inside was found, the result is right only if the search went exactly as far as the exterior band.
  const bool is_as_wide = !is_wide && wide.interior == wide.exterior && wide.exterior >= kEndOfEdge;
  if (result.is_signed || is_as_wide) return result;
  return voxelize_within(mesh, outside_only, exterior, context);
}

}  // namespace hermesh
