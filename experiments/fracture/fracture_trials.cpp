#include "experiments/fracture/fracture_trials.h"

#include "experiments/cases/recipe_shapes.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using recipes::Random;

PolygonMesh unit_box() {
  PolygonMesh mesh;
  for (int c = 0; c < 8; ++c)
    recipes::add_point(mesh, Vector3d(c & 1, (c >> 1) & 1, c >> 2) - Vector3d::Constant(0.5));
  for (const Quad& q :
       {Quad{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}})
    recipes::add_quad(mesh, q[0], q[1], q[2], q[3]);
  return mesh;
}

class Assembly {
 public:
  explicit Assembly(std::uint64_t seed) : random_(static_cast<double>(seed)) {}

  double uniform(double low, double high) { return random_.uniform(low, high); }
  /// Returns a random integer from `least` to `most`.
  int whole(int least, int most) {
    return least + static_cast<int>(random_.bits() % static_cast<std::uint64_t>(most - least + 1));
  }
  Vector3d somewhere(double reach) {
    const double x = uniform(-reach, reach), y = uniform(-reach, reach), z = uniform(-reach, reach);
    return {x, y, z};
  }
  /// A turn about each axis, by any angle.
  RecipeParameters turn() {
    const double x = uniform(0, 360), y = uniform(0, 360), z = uniform(0, 360);
    return {{"about_x", x}, {"about_y", y}, {"about_z", z}};
  }

  /// Adds the part, scaled along its own axes, turned and moved.
  void add(const PolygonMesh& part, const Vector3d& scale, const RecipeParameters& turn,
           const Vector3d& centre, bool inwards = false) {
    const std::uint32_t first = recipes::next_index(mesh);
    for (const auto& point : part.points)
      recipes::add_point(mesh, centre + recipes::turned(point.cast<double>().cwiseProduct(scale), turn));
    for (Triangle t : part.triangles) {
      if (inwards) std::swap(t[1], t[2]);
      mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    }
  }

  /// Adds balls, boxes and rings of any size, most of which overlap.
  void add_solids() {
    for (int left = whole(2, 7); left > 0; --left) {
      const int shape = whole(0, 2);
      const Vector3d scale(uniform(0.2, 0.7), uniform(0.2, 0.7), uniform(0.2, 0.7));
      if (shape == 0) {
        add(recipes::octahedral_sphere(7), Vector3d::Constant(scale[0]), turn(), somewhere(0.7));
      } else if (shape == 1) {
        add(unit_box(), 2.0 * scale, turn(), somewhere(0.7));
      } else {
        const PolygonMesh ring = recipes::torus(
            {{"around", 40.0}, {"across", 20.0}, {"major_radius", 1.0}, {"minor_radius", uniform(0.1, 0.4)}},
            unused_);
        add(ring, Vector3d::Constant(scale[0]), turn(), somewhere(0.7));
      }
    }
  }
  /// Adds plates of half a voxel to two voxels, that cross one another.
  void add_plates(double voxel) {
    for (int left = whole(1, 3); left > 0; --left)
      add(unit_box(), {uniform(1.0, 2.0), uniform(0.6, 1.6), voxel * uniform(0.5, 2.0)}, turn(),
          somewhere(0.2));
  }
  /// Adds a hollow ball with a wall of half a voxel to two voxels.
  void add_shell(double voxel) {
    const PolygonMesh ball = recipes::octahedral_sphere(12);
    const double radius = uniform(0.7, 1.0), wall = voxel * uniform(0.5, 2.0);
    const Vector3d centre = somewhere(0.1);
    const RecipeParameters turned = turn();
    const Vector3d scale = radius * Vector3d(1.0, uniform(0.6, 1.0), uniform(0.6, 1.0));
    add(ball, scale, turned, centre);
    add(ball, scale - Vector3d::Constant(wall), turned, centre, true);
  }
  /// Adds thin bars that run through one another.
  void add_bars(double voxel) {
    for (int left = whole(3, 8); left > 0; --left)
      add(unit_box(), {uniform(1.0, 2.2), voxel * uniform(0.7, 2.5), voxel * uniform(0.7, 2.5)}, turn(),
          somewhere(0.3));
  }

  PolygonMesh mesh;

 private:
  Random random_;
  RunContext unused_;
};

}  // namespace

FractureTrial fracture_trial(std::uint64_t number) {
  Assembly assembly(number);
  FractureTrial trial;
  trial.longest = assembly.whole(12, 48);
  const double voxel = 2.0 / trial.longest;
  switch (number % 4) {
    case 0:
      trial.kind = "solids", assembly.add_solids();
      break;
    case 1:
      trial.kind = "plates", assembly.add_plates(voxel);
      break;
    case 2:
      trial.kind = "shell", assembly.add_shell(voxel);
      break;
    default:
      trial.kind = "bars", assembly.add_bars(voxel);
  }
  switch (assembly.whole(0, 2)) {
    case 0:
      trial.cutters = "planes:" + std::to_string(assembly.whole(1, 3));
      break;
    case 1:
      trial.cutters = "voronoi:" + std::to_string(assembly.whole(2, 20));
      break;
    default:
      trial.cutters = "chunks:" + std::to_string(assembly.whole(2, 20));
  }
  trial.mesh = std::move(assembly.mesh);
  return trial;
}

}  // namespace hermesh
