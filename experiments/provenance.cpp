#include "experiments/provenance.h"

#include <CGAL/version.h>
#include <OpenMesh/Core/System/config.h>
#include <openvdb/version.h>
#include <tbb/global_control.h>
#include <tbb/version.h>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "algorithms/lattice/simd/simd_level.h"

#ifndef HERMESH_BUILD_TYPE
#define HERMESH_BUILD_TYPE "unknown"
#endif
#ifndef HERMESH_COMPILE_FLAGS
#define HERMESH_COMPILE_FLAGS "unknown"
#endif
#define HERMESH_TEXT_OF(x) #x
#define HERMESH_TEXT(x) HERMESH_TEXT_OF(x)

namespace hermesh {
namespace {

using Json = nlohmann::ordered_json;

Json build() {
#if defined(__clang__)
  const std::string compiler = "clang " __clang_version__;
#else
  const std::string compiler = "g++ " __VERSION__;
#endif
  return {{"compiler", compiler},
          {"flags", HERMESH_COMPILE_FLAGS},
          {"type", HERMESH_BUILD_TYPE},
          {"simd", name(chosen_simd_level())}};
}

Json libraries() {
  return {{"OpenVDB", OPENVDB_LIBRARY_VERSION_STRING},
          {"CGAL", HERMESH_TEXT(CGAL_VERSION)},
          {"OpenMesh",
           std::to_string(OM_GET_VER) + "." + std::to_string(OM_GET_MAJ) + "." + std::to_string(OM_GET_MIN)},
          {"TBB", TBB_runtime_version()},
          {"Eigen", HERMESH_TEXT(EIGEN_WORLD_VERSION) "." HERMESH_TEXT(EIGEN_MAJOR_VERSION) "." HERMESH_TEXT(
                        EIGEN_MINOR_VERSION)}};
}

}  // namespace

Json build_facts() {
  const SourceState built = built_from();
  return {{"commit", built.commit},
          {"dirty", built.dirty ? Json(*built.dirty) : Json(nullptr)},
          {"build", build()},
          {"libraries", libraries()},
          {"threads", tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism)}};
}

std::string build_text() {
  const SourceState built = built_from();
  const Json made = build();
  std::string text = "commit " + built.commit;
  if (!built.dirty) text += ", unknown if files differed from it";
  if (built.dirty.value_or(false)) text += ", with changes";
  text += "\n" + made.at("compiler").get<std::string>() + ", " + made.at("type").get<std::string>() + ", " +
          made.at("flags").get<std::string>() + "\nvector code " + made.at("simd").get<std::string>() + "\n";
  std::string names;
  const Json versions = libraries();
  for (const auto& [library, version] : versions.items())
    names += (names.empty() ? "" : ", ") + library + " " + version.get<std::string>();
  return text + names;
}

}  // namespace hermesh
