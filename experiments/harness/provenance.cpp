#include "experiments/harness/provenance.h"

#include <CGAL/version.h>
#include <OpenMesh/Core/System/config.h>
#include <embree3/rtcore_config.h>
#include <openvdb/version.h>
#include <sys/utsname.h>
#include <tbb/global_control.h>
#include <tbb/version.h>
#include <unistd.h>

#include <Eigen/Core>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#ifndef HERMESH_BUILD_TYPE
#define HERMESH_BUILD_TYPE "unknown"
#endif
#ifndef HERMESH_COMPILE_FLAGS
#define HERMESH_COMPILE_FLAGS "unknown"
#endif

namespace hermesh {
namespace {

using Json = nlohmann::ordered_json;

/// A path as one word of a shell command, whatever characters it has.
std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? "'\\''" : std::string(1, c);
  return result + "'";
}

/// What git prints, without the last line break; nothing when it fails.
std::optional<std::string> git(const std::filesystem::path& folder, const std::string& arguments) {
  const std::string command = "git -C " + quoted(folder.string()) + " " + arguments + " 2>/dev/null";
  FILE* pipe = popen(command.c_str(), "r");
  if (!pipe) return std::nullopt;
  std::string output;
  std::array<char, 4096> buffer;
  while (const std::size_t count = fread(buffer.data(), 1, buffer.size(), pipe))
    output.append(buffer.data(), count);
  if (pclose(pipe) != 0) return std::nullopt;
  while (!output.empty() && output.back() == '\n') output.pop_back();
  return output;
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
  return {{"compiler", compiler}, {"flags", HERMESH_COMPILE_FLAGS}, {"type", HERMESH_BUILD_TYPE}};
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

Json provenance(const std::filesystem::path& source_folder) {
  const auto commit = git(source_folder, "rev-parse --verify HEAD");
  // Results of runs are no part of what is run.
  const auto changes = git(source_folder, "status --porcelain -- ':(top)' ':(top,exclude)results'");
  return {{"commit", commit.value_or("unknown")},
          {"dirty", changes ? Json(!changes->empty()) : Json(nullptr)},
          {"date", utc_now()},
          {"machine", machine()},
          {"build", build()},
          {"libraries", libraries()},
          {"threads", tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism)}};
}

Json load_averages() {
  std::array<double, 3> load{};
  if (getloadavg(load.data(), 3) != 3) return nullptr;
  return {load[0], load[1], load[2]};
}

}  // namespace hermesh
