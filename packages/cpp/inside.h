// What the public functions share on the inside: the way from public types to those of the rooms and back.
// Only the sources of this folder include it.
#pragma once

// Public names must live in hermesh::v1 alone here, beside the rooms' own of the same names.
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
#include "hermesh/context.h"
#include "hermesh/hermite.h"
#include "hermesh/mesh.h"
#include "hermesh/options.h"
#include "hermesh/volume.h"

/// What lives in the public namespace and is not public: the shared libraries show that namespace, but for
/// this.
#define HERMESH_INNER __attribute__((visibility("hidden")))

namespace hermesh::v1 {

struct HERMESH_INNER Mesh::Arrays {
  PolygonMesh mesh;
};

/// Grants the sources of this folder what the public classes hold.
struct HERMESH_INNER Inside {
  static const PolygonMesh& polygons(const Mesh& mesh) { return mesh.arrays_->mesh; }
  static Mesh mesh(PolygonMesh&& polygons) {
    return Mesh(std::make_shared<const Mesh::Arrays>(Mesh::Arrays{std::move(polygons)}));
  }
  /// The mesh's polygons as whatever samples them takes them: quads cut along their better diagonals. A mesh
  /// without quads is not copied; `copy` holds one that is.
  static const PolygonMesh& sampled(const Mesh& mesh, PolygonMesh& copy);

  static const std::atomic<bool>& flag(const Context& context) { return context.cancelled_; }

  /// The level set inside. @throws hermesh::Error for a volume of nothing, or not of floats.
  static LevelSet level_set(const Volume& volume);
  /// A volume of a level set, by the name of its grid unless another is given.
  static Volume volume(const LevelSet& level_set, const std::string& name = {});

  static const Volume::Grid& grid(const Volume& volume);
  static Volume volume_of(Volume::Grid&& grid);
  static const Solid::Data& data(const Solid& solid);
  static Solid solid(Solid::Data&& data);
};

/// Runs work(RunContext&) for a public function: with the caller's progress and cancellation, gives the
/// caller the notes and times also where the work ends early, and turns the rooms' exceptions into the public
/// ones.
template <class Work>
auto run(Context& context, Work&& work) {
  RunContext inner;
  inner.cancel = &Inside::flag(context);
  std::exception_ptr of_callback;
  if (context.on_progress)
    inner.on_progress = [&](std::string_view stage, double fraction) {
      // A stage reports from its destructor, too, out of which nothing may be thrown: the work is asked to
      // stop, and the exception kept until it has.
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
  // What the callback threw comes first, since the work ended because of it; the request to stop was ours
  // then.
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
    // Whatever a library throws while the caller is waiting for the end, it ends because the caller said so.
    rethrow();
    if (context.cancelled()) throw Cancelled();
    throw Error(error.what());
  }
}

/// Runs work() for a public function without a context. @throws Error in place of whatever the work throws.
template <class Work>
auto run(Work&& work) {
  Context context;
  return run(context, [&](RunContext&) { return work(); });
}

/// A method of a table as the public functions list it.
HERMESH_INNER MethodInfo method_info(const std::string& name, const std::string& summary,
                                     const std::vector<OptionSpec>& options);

}  // namespace hermesh::v1
