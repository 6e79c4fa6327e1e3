// Internals of the public functions: conversions between the public types and those of the algorithms, and
// steps that several functions share. Only the sources of this directory include it.
#pragma once

// Public names must live only in hermesh::v1 here, next to names of the algorithms that are the same.
#ifndef HERMESH_IMPLEMENTATION
#error "only sources of packages/cpp, compiled with HERMESH_IMPLEMENTATION, include this header"
#endif

#include <exception>
#include <memory>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/core/level_set.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/core/variant.h"
#include "algorithms/hermite/boolean_rule.h"
#include "algorithms/hermite/sparse_hermite.h"
#include "algorithms/remesh/remesh.h"
#include "hermesh/hermite.h"
#include "hermesh/voxelize.h"

/// Marks names of the public namespace that are not public: the shared libraries export that namespace
/// without them.
#define HERMESH_INNER __attribute__((visibility("hidden")))

namespace hermesh::v1 {

struct HERMESH_INNER Mesh::Arrays {
  PolygonMesh mesh;
};

struct HERMESH_INNER Solid::Data {
  Volume level_set;
  FloatHermite hermite;
};

/// Gives the sources of this directory access to the data of the public classes.
struct HERMESH_INNER Inside {
  static const PolygonMesh& polygons(const Mesh& mesh) { return mesh.arrays_->mesh; }
  static Mesh mesh(PolygonMesh&& polygons) {
    return Mesh(std::make_shared<const Mesh::Arrays>(Mesh::Arrays{std::move(polygons)}));
  }
  /// Returns the polygons for sampling, with quads cut along their better diagonals. A mesh with quads is
  /// copied to `copy`.
  static const PolygonMesh& sampled(const Mesh& mesh, PolygonMesh& copy);

  static const std::atomic<bool>& flag(const Context& context) { return context.cancelled_; }

  /// Returns the level set of a volume. @throws Error for an empty volume, or one of other values than
  /// floats.
  static LevelSet level_set(const Volume& volume);
  /// Returns a volume of a level set, under the name of its grid.
  static Volume volume(const LevelSet& level_set);

  static const Volume::Grid& grid(const Volume& volume);  ///< @throws Error for an empty volume.
  static Volume volume_of(Volume::Grid&& grid);
  static const Solid::Data& data(const Solid& solid);
  static Solid solid(Solid::Data&& data);
};

/// Runs work(RunContext&) for a public function, with the caller's progress and cancellation. Passes notes
/// and times to the caller even if the work fails, and rethrows the exceptions of the algorithms as public
/// ones.
template <class Work>
auto run(Context& context, Work&& work) {
  RunContext inner;
  inner.cancel = &Inside::flag(context);
  std::exception_ptr of_callback;
  if (context.on_progress)
    inner.on_progress = [&](std::string_view stage, double fraction) {
      // A stage reports from its destructor, too, which must not throw: the exception is stored until the
      // cancelled work has ended.
      if (of_callback) return;
      try {
        context.on_progress(stage, fraction);
      } catch (...) {
        of_callback = std::current_exception();
        context.cancel();
      }
    };
  struct HandBack {
    Context& to;
    RunContext& from;
    ~HandBack() {
      const auto move_to = [](auto& all, auto& more) {
        all.insert(all.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
      };
      move_to(to.notes, from.notes);
      move_to(to.stage_seconds, from.stage_seconds);
      move_to(to.figures, from.figures);
    }
  };
  // An exception of the callback takes precedence, because it ended the work; the cancellation was ours then.
  const auto rethrow = [&] {
    if (!of_callback) return;
    context.reset();
    std::rethrow_exception(of_callback);
  };
  try {
    const HandBack hand_back{context, inner};
    inner.check();
    auto result = work(inner);
    inner.check();
    return result;
  } catch (const hermesh::Cancelled&) {
    rethrow();
    throw Cancelled();
  } catch (const hermesh::Error& error) {
    rethrow();
    throw Error(error.what());
  } catch (const std::bad_alloc&) {
    rethrow();
    throw Error("out of memory: use larger voxels, a smaller mesh or a machine with more memory");
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    // After a cancellation any exception of a library ends the work on the caller's request.
    rethrow();
    if (context.cancelled()) throw Cancelled();
    throw Error(error.what());
  }
}

/// Runs work() for a public function without a context. @throws Error for every exception of the work.
template <class Work>
auto run(Work&& work) {
  Context context;
  return run(context, [&](RunContext&) { return work(); });
}

/// @throws hermesh::Error with the message unless `holds`.
HERMESH_INNER inline void require(bool holds, const std::string& message) {
  if (!holds) throw hermesh::Error(message);
}

static_assert(int(Boolean::union_of) == int(hermesh::Boolean::unite) &&
              int(Boolean::intersection) == int(hermesh::Boolean::intersect) &&
              int(Boolean::difference) == int(hermesh::Boolean::subtract));
HERMESH_INNER inline hermesh::Boolean inner_boolean(Boolean operation) {
  return static_cast<hermesh::Boolean>(operation);
}

/// Returns the public description of a method.
HERMESH_INNER MethodInfo method_info(const std::string& name, const std::string& summary,
                                     const std::vector<OptionSpec>& options);

/// @throws hermesh::Error for an unknown name, option or value, or an invalid band.
HERMESH_INNER ChosenVoxelizer choose(const VoxelizeOptions& options);

/// Returns the edge length of a voxel in world units. @throws hermesh::Error unless exactly one of
/// resolution, voxel size and lattice is given, within its range, and for a resolution of a mesh without
/// extent.
HERMESH_INNER double voxel_size_of(const PolygonMesh& mesh, const VoxelizeOptions& options);

/// Returns the parameters of make_solid() and remesh(). @throws hermesh::Error if `options` name the lattice
/// of another volume, or thin parts cannot be kept although that was requested; as the two functions above
HERMESH_INNER VoxelizeRecipe recipe_of(const PolygonMesh& mesh, const VoxelizeOptions& options,
                                       double isovalue = 0.0);

}  // namespace hermesh::v1
