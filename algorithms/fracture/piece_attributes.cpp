#include "algorithms/fracture/piece_attributes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "algorithms/core/parallel.h"
#include "algorithms/search/triangle_point.h"
#include "algorithms/search/triangle_tree.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Two unit axes at right angles to a normal and to each other, the same for the opposite normal.
std::array<Vector3d, 2> frame_of(Vector3d normal) {
  int largest, smallest;
  normal.cwiseAbs().maxCoeff(&largest);
  normal.cwiseAbs().minCoeff(&smallest);
  // The largest component decides the sign, so a normal and its opposite give one frame. The axis of the
  // smallest component is the farthest from parallel to the normal, so the product is never near zero.
  if (normal[largest] < 0) normal = -normal;
  const Vector3d u = normal.cross(Vector3d(Vector3d::Unit(smallest))).normalized();
  return {u, normal.cross(u)};
}

/// The two coordinate axes other than the one along which the triangle's normal is greatest. They do not
/// depend on the sign of the normal, so a seam's triangle has the same axes on both sides.
std::array<Vector3d, 2> frame_of_triangle(const PolygonMesh& mesh, const Triangle& t) {
  const auto at = [&](int c) { return Vector3d(mesh.points[t[c]].cast<double>()); };
  int axis;
  (at(1) - at(0)).cross(at(2) - at(0)).cwiseAbs().maxCoeff(&axis);
  return {Vector3d::Unit((axis + 1) % 3), Vector3d::Unit((axis + 2) % 3)};
}

/// Returns the polygons' integer attribute of that name. @throws Error if the piece has none.
const std::vector<std::int32_t>& whole_numbers(const PolygonMesh& mesh, const std::string& name) {
  for (const MeshAttribute& a : mesh.attributes)
    if (a.name == name && a.domain == AttributeDomain::polygon) return std::get<1>(a.values);
  throw Error("the piece lacks the attribute " + name);
}

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

}  // namespace

void add_cut_uv(PolygonMesh& piece, const PlaneOfNeighbour& plane) {
  const auto& surface = whole_numbers(piece, "surface");
  const auto& neighbour = whole_numbers(piece, "neighbour");
  std::vector<float> uv(6 * piece.triangles.size());
  std::map<std::int32_t, std::optional<std::array<Vector3d, 2>>> frames;
  for (std::size_t t = 0; t < piece.triangles.size(); ++t) {
    if (surface[t] == 0) continue;
    // The plane depends only on the two pieces, so all triangles of a seam share one frame.
    auto [at, is_new] = frames.try_emplace(neighbour[t]);
    if (is_new)
      if (const auto normal = plane(neighbour[t])) at->second = frame_of(*normal);
    const auto axes = at->second ? *at->second : frame_of_triangle(piece, piece.triangles[t]);
    // Points are relative to the origin, which all pieces share, so both sides of a seam compute the same
    // bits.
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t i = 0; i < 2; ++i)
        uv[6 * t + 2 * c + i] =
            static_cast<float>(axes[i].dot(piece.points[piece.triangles[t][c]].cast<double>()));
  }
  piece.attributes.push_back({"uv", AttributeDomain::corner, 2, std::move(uv), {}});
}

/// The search for the nearest polygon of the source. Positions are in world units relative to the source's
/// origin; the tree scales them to voxels.
struct SourceAttributes::Tree {
  std::vector<Triangle> triangles;
  TriangleTree tree;
  double scale;

  Tree(const PolygonMesh& source, double voxel_size)
      : triangles(triangulated(source)),
        tree(source.points, triangles, 1.0 / voxel_size),
        scale(1.0 / voxel_size) {}

  std::uint32_t nearest(const Vector3d& local) const { return tree.nearest(scale * local).triangle; }
  Vector3d weights(std::uint32_t t, const Vector3d& local) const {
    return closest_point(scale * local, tree.corner(t, 0), tree.corner(t, 1), tree.corner(t, 2)).weights;
  }
};

SourceAttributes::SourceAttributes(const PolygonMesh& source, double voxel_size) : source_(source) {
  if (!source.attributes.empty() && !source.empty()) tree_ = std::make_unique<Tree>(source, voxel_size);
}
SourceAttributes::~SourceAttributes() = default;

void SourceAttributes::add_to(PolygonMesh& piece, RunContext& context) const {
  if (!tree_) return;
  // A copy, for the piece gets more attributes below and a reference would not outlast that.
  const std::vector<std::int32_t> surface = whole_numbers(piece, "surface");
  // The piece and the source may be about different origins.
  const auto local = [&](std::uint32_t p) { return Vector3d(piece.world(p) - source_.origin); };
  const std::size_t triangles = source_.triangles.size();
  // A quad's corner is one of four; triangulated() makes abc and acd of it.
  const auto corner_of = [&](std::uint32_t t, std::size_t c) -> std::size_t {
    if (t < triangles) return 3 * std::size_t(t) + c;
    const std::size_t quad = (t - triangles) / 2, half = (t - triangles) % 2;
    return 3 * triangles + 4 * quad + (half == 0 ? c : c == 0 ? 0 : c + 1);
  };
  const auto polygon_of = [&](std::uint32_t t) -> std::size_t {
    return t < triangles ? t : triangles + (t - triangles) / 2;
  };
  const std::array<std::size_t, 3> elements = {piece.points.size(), 3 * piece.triangles.size(),
                                               piece.triangles.size()};
  std::vector<const MeshAttribute*> from;
  std::vector<std::size_t> to;
  for (const MeshAttribute& attribute : source_.attributes) {
    const auto same = [&](const MeshAttribute& a) { return a.name == attribute.name; };
    // An attribute that the piece has already is its own (`surface`, `cutter`, `neighbour`) and stays.
    const auto there = std::find_if(piece.attributes.begin(), piece.attributes.end(), same);
    // Only texture coordinates are merged: those of the source's points are also written to the piece's
    // corners, because their values differ at seams.
    const bool fills_uv = attribute.name == "uv" && attribute.domain != AttributeDomain::polygon &&
                          attribute.components == 2 && attribute.values.index() == 0;
    if (there != piece.attributes.end() && !fills_uv) continue;
    from.push_back(&attribute);
    to.push_back(static_cast<std::size_t>(there - piece.attributes.begin()));
    if (there == piece.attributes.end())
      piece.attributes.push_back(empty_like(attribute, elements[static_cast<std::size_t>(attribute.domain)]));
  }
  // Elements are independent of one another, and each is written by one thread: any order gives the same
  // values.
  constexpr std::size_t kChunk = 256;
  const auto in_chunks = [&](std::size_t n, auto&& f) {
    parallel_blocks((n + kChunk - 1) / kChunk, context, [&](std::size_t chunk) {
      for (std::size_t i = chunk * kChunk; i < std::min(n, (chunk + 1) * kChunk); ++i) f(i);
    });
  };
  in_chunks(piece.points.size(), [&](std::size_t p) {
    const Vector3d at = local(static_cast<std::uint32_t>(p));
    const std::uint32_t t = tree_->nearest(at);
    const Triangle& corners = tree_->triangles[t];
    for (std::size_t a = 0; a < from.size(); ++a)
      if (piece.attributes[to[a]].domain == AttributeDomain::point)
        take(*from[a], {corners[0], corners[1], corners[2]}, tree_->weights(t, at), piece.attributes[to[a]],
             p);
  });
  in_chunks(piece.triangles.size(), [&](std::size_t i) {
    if (surface[i] != 0) return;
    const Triangle& own = piece.triangles[i];
    // Use one polygon of the source for all three corners: with a separate query per corner, a triangle next
    // to a seam of the source's texture could take corners from both sides of the seam.
    const std::uint32_t t = tree_->nearest((local(own[0]) + local(own[1]) + local(own[2])) / 3.0);
    for (std::size_t a = 0; a < from.size(); ++a) {
      MeshAttribute& target = piece.attributes[to[a]];
      if (target.domain == AttributeDomain::polygon)
        take(*from[a], {polygon_of(t), polygon_of(t), polygon_of(t)}, Vector3d(1, 0, 0), target, i);
      if (target.domain == AttributeDomain::corner) {
        const Triangle& corners = tree_->triangles[t];
        const std::array<std::size_t, 3> sources =
            from[a]->domain == AttributeDomain::corner
                ? std::array<std::size_t, 3>{corner_of(t, 0), corner_of(t, 1), corner_of(t, 2)}
                : std::array<std::size_t, 3>{corners[0], corners[1], corners[2]};
        for (std::size_t c = 0; c < 3; ++c)
          take(*from[a], sources, tree_->weights(t, local(own[c])), target, 3 * i + c);
      }
    }
  });
}

}  // namespace hermesh
