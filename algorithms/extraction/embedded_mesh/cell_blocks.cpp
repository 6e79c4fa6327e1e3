#include "algorithms/extraction/embedded_mesh/cell_blocks.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cmath>

#include "algorithms/core/parallel.h"

namespace hermesh {
namespace {

/// Returns true if all crossings of an ambiguous face belong to one sheet.
bool has_one_sheet(const CellSheets& sheets, int face) {
  const std::array<int, 4> edges = face_edges(face);
  return std::ranges::all_of(edges,
                             [&](int edge) { return sheets.sheet_of[edge] == sheets.sheet_of[edges[0]]; });
}

/// Returns true for alternating corners. Joining several faces of such a cell could leave loops that no plane
/// separates (cell_sheets.h).
bool is_checkerboard(int signs) { return kCellSheets[signs].sheets == 4; }

}  // namespace

CellBlocks::CellBlocks(const CellGrid& grid, RunContext& context)
    : grid_(grid),
      source_(grid.blocks()),
      rounding_(rounding_in_file()),
      margin_(margin_for_rounding()),
      cuts_(grid.cuts()),
      given_(grid.joint_sheets()),
      blocks_(grid.blocks().size()),
      joined_sheets_(blocks_.size()),
      several_(blocks_.size()) {
  Stage stage(context, "find cells");
  std::array<bool, 256> is_plain;  // by signs of the corners
  for (std::size_t signs = 0; signs < 256; ++signs)
    is_plain[signs] = kCellSheets[signs].sheets == 1 && kCellSheets[signs].ambiguous_faces == 0;
  const std::size_t n = blocks_.size();
  std::vector<std::uint64_t> codes(n), points(n);
  // Count, scan, fill (core/parallel.h), so that the numbers do not depend on the thread schedule.
  std::vector<std::vector<std::uint8_t>> found(n);
  parallel_blocks(n, context, [&](std::size_t b) {
    Block& block = blocks_[b] = {};
    const std::array<BlockMask, 8> signs = corner_signs(static_cast<std::int32_t>(b));
    block.joints = cells_with_cuts(static_cast<std::int32_t>(b));
    for (int word = 0; word < 8; ++word) {
      std::uint64_t all = ~std::uint64_t{0}, some = 0;
      // Active cells have corners of both signs, or are joints: both ends of a cut may be inside.
      for (const BlockMask& corner : signs) all &= corner[word], some |= corner[word];
      block.active[word] = (some & ~all) | block.joints[word];
    }
    if (!grid_.is_complete(source_[b].lower)) std::ranges::fill(block.active, 0);
    codes[b] = count_before(block);
    found[b].reserve(codes[b]);
    for_each_bit(block.active, [&](int cell) {
      int code = 0;
      for (int c = 0; c < 8; ++c) code |= test(signs[c], cell) << c;
      found[b].push_back(static_cast<std::uint8_t>(code));
      if (!is_plain[code]) block.special[cell >> 6] |= std::uint64_t{1} << (cell & 63);
    });
    for (std::size_t word = 0; word < 8; ++word) block.special[word] |= block.joints[word];
  });
  codes_.resize(exclusive_scan(codes, "cells"));
  parallel_blocks(n, context, [&](std::size_t b) {
    blocks_[b].first_cell = static_cast<std::uint32_t>(codes[b]);
    const std::vector<std::uint8_t> own = std::move(found[b]);  // freed here, in parallel
    std::ranges::copy(own, codes_.begin() + static_cast<std::ptrdiff_t>(codes[b]));
  });
  // Before vertices are numbered, because the drawing of faces determines the number of sheets.
  draw_ambiguous_faces(context);
  // The vertex of a first sheet has the cell's rank in the block, which plain_points() relies on; those of
  // further sheets, which only special cells have, follow.
  parallel_blocks(n, context, [&](std::size_t b) {
    std::uint16_t later = 0;
    for_each_bit(blocks_[b].special, [&](int cell) {
      const int sheets = point_count(static_cast<std::int32_t>(b), cell);
      if (sheets <= 1) return;
      several_.at(b).emplace_back(static_cast<std::uint16_t>(cell), later);
      later = static_cast<std::uint16_t>(later + sheets - 1);
    });
    points[b] = cells_in(static_cast<std::int32_t>(b)) + later;
  });
  points_ = exclusive_scan(points, "points");
  for (std::size_t b = 0; b < n; ++b) blocks_[b].first_point = static_cast<std::uint32_t>(points[b]);
}

/// Draws ambiguous faces as the normals indicate, then reverses those that are pinched. The second pass
/// handles one face after another, since reversing one may resolve the next one of its cells; one pass is
/// sufficient, because it splits sheets and joins none.
void CellBlocks::draw_ambiguous_faces(RunContext& context) {
  struct Face {
    std::int32_t block;
    int cell, face;
    bool joined;  ///< according to the normals
  };
  std::vector<std::vector<Face>> faces(blocks_.size());
  parallel_blocks(blocks_.size(), context, [&](std::size_t b) {
    const auto block = static_cast<std::int32_t>(b);
    for_each_bit(blocks_[b].special, [&](int cell) {
      // Each face once, as an upper face of the cell below it. Nothing is marked as joined yet, so sheets()
      // returns kCellSheets for all cells without a cut. Faces of joints stay unchanged: the lattice draws
      // both of their sides (fracture/label_repair.h).
      for (int face = 1; face < 6; face += 2) {
        if (!((sheets(block, cell).ambiguous_faces >> face) & 1)) continue;
        const Cell upper = beside(block, cell, face);
        if (!is_active(upper)) continue;
        if (!is_joint(block, cell) && !is_joint(upper.block, upper.cell) &&
            grid_.is_of_one_piece(block, cell, face))
          faces[b].push_back({block, cell, face, normals_join(block, cell, face)});
      }
    });
  });
  std::vector<std::uint8_t> joined(codes_.size());  // faces, by active cell
  const auto joined_faces = [&](const Cell& at) -> std::uint8_t& {
    return joined[cell_number(at.block, at.cell)];
  };
  const auto code = [&](const Cell& at) { return codes_[cell_number(at.block, at.cell)]; };
  // Both cells at a face record its drawing, so their segments on it agree and the surface stays closed.
  const auto cut_the_other_way = [&](const Cell& lower, const Cell& upper, int face) {
    joined_faces(lower) ^= static_cast<std::uint8_t>(1 << face);
    joined_faces(upper) ^= static_cast<std::uint8_t>(1 << (face ^ 1));
  };
  // Both passes are sequential, by block, cell and face: the result of the second depends on the order.
  for (const auto& list : faces)
    for (const auto& [block, cell, face, join] : list) {
      const Cell lower{block, cell}, upper = beside(block, cell, face);
      if (join && !is_checkerboard(code(lower)) && !is_checkerboard(code(upper)))
        cut_the_other_way(lower, upper, face);
    }
  for (const auto& list : faces)
    for (const auto& [block, cell, face, join] : list) {
      const Cell lower{block, cell}, upper = beside(block, cell, face);
      // With all faces as drawn so far, including those reversed by this pass.
      const auto sheets_of = [&](const Cell& at) { return cell_sheets(code(at), joined_faces(at)); };
      if (has_one_sheet(sheets_of(lower), face) && has_one_sheet(sheets_of(upper), face ^ 1))
        cut_the_other_way(lower, upper, face);
    }
  // Cells that differ from kCellSheets are few, except in noise; only they store their sheets.
  parallel_blocks(blocks_.size(), context, [&](std::size_t b) {
    for_each_bit(blocks_[b].special, [&](int cell) {
      const std::size_t at = cell_number(static_cast<std::int32_t>(b), cell);
      if (joined[at] == 0) return;
      blocks_[b].joined[cell >> 6] |= std::uint64_t{1} << (cell & 63);
      joined_sheets_.at(b).emplace_back(static_cast<std::uint16_t>(cell),
                                        cell_sheets(codes_[at], joined[at]));
    });
  });
}

/// Returns true if the normals indicate that the inside corners of an ambiguous face are joined, i.e. if the
/// pair of segments that cuts off the outside corners fits the tangent planes at its ends better. The
/// segments of an edge or of a thin wall run along it, whatever the distances along the lattice's edges are.
bool CellBlocks::normals_join(std::int32_t block, int cell, int face) const {
  const std::array<int, 4> edges = face_edges(face), corners = face_corners(face);
  std::array<Eigen::Vector3d, 4> points, normals;
  for (int i = 0; i < 4; ++i) {
    const Edge edge = edge_of_cell(block, cell, edges[i]);
    const EdgeCrossing crossing = grid_.crossing(edge.block, edge.sample, edge.axis);
    points[i] = crossing_point(edge, crossing);
    normals[i] = {crossing.normal[0], crossing.normal[1], crossing.normal[2]};
  }
  // The deviation of a segment between two crossings from the planes at its ends: the sum of two sines.
  const auto slant = [&](int i, int j) {
    const Eigen::Vector3d along = (points[j] - points[i]).normalized();
    return std::abs(normals[i].dot(along)) + std::abs(normals[j].dot(along));
  };
  const int inside = (codes_[cell_number(block, cell)] >> corners[0]) & 1 ? 0 : 1;  // one inside corner
  // The edges at a corner are the one before it and its own; the opposite corner is two further on.
  const auto cut_off = [&](int corner) {
    return slant((corner + 3) % 4, corner % 4) + slant((corner + 1) % 4, (corner + 2) % 4);
  };
  // Strict, because without normals both are zero and the inside corners are cut off.
  return cut_off(inside + 1) < cut_off(inside);
}

bool CellBlocks::is_pinched(std::int32_t block, int cell, int face) const {
  const CellSheets& own = sheets(block, cell);
  if (!((own.ambiguous_faces >> face) & 1) || !has_one_sheet(own, face)) return false;
  const Cell there = beside(block, cell, face);
  return is_active(there) && has_one_sheet(sheets(there.block, there.cell), face ^ 1);
}

CellBlocks::Cell CellBlocks::beside(std::int32_t block, int cell, int face) const {
  int at[3] = {cell >> 6, (cell >> 3) & 7, cell & 7};
  at[face >> 1] += face & 1 ? 1 : -1;
  return locate(block, at[0], at[1], at[2]);
}

BlockMask CellBlocks::cells_with_cuts(std::int32_t b) const {
  if (cuts_.empty()) return {};
  return cells_with_edges(
      source_, b, [&](std::int32_t there) -> const auto& { return cuts_[there]; });
}

// From the signs of the first corners and the crossed edges that are not cuts, so that the signs of no other
// block are needed, and upper samples may be outside all blocks.
std::array<BlockMask, 8> CellBlocks::corner_signs(std::int32_t b) const {
  const HermiteView::Block& block = source_[b];
  const auto crossed = [&](int axis, int dx, int dy, int dz) {
    return shifted_mask(dx, dy, dz, [&](int ax, int ay, int az) -> BlockMask {
      const std::int32_t there = block.neighbours[neighbour_slot(ax, ay, az)];
      if (there < 0) return {};
      BlockMask edges = source_[there].crossing[axis];
      if (!cuts_.empty())
        for (int word = 0; word < 8; ++word) edges[word] &= ~cuts_[there][axis][word];
      return edges;
    });
  };
  std::array<BlockMask, 8> signs;
  signs[0] = block.inside;
  const auto step = [&](int from, int axis) {
    const BlockMask edges = crossed(axis, from & 1, (from >> 1) & 1, from >> 2);
    BlockMask& to = signs[from | 1 << axis];
    for (int word = 0; word < 8; ++word) to[word] = signs[from][word] ^ edges[word];
  };
  // Seven steps along the edges of a cell reach all corners; each starts from a known one.
  step(0, 0), step(0, 1), step(0, 2), step(1, 1), step(1, 2), step(2, 2), step(3, 2);
  return signs;
}

Eigen::Vector3d CellBlocks::rounding_in_file() const {
  const IndexToWorld& placement = grid_.placement();
  Eigen::Vector3d farthest =
      Eigen::Vector3d::Zero();  // from the meshes' origin, along each axis of the world
  // Rounding grows with the coordinate, so the farthest corner along each axis of the world counts.
  const auto include = [&](const Eigen::Vector3d& lower, const Eigen::Vector3d& upper) {
    for (int corner = 0; corner < 8; ++corner) {
      Eigen::Vector3d index = lower;
      for (int a = 0; a < 3; ++a)
        if ((corner >> a) & 1) index[a] = upper[a];
      farthest = farthest.cwiseMax(placement.local(index).cwiseAbs());
    }
  };
  const auto lower_of = [&](const HermiteView::Block& block) {
    return Eigen::Vector3d(block.lower[0] - placement.base[0], block.lower[1] - placement.base[1],
                           block.lower[2] - placement.base[2]);
  };
  const Eigen::Vector3d side = Eigen::Vector3d::Constant(8);
  if (const SampleBox whole = grid_.whole(); !whole.empty()) {
    const Eigen::Vector3d base(placement.base[0], placement.base[1], placement.base[2]);
    include(whole.lower.cast<double>() - base, whole.upper.cast<double>() - base);
  }
  if (placement.linear.isDiagonal(0)) {  // then the corners of the bounding box suffice
    Eigen::AlignedBox3d box;
    for (const HermiteView::Block& block : source_) box.extend(lower_of(block));
    if (!box.isEmpty()) include(box.min(), box.max() + side);
  } else {
    for (const HermiteView::Block& block : source_) include(lower_of(block), lower_of(block) + side);
  }
  // Single precision about the origin, and double precision of the file's coordinates (FilePoints).
  const Eigen::Vector3d in_world = farthest * 0x1p-24 + (placement.origin.cwiseAbs() + farthest) * 0x1p-53;
  // In voxels: the magnitudes of the rows bound the movement along each axis of the lattice.
  return placement.linear.inverse().cwiseAbs() * in_world;
}

double CellBlocks::margin_for_rounding() const {
  const double margin = std::max(1.0 / 1024.0, 8.0 * rounding_.maxCoeff());
  if (!(margin <= 0.25))  // eight times the precision in the message
    throw Error(
        "the coordinates of a mesh file cannot represent a mesh of this volume to 1/32 voxel, so no "
        "guarantee is "
        "possible: its axes lie nearly in a plane, or it is too large, or too far from the origin; resample, "
        "divide "
        "or move it, or use --extractor dual-contouring");
  return margin;
}

const CellSheets* CellBlocks::find(const SheetsOfBlock& list, int cell) {
  const auto at =
      std::ranges::lower_bound(list, cell, {}, [](const auto& entry) { return int(entry.first); });
  return at != list.end() && at->first == cell ? &at->second : nullptr;
}

std::uint32_t CellBlocks::point(std::int32_t number, int cell, int sheet) const {
  const Block& block = blocks_[number];
  if (sheet == 0) return block.first_point + rank_of(block, cell);
  // Further sheets follow all first sheets, in the order of cells and sheets.
  const auto& several = several_[number];
  const auto at =
      std::ranges::lower_bound(several, cell, {}, [](const auto& entry) { return int(entry.first); });
  return block.first_point + cells_in(number) + at->second + static_cast<std::uint32_t>(sheet - 1);
}

Eigen::Vector3d CellBlocks::corner(std::int32_t block, int sample) const {
  const auto& lower = source_[block].lower;
  const auto& base = grid_.placement().base;
  return {double(lower[0] - base[0] + (sample >> 6)), double(lower[1] - base[1] + ((sample >> 3) & 7)),
          double(lower[2] - base[2] + (sample & 7))};
}

CellBlocks::Edge CellBlocks::edge_of_cell(std::int32_t block, int cell, int edge) const {
  const std::array<int, 3> d = edge_offset(edge);
  const Cell there = locate(block, (cell >> 6) + d[0], ((cell >> 3) & 7) + d[1], (cell & 7) + d[2]);
  return {there.block, there.cell, edge_axis(edge)};
}

int CellBlocks::crossings_on(const Edge& first, int length) const {
  if (first.block < 0) return 0;
  const BlockMask& crossing = source(first.block).crossing[first.axis];
  const int word = first.sample >> 6, bit = first.sample & 63;
  // A mask has a word per x with a row of eight bits per y: edges along x are 64 bits apart, along y eight.
  if (first.axis == 0) {
    int found = 0;
    for (int k = 0; k < length; ++k) found += test(crossing, first.sample + 64 * k);
    return found;
  }
  const std::uint64_t line =
      first.axis == 1 ? 0x0101010101010101u >> (8 * (8 - length)) : 0xffu >> (8 - length);
  return std::popcount((crossing[word] >> bit) & line);
}

Eigen::Vector3d CellBlocks::crossing_point(const Edge& edge, const EdgeCrossing& crossing) const {
  Eigen::Vector3d point = corner(edge.block, edge.sample);
  point[edge.axis] += std::clamp(double(crossing.offset), margin_, 1.0 - margin_);
  return point;
}

CellBlocks::Around CellBlocks::around(const Edge& edge) const {
  Around result;
  result.axis = edge.axis;
  for (int i = 0; i < 4; ++i) {
    const Cell cell = cell_around(edge, i);
    result.cells[i] = cell;
    result.sheets[i] = &sheets(cell.block, cell.cell);
    const CellSheets& loops = *result.sheets[i];  // those of a joint of one vertex ignore its cuts
    result.points[i] =
        point(cell.block, cell.cell, loops.sheets > 1 ? loops.sheet_of[edge_in(edge.axis, i)] : 0);
  }
  return result;
}

CellBlocks::Edge CellBlocks::other_end(const Around& around, int i) const {
  const int other = around.sheets[i]->partner[face_after(around.axis, i)][edge_in(around.axis, i)];
  return edge_of_cell(around.cells[i].block, around.cells[i].cell, other);
}

bool CellBlocks::has_explicit_face(std::int32_t block, int cell) const {
  const CellSheets& own = sheets(block, cell);
  if (own.sheets > 1 || own.ambiguous_faces != 0) return true;
  for (int face = 0; face < 6; ++face) {
    const Cell there = beside(block, cell, face);
    if (is_active(there) && sheets(there.block, there.cell).sheets > 1) return true;
  }
  return false;
}

bool CellBlocks::comes_first(const Edge& a, const Edge& b) const {
  const auto key = [&](const Edge& edge) {
    const auto& lower = source_[edge.block].lower;
    return std::array{lower[0] + (edge.sample >> 6), lower[1] + ((edge.sample >> 3) & 7),
                      lower[2] + (edge.sample & 7), std::int32_t(edge.axis)};
  };
  return key(a) < key(b);
}

}  // namespace hermesh
