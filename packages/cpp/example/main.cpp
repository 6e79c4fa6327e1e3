// Mesh arrays in, a volume, mesh arrays out, with progress and cancelling. The pieces between //! [name] are
// the examples of the API pages.
#include <hermesh/hermesh.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

namespace {

/// Volume of a closed mesh: the sum over its triangles of the tetrahedra with the origin. A quad (a, b, c, d)
/// is abc and acd.
double volume_of(const hermesh::Mesh& mesh) {
  const std::vector<double> p = mesh.world_points();
  double six_volumes = 0.0;
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const double *u = &p[3 * a], *v = &p[3 * b], *w = &p[3 * c];
    six_volumes += u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) +
                   u[2] * (v[0] * w[1] - v[1] * w[0]);
  };
  for (std::size_t i = 0; i < mesh.triangles().size(); i += 3)
    add(mesh.triangles()[i], mesh.triangles()[i + 1], mesh.triangles()[i + 2]);
  for (std::size_t i = 0; i < mesh.quads().size(); i += 4) {
    const auto q = mesh.quads().subspan(i, 4);
    add(q[0], q[1], q[2]);
    add(q[0], q[2], q[3]);
  }
  return six_volumes / 6.0;
}

}  // namespace

int main() try {
  //! [arrays]
  // A cube of side 2: x, y, z of eight points, and six quads, counter-clockwise from outside.
  const std::vector<float> points = {-1, -1, -1, 1, -1, -1, -1, 1, -1, 1, 1, -1,
                                     -1, -1, 1,  1, -1, 1,  -1, 1, 1,  1, 1, 1};
  const std::vector<std::uint32_t> quads = {0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4,
                                            2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5};
  const hermesh::Mesh cube(std::span<const float>(points), {}, quads);
  //! [arrays]

  //! [volume]
  hermesh::Context context;
  const hermesh::Volume volume = hermesh::voxelize(cube, {.voxel_size = 0.05}, context);
  const std::vector<double> centre_of_a_face = {1.0, 0.0, 0.0};
  std::printf("%zu voxels, distance at a face %.4f\n", volume.active_voxels(),
              volume.sample(centre_of_a_face)[0]);
  //! [volume]

  //! [extract]
  const hermesh::Mesh uniform = hermesh::extract(volume, {.extractor = "marching-cubes"}, context);
  const std::span<const float> out = uniform.points();  // no copy: the array lives as long as the mesh
  std::printf("%zu points, the first at %.3f %.3f %.3f\n", uniform.point_count(), out[0], out[1], out[2]);
  //! [extract]

  //! [remesh]
  const hermesh::Mesh adaptive =
      hermesh::remesh(cube, {.resolution = 40}, {.options = {{"tolerance", "0.05"}}}, context);
  for (const std::string& note : context.notes) std::printf("note: %s\n", note.c_str());
  //! [remesh]
  std::printf("%zu polygons of volume %.6f\n", adaptive.triangle_count() + adaptive.quad_count(),
              volume_of(adaptive));

  //! [combine]
  const std::vector<double> moved = [&] {
    std::vector<double> p(points.begin(), points.end());
    for (double& x : p) x += 1.0;
    return p;
  }();
  const hermesh::Mesh corner(std::span<const double>(moved), {}, quads);
  const hermesh::Mesh cut =
      hermesh::combine(hermesh::Boolean::difference, cube, corner, {.resolution = 40}, {}, context);
  //! [combine]
  std::printf("difference of volume %.6f\n", volume_of(cut));

  //! [cancel]
  context.on_progress = [&](std::string_view stage, double fraction) {
    std::printf("%s %.0f %%\n", std::string(stage).c_str(), 100.0 * fraction);
    if (fraction == 1.0) context.cancel();
  };
  bool cancelled = false;
  try {
    hermesh::remesh(cube, {.resolution = 100}, {}, context);
  } catch (const hermesh::Cancelled&) {
    cancelled = true;
  }
  //! [cancel]

  //! [error]
  std::string sentence;
  try {
    hermesh::Context fresh;
    hermesh::remesh(cube, {.resolution = 100}, {.extractor = "marching-squares"}, fresh);
  } catch (const hermesh::Error& error) {
    sentence = error.what();
  }
  //! [error]
  const bool right = cancelled && !sentence.empty() && std::abs(volume_of(adaptive) - 8.0) < 1e-3 &&
                     std::abs(volume_of(cut) - 7.0) < 1e-2 && std::abs(volume_of(uniform) - 8.0) < 0.1;
  std::printf("%s\n%s\n", sentence.c_str(), right ? "as it should be" : "WRONG");
  return right ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
