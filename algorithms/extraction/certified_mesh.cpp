#include "algorithms/extraction/certified_mesh.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "algorithms/core/option_table.h"
#include "algorithms/core/parallel.h"
#include "algorithms/extraction/hermite_input.h"
#include "algorithms/hermite/normal_codes.h"

namespace hermesh {
namespace {

/// Largest distance off a plane, in third powers of its longest side, of a quad that a reader may treat as
/// plane, and the part of its area that counts as zero.
constexpr double kPlane = 1e-5, kNoArea = 1e-9;

/// Returns true if a quad is folded back beyond itself along its first diagonal, whereas a reader that treats
/// it as plane and concave cuts it along the interior diagonal.
bool is_folded_in_its_plane(const std::vector<Eigen::Vector3f>& points, const Quad& q) {
  const Eigen::Vector3d a = points[q[0]].cast<double>(), u = points[q[1]].cast<double>() - a,
                        v = points[q[2]].cast<double>() - a, w = points[q[3]].cast<double>() - a;
  const Eigen::Vector3d first = u.cross(v), second = v.cross(w), whole = first + second;
  const double longest = std::sqrt(std::max({u.squaredNorm(), v.squaredNorm(), w.squaredNorm()}));
  return std::min(first.dot(whole), second.dot(whole)) < -kNoArea * whole.squaredNorm() &&
         std::abs(first.dot(w)) <= kPlane * longest * longest * longest;
}

/// Replaces such quads by the two triangles that were proved.
void part_folded_quads(PolygonMesh& mesh, RunContext& context) {
  std::vector<std::uint8_t> folded(mesh.quads.size());
  parallel_blocks(folded.size(), context,
                  [&](std::size_t i) { folded[i] = is_folded_in_its_plane(mesh.points, mesh.quads[i]); });
  const auto first = std::find(folded.begin(), folded.end(), 1);
  if (first == folded.end()) return;
  std::size_t kept = std::size_t(first - folded.begin());
  for (std::size_t i = kept; i < folded.size(); ++i) {
    const Quad q = mesh.quads[i];
    if (folded[i])
      mesh.triangles.insert(mesh.triangles.end(), {Triangle{q[0], q[1], q[2]}, Triangle{q[0], q[2], q[3]}});
    else
      mesh.quads[kept++] = q;
  }
  mesh.quads.resize(kept);
}

/// Returns the mesh in file coordinates, relative to the placement's origin.
PolygonMesh in_world(CertifiedPolygons polygons, const FilePoints& file, RunContext& context) {
  PolygonMesh result;
  result.origin = file.placement().origin;
  result.points.resize(polygons.points.size());
  parallel_blocks(polygons.points.size(), context,
                  [&](std::size_t i) { result.points[i] = file.in_file(polygons.points[i]); });
  result.quads = std::move(polygons.quads);
  result.triangles = std::move(polygons.triangles);
  // A mirror reverses the order of corners.
  if (file.placement().mirrors()) {
    for (Quad& quad : result.quads) std::swap(quad[1], quad[3]);
    for (Triangle& triangle : result.triangles) std::swap(triangle[1], triangle[2]);
  }
  part_folded_quads(result, context);
  return result;
}

/// Returns the triangles that the field does not exclude, and their vertices, in the order of first use. A
/// triangle of the uniform mesh is outside if its middle is; a merged one may have its middle anywhere.
CertifiedPolygons within(const FieldAtPoints& field, CertifiedPolygons all) {
  constexpr std::uint32_t kNone = 0xffffffffu;
  std::vector<std::uint32_t> number(all.points.size(), kNone);
  CertifiedPolygons result;
  std::size_t triangle = 0;
  for (Triangle t : all_triangles(std::move(all.triangles), all.quads)) {
    const bool shown = !all.shown.empty() && all.shown[triangle];
    ++triangle;
    if (!shown && field.leaves_out((all.points[t[0]] + all.points[t[1]] + all.points[t[2]]) / 3.0)) continue;
    for (std::uint32_t& p : t) {
      if (number[p] == kNone) {
        number[p] = static_cast<std::uint32_t>(result.points.size());
        result.points.push_back(all.points[p]);
      }
      p = number[p];
    }
    result.triangles.push_back(t);
  }
  return result;
}

/// Returns the largest length in the world of a unit step in index space, the map's largest singular value. A
/// bound in world units divided by it holds in every direction.
double longest_step(const IndexToWorld& placement) { return placement.linear.operatorNorm(); }

}  // namespace

/// A cell for FieldEvaluator: its block, and the only bit of a mask.
struct FieldAtPoints::Cell {
  std::array<std::int32_t, 3> lower;
  BlockMask mask{};
  std::size_t sample;
};

FieldAtPoints::Cell FieldAtPoints::cell_at(const Eigen::Vector3d& p) const {
  Cell cell;
  int at[3];
  for (int a = 0; a < 3; ++a) {
    const int index = static_cast<int>(std::floor(p[a])) + base_[a];
    // Bit operations round down for negative coordinates, too.
    cell.lower[a] = index & ~7;
    at[a] = index & 7;
  }
  cell.sample = static_cast<std::size_t>(sample_index(at[0], at[1], at[2]));
  cell.mask[cell.sample >> 6] = std::uint64_t{1} << (cell.sample & 63);
  return cell;
}

bool FieldAtPoints::in_mask(const Eigen::Vector3d& p) const {
  const auto is_in = [&](const Eigen::Vector3d& at) {
    const Cell cell = cell_at(at);
    return any(inside(cell.lower, cell.mask));
  };
  if (is_in(p)) return true;
  // A vertex on a face of its cell, except for rounding, is also within it.
  constexpr double kOnFace = 1e-5;
  const Eigen::Vector3d off = p - p.array().round().matrix();
  if (off.cwiseAbs().minCoeff() > kOnFace) return false;
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d at = p;
    for (int a = 0; a < 3; ++a) at[a] += corner >> a & 1 ? kOnFace : -kOnFace;
    if (is_in(at)) return true;
  }
  return false;
}

bool FieldAtPoints::leaves_out(const Eigen::Vector3d& p) const { return leaves_out_outside() && !in_mask(p); }

float FieldAtPoints::tolerance(const Eigen::Vector3d& p, double tolerance) const {
  // Outside of the mask the scale does not apply, and a tolerance larger than that of simplification remains.
  if (simplifies_outside() && !in_mask(p))
    return static_cast<float>(std::max(tolerance, kSimplifiedTolerance));
  // Excluded vertices must not be merged with others.
  if (leaves_out_outside() && !in_mask(p)) return 0;
  if (!has_scale()) return static_cast<float>(tolerance);
  const Cell cell = cell_at(p);
  std::array<float, 512> scales;
  this->scales(cell.lower, cell.mask, scales);
  return static_cast<float>(tolerance * scales[cell.sample]);
}

std::vector<Triangle> all_triangles(std::vector<Triangle> triangles, const LargeArray<Quad>& quads) {
  triangles.reserve(triangles.size() + 2 * quads.size());
  for (const Quad& q : quads) {
    triangles.push_back({q[0], q[1], q[2]});
    triangles.push_back({q[0], q[2], q[3]});
  }
  return triangles;
}

void show(CertifiedPolygons& polygons, const std::function<bool(std::size_t, int, std::uint32_t)>& is_shown) {
  for (const Triangle& t : all_triangles(polygons.triangles, polygons.quads)) {
    const std::size_t number = polygons.shown.size();
    polygons.shown.push_back(is_shown(number, 0, t[0]) || is_shown(number, 1, t[1]) ||
                             is_shown(number, 2, t[2]));
  }
}

void report(const UniformCounts& counts, RunContext& context) {
  context.figure("cells", double(counts.cells));
  context.figure("several_sheets", double(counts.several_sheets));
  context.figure("held_cells", double(counts.held));
  context.figure("fanned_edges", double(counts.fanned_edges));
  context.figure("escaped", double(counts.escaped));
}

CertifiedPolygons as_they_are(UniformMesh uniform) {
  return {std::move(uniform.points), std::move(uniform.triangles), std::move(uniform.quads), {}};
}

PolygonMesh finished(CertifiedPolygons polygons, const FieldAtPoints& field, const FilePoints& file,
                     RunContext& context) {
  if (field.leaves_out_outside()) polygons = within(field, std::move(polygons));
  return in_world(std::move(polygons), file, context);
}

namespace {

/// The requested tolerance.
struct AskedTolerance {
  double voxels = 0.1;
  double world = 0.0;  ///< world units; replaces `voxels` if greater than 0
};

const OptionTable<AskedTolerance>& tolerance_table() {
  static const auto table =
      OptionTable<AskedTolerance>()
          .number("tolerance", &AskedTolerance::voxels, {.maximum = 1e6},
                  "two-sided distance to the uniform mesh, in voxels, that is exceeded by no more than "
                  "0.005; larger "
                  "gives fewer polygons, 0 the uniform mesh itself, whose quads are cut from their first "
                  "corner to the third",
                  {"tolerance_world=0"})
          .number("tolerance_world", &AskedTolerance::world, {.maximum = 1e30},
                  "the same in world units, instead of tolerance where it is greater than 0");
  return table;
}

}  // namespace

std::vector<OptionSpec> tolerance_options() { return tolerance_table().specs(); }

double asked_tolerance(const Options& options, const IndexToWorld& placement) {
  const AskedTolerance asked = tolerance_table().read(options);
  return asked.world > 0 ? asked.world / longest_step(placement) : asked.voxels;
}

PolygonMesh contour_certified(const ExtractionInput& input, std::string_view name, bool needs_normals,
                              const std::function<PolygonMesh(const HermiteView&, double)>& contour) {
  const auto contoured = [&](const HermiteView& grid) {
    return contour(grid, asked_tolerance(input.options, grid.placement()));
  };
  // Packed data are decoded on access, by code compiled for their normal code; all other representations are
  // floats by now.
  const std::string variant(name);
  if (const std::optional<PackedHermite> packed = packed_hermite_input(input, variant))
    return with_normal_code(packed->normal_code,
                            [&](auto code) { return contoured(view_of(*packed, code, input.context)); });
  const FloatHermite hermite = hermite_input(input, variant, needs_normals);
  return contoured(view_of(hermite, input.context));
}

}  // namespace hermesh
