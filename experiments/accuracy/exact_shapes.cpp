#include "experiments/accuracy/exact_shapes.h"

#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <unordered_map>

#include "algorithms/core/error.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

// ---- Facets: the surface of the cube [-1, 1]³ in squares of the same number along each side, mapped onto a
// shape.

template <class Map>
PolygonMesh mapped_cube(int n, const Map& map) {
  PolygonMesh mesh;
  std::unordered_map<std::uint64_t, std::uint32_t> numbers;
  const auto point = [&](const std::array<int, 3>& at) {
    const std::uint64_t key =
        (std::uint64_t(at[0]) << 42) | (std::uint64_t(at[1]) << 21) | std::uint64_t(at[2]);
    const auto [found, is_new] = numbers.emplace(key, std::uint32_t(mesh.points.size()));
    if (is_new)
      mesh.points.push_back(map(Vector3d(2.0 * at[0] / n - 1, 2.0 * at[1] / n - 1, 2.0 * at[2] / n - 1))
                                .template cast<float>());
    return found->second;
  };
  for (int axis = 0; axis < 3; ++axis)
    for (const int side : {0, n})
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          const auto corner = [&](int u, int v) {
            std::array<int, 3> at;
            at[axis] = side, at[(axis + 1) % 3] = i + u, at[(axis + 2) % 3] = j + v;
            return point(at);
          };
          std::uint32_t a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
          // The two axes after the first turn about it, so that the far side is seen from outside and the
          // near one is not.
          if (side == 0) std::swap(b, d);
          mesh.triangles.push_back({a, b, c});
          mesh.triangles.push_back({a, c, d});
        }
  return mesh;
}

int pieces(double length, double of) { return std::max(1, int(std::ceil(length / of))); }

/// Equal angles instead of equal lengths, for a projection from the middle.
Vector3d by_angle(const Vector3d& cube) {
  return (0.25 * pi * cube).unaryExpr([](double angle) { return std::tan(angle); });
}

/// The square onto the disc with squares about the middle onto circles (Shirley & Chiu 1997).
Eigen::Vector2d disc(double x, double y) {
  if (x == 0.0 && y == 0.0) return {0.0, 0.0};
  const bool by_x = std::abs(x) > std::abs(y);
  const double radius = by_x ? x : y;
  const double angle = by_x ? 0.25 * pi * y / x : 0.5 * pi - 0.25 * pi * x / y;
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

// ---- Shapes.

class Ellipsoid : public ExactShape {
 public:
  explicit Ellipsoid(const Vector3d& axes) : axes_(axes) {}  ///< axes in descending order

  SurfacePlace nearest(const Vector3d& p) const override {
    // The nearest point is q = a² p / (t + a²) for the largest t with q on the surface (Eberly, Distance from
    // a Point to an Ellipsoid). In units of the shortest axis the condition is convex and falls in t:
    // Newton's method from a t that is too small comes from the left and never passes. A coordinate of 0
    // would make the point's side undecided.
    const Vector3d squares = axes_.cwiseAbs2() / (axes_[2] * axes_[2]);
    const Vector3d apart = p.cwiseAbs().cwiseMax(1e-15);
    const Vector3d scaled = squares.cwiseProduct(apart).cwiseQuotient(axes_);
    double t = (scaled - squares).maxCoeff();
    for (int i = 0; i < 200; ++i) {
      const Vector3d parts = scaled.cwiseQuotient((squares.array() + t).matrix());
      const double value = parts.squaredNorm() - 1.0;
      const double slope = -2.0 * parts.cwiseAbs2().cwiseQuotient((squares.array() + t).matrix()).sum();
      const double next = t - value / slope;
      if (!(next > t)) break;
      t = next;
    }
    SurfacePlace place;
    place.point = squares.cwiseProduct(apart).cwiseQuotient((squares.array() + t).matrix());
    for (int a = 0; a < 3; ++a) place.point[a] = std::copysign(place.point[a], p[a]);
    const Vector3d gradient = place.point.cwiseQuotient(axes_.cwiseAbs2());
    place.normal = gradient.normalized();
    const double product = axes_.prod() * axes_.prod(), w = gradient.squaredNorm();
    place.gaussian_curvature = 1.0 / (product * w * w);
    place.mean_curvature =
        (axes_.squaredNorm() - place.point.squaredNorm()) / (2.0 * product * w * std::sqrt(w));
    return place;
  }
  double distance(const Vector3d& p) const override {
    const double length = (p - nearest(p).point).norm();
    return p.cwiseQuotient(axes_).squaredNorm() < 1.0 ? -length : length;
  }
  std::optional<double> area() const override {
    if (axes_[0] == axes_[2]) return 4.0 * pi * axes_[0] * axes_[0];
    // Legendre's formula.
    const double a = axes_[0], b = axes_[1], c = axes_[2];
    const double angle = std::acos(c / a),
                 modulus = std::sqrt((a * a * (b * b - c * c)) / (b * b * (a * a - c * c)));
    const double sine = std::sin(angle), cosine = std::cos(angle);
    return 2.0 * pi * c * c + 2.0 * pi * a * b / sine *
                                  (std::ellint_2(modulus, angle) * sine * sine +
                                   std::ellint_1(modulus, angle) * cosine * cosine);
  }
  std::optional<double> volume() const override { return 4.0 / 3.0 * pi * axes_.prod(); }
  Vector3d half_size() const override { return axes_; }
  PolygonMesh facets(double length) const override {
    return mapped_cube(pieces(0.5 * pi * axes_[0], length), [&](const Vector3d& at) -> Vector3d {
      return axes_.cwiseProduct(by_angle(at).normalized());
    });
  }

 private:
  Vector3d axes_;
};

class Sphere final : public Ellipsoid {
 public:
  Sphere() : Ellipsoid(Vector3d::Ones()) {}
  SurfacePlace nearest(const Vector3d& p) const override {
    const Vector3d normal = p.norm() > 0 ? p.normalized() : Vector3d(Vector3d::UnitX());
    return {normal, normal, 1.0, 1.0};
  }
  double distance(const Vector3d& p) const override { return p.norm() - 1.0; }
};

class Torus final : public ExactShape {
 public:
  SurfacePlace nearest(const Vector3d& p) const override {
    const double rho = std::hypot(p.x(), p.y());
    const Vector3d outwards = rho > 0 ? Vector3d(p.x() / rho, p.y() / rho, 0) : Vector3d(Vector3d::UnitX());
    const Vector3d from = (rho - kRing) * outwards + p.z() * Vector3d::UnitZ();
    const Vector3d normal = from.norm() > 0 ? from.normalized() : outwards;
    const double cosine = normal.dot(outwards), reach = kRing + kTube * cosine;
    return {kRing * outwards + kTube * normal, normal, (kRing + 2.0 * kTube * cosine) / (2.0 * kTube * reach),
            cosine / (kTube * reach)};
  }
  double distance(const Vector3d& p) const override {
    return std::hypot(std::hypot(p.x(), p.y()) - kRing, p.z()) - kTube;
  }
  std::optional<double> area() const override { return 4.0 * pi * pi * kRing * kTube; }
  std::optional<double> volume() const override { return 2.0 * pi * pi * kRing * kTube * kTube; }
  Vector3d half_size() const override { return {kRing + kTube, kRing + kTube, kTube}; }
  PolygonMesh facets(double length) const override {
    const int around = std::max(3, pieces(2.0 * pi * (kRing + kTube), length));
    const int tube = std::max(3, pieces(2.0 * pi * kTube, length));
    PolygonMesh mesh;
    for (int i = 0; i < around; ++i)
      for (int j = 0; j < tube; ++j) {
        const double u = 2.0 * pi * i / around, v = 2.0 * pi * j / tube, reach = kRing + kTube * std::cos(v);
        mesh.points.push_back(
            Vector3d(reach * std::cos(u), reach * std::sin(u), kTube * std::sin(v)).cast<float>());
      }
    const auto number = [&](int i, int j) { return std::uint32_t((i % around) * tube + j % tube); };
    for (int i = 0; i < around; ++i)
      for (int j = 0; j < tube; ++j) {
        mesh.triangles.push_back({number(i, j), number(i + 1, j), number(i + 1, j + 1)});
        mesh.triangles.push_back({number(i, j), number(i + 1, j + 1), number(i, j + 1)});
      }
    return mesh;
  }

 private:
  static constexpr double kRing = 0.7, kTube = 0.3;
};

/// All points within a radius of a box. Its normals are continuous, its curvatures are not.
class RoundedBox final : public ExactShape {
 public:
  SurfacePlace nearest(const Vector3d& p) const override {
    const Vector3d within = p.cwiseMax(-kInner).cwiseMin(kInner), from = p - within;
    if (from.norm() == 0.0) {
      int face = 0;
      (p.cwiseAbs() - kInner).maxCoeff(&face);
      const Vector3d normal = std::copysign(1.0, p[face]) * Vector3d::Unit(face);
      Vector3d point = p;
      point[face] = std::copysign(kInner[face] + kRadius, p[face]);
      return {point, normal, 0.0, 0.0};
    }
    const Vector3d normal = from.normalized();
    const auto bent = int((from.array() != 0.0).count()) - 1;
    return {within + kRadius * normal, normal, 0.5 * bent / kRadius,
            bent == 2 ? 1.0 / (kRadius * kRadius) : 0.0};
  }
  double distance(const Vector3d& p) const override {
    const Vector3d over = p.cwiseAbs() - kInner;
    return over.cwiseMax(0.0).norm() + std::min(over.maxCoeff(), 0.0) - kRadius;
  }
  std::optional<double> area() const override {
    return 8.0 * faces() + 4.0 * pi * kRadius * kInner.sum() + 4.0 * pi * kRadius * kRadius;
  }
  std::optional<double> volume() const override {
    return 8.0 * kInner.prod() + 8.0 * kRadius * faces() + 2.0 * pi * kRadius * kRadius * kInner.sum() +
           4.0 / 3.0 * pi * kRadius * kRadius * kRadius;
  }
  Vector3d half_size() const override { return (kInner.array() + kRadius).matrix(); }
  PolygonMesh facets(double length) const override {
    return mapped_cube(pieces(2.0 * half_size().maxCoeff(), length), [&](const Vector3d& at) -> Vector3d {
      return nearest(at.cwiseProduct(half_size())).point;
    });
  }

 private:
  static double faces() { return kInner[0] * kInner[1] + kInner[1] * kInner[2] + kInner[2] * kInner[0]; }
  static constexpr double kRadius = 0.4;
  static inline const Vector3d kInner{0.5, 0.35, 0.2};
};

class Cylinder final : public ExactShape {
 public:
  SurfacePlace nearest(const Vector3d& p) const override {
    const double rho = std::hypot(p.x(), p.y());
    const Vector3d outwards = rho > 0 ? Vector3d(p.x() / rho, p.y() / rho, 0) : Vector3d(Vector3d::UnitX());
    const double beside = rho - kRadius, above = std::abs(p.z()) - kHalf, up = std::copysign(1.0, p.z());
    const bool side = beside > above;
    // Beyond the rim both are clamped; else it is the face that is nearer.
    const double radius = side || beside > 0 ? kRadius : rho;
    const double height = !side || above > 0 ? kHalf : std::abs(p.z());
    return {radius * outwards + up * height * Vector3d::UnitZ(),
            side ? outwards : Vector3d(up * Vector3d::UnitZ()), side ? 0.5 / kRadius : 0.0, 0.0};
  }
  double distance(const Vector3d& p) const override {
    const double beside = std::hypot(p.x(), p.y()) - kRadius, above = std::abs(p.z()) - kHalf;
    return beside > 0 && above > 0 ? std::hypot(beside, above) : std::max(beside, above);
  }
  std::optional<double> area() const override { return 2.0 * pi * kRadius * (2.0 * kHalf + kRadius); }
  std::optional<double> volume() const override { return 2.0 * pi * kRadius * kRadius * kHalf; }
  Vector3d half_size() const override { return {kRadius, kRadius, kHalf}; }
  bool is_sharp() const override { return true; }
  std::vector<Vector3d> crease_points(double spacing) const override {
    std::vector<Vector3d> points;
    const int n = pieces(2.0 * pi * kRadius, spacing);
    for (const double z : {-kHalf, kHalf})
      for (int i = 0; i < n; ++i)
        points.emplace_back(kRadius * std::cos(2.0 * pi * i / n), kRadius * std::sin(2.0 * pi * i / n), z);
    return points;
  }
  PolygonMesh facets(double length) const override {
    return mapped_cube(pieces(0.5 * pi * kRadius, length), [](const Vector3d& at) -> Vector3d {
      const Eigen::Vector2d round = kRadius * disc(at.x(), at.y());
      return {round.x(), round.y(), kHalf * at.z()};
    });
  }

 private:
  static constexpr double kRadius = 0.8, kHalf = 0.7;
};

class Cube final : public ExactShape {
 public:
  SurfacePlace nearest(const Vector3d& p) const override {
    const Vector3d over = (p.cwiseAbs().array() - kHalf).matrix();
    int face = 0;
    over.maxCoeff(&face);
    Vector3d point = p.cwiseMax(-kHalf).cwiseMin(kHalf);
    point[face] = std::copysign(kHalf, p[face]);
    return {point, std::copysign(1.0, p[face]) * Vector3d::Unit(face), 0.0, 0.0};
  }
  double distance(const Vector3d& p) const override {
    const Vector3d over = (p.cwiseAbs().array() - kHalf).matrix();
    return over.cwiseMax(0.0).norm() + std::min(over.maxCoeff(), 0.0);
  }
  std::optional<double> area() const override { return 24.0 * kHalf * kHalf; }
  std::optional<double> volume() const override { return 8.0 * kHalf * kHalf * kHalf; }
  Vector3d half_size() const override { return Vector3d::Constant(kHalf); }
  bool is_sharp() const override { return true; }
  bool is_flat() const override { return true; }
  std::vector<Vector3d> crease_points(double spacing) const override {
    std::vector<Vector3d> points;
    const int n = pieces(2.0 * kHalf, spacing);
    for (int axis = 0; axis < 3; ++axis)
      for (const double u : {-kHalf, kHalf})
        for (const double v : {-kHalf, kHalf})
          for (int i = 0; i < n; ++i) {
            Vector3d at;
            at[axis] = kHalf * (2.0 * (i + 0.5) / n - 1.0), at[(axis + 1) % 3] = u, at[(axis + 2) % 3] = v;
            points.push_back(at);
          }
    return points;
  }
  std::vector<Vector3d> corners() const override {
    std::vector<Vector3d> points;
    for (int i = 0; i < 8; ++i)
      points.push_back(kHalf * Vector3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
    return points;
  }
  PolygonMesh facets(double) const override {
    return mapped_cube(1, [](const Vector3d& at) -> Vector3d { return kHalf * at; });
  }

 private:
  static constexpr double kHalf = 0.6;
};

class Gyroid final : public ExactShape {
 public:
  SurfacePlace nearest(const Vector3d& p) const override {
    // Newton's method finds one of the points at which the vector to p is normal to the surface, so it is
    // started from several points.
    std::optional<Vector3d> best;
    for (int start = 0; start < 7 || (!best && start < kMostStarts); ++start) {
      Vector3d from = p;
      // Along the axes; and where that finds none, farther and farther away.
      if (start > 0)
        from[(start - 1) / 2 % 3] += (start % 2 == 0 ? kStart : -kStart) * double(1 + (start - 1) / 6);
      const std::optional<Vector3d> found = foot(p, from);
      if (found && (!best || (*found - p).squaredNorm() < (*best - p).squaredNorm())) best = found;
    }
    if (!best) throw Error("no place of the gyroid was found that is nearest to a point");
    const Vector3d q = *best;
    const Vector3d slope = gradient(q);
    const Eigen::Matrix3d bend = hessian(q);
    const double length = slope.norm();
    const Vector3d n = slope / length;
    // Curvatures of a level set: H is half the divergence of the normal, K the determinant of the shape
    // operator.
    Eigen::Matrix4d bordered = Eigen::Matrix4d::Zero();
    bordered.topLeftCorner<3, 3>() = bend;
    bordered.topRightCorner<3, 1>() = slope;
    bordered.bottomLeftCorner<1, 3>() = slope.transpose();
    return {q, n, 0.5 * (bend.trace() - n.dot(bend * n)) / length,
            -bordered.determinant() / std::pow(length, 4)};
  }
  double distance(const Vector3d& p) const override {
    const double ball = p.norm() - kBall;
    const double g = value(p);
    // The gradient is no longer than the bound, so a large value is far away; its distance does not matter
    // there.
    const double bound = std::abs(g) / kSteepest;
    double sheet = g < 0 ? -bound : bound;
    if (bound < kExact) {
      const double length = (p - nearest(p).point).norm();
      sheet = g < 0 ? -length : length;
    }
    return std::max(sheet, ball);
  }
  double exact_within() const override { return kExact; }
  double bounded_distance(const Vector3d& p) const override {
    return std::max(value(p) / kSteepest, p.norm() - kBall);
  }
  std::optional<double> area() const override { return std::nullopt; }
  std::optional<double> volume() const override { return std::nullopt; }
  Vector3d half_size() const override { return Vector3d::Constant(kBall); }
  bool describes(const Vector3d& p) const override { return p.norm() < 0.75; }
  PolygonMesh facets(double) const override { return {}; }

 private:
  /// Returns a point q of the surface with q - p + m ∇g(q) = 0, or none: a first guess from the gradient at
  /// `start`, then Newton's method for all four unknowns, which doubles the number of correct digits in each
  /// step.
  static std::optional<Vector3d> foot(const Vector3d& p, const Vector3d& start) {
    Vector3d q = start;
    for (int i = 0; i < 3; ++i) q -= value(q) / std::max(gradient(q).squaredNorm(), 0.1) * gradient(q);
    double m = (p - q).dot(gradient(q)) / gradient(q).squaredNorm();
    double last = 1.0;
    for (int i = 0; i < 30; ++i) {
      const Vector3d slope = gradient(q);
      Eigen::Matrix4d system = Eigen::Matrix4d::Zero();
      system.topLeftCorner<3, 3>() = Eigen::Matrix3d::Identity() + m * hessian(q);
      system.topRightCorner<3, 1>() = slope;
      system.bottomLeftCorner<1, 3>() = slope.transpose();
      Eigen::Vector4d rest;
      rest << q - p + m * slope, value(q);
      const Eigen::Vector4d step = system.partialPivLu().solve(-rest);
      q += step.head<3>();
      m += step[3];
      if (!q.allFinite()) return std::nullopt;
      last = step.norm();
      if (last < 1e-13) return q;
    }
    // Near the centre of a curvature the system is nearly singular, and rounding keeps the steps from
    // becoming smaller.
    if (last < 1e-9 && std::abs(value(q)) < 1e-12) return q;
    return std::nullopt;
  }

  static double value(const Vector3d& p) {
    const Vector3d u = kScale * p;
    return std::sin(u.x()) * std::cos(u.y()) + std::sin(u.y()) * std::cos(u.z()) +
           std::sin(u.z()) * std::cos(u.x());
  }
  static Vector3d gradient(const Vector3d& p) {
    const Vector3d s = (kScale * p).array().sin(), c = (kScale * p).array().cos();
    return kScale * Vector3d(c.x() * c.y() - s.z() * s.x(), c.y() * c.z() - s.x() * s.y(),
                             c.z() * c.x() - s.y() * s.z());
  }
  static Eigen::Matrix3d hessian(const Vector3d& p) {
    const Vector3d s = (kScale * p).array().sin(), c = (kScale * p).array().cos();
    Eigen::Matrix3d h;
    h << -s.x() * c.y() - s.z() * c.x(), -c.x() * s.y(), -c.z() * s.x(),  //
        -c.x() * s.y(), -s.y() * c.z() - s.x() * c.y(), -c.y() * s.z(),   //
        -c.z() * s.x(), -c.y() * s.z(), -s.z() * c.x() - s.y() * c.z();
    return kScale * kScale * h;
  }
  static constexpr double kScale = 2.0, kBall = 1.25;
  static constexpr double kStart = 0.2;  ///< how far from a point Newton's method starts, too
  static constexpr int kMostStarts = 31;
  /// Each component of the gradient, kScale (cos a cos b − sin c sin a), is at most √2 kScale, so its length
  /// √6 kScale.
  static constexpr double kSteepest = 2.0 * std::numbers::sqrt2 * std::numbers::sqrt3;
  static constexpr double kExact = 0.4;
};

}  // namespace

std::span<const char* const> exact_shape_names() {
  static constexpr std::array kNames = {"sphere", "ellipsoid", "torus", "rounded-box",
                                        "gyroid", "cylinder",  "cube"};
  return kNames;
}

std::shared_ptr<const ExactShape> exact_shape(const std::string& name) {
  if (name == "sphere") return std::make_shared<Sphere>();
  if (name == "ellipsoid") return std::make_shared<Ellipsoid>(Vector3d(1.0, 0.7, 0.5));
  if (name == "torus") return std::make_shared<Torus>();
  if (name == "rounded-box") return std::make_shared<RoundedBox>();
  if (name == "gyroid") return std::make_shared<Gyroid>();
  if (name == "cylinder") return std::make_shared<Cylinder>();
  if (name == "cube") return std::make_shared<Cube>();
  throw Error("there is no exact shape \"" + name + "\"");
}

SurfacePlace PlacedShape::nearest(const Vector3d& p) const {
  SurfacePlace place = shape_->nearest(to_shape_ * p);
  place.point = to_world_ * place.point;
  place.normal = to_world_.linear() * place.normal;
  return place;
}

std::vector<Vector3d> PlacedShape::crease_points(double spacing) const {
  std::vector<Vector3d> points = shape_->crease_points(spacing);
  for (Vector3d& p : points) p = to_world_ * p;
  return points;
}

std::vector<Vector3d> PlacedShape::corners() const {
  std::vector<Vector3d> points = shape_->corners();
  for (Vector3d& p : points) p = to_world_ * p;
  return points;
}

PolygonMesh PlacedShape::facets(double length) const {
  PolygonMesh mesh = shape_->facets(length);
  for (Eigen::Vector3f& p : mesh.points) p = (to_world_ * p.cast<double>()).cast<float>();
  return mesh;
}

Bounds PlacedShape::bounds() const {
  Bounds box;
  const Vector3d half = shape_->half_size();
  for (int i = 0; i < 8; ++i)
    box.add(to_world_ * half.cwiseProduct(Vector3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)));
  return box;
}

PlacedShape turned(std::shared_ptr<const ExactShape> shape, const Vector3d& move) {
  constexpr double kDegree = pi / 180.0;
  Eigen::Isometry3d to_world = Eigen::Isometry3d::Identity();
  to_world.linear() = (Eigen::AngleAxisd(40 * kDegree, Vector3d::UnitZ()) *
                       Eigen::AngleAxisd(30 * kDegree, Vector3d::UnitY()) *
                       Eigen::AngleAxisd(20 * kDegree, Vector3d::UnitX()))
                          .toRotationMatrix();
  to_world.translation() = move;
  return {std::move(shape), to_world};
}

}  // namespace hermesh
