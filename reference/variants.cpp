#include "reference/variants.h"

#include <array>

#include "reference/cgal_surface_mesher.h"
#include "reference/exact_voxelizer.h"
#include "reference/marching_cubes_decimated.h"
#include "reference/openvdb_mesh_to_volume.h"
#include "reference/openvdb_volume_to_mesh.h"
#include "reference/pseudo_normal_voxelizer.h"

namespace hermesh {

std::span<const Extractor> reference_extractors() {
  static const std::array<Extractor, 3> kTable = {{
      {.name = "openvdb",
       .summary =
           "OpenVDB's volumeToMesh: dual extraction with mean placement, adaptive merging inside leaves",
       .promises = {.closed = true, .manifold = true, .oriented = true},
       .options = {{.name = "adaptivity",
                    .fallback = "0",
                    .help = "0 to 1, no unit: larger merges more cells into one vertex; 0 merges none",
                    .maximum = 1.0}},
       .extract = openvdb_volume_to_mesh},
      {.name = "cgal-surface-mesher",
       .summary = "CGAL's surface mesher: Delaunay refinement of the trilinear isosurface",
       .promises = {.closed = true, .manifold = true, .oriented = true, .no_self_intersection = true},
       .options = {{.name = "angle_bound",
                    .fallback = "25",
                    .help = "degrees: smallest angle of a facet; above 30 the refinement need not end",
                    .maximum = 60.0},
                   {.name = "facet_size",
                    .fallback = "4",
                    .help = "voxels: largest radius of a facet's surface ball; larger gives fewer triangles",
                    .minimum = 0.05},
                   {.name = "facet_distance",
                    .fallback = "0.5",
                    .help = "voxels: largest distance of a facet's centre to the surface; larger is coarser",
                    .minimum = 0.01},
                   {.name = "seed_spacing",
                    .fallback = "8",
                    .help = "voxels between the first points; larger starts faster and may miss small parts",
                    .minimum = 1.0,
                    .maximum = 1e6},
                   {.name = "max_points",
                    .fallback = "500000",
                    .help = "the refinement fails beyond this many points",
                    .minimum = 4.0,
                    .maximum = 4e9}},
       .extract = cgal_surface_mesher},
      {.name = "marching-cubes-decimated",
       .summary = "our marching cubes, then OpenMesh's quadric edge collapse to a triangle budget",
       .promises = {.closed = true, .manifold = true, .oriented = true},
       .options = {{.name = "triangles",
                    .fallback = "0",
                    .help = "budget of triangles; 0 takes the fraction instead",
                    .maximum = 4e9},
                   {.name = "fraction",
                    .fallback = "0.1",
                    .help = "share of marching cubes' triangles to keep, 0 to 1",
                    .maximum = 1.0},
                   {.name = "normal_flip",
                    .fallback = "180",
                    .help = "degrees: largest turn of a normal in one collapse; 180 allows any",
                    .minimum = 1.0,
                    .maximum = 180.0}},
       .extract = marching_cubes_decimated},
  }};
  return kTable;
}

std::span<const Voxelizer> reference_voxelizers() {
  static const std::array<Voxelizer, 3> kTable = {{
      {.name = "openvdb",
       .summary = "OpenVDB's meshToVolume: flooded nearest polygons, signs by the surface's side",
       .options = {{.name = "renormalize",
                    .fallback = "yes",
                    .help = "yes, as OpenVDB does by default, smooths the distances after the signs",
                    .choices = {"yes", "no"}}},
       .voxelize = openvdb_mesh_to_volume},
      {.name = "exact",
       .summary = "brute-force distances with a CGAL tree and signs by rays: the oracle for small grids",
       .options = {{.name = "signs",
                    .fallback = "parity",
                    .help = "inside is where rays cross the polygons an odd number of times, for closed "
                            "surfaces that do "
                            "not meet; or what the polygons wind around, for parts that overlap or touch",
                    .choices = {"parity", "winding-number"}}},
       .voxelize = exact_voxelizer},
      {.name = "pseudo-normals",
       .summary = "exact distances, signs from angle-weighted pseudo-normals (Bærentzen & Aanæs 2005), for "
                  "clean models",
       .options = {},
       .voxelize = pseudo_normal_voxelizer},
  }};
  return kTable;
}

}  // namespace hermesh
