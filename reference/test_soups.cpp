#include "reference/test_soups.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "reference/test_meshes.h"

namespace hermesh::test {
namespace {

using Eigen::Vector3d;

constexpr double kTurn = 2.0 * std::numbers::pi;

void append(PolygonMesh& mesh, const PolygonMesh& other, const Eigen::Affine3d& place) {
  const auto first = std::uint32_t(mesh.points.size());
  for (const Eigen::Vector3f& p : other.points)
    mesh.points.push_back((place * p.cast<double>()).cast<float>());
  for (const Triangle& t : triangulated(other))
    mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
}

class Maker {
 public:
  explicit Maker(std::uint64_t seed) : random_(seed) {}

  Soup make() {
    const std::size_t kind = std::size_t(random_() % 6);
    const double triangles = 100.0 * std::pow(100.0, uniform());
    double resolution = 12.0 * std::pow(33.0, uniform());
    constexpr const char* kNames[] = {"triangles", "balls", "boxes", "tori", "spikes", "sheets"};
    switch (kind) {
      case 0:
        make_triangles(triangles);
        break;
      case 1:
        make_balls(triangles);
        break;
      case 2:
        make_boxes(triangles);
        break;
      case 3:
        make_tori(triangles);
        break;
      case 4:
        make_spikes(triangles);
        break;
      default:
        make_sheets(triangles, resolution);
    }
    const double extent = bounds(soup_.mesh).size().maxCoeff();
    constexpr double kMostArea = 1e6;  // in voxels, which OpenVDB needs seconds for
    resolution = std::clamp(resolution, 12.0, 12.0 + extent * std::sqrt(kMostArea / area()));
    soup_.voxel_size = extent / resolution;
    soup_.name = std::string(kNames[kind]) + ", " + std::to_string(soup_.mesh.triangles.size()) +
                 " triangles, " + std::to_string(std::lround(resolution)) + " voxels";
    return std::move(soup_);
  }

 private:
  /// A random number in [0, 1), made without the library's distributions, which differ between platforms.
  double uniform() { return double(random_() >> 11) * 0x1p-53; }
  double between(double low, double high) { return low + (high - low) * uniform(); }
  Vector3d in_cube() {
    const double x = between(-1, 1), y = between(-1, 1);
    return {x, y, between(-1, 1)};
  }
  Vector3d direction() {
    const double z = between(-1, 1), phi = between(0, kTurn), r = std::sqrt(1 - z * z);
    return {r * std::cos(phi), r * std::sin(phi), z};
  }
  Eigen::Affine3d placed(const Vector3d& at) {
    const Vector3d axis = direction();
    return Eigen::Translation3d(at) * Eigen::AngleAxisd(between(0, kTurn), axis);
  }
  double area() const {
    double twice = 0;
    for (const Triangle& t : soup_.mesh.triangles) {
      const auto from_first = [&](int i) {
        return Vector3d((soup_.mesh.points[t[i]] - soup_.mesh.points[t[0]]).cast<double>());
      };
      twice += from_first(1).cross(from_first(2)).norm();
    }
    return 0.5 * twice;
  }
  void add_triangle(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    PolygonMesh& mesh = soup_.mesh;
    const auto first = std::uint32_t(mesh.points.size());
    for (const Vector3d& p : {a, b, c}) mesh.points.push_back(p.cast<float>());
    mesh.triangles.push_back({first, first + 1, first + 2});
  }

  void make_triangles(double count) {
    const double size = std::pow(10.0, between(-1.5, 0.3));
    for (int i = 0; i < count; ++i) {
      const Vector3d at = in_cube();
      const Vector3d a = at + size * in_cube(), b = at + size * in_cube();
      add_triangle(a, b, at + size * in_cube());
    }
  }
  void make_balls(double count) {
    const int levels = int(random_() % 4);
    const int balls = std::max(2, int(count / (8 << 2 * levels)));
    const double size = between(0.2, 1.0);
    for (int i = 0; i < balls; ++i) {
      const Vector3d at = in_cube();
      append(soup_.mesh, sphere(size * between(0.3, 1.0), levels), placed(at));
    }
  }
  void make_boxes(double count) {
    const double size = between(0.1, 1.0);
    for (int i = 0; i < std::max(2.0, count / 12); ++i) {
      const Vector3d half = size * (in_cube().cwiseAbs() + Vector3d::Constant(0.02)), at = in_cube();
      PolygonMesh box = turned_cube(1.0);
      for (Eigen::Vector3f& p : box.points)
        p = half.cwiseProduct(turn().transpose() * p.cast<double>()).cast<float>();
      append(soup_.mesh, box, placed(at));
    }
  }
  /// Adds tori that cross themselves: the tube is wider than the ring that it follows.
  void make_tori(double count) {
    const int tori = 1 + int(random_() % 4), sides = std::max(4, int(std::sqrt(count / (4.0 * tori))));
    for (int i = 0; i < tori; ++i) {
      const double minor = between(0.2, 1.0);
      const Vector3d at = i * 0.5 * in_cube();
      append(soup_.mesh, torus(minor * between(0.1, 0.95), minor, 2 * sides, sides), placed(at));
    }
  }
  void make_spikes(double count) {
    const double width = std::pow(10.0, between(-2.5, -0.5));
    for (int i = 0; i < count / 4; ++i) {
      const Vector3d way = direction(), u = way.unitOrthogonal(), v = way.cross(u),
                     tip = way * between(0.3, 1.0);
      Vector3d foot[3];
      for (int k = 0; k < 3; ++k)
        foot[k] = 0.1 * way + width * (std::cos(kTurn * k / 3) * u + std::sin(kTurn * k / 3) * v);
      for (int k = 0; k < 3; ++k) add_triangle(foot[k], foot[(k + 1) % 3], tip);
      add_triangle(foot[2], foot[1], foot[0]);
    }
  }
  /// Adds plates, stacked closely, half of them tilted a little so that they cross the next ones.
  void make_sheets(double count, double resolution) {
    const double gap = 2.0 / resolution * between(0.05, 1.5);
    const int plates = std::max(2, std::min(int(count / 12), int(2.0 / gap)));
    const bool tilted = random_() % 2;
    for (int i = 0; i < plates; ++i) {
      PolygonMesh plate = turned_cube(1.0);
      for (Eigen::Vector3f& p : plate.points)
        p = Vector3d(1, 1, 0.3 * gap).cwiseProduct(turn().transpose() * p.cast<double>()).cast<float>();
      const Vector3d axis = direction();
      append(soup_.mesh, plate,
             Eigen::Translation3d(0, 0, i * gap) * Eigen::AngleAxisd(tilted ? 3.0 * gap : 0.0, axis));
    }
  }

  std::mt19937_64 random_;
  Soup soup_;
};

}  // namespace

Soup soup(std::uint64_t seed) { return Maker(seed).make(); }

}  // namespace hermesh::test
