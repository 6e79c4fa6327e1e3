// Times of signs on meshes that intersect themselves, compared with OpenVDB.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cstdio>
#include <ctime>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/voxelization/voxelize.h"
#include "reference/openvdb_mesh_to_volume.h"
#include "reference/test_soups.h"

namespace hermesh {
namespace soup_speed_test {

using test::Soup;

/// Returns the processor time of f() in all threads of this process, without that of other processes.
template <class F>
double processor_seconds(F&& f) {
  const auto now = [] {
    timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
  };
  const double start = now();
  f();
  return now() - start;
}

struct Times {
  double ours, openvdb;
  /// The time of ours beyond its first second, divided by the time of OpenVDB.
  double ratio() const { return (ours - 1.0) / openvdb; }
};

Times times(const Soup& soup) {
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  RunContext context;
  const double openvdb = processor_seconds([&] {
    openvdb_mesh_to_volume({.mesh = soup.mesh, .voxel_size = soup.voxel_size, .context = context});
  });
  return {processor_seconds([&] { voxelize(soup.mesh, {.voxel_size = soup.voxel_size}, context); }), openvdb};
}

/// Prints a curve, too: the number of triangles of each soup, and the seconds of either voxelizer.
TEST(Slow, TwoHundredSoupsTakeNoMoreThanTwentyTimesWhatOpenVDBTakes) {
  initialize_openvdb();
  double worst = -1e9;
  std::string worst_name;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const Soup soup = test::soup(seed);
    const Times t = times(soup);
    std::printf("%llu\t%zu\t%.3f\t%.3f\t%.1f\t%s\n", static_cast<unsigned long long>(seed),
                soup.mesh.triangles.size(), t.ours, t.openvdb, t.ratio(), soup.name.c_str());
    EXPECT_LT(t.ratio(), 20.0) << soup.name << ", seed " << seed;
    if (t.ratio() > worst) worst = t.ratio(), worst_name = soup.name + ", seed " + std::to_string(seed);
  }
  std::printf("worst: %.1f times, %s\n", worst, worst_name.c_str());
}

}  // namespace soup_speed_test
}  // namespace hermesh
