#include "algorithms/extraction/certified_collapse/tile_mesh.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>

#include "algorithms/core/error.h"
#include "algorithms/extraction/certified_mesh.h"

namespace hermesh {
namespace {

constexpr std::uint32_t kNone = FineMesh::kNone;

std::int32_t floor_of(std::int32_t index, int side) {
  return index >= 0 ? index / side : -((-index + side - 1) / side);
}

/// Returns the bit of TileMesh::touched for a tile next to another one.
std::uint32_t bit_of(const TileAt& tile, const TileAt& from) {
  return 1u << (9 * (tile[0] - from[0] + 1) + 3 * (tile[1] - from[1] + 1) + tile[2] - from[2] + 1);
}

std::string name_of(const TileAt& tile) {
  return "tile (" + std::to_string(tile[0]) + ", " + std::to_string(tile[1]) + ", " +
         std::to_string(tile[2]) + ")";
}

}  // namespace

TilePatches::TilePatches(UniformMesh uniform, std::vector<VertexKey> keys, const TileDecimation& decimation,
                         const FilePoints& file, const std::optional<TileAt>& only)
    : decimation_(decimation),
      file_(file),
      points_(std::move(uniform.points)),
      keys_(std::move(keys)),
      triangles_(all_triangles(std::move(uniform.triangles), std::exchange(uniform.quads, {}))),
      number_(points_.size(), kNone) {
  for (std::uint32_t t = 0; t < triangles_.size(); ++t)
    for_each_touched(triangles_[t], [&](const TileAt& tile) {
      if (!only || tile == *only) patches_[tile].push_back(t);
    });
}

TileAt TilePatches::tile_of(std::uint32_t vertex) const {
  TileAt tile;
  for (int a = 0; a < 3; ++a) tile[a] = floor_of(keys_[vertex].at[a], decimation_.side);
  return tile;
}

Bounds TilePatches::box_of(const TileAt& tile) const {
  Bounds box;
  for (int a = 0; a < 3; ++a) {
    box.lower[a] = double(tile[a]) * decimation_.side - file_.placement().base[a];
    box.upper[a] = box.lower[a] + decimation_.side;
  }
  return box;
}

/// Calls f(tile) for the tiles that a triangle touches, each once and ascending.
template <class F>
void TilePatches::for_each_touched(const Triangle& t, F&& f) const {
  const TileAt at[3] = {tile_of(t[0]), tile_of(t[1]), tile_of(t[2])};
  TileAt low = at[0], high = at[0];
  Bounds box;
  for (int i = 0; i < 3; ++i) {
    box.add(points_[t[i]]);
    for (int a = 0; a < 3; ++a) low[a] = std::min(low[a], at[i][a]), high[a] = std::max(high[a], at[i][a]);
  }
  TileAt first, last;  // of the boxes that the triangle's meets
  for (int a = 0; a < 3; ++a) {
    const double base = file_.placement().base[a], side = decimation_.side;
    first[a] = static_cast<std::int32_t>(std::ceil((box.lower[a] + base) / side)) - 1;
    last[a] = static_cast<std::int32_t>(std::floor((box.upper[a] + base) / side));
    low[a] = std::min(low[a], first[a]), high[a] = std::max(high[a], last[a]);
  }
  if (low == high) return f(low);
  for (TileAt tile = low; tile[0] <= high[0]; ++tile[0])
    for (tile[1] = low[1]; tile[1] <= high[1]; ++tile[1])
      for (tile[2] = low[2]; tile[2] <= high[2]; ++tile[2]) {
        bool meets = true;
        for (int a = 0; a < 3; ++a) meets = meets && first[a] <= tile[a] && tile[a] <= last[a];
        if (meets || tile == at[0] || tile == at[1] || tile == at[2]) f(tile);
      }
}

std::vector<TileAt> TilePatches::tiles() const {
  std::vector<TileAt> tiles;
  for (const auto& [tile, patch] : patches_)
    if (std::ranges::any_of(patch, [&](std::uint32_t t) {
          return std::ranges::any_of(triangles_[t], [&](std::uint32_t p) { return tile_of(p) == tile; });
        }))
      tiles.push_back(tile);
  return tiles;
}

TileMesh TilePatches::decimated(const TileAt& tile, RunContext& context) {
  const std::vector<std::uint32_t>& patch = patches_.at(tile);
  // The patch as a mesh of its own, with vertices and triangles in their order.
  std::vector<std::uint32_t> used;
  for (const std::uint32_t t : patch)
    for (const std::uint32_t p : triangles_[t])
      if (std::exchange(number_[p], 0) == kNone) used.push_back(p);
  std::ranges::sort(used);
  std::vector<Eigen::Vector3d> points;
  for (const std::uint32_t p : used) {
    number_[p] = static_cast<std::uint32_t>(points.size());
    points.push_back(points_[p]);
  }
  std::vector<Triangle> triangles;
  std::vector<std::uint8_t> pinned(points.size(), 0);
  std::vector<std::uint32_t> touched;  // by triangle, as in TileMesh
  for (const std::uint32_t t : patch) {
    const Triangle& c = triangles_[t];
    triangles.push_back({number_[c[0]], number_[c[1]], number_[c[2]]});
    touched.push_back(0);
    for_each_touched(c, [&](const TileAt& other) { touched.back() |= bit_of(other, tile); });
    if (touched.back() != bit_of(tile, tile))
      for (const std::uint32_t p : triangles.back()) pinned[p] = 1;
  }
  for (const std::uint32_t p : used) number_[p] = kNone;
  const FineMesh fine(std::move(points), std::move(triangles), context);
  CertifiedMesh coarse;
  if (decimation_.tolerance > 0) {
    const std::vector<float> tolerance(fine.points().size(), static_cast<float>(decimation_.tolerance));
    coarse = decimate_certified(fine, tolerance, std::move(pinned), file_, context, decimation_.nearness, {},
                                box_of(tile));
  } else {
    coarse = {fine.points(), fine.triangles(), {}};
    for (std::uint32_t t = 0; t < fine.triangles().size(); ++t) coarse.fine_triangle.push_back(t);
  }
  // The tile's own vertices come first. All corners of a triangle that changed belong to the tile, and those
  // of a fixed triangle are the vertices of the uniform mesh.
  std::vector<std::uint32_t> origin(coarse.points.size());  // a vertex of the uniform mesh in the same tile
  for (std::size_t i = 0; i < coarse.triangles.size(); ++i)
    for (int corner = 0; corner < 3; ++corner)
      origin[coarse.triangles[i][corner]] = used[fine.triangles()[coarse.fine_triangle[i]][corner]];
  TileMesh result{.tile = tile, .points = {}, .triangles = {}, .fixed = {}, .touched = {}, .keys = {}};
  std::vector<std::uint32_t> order;
  for (const bool own : {true, false}) {
    for (std::uint32_t p = 0; p < origin.size(); ++p)
      if ((tile_of(origin[p]) == tile) == own) order.push_back(p);
    if (own) result.own = static_cast<std::uint32_t>(order.size());
  }
  std::vector<std::uint32_t> number(order.size()), key_of(order.size(), kNone);
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    number[order[i]] = i;
    result.points.push_back(file_.in_file(coarse.points[order[i]]));
  }
  const bool mirrors = file_.placement().mirrors();
  for (std::size_t i = 0; i < coarse.triangles.size(); ++i) {
    const Triangle& c = coarse.triangles[i];
    const Triangle& before = fine.triangles()[coarse.fine_triangle[i]];
    Triangle t{number[c[0]], number[c[1]], number[c[2]]};
    const std::uint32_t where = touched[coarse.fine_triangle[i]];
    const bool fixed = where != bit_of(tile, tile);
    if (!fixed || std::min({tile_of(origin[c[0]]), tile_of(origin[c[1]]), tile_of(origin[c[2]])}) == tile)
      result.triangles.push_back(mirrors ? Triangle{t[0], t[2], t[1]} : t);
    if (!fixed) continue;
    result.fixed.push_back(t);
    result.touched.push_back(where);
    for (int corner = 0; corner < 3; ++corner) key_of[t[corner]] = used[before[corner]];
  }
  for (std::uint32_t p = 0; p < key_of.size(); ++p)
    if (key_of[p] != kNone) result.keys.emplace_back(p, keys_[key_of[p]]);
  return result;
}

namespace {

/// The numbers that the vertices of tiles have in their joined mesh.
class JoinedVertices {
 public:
  explicit JoinedVertices(const std::vector<TileMesh>& tiles) : tiles_(tiles) {
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      first_.push_back(static_cast<std::uint32_t>(count));
      count += tiles[i].own;
      for (const auto& [vertex, key] : tiles[i].keys)
        if (vertex < tiles[i].own) shared_.push_back({key, first_[i] + vertex, tiles[i].points[vertex]});
    }
    if (count >= kNone) throw Error("the mesh has more than 2^32 vertices; use larger voxels");
    std::ranges::sort(shared_, {}, &Shared::key);
    count_ = static_cast<std::uint32_t>(count);
  }
  std::uint32_t count() const { return count_; }

  /// Returns the numbers of a tile's vertices; kNone for a vertex of a tile that is not there.
  std::vector<std::uint32_t> of(std::size_t tile) const {
    const TileMesh& mesh = tiles_[tile];
    std::vector<std::uint32_t> numbers(mesh.points.size(), kNone);
    for (std::uint32_t v = 0; v < mesh.own; ++v) numbers[v] = first_[tile] + v;
    for (const auto& [vertex, key] : mesh.keys) {
      if (vertex < mesh.own) continue;
      const auto found = std::ranges::lower_bound(shared_, key, {}, &Shared::key);
      if (found == shared_.end() || found->key != key || found->point != mesh.points[vertex])
        throw Error(name_of(mesh.tile) + " and a tile next to it disagree about a vertex at sample (" +
                    std::to_string(key.at[0]) + ", " + std::to_string(key.at[1]) + ", " +
                    std::to_string(key.at[2]) +
                    "), or that tile is missing; use larger tiles, or another resolution");
      numbers[vertex] = found->number;
    }
    return numbers;
  }

 private:
  struct Shared {
    VertexKey key;
    std::uint32_t number;
    Eigen::Vector3f point;
  };
  const std::vector<TileMesh>& tiles_;
  std::vector<std::uint32_t> first_;
  std::vector<Shared> shared_;  ///< ascending by key
  std::uint32_t count_ = 0;
};

/// A fixed triangle as one tile has it.
struct FixedTriangle {
  Triangle corners;  ///< numbers of the joined mesh, the least first
  std::uint32_t tile, touched;
};

/// Checks that all tiles that a fixed triangle touches have it. @throws Error
void check_fixed(std::vector<FixedTriangle> fixed, const std::vector<TileMesh>& tiles) {
  std::ranges::sort(fixed, {}, [](const FixedTriangle& t) { return std::tie(t.corners, t.tile); });
  const auto number_of = [&](const TileAt& tile) {
    const auto at = std::ranges::lower_bound(tiles, tile, {}, &TileMesh::tile);
    return at != tiles.end() && at->tile == tile ? std::uint32_t(at - tiles.begin()) : kNone;
  };
  for (std::size_t i = 0, end = 0; i < fixed.size(); i = end) {
    while (end < fixed.size() && fixed[end].corners == fixed[i].corners) ++end;
    const TileAt& from = tiles[fixed[i].tile].tile;
    for (int bit = 0; bit < 27; ++bit) {
      if (!(fixed[i].touched >> bit & 1)) continue;
      const std::uint32_t other =
          number_of({from[0] + bit / 9 - 1, from[1] + bit / 3 % 3 - 1, from[2] + bit % 3 - 1});
      // A tile without vertices changes nothing, so it need not know the triangle.
      if (other != kNone &&
          std::none_of(fixed.begin() + std::ptrdiff_t(i), fixed.begin() + std::ptrdiff_t(end),
                       [&](const FixedTriangle& t) { return t.tile == other; }))
        throw Error(name_of(from) + " and " + name_of(tiles[other].tile) +
                    " disagree about a triangle between them; use larger tiles, or another resolution");
    }
  }
}

}  // namespace

PolygonMesh join_tiles(std::vector<TileMesh> tiles, const Eigen::Vector3d& origin) {
  std::ranges::sort(tiles, {}, &TileMesh::tile);
  for (std::size_t i = 1; i < tiles.size(); ++i)
    if (tiles[i].tile == tiles[i - 1].tile) throw Error(name_of(tiles[i].tile) + " occurs twice");
  const JoinedVertices vertices(tiles);
  PolygonMesh mesh;
  mesh.origin = origin;
  mesh.points.reserve(vertices.count());
  std::vector<FixedTriangle> fixed;
  for (std::uint32_t i = 0; i < tiles.size(); ++i) {
    TileMesh& tile = tiles[i];
    const std::vector<std::uint32_t> number = vertices.of(i);
    const auto joined = [&](const Triangle& t) { return Triangle{number[t[0]], number[t[1]], number[t[2]]}; };
    mesh.points.insert(mesh.points.end(), tile.points.begin(), tile.points.begin() + tile.own);
    for (const Triangle& t : tile.triangles) mesh.triangles.push_back(joined(t));
    for (std::size_t f = 0; f < tile.fixed.size(); ++f) {
      Triangle t = joined(tile.fixed[f]);
      std::ranges::rotate(t, std::ranges::min_element(t));
      fixed.push_back({t, i, tile.touched[f]});
    }
  }
  check_fixed(std::move(fixed), tiles);
  return mesh;
}

}  // namespace hermesh
