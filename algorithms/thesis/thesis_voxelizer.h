// The voxelizer of the thesis, chapter 5 (algorithms 1 to 5) and §3.4: rasterise sampled triangles, flood the
// outside, clean up the inside, expand the band layer by layer.
//
// As printed, with its traps: boundary voxels that the samples miss, and shells that leak where samples lie
// halfway between voxels (§5.2), distances that depend on the order of the triangles (algorithm 2), closed
// cavities that come out filled (§5.3), wrong signs of single voxels next to sharp edges and
// self-intersections (§5.3), and distances beyond the first band that rest on a neighbour's triangle
// (algorithm 5).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "algorithms/core/variant.h"

namespace hermesh {

/// Choices that the text leaves open, and the order of the triangles, on which its distances depend.
struct ThesisVoxelizerOptions {
  /// The sign angle in degrees, above 0 and at most 180: a boundary voxel is outside if its closest-point
  /// vector and that of an outside neighbour make a smaller angle.
  double sign_angle = 90.0;
  /// Seed of the triangles' order: 0 takes them as in the mesh (then the quads' halves), any other shuffles
  /// them.
  std::uint64_t shuffle_seed = 0;
  // Stages 3 to 5, optional according to §5.1. Stage 6, fog, is made from their result.
  bool signs = true;     ///< stage 3; without it distances have no sign, and there is nothing to clean up
  bool clean_up = true;  ///< stage 4; without it voxels of self-intersections stay in the band
  bool expansion =
      true;  ///< stage 5; without it the band is that of the rasterisation, about a voxel to either side
};

/// Options of the variant: those of ThesisVoxelizerOptions.
std::vector<OptionSpec> thesis_voxelizer_options();
/// Returns the values of these options.
ThesisVoxelizerOptions thesis_voxelizer_options(const Options& options);

/// Makes the level set of any polygon soup, with any winding, as a grid "sdf" of class level set, or without
/// signs as "udf". Active voxels lie within the band of their side; values outside of it are exterior_band
/// and −interior_band voxels in world units. Adds a note if next to nothing is inside. The bytes do not
/// depend on the number of threads.
///
/// Readings, where the text leaves a choice (paper/readings.md, R1 to R13, lists the effect of each):
/// - §5.2, subsets: 32 runs of consecutive triangles, for any number of threads. Each is rasterised into a
///   grid of its own; two neighbouring grids are merged at a time, the smaller distance wins, and of equal
///   ones the earlier triangle's.
/// - §5.2, samples: see rasterize_by_samples().
/// - §5.3, start of the flood: on every grid line along every axis, the first and the last voxel with a
///   distance, unless it is a boundary voxel. A part that no such line reaches from outside stays inside.
/// - §5.3, flood: from face to face, through voxels with a distance that are not boundary voxels.
/// - §5.3, boundary voxels (the rule is cut off by a page break): outside if the angle is below sign_angle
///   for any of the 18 neighbours that the flood marked, as in OpenVDB's meshToVolume; a voxel on the surface
///   itself, whose vector has no direction, is not.
/// - §5.4: "marked as outside" includes the boundary voxels that the rule above found outside.
/// - §5.5: N_closest is the neighbour with the least distance, the first of equal ones in the order of
///   kNeighbours; a layer depends only on the layers before it.
/// - §5.5, end: layers are added until one finds no voxel within the width, rather than as many as the width
///   has voxels.
/// - The first band reaches up to 2.3 voxels; its part beyond a narrower band is dropped in the end.
/// - Beyond the band the sign is that of the band's voxels before it along z (OpenVDB's flood fill of
///   values). Stored in another form than the text's: distances squared and in single precision, and instead
///   of the closest point the triangle that it lies on.
/// @throws Error as check_voxelization_fits(), and for a sign_angle out of range; Cancelled
LevelSet thesis_voxelizer(const VoxelizationInput& input, const ThesisVoxelizerOptions& options = {});

/// Index coordinates of a voxel; its centre is there, and it reaches half a voxel to every side.
using Voxel = std::array<std::int32_t, 3>;
/// Corners of a triangle in index coordinates.
using GridTriangle = std::array<Eigen::Vector3d, 3>;

/// Returns the boundary voxels of a triangle as §5.2 finds them, in lexicographic order, each once. With n =
/// d_T, the largest component of any edge, rounded up: n + 1 line segments parallel to the edge p1 p2 divide
/// the other two edges into n equal parts, and segment i is divided into i equal parts by i + 1 points. These
/// are the points whose barycentric coordinates are multiples of 1/n, so that no corner is special and
/// neighbouring points are at most a voxel apart along every axis. With n ≤ 1 they are the corners. Every
/// point is rounded to the nearest voxel, halves upwards.
///
/// About a third of the voxels that a large triangle touches contain no sample. Even so, in exact arithmetic
/// the voxels of a closed mesh separate its inside from its outside for paths from face to face, as §5.2
/// claims: rounding takes the small triangles between the samples to triangles between corners of a cube of
/// edge 1, a step from face to face is an edge of such cubes, and a triangle that has neither end of a cube's
/// edge as a corner does not meet that edge. Where two triangles sample their common edge at different
/// spacings, the strip between both rows of samples consists of such triangles, too.
///
/// In floating point they do not. If d_T is an integer and attained along an axis, neighbouring samples are
/// one voxel apart, and if they lie halfway between voxels as well, the last bit decides the rounding of each
/// one: 4.5 may become 4 and 5.5 become 6, no cube contains both, and voxel 5 is a hole through which the
/// flood empties the solid (the model "cheese" at 200 voxels has ten). The print ignores this and is
/// followed; samples at half a voxel are common in models of integer sizes.
std::vector<Voxel> rasterize_by_samples(const GridTriangle& triangle);

}  // namespace hermesh
