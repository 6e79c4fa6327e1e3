#include "experiments/harness/provenance.h"

#include <CGAL/version.h>
#include <OpenMesh/Core/System/config.h>
#include <openvdb/version.h>
#include <sys/utsname.h>
#include <tbb/global_control.h>
#include <tbb/version.h>
#include <unistd.h>

#include <Eigen/Core>
#include <array>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "algorithms/core/error.h"
#include "algorithms/lattice/simd/simd_level.h"
#include "experiments/harness/shell.h"
#include "experiments/pictures/embree.h"

#ifndef HERMESH_BUILD_TYPE
#define HERMESH_BUILD_TYPE "unknown"
#endif
#ifndef HERMESH_COMPILE_FLAGS
#define HERMESH_COMPILE_FLAGS "unknown"
#endif

namespace hermesh {
namespace {

using Json = nlohmann::ordered_json;

SourceState& mutable_source_state() {
  static SourceState state;
  return state;
}

/// What git prints; nothing when it fails.
std::optional<std::string> git(const std::filesystem::path& folder, const std::string& arguments) {
  const ShellOutput output = shell_output("git -C " + shell_quoted(folder.string()) + " " + arguments + " 2>/dev/null");
  if (output.status != 0) return std::nullopt;
  return output.text;
}

std::string cpu_model() {
  std::ifstream info("/proc/cpuinfo");
  std::string line;
  while (std::getline(info, line))
    if (line.starts_with("model name"))
      if (const std::size_t colon = line.find(": "); colon != std::string::npos)
        return line.substr(colon + 2);
  return "unknown";
}

Json machine() {
  utsname system{};
  const bool known = uname(&system) == 0;
  return {{"cpu", cpu_model()},
          {"cores", sysconf(_SC_NPROCESSORS_ONLN)},
          {"memory_bytes", static_cast<std::int64_t>(sysconf(_SC_PHYS_PAGES)) * sysconf(_SC_PAGE_SIZE)},
          {"system",
           known ? std::string(system.sysname) + " " + system.release + " " + system.machine : "unknown"}};
}

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

#define HERMESH_TEXT_OF(x) #x
#define HERMESH_TEXT(x) HERMESH_TEXT_OF(x)

Json libraries() {
  return {{"OpenVDB", OPENVDB_LIBRARY_VERSION_STRING},
          {"CGAL", HERMESH_TEXT(CGAL_VERSION)},
          {"OpenMesh",
           std::to_string(OM_GET_VER) + "." + std::to_string(OM_GET_MAJ) + "." + std::to_string(OM_GET_MIN)},
          {"TBB", TBB_runtime_version()},
          {"Eigen", HERMESH_TEXT(EIGEN_WORLD_VERSION) "." HERMESH_TEXT(EIGEN_MAJOR_VERSION) "." HERMESH_TEXT(
                        EIGEN_MINOR_VERSION)},
          {"Embree", RTC_VERSION_STRING}};
}

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  gmtime_r(&now, &parts);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text.data();
}

}  // namespace

void set_source_state(SourceState state) { mutable_source_state() = std::move(state); }

const SourceState& source_state() { return mutable_source_state(); }

SourceState checked_out(const std::filesystem::path& folder) {
  SourceState state;
  const auto commit = git(folder, "rev-parse --verify HEAD");
  if (!commit) return state;
  state.commit = *commit;
  // The same files as in build_stamp.cmake.
  const auto changes = git(folder,
                           "status --porcelain -- ':(top)' ':(top,exclude)results' ':(top,exclude)paper' "
                           "':(top,exclude,glob)**/*.md'");
  if (changes) state.dirty = !changes->empty();
  return state;
}

bool is_kept(const std::filesystem::path& folder, const std::filesystem::path& checkout) {
  const auto is_below = [](const std::filesystem::path& path, const std::filesystem::path& above) {
    const std::filesystem::path way = path.lexically_relative(above);
    return !way.empty() && *way.begin() != "..";
  };
  const std::filesystem::path target = std::filesystem::weakly_canonical(std::filesystem::absolute(folder));
  const std::filesystem::path results = std::filesystem::weakly_canonical(checkout / "results");
  return is_below(target, results) && !is_below(target, results / "local");
}

void check_may_be_kept(const std::filesystem::path& out, const std::filesystem::path& checkout, const SourceState& built) {
  if (!is_kept(out, checkout)) return;
  const SourceState now = checked_out(checkout);
  const auto refuse = [&](const std::string& why) {
    throw Error(out.string() + " takes rows of a clean commit alone, and " + why +
                "; name a folder such as results/local/" + std::filesystem::absolute(out).lexically_normal().filename().string() + " instead");
  };
  if (now.commit == "unknown" || !now.dirty) refuse("there is no git checkout to compare the program with");
  if (built.commit != now.commit)
    refuse("this program was built from commit " + built.commit.substr(0, 12) + " while " + now.commit.substr(0, 12) +
           " is checked out: build it again");
  if (built.dirty.value_or(true)) refuse("this program was built from files that differ from its commit: commit and build it again");
  if (*now.dirty) refuse("files differ from the commit: commit them");
}

Json provenance(const std::filesystem::path& source_folder) {
  const SourceState& built = source_state();
  const SourceState now = checked_out(source_folder);
  Json dirty = nullptr;
  if (built.dirty) dirty = *built.dirty || now.dirty.value_or(false) || (now.commit != "unknown" && now.commit != built.commit);
  return {{"commit", built.commit},
          {"dirty", dirty},
          {"date", utc_now()},
          {"machine", machine()},
          {"build", build()},
          {"libraries", libraries()},
          {"threads", tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism)}};
}

std::string provenance_text() {
  const SourceState& built = source_state();
  const Json made = build();
  std::string text = "commit " + built.commit;
  if (!built.dirty) text += ", whether files differed from it is unknown";
  if (built.dirty.value_or(false)) text += ", with changes";
  text += "\n" + made.at("compiler").get<std::string>() + ", " + made.at("type").get<std::string>() + ", " +
          made.at("flags").get<std::string>() + "\nvector code " + made.at("simd").get<std::string>() + "\n";
  std::string names;
  const Json versions = libraries();
  for (const auto& [library, version] : versions.items())
    names += (names.empty() ? "" : ", ") + library + " " + version.get<std::string>();
  return text + names;
}

Json load_averages() {
  std::array<double, 3> load{};
  if (getloadavg(load.data(), 3) != 3) return nullptr;
  return {load[0], load[1], load[2]};
}

}  // namespace hermesh
