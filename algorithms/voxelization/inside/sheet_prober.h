// What a face of a triangle has on its two sides: the question of interior_faces.h, asked of one face.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "algorithms/voxelization/distance/band.h"
#include "algorithms/voxelization/inside/box_bits.h"
#include "algorithms/voxelization/inside/surface_probe.h"
#include "algorithms/voxelization/inside/triangle_faces.h"

namespace hermesh {

/// The voxels around which sheets may be inner.
struct Suspects {
  std::vector<BlockMask> voxels;      ///< by block
  std::vector<std::uint32_t> blocks;  ///< those with some
};

/// Tells whether pieces are near suspicious voxels; each thread has its own, since it keeps the block that it
/// looked up last.
class Suspicion {
 public:
  Suspicion(const Suspects& suspects, const Band& band, const BlockTable& blocks)
      : suspects_(suspects), band_(band), finder_(blocks) {}

  /// Whether a suspicious voxel is in or next to the box of these corners.
  bool touches(std::span<const Eigen::Vector3d> corners) {
    Voxel from, to;
    BlockAt low, high;
    double blocks = 1;
    Eigen::Vector3d least = corners[0], most = corners[0];
    for (const Eigen::Vector3d& corner : corners) {
      least = least.cwiseMin(corner);
      most = most.cwiseMax(corner);
    }
    for (std::size_t a = 0; a < 3; ++a) {
      from[a] = std::int32_t(std::floor(least[int(a)])), low[a] = from[a] >> 3;
      to[a] = std::int32_t(std::floor(most[int(a)])), high[a] = to[a] >> 3;
      blocks *= high[a] - low[a] + 1;
    }
    // A large triangle has more blocks in its box than there are with suspicious voxels.
    if (blocks > static_cast<double>(suspects_.blocks.size()))
      return std::ranges::any_of(suspects_.blocks,
                                 [&](std::uint32_t b) { return has(b, band_.blocks[b], from, to); });
    for (std::int32_t x = low[0]; x <= high[0]; ++x)
      for (std::int32_t y = low[1]; y <= high[1]; ++y)
        for (std::int32_t z = low[2]; z <= high[2]; ++z) {
          const std::uint32_t block = finder_.find({x, y, z});
          if (block != BlockTable::kNone && has(block, {x, y, z}, from, to)) return true;
        }
    return false;
  }

 private:
  /// Whether one of the block's suspicious voxels is in the box.
  bool has(std::uint32_t block, const BlockAt& at, const Voxel& from, const Voxel& to) const {
    const BlockMask bits = box_bits(at, from, to);
    for (std::size_t x = 0; x < 8; ++x)
      if (suspects_.voxels[block][x] & bits[x]) return true;
    return false;
  }

  const Suspects& suspects_;
  const Band& band_;
  BlockFinder finder_;
};

/// How far off a sheet the ways to voxels start, in voxels: beyond rounding and beyond doubled faces, but in
/// a narrow face nearer than its border.
inline constexpr double kMostOff = 1e-3, kLeastOff = 1e-5;
/// The size of a face, in voxels, of which one place tells as much as several.
inline constexpr double kSmallFace = 0.5;

/// A face of a triangle, and what is known about it.
struct TriangleSheet {
  std::uint32_t triangle = 0;  ///< by its place in the list of suspicious ones
  std::uint32_t face = 0;
  Side side = Side::unknown;
  std::array<Side, 2> sides{Side::unknown,
                            Side::unknown};  ///< what each side is: along the normal, against it

  /// A face is outer if one of its sides is, and inner if both are inner.
  void conclude() {
    if (sides[0] == Side::outer || sides[1] == Side::outer)
      side = Side::outer;
    else if (sides[0] == Side::inner && sides[1] == Side::inner)
      side = Side::inner;
  }
};

/// Places off the middle of a face on both of its sides.
inline std::array<Eigen::Vector3d, 2> places_beside(const TriangleFace& face, const Eigen::Vector3d& place,
                                                    const Eigen::Vector3d& normal) {
  const double off = std::clamp(0.05 * face.room_at(face.middle()), kLeastOff, kMostOff);
  return {place + off * normal, place - off * normal};
}

/// Looks from faces for the voxels around them; each thread has its own.
class Prober {
 public:
  Prober(const IndexSoup& soup, const TriangleBins& bins, const Band& band,
         const std::vector<BlockMask>& inside, const Suspects& suspects)
      : probe_(soup, bins, inside), suspicion_(suspects, band, bins.blocks()) {}

  /// Finds out what is on the two sides of a face. All places of a whole face have the same around them, so
  /// that one that sees something tells. It is outer where one of its sides is; of a face that is not whole,
  /// all places have to agree that it is inner.
  void look(const TriangleFace& face, const Eigen::Vector3d& normal, TriangleSheet& sheet) {
    if (!suspicion_.touches(face.corners)) {
      sheet.side = Side::outer;
      return;
    }
    const Eigen::Vector3d middle = face.middle();
    bool agree = look_from(middle, face, normal, sheet);
    const bool one_tells = face.whole ? face.size() <= kSmallFace : !agree;
    if (!one_tells)
      for (const Eigen::Vector3d& corner : face.corners) {
        if (sheet.side == Side::outer || (!face.whole && !agree)) break;
        agree &= look_from(0.8 * corner + 0.2 * middle, face, normal, sheet);
      }
    if (!face.whole && !agree && sheet.side == Side::inner) sheet.side = Side::unknown;
  }

  /// Follows the narrow spaces beside a face's middle where nothing was seen.
  void follow_spaces(const TriangleFace& face, const Eigen::Vector3d& normal, TriangleSheet& sheet) {
    const std::array<Eigen::Vector3d, 2> places = places_beside(face, face.middle(), normal);
    for (std::size_t i = 0; i < 2; ++i)
      if (sheet.sides[i] == Side::unknown) sheet.sides[i] = probe_.followed_from(places[i], normal);
    sheet.conclude();
  }

 private:
  /// Looks from a place of a face to both sides; true if the face is inner there for certain.
  bool look_from(const Eigen::Vector3d& place, const TriangleFace& face, const Eigen::Vector3d& normal,
                 TriangleSheet& sheet) {
    bool inner = true;
    const std::array<Eigen::Vector3d, 2> places = places_beside(face, place, normal);
    for (std::size_t i = 0; i < 2; ++i) {
      const Side seen = probe_.seen_from(places[i]);
      if (seen != Side::unknown) sheet.sides[i] = seen;
      inner &= seen == Side::inner;
      if (seen == Side::outer) break;
    }
    sheet.conclude();
    return inner;
  }

  SurfaceProbe probe_;
  Suspicion suspicion_;
};

}  // namespace hermesh
