#include "algorithms/variants.h"

#include "algorithms/extraction/certified_collapse/manifold_dual_contouring.h"
#include "algorithms/extraction/certified_octree/certified_octree.h"
#include "algorithms/extraction/dual_contouring/dual_contouring.h"
#include "algorithms/extraction/marching_cubes/marching_cubes.h"
#include "algorithms/thesis/adaptive_dual_contouring/adaptive_dual_contouring.h"

namespace hermesh {

std::span<const Extractor> our_extractors() {
  // The harness checks the promises with every mesh of a variant: a missing promise is a property that the
  // method does not have, for the reason in its header.
  static const std::vector<Extractor> table = {
      {.name = "marching-cubes",
       .summary = "triangles from a table of 256 sign patterns, closed and manifold (Lorensen & Cline 1987, "
                  "ambiguities resolved)",
       .promises = {.closed = true, .manifold = true, .oriented = true},
       .options = marching_cubes_options(),
       .extract = marching_cubes},
      // One vertex for each cell, shared by all sheets in it: closed, but not manifold.
      {.name = "dual-contouring",
       .summary = "uniform dual contouring of Hermite data, keeps sharp features (Ju et al. 2002; Aldén "
                  "2011, chapter 6)",
       .promises = {.closed = true, .oriented = true},
       .options = dual_contouring_options(),
       .extract = dual_contouring},
      // Chapter 6 with its faults: the sheets of a region share a vertex, too (trap T5), and crossings lost
      // in its 10-byte data leave holes (trap T2), so it promises nothing. With other data it is closed and
      // oriented.
      {.name = "adaptive-dual-contouring",
       .summary = "cells merged into 2³, 4³ and 8³ regions within each block, of 10-byte data, as printed "
                  "(Aldén 2011, chapters 4 and 6)",
       .promises = {},
       .options = adaptive_dual_contouring_options(),
       .extract = adaptive_dual_contouring},
      {.name = "manifold-dual-contouring",
       .summary = "adaptive dual contouring within a stated tolerance: closed, manifold, free of "
                  "self-intersection, sharp",
       .promises = {.closed = true, .manifold = true, .oriented = true, .no_self_intersection = true},
       .options = manifold_dual_contouring_options(),
       .extract = manifold_dual_contouring},
      {.name = "certified-octree",
       .summary = "the same promises many times as fast, with more polygons: cubes of up to 8³ cells become "
                  "one point each",
       .promises = {.closed = true, .manifold = true, .oriented = true, .no_self_intersection = true},
       .options = certified_octree_options(),
       .extract = certified_octree},
  };
  return table;
}

}  // namespace hermesh
