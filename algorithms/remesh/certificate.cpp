#include "algorithms/remesh/certificate.h"

#include <zlib.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>
#include <utility>

#include "algorithms/core/error.h"
#include "algorithms/core/parallel.h"
#include "algorithms/io/atomic_file.h"
#include "algorithms/search/surface_distance.h"
#include "algorithms/search/triangle_point.h"

namespace hermesh {
namespace {

/// Distance beyond a triangle at which a piece is cut off, in limits; 0.7 and 0.9 make more pieces.
constexpr double kCut = 0.5;
/// Pieces whose radius is below this many limits are not divided any more.
constexpr double kSmallest = 1.0 / 4096.0;
constexpr std::size_t kMostPieces = 1'000'000;  // of a triangle
/// Largest coefficient of a line.
constexpr double kLargest = double(1 << 30);

/// A corner of a piece.
struct Corner {
  Eigen::Vector3d weights;  ///< barycentric coordinates in the divided triangle
  Eigen::Vector3d place;
};
using Piece = std::vector<Corner>;

/// Returns the number with enough digits to read the same double.
std::string exact(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.17g", value);
  return buffer;
}

/// Covers one triangle after another of a block.
class Cover {
 public:
  Cover(const TriangleTree& tree, double limit, const RunContext& context, CoverProof& proof)
      : tree_(tree), limit_(limit), context_(context), proof_(proof) {}

  void add(const std::array<Eigen::Vector3d, 3>& triangle) {
    triangle_ = triangle;
    pieces_ = 0;
    divide({corner(Eigen::Vector3d::UnitX()), corner(Eigen::Vector3d::UnitY()),
            corner(Eigen::Vector3d::UnitZ())},
           last_);
  }

 private:
  Corner corner(const Eigen::Vector3d& weights) const {
    return {weights, weights[0] * triangle_[0] + weights[1] * triangle_[1] + weights[2] * triangle_[2]};
  }

  /// Adds the tree of a piece. `known` is a triangle that is likely near.
  void divide(const Piece& piece, std::uint32_t known) {
    if (pieces_++ % 256 == 0) context_.check();
    if (known != TriangleTree::kNone && assign(piece, known)) return;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const Corner& p : piece) middle += p.place / double(piece.size());
    double radius = 0.0;
    for (const Corner& p : piece) radius = std::max(radius, (p.place - middle).norm());
    const double search = limit_ + radius;
    const std::uint32_t nearest = tree_.nearest(middle, search * search).triangle;
    if (nearest != known && nearest != TriangleTree::kNone && assign(piece, nearest)) return;
    if (nearest == TriangleTree::kNone || radius < kSmallest * limit_ || pieces_ > kMostPieces)
      return leave(piece);
    if (!cut_off(piece, nearest) && !halve(piece, middle, nearest)) leave(piece);
  }

  /// Assigns the piece to a triangle if all of its corners are near enough.
  bool assign(const Piece& piece, std::uint32_t triangle) {
    const Eigen::Vector3d a = tree_.corner(triangle, 0), b = tree_.corner(triangle, 1),
                          c = tree_.corner(triangle, 2);
    for (const Corner& p : piece)
      if (squared_distance(p.place, a, b, c) > limit_ * limit_) return false;
    const std::int64_t step =
        std::int64_t(triangle) - (last_ == TriangleTree::kNone ? 0 : std::int64_t(last_));
    proof_.numbers.push_back(std::int32_t((step >= 0 ? 2 * step : -2 * step - 1) + 2));
    last_ = triangle;
    ++proof_.pieces;
    return true;
  }

  void leave(const Piece& piece) {
    Eigen::Vector3d twice = Eigen::Vector3d::Zero();
    for (std::size_t i = 2; i < piece.size(); ++i)
      twice += (piece[i - 1].place - piece[0].place).cross(piece[i].place - piece[0].place);
    proof_.uncovered_area += 0.5 * twice.norm();
    proof_.numbers.push_back(0);
  }

  /// Cuts off what is beyond a triangle, at right angles to the way to the farthest corner. Returns false if
  /// nothing is left, or nothing cut off.
  bool cut_off(const Piece& piece, std::uint32_t triangle) {
    const Eigen::Vector3d a = tree_.corner(triangle, 0), b = tree_.corner(triangle, 1),
                          c = tree_.corner(triangle, 2);
    double farthest = -1.0;
    Eigen::Vector3d from = Eigen::Vector3d::Zero(), to = from;
    for (const Corner& p : piece) {
      const Eigen::Vector3d q = closest_point(p.place, a, b, c).position;
      if ((p.place - q).norm() <= farthest) continue;
      farthest = (p.place - q).norm();
      from = q, to = p.place;
    }
    const Eigen::Vector3d way = (to - from).normalized();
    double least = farthest;
    for (const Corner& p : piece) least = std::min(least, way.dot(p.place - from));
    // A piece that is beyond the cut everywhere is divided at the limit.
    const double level = least < 0.9 * kCut * limit_ ? kCut * limit_ : 0.5 * (least + limit_);
    if (!(least < 0.98 * limit_ && level < farthest)) return false;
    return split(piece, way, from + level * way, triangle);
  }

  /// Divides the piece across its longest diagonal or side.
  bool halve(const Piece& piece, const Eigen::Vector3d& middle, std::uint32_t near) {
    Eigen::Vector3d longest = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < piece.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        if (const Eigen::Vector3d d = piece[i].place - piece[j].place; d.norm() > longest.norm()) longest = d;
    return split(piece, longest, middle, near);
  }

  /// Divides a piece by a plane. Returns false, with nothing added, if one of the parts would be empty.
  bool split(const Piece& piece, const Eigen::Vector3d& normal, const Eigen::Vector3d& on,
             std::uint32_t near) {
    Eigen::Vector3d line;
    for (int i = 0; i < 3; ++i) line[i] = normal.dot(triangle_[i] - on);
    const double largest = line.cwiseAbs().maxCoeff();
    if (!(largest > 0.0)) return false;
    for (double& c : line) c = std::round(c / largest * kLargest);
    // A part whose corners are all closer to the line than this is empty, apart from rounding.
    constexpr double kOnLine = 8.0;
    Piece parts[2];
    bool has[2] = {};
    for (std::size_t i = 0; i < piece.size(); ++i) {
      const Corner &p = piece[i], &q = piece[(i + 1) % piece.size()];
      const double at = line.dot(p.weights), next = line.dot(q.weights);
      if (at >= 0.0) parts[0].push_back(p);
      if (at <= 0.0) parts[1].push_back(p);
      has[0] = has[0] || at > kOnLine;
      has[1] = has[1] || at < -kOnLine;
      if ((at > 0.0 && next < 0.0) || (at < 0.0 && next > 0.0)) {
        const Corner between = corner((at * q.weights - next * p.weights) / (at - next));
        parts[0].push_back(between);
        parts[1].push_back(between);
      }
    }
    if (!has[0] || !has[1]) return false;
    proof_.numbers.insert(proof_.numbers.end(),
                          {1, std::int32_t(line[0]), std::int32_t(line[1]), std::int32_t(line[2])});
    // The part behind the plane is that of the triangle.
    divide(parts[0], TriangleTree::kNone);
    divide(parts[1], near);
    return true;
  }

  const TriangleTree& tree_;
  const double limit_;
  const RunContext& context_;
  CoverProof& proof_;
  std::array<Eigen::Vector3d, 3> triangle_;
  std::size_t pieces_ = 0;
  std::uint32_t last_ = TriangleTree::kNone;  ///< assigned last
};

}  // namespace

CoverProof cover(std::span<const Eigen::Vector3f> points, std::span<const Triangle> triangles,
                 const Eigen::Vector3d& offset, std::span<const Eigen::Vector3f> other_points,
                 std::span<const Triangle> other, double distance, const RunContext& context) {
  const SurfaceDistance surface(other_points, other);
  const double limit = distance - surface.rounding();
  constexpr std::size_t kBlock = 256;  // as in the format
  std::vector<CoverProof> blocks((triangles.size() + kBlock - 1) / kBlock);
  parallel_blocks(
      blocks.size(), context,
      [&](std::size_t block) {
        Cover walk(surface.tree(), limit, context, blocks[block]);
        for (std::size_t t = block * kBlock; t < std::min(triangles.size(), (block + 1) * kBlock); ++t) {
          std::array<Eigen::Vector3d, 3> corners;
          for (int i = 0; i < 3; ++i) corners[i] = offset + points[triangles[t][i]].cast<double>();
          walk.add(corners);
        }
      },
      1);
  CoverProof all;
  for (const CoverProof& block : blocks) {
    all.numbers.insert(all.numbers.end(), block.numbers.begin(), block.numbers.end());
    all.pieces += block.pieces;
    all.uncovered_area += block.uncovered_area;
  }
  return all;
}

CertificateReport write_certificate(const std::filesystem::path& path, const MeshFile& input,
                                    const PolygonMesh& output, double error, RunContext& context) {
  const Stage stage(context, "write the certificate");
  static_assert(std::endian::native == std::endian::little);
  const PolygonMesh polygons = to_polygon_mesh(input);
  // Steps between triangles are numbers of 31 bits.
  if (std::max(polygons.triangle_count(), output.triangles.size()) >= std::size_t(1) << 29)
    throw Error("a certificate is for meshes of fewer than 2^29 triangles");
  std::vector<Triangle> triangles = triangulated(polygons);
  if (!input.triangle_numbers.empty()) {
    std::vector<Triangle> in_order(triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t) in_order[input.triangle_numbers[t]] = triangles[t];
    triangles = std::move(in_order);
  }
  const Eigen::Vector3d offset = output.origin - polygons.origin;
  const CoverProof of_output =
      cover(output.points, output.triangles, offset, polygons.points, triangles, error, context);
  const CoverProof of_input =
      cover(polygons.points, triangles, -offset, output.points, output.triangles, error, context);
  const bool has_cuts = !input.quads.empty() || !input.triangle_numbers.empty();
  std::vector<std::int32_t> numbers;
  if (has_cuts)
    for (const Triangle& t : triangles) numbers.insert(numbers.end(), t.begin(), t.end());
  for (const CoverProof* proof : {&of_output, &of_input})
    numbers.insert(numbers.end(), proof->numbers.begin(), proof->numbers.end());
  const std::string header = "{\"format\": \"hermesh certificate 1\", \"error\": " + exact(error) +
                             ", \"input_triangles\": " + std::to_string(triangles.size()) +
                             ", \"output_triangles\": " + std::to_string(output.triangles.size()) +
                             ", \"cuts\": " + (has_cuts ? "true" : "false") + "}\n";
  uLongf size = compressBound(numbers.size() * sizeof(std::int32_t));
  std::vector<unsigned char> bytes(size);
  if (compress2(bytes.data(), &size, reinterpret_cast<const unsigned char*>(numbers.data()),
                numbers.size() * sizeof(std::int32_t), Z_BEST_SPEED) != Z_OK)
    throw Error("the certificate cannot be compressed");
  AtomicFile file(path);
  std::ofstream stream(file.path(), std::ios::binary);
  stream << header;
  stream.write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(size));
  stream.close();
  if (!stream) throw Error("'" + path.string() + "' cannot be written");
  file.commit();
  return {of_input.uncovered_area, of_output.uncovered_area, of_input.pieces + of_output.pieces};
}

}  // namespace hermesh
