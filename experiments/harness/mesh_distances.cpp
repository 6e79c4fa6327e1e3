#include "experiments/harness/mesh_distances.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cmath>

#include "algorithms/io/mesh_file.h"
#include "validation/geometry/triangle_tree.h"

namespace hermesh {

std::vector<std::vector<double>> mesh_distances(const LoadedCase& input,
                                                const std::vector<std::filesystem::path>& meshes,
                                                RunContext& context) {
  // Quads of an input are split as validation splits them.
  const validation::TriangleTree tree(
      validation::TriangleSoup(to_mesh_file(input.mesh), validation::QuadRule::better));
  std::vector<std::vector<double>> all;
  for (const std::filesystem::path& file : meshes) {
    const MeshFile mesh = read_mesh_file(file, context);
    std::vector<double> distances(mesh.points.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, distances.size(), 512), [&](const auto& range) {
      context.check();
      std::uint32_t guess = 0;
      for (std::size_t i = range.begin(); i < range.end(); ++i) {
        const validation::ClosestHit hit = tree.closest(mesh.points[i], guess);
        guess = hit.slot;
        distances[i] = std::sqrt(hit.squared);
      }
    });
    all.push_back(std::move(distances));
  }
  return all;
}

}  // namespace hermesh
