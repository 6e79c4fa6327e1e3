#include "algorithms/search/transfer_attributes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "algorithms/core/disjoint_sets.h"
#include "algorithms/core/parallel.h"
#include "algorithms/search/triangle_point.h"
#include "algorithms/search/triangle_tree.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Sets one element of `to` to the mean of three elements of `from` by their weights, or, of whole numbers,
/// to the element of the greatest weight, for numbers of materials cannot be mixed.
void take(const MeshAttribute& from, const std::array<std::size_t, 3>& elements, const Vector3d& weights,
          MeshAttribute& to, std::size_t element) {
  const auto n = static_cast<std::size_t>(from.components);
  if (from.values.index() == 1) {
    int heaviest;
    weights.maxCoeff(&heaviest);
    std::get<1>(to.values)[element] = std::get<1>(from.values)[elements[heaviest]];
    return;
  }
  const auto& values = std::get<0>(from.values);
  for (std::size_t i = 0; i < n; ++i) {
    double sum = 0.0;
    for (int c = 0; c < 3; ++c) sum += weights[c] * double(values[n * elements[c] + i]);
    std::get<0>(to.values)[n * element + i] = static_cast<float>(sum);
  }
}

/// An attribute of the same kind with the requested number of elements, all of them 0 or, for integers, −1
/// (none).
MeshAttribute empty_like(const MeshAttribute& source, std::size_t elements) {
  MeshAttribute result{source.name, source.domain, source.components, {}, source.labels};
  const std::size_t values = elements * static_cast<std::size_t>(source.components);
  if (source.values.index() == 1)
    result.values = std::vector<std::int32_t>(values, -1);
  else
    result.values = std::vector<float>(values, 0.0f);
  return result;
}

std::size_t element_count(const PolygonMesh& mesh, AttributeDomain domain) {
  if (domain == AttributeDomain::point) return mesh.points.size();
  return domain == AttributeDomain::polygon ? mesh.triangles.size() + mesh.quads.size()
                                            : 3 * mesh.triangles.size() + 4 * mesh.quads.size();
}

/// Returns the number of a corner of one of triangulated()'s triangles among the corners of the mesh.
std::size_t corner_of(const PolygonMesh& mesh, std::size_t t, std::size_t c) {
  const std::size_t triangles = mesh.triangles.size();
  if (t < triangles) return 3 * t + c;
  // A quad's corner is one of four; triangulated() makes abc and acd of it.
  const std::size_t quad = (t - triangles) / 2, half = (t - triangles) % 2;
  return 3 * triangles + 4 * quad + (half == 0 ? c : c == 0 ? 0 : c + 1);
}

/// Returns for each triangle a number of its chart.
std::vector<std::uint32_t> charts_of(const PolygonMesh& mesh, const std::vector<Triangle>& triangles) {
  std::vector<const MeshAttribute*> of_corners;
  for (const MeshAttribute& attribute : mesh.attributes)
    if (attribute.domain == AttributeDomain::corner) of_corners.push_back(&attribute);
  if (of_corners.empty()) return std::vector<std::uint32_t>(triangles.size(), 0);
  const auto agree = [&](std::size_t a, std::size_t b) {
    return std::ranges::all_of(of_corners, [&](const MeshAttribute* attribute) {
      return std::visit(
          [&](const auto& values) {
            const auto n = static_cast<std::size_t>(attribute->components);
            return std::equal(values.begin() + std::ptrdiff_t(n * a),
                              values.begin() + std::ptrdiff_t(n * a + n),
                              values.begin() + std::ptrdiff_t(n * b));
          },
          attribute->values);
    });
  };
  DisjointSets sets(triangles.size());
  // The side of a triangle at each edge, given by its points in ascending order.
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::pair<std::size_t, std::size_t>> sides;
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t next = (c + 1) % 3;
      const std::uint32_t a = triangles[t][c], b = triangles[t][next];
      const auto [at, is_new] = sides.try_emplace(std::minmax(a, b), t, c);
      if (is_new) continue;
      const auto [other, corner] = at->second;
      const std::size_t behind = (corner + 1) % 3;
      const bool same_order = triangles[other][corner] == a;
      if (agree(corner_of(mesh, t, c), corner_of(mesh, other, same_order ? corner : behind)) &&
          agree(corner_of(mesh, t, next), corner_of(mesh, other, same_order ? behind : corner)))
        sets.join(static_cast<std::uint32_t>(t), static_cast<std::uint32_t>(other));
    }
  std::vector<std::uint32_t> charts(triangles.size());
  for (std::uint32_t t = 0; t < charts.size(); ++t) charts[t] = sets.find(t);
  return charts;
}

/// Calls f(polygon, first corner, corners) for each polygon of a mesh.
template <class F>
void visit_polygon(const PolygonMesh& mesh, std::size_t polygon, F&& f) {
  const std::size_t triangles = mesh.triangles.size();
  if (polygon < triangles)
    f(3 * polygon, std::span<const std::uint32_t>(mesh.triangles[polygon]));
  else
    f(3 * triangles + 4 * (polygon - triangles),
      std::span<const std::uint32_t>(mesh.quads[polygon - triangles]));
}

}  // namespace

/// The search for the nearest polygon of the source. Positions are in world units relative to the source's
/// origin; the tree scales them to voxels.
struct SourceAttributes::Tree {
  std::vector<Triangle> triangles;
  TriangleTree tree;
  double scale;
  std::vector<std::uint32_t> charts;

  Tree(const PolygonMesh& source, double voxel_size)
      : triangles(triangulated(source)),
        tree(source.points, triangles, 1.0 / voxel_size),
        scale(1.0 / voxel_size),
        charts(charts_of(source, triangles)) {}

  std::uint32_t nearest(const Vector3d& local) const { return tree.nearest(scale * local).triangle; }
  Vector3d weights(std::uint32_t t, const Vector3d& local) const {
    return closest_point(scale * local, tree.corner(t, 0), tree.corner(t, 1), tree.corner(t, 2)).weights;
  }
  /// Returns the triangle for a corner of a polygon whose middle is nearest to `triangle`.
  std::uint32_t at_corner(std::uint32_t triangle, const Vector3d& corner, const Vector3d& middle) const {
    // A little towards the middle, so that a corner on a seam finds its own side of it.
    constexpr double kInwards = 1e-3;
    const std::uint32_t own = nearest(corner + kInwards * (middle - corner));
    return charts[own] == charts[triangle] ? own : triangle;
  }
};

SourceAttributes::SourceAttributes(const PolygonMesh& source, double voxel_size) : source_(source) {
  if (!source.attributes.empty() && !source.empty()) tree_ = std::make_unique<Tree>(source, voxel_size);
}
SourceAttributes::~SourceAttributes() = default;

void SourceAttributes::add_to(PolygonMesh& mesh, RunContext& context) const {
  if (!tree_) return;
  // A copy, for the mesh gets more attributes below and a reference would not outlast that.
  std::vector<std::int32_t> surface;
  for (const MeshAttribute& attribute : mesh.attributes)
    if (attribute.name == "surface" && attribute.domain == AttributeDomain::polygon)
      surface = std::get<1>(attribute.values);
  // The mesh and the source may be about different origins.
  const auto local = [&](std::uint32_t p) { return Vector3d(mesh.world(p) - source_.origin); };
  const std::size_t triangles = source_.triangles.size();
  const auto polygon_of = [&](std::uint32_t t) -> std::size_t {
    return t < triangles ? t : triangles + (t - triangles) / 2;
  };
  std::vector<const MeshAttribute*> from;
  std::vector<std::size_t> to;
  for (const MeshAttribute& attribute : source_.attributes) {
    const auto same = [&](const MeshAttribute& a) { return a.name == attribute.name; };
    // An attribute that the mesh has already is its own (`surface`, `cutter`, `neighbour`) and stays.
    const auto there = std::ranges::find_if(mesh.attributes, same);
    // Only texture coordinates are merged: those of the source's points are also written to the mesh's
    // corners, because their values differ at seams.
    const bool fills_uv = attribute.name == "uv" && attribute.domain != AttributeDomain::polygon &&
                          attribute.components == 2 && attribute.values.index() == 0;
    if (there != mesh.attributes.end() && !fills_uv) continue;
    from.push_back(&attribute);
    to.push_back(static_cast<std::size_t>(there - mesh.attributes.begin()));
    if (there == mesh.attributes.end())
      mesh.attributes.push_back(empty_like(attribute, element_count(mesh, attribute.domain)));
  }
  // Elements are independent of one another, and each is written by one thread: any order gives the same
  // values.
  constexpr std::size_t kChunk = 256;
  const auto in_chunks = [&](std::size_t n, auto&& f) {
    parallel_blocks((n + kChunk - 1) / kChunk, context, [&](std::size_t chunk) {
      for (std::size_t i = chunk * kChunk; i < std::min(n, (chunk + 1) * kChunk); ++i) f(i);
    });
  };
  in_chunks(mesh.points.size(), [&](std::size_t p) {
    const Vector3d at = local(static_cast<std::uint32_t>(p));
    const std::uint32_t t = tree_->nearest(at);
    const Triangle& corners = tree_->triangles[t];
    for (std::size_t a = 0; a < from.size(); ++a)
      if (mesh.attributes[to[a]].domain == AttributeDomain::point)
        take(*from[a], {corners[0], corners[1], corners[2]}, tree_->weights(t, at), mesh.attributes[to[a]],
             p);
  });
  in_chunks(mesh.triangles.size() + mesh.quads.size(), [&](std::size_t i) {
    if (!surface.empty() && surface[i] != 0) return;
    visit_polygon(mesh, i, [&](std::size_t first, std::span<const std::uint32_t> own) {
      Vector3d middle = Vector3d::Zero();
      for (const std::uint32_t corner : own) middle += local(corner) / double(own.size());
      const std::uint32_t t = tree_->nearest(middle);
      for (std::size_t a = 0; a < from.size(); ++a) {
        MeshAttribute& target = mesh.attributes[to[a]];
        if (target.domain == AttributeDomain::polygon)
          take(*from[a], {polygon_of(t), polygon_of(t), polygon_of(t)}, Vector3d(1, 0, 0), target, i);
        if (target.domain != AttributeDomain::corner) continue;
        for (std::size_t c = 0; c < own.size(); ++c) {
          const Vector3d at = local(own[c]);
          const std::uint32_t near = tree_->at_corner(t, at, middle);
          const Triangle& corners = tree_->triangles[near];
          const bool of_corners = from[a]->domain == AttributeDomain::corner;
          std::array<std::size_t, 3> sources{};
          for (std::size_t k = 0; k < 3; ++k)
            sources[k] = of_corners ? corner_of(source_, near, k) : corners[k];
          take(*from[a], sources, tree_->weights(near, at), target, first + c);
        }
      }
    });
  });
}

PolygonMesh joined(const PolygonMesh& a, const PolygonMesh& b) {
  PolygonMesh result;
  result.origin = a.origin;
  result.points = a.points;
  for (std::size_t p = 0; p < b.points.size(); ++p)
    result.points.push_back((b.world(p) - a.origin).cast<float>());
  result.triangles = a.triangles;
  result.quads = a.quads;
  const auto shift = static_cast<std::uint32_t>(a.points.size());
  const auto append = [&](auto& to, const auto& polygons) {
    for (auto polygon : polygons) {
      for (std::uint32_t& corner : polygon) corner += shift;
      to.push_back(polygon);
    }
  };
  append(result.triangles, b.triangles);
  append(result.quads, b.quads);
  // The elements of each are its triangles' first, then its quads'.
  const auto add = [&](const MeshAttribute& like, const MeshAttribute* first, const MeshAttribute* second) {
    MeshAttribute to = empty_like(like, 0);
    const MeshAttribute none_a = empty_like(like, element_count(a, like.domain)),
                        none_b = empty_like(like, element_count(b, like.domain));
    std::visit(
        [&]<class T>(std::vector<T>& values) {
          const auto n = static_cast<std::size_t>(like.components);
          const auto of_triangles = [&](const PolygonMesh& mesh) {
            return like.domain == AttributeDomain::point    ? n * mesh.points.size()
                   : like.domain == AttributeDomain::corner ? 3 * n * mesh.triangles.size()
                                                            : n * mesh.triangles.size();
          };
          const auto& va = std::get<std::vector<T>>((first ? *first : none_a).values);
          std::vector<T> vb = std::get<std::vector<T>>((second ? *second : none_b).values);
          if constexpr (std::is_same_v<T, std::int32_t>)
            // Labels of the second follow those of the first.
            if (first && second && !second->labels.empty()) {
              for (T& value : vb)
                if (value >= 0) value += static_cast<T>(first->labels.size());
              to.labels.insert(to.labels.end(), second->labels.begin(), second->labels.end());
            }
          const auto ta = std::ptrdiff_t(of_triangles(a)), tb = std::ptrdiff_t(of_triangles(b));
          values.insert(values.end(), va.begin(), va.begin() + ta);
          values.insert(values.end(), vb.begin(), vb.begin() + tb);
          values.insert(values.end(), va.begin() + ta, va.end());
          values.insert(values.end(), vb.begin() + tb, vb.end());
        },
        to.values);
    result.attributes.push_back(std::move(to));
  };
  const auto of_name = [](const PolygonMesh& mesh, const std::string& name) {
    const auto at = std::ranges::find(mesh.attributes, name, &MeshAttribute::name);
    return at == mesh.attributes.end() ? nullptr : &*at;
  };
  for (const MeshAttribute& first : a.attributes) {
    const MeshAttribute* second = of_name(b, first.name);
    if (second && (second->domain != first.domain || second->components != first.components ||
                   second->values.index() != first.values.index()))
      continue;
    add(first, &first, second);
  }
  for (const MeshAttribute& second : b.attributes)
    if (!of_name(a, second.name)) add(second, nullptr, &second);
  return result;
}

}  // namespace hermesh
