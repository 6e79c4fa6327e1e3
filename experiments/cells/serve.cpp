#include "experiments/cells/serve.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <iostream>

#include "algorithms/io/mesh_file.h"
#include "experiments/harness/cell.h"
#include "experiments/measurements/measurements.h"
#include "experiments/variants.h"
#include "validation/geometry/triangle_tree.h"

namespace hermesh {
namespace {

constexpr int kAnswers = 3;  ///< the file descriptor of the answers

void send(const Json& answer) {
  const std::string text = answer.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t written = write(kAnswers, text.data() + done, text.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return;  // the laboratory has ended
    done += static_cast<std::size_t>(written);
  }
}

/// Returns the distances of the vertices of each mesh file to the polygons of the input, world units.
std::vector<std::vector<double>> mesh_distances(const LoadedCase& input,
                                                const std::vector<std::filesystem::path>& meshes,
                                                RunContext& context) {
  // Quads of an input are split like in validation.
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

void work_on(const AnyJob& any, const Tables& tables, RunContext& context) {
  const auto& [job, kind, threads, data, out] = any;
  if (kind == "input") {
    send({{"input", case_json(load_input(job.at("case"), read_change(job), tables, context))}});
  } else if (kind == "measurement") {
    run_measurement({.name = job.at("measurement"),
                     .parameters = job.at("parameters"),
                     .seed = job.at("seed"),
                     .out = out,
                     .filter = job.at("filter"),
                     .done = job.at("done"),
                     .head = job.at("head")},
                    tables, context, [](const Json& row) {
                      send({{"row", row}});
                    });
  } else if (kind == "distances") {
    std::vector<std::filesystem::path> meshes;
    for (const Json& file : job.at("meshes")) meshes.emplace_back(file.get<std::string>());
    const LoadedCase input = load_input(job.at("case"), std::nullopt, tables, context);
    if (const std::string hash = job.at("sha256"); input.sha256 != hash)
      throw Error("the input " + input.name + " (" + input.origin + ") has the SHA-256 " +
                  input.sha256.substr(0, 12) + ", while that of the row has " + hash.substr(0, 12));
    for (const std::vector<double>& distances : mesh_distances(input, meshes, context))
      send({{"distances", distances}});
  } else {
    const CellWatch watch{[](const Json& row) {
                            send({{"planned", row}});
                          },
                          [](const std::string& label) {
                            send({{"at", label}});
                          }};
    for (const Json& row : run_job(read_group_job(job), tables, watch, context)) send({{"row", row}});
  }
}

Json to_json(const Measurement& measurement) {
  Json tables = Json::array();
  for (const MeasuredTable& table : measurement.tables) {
    Json columns = Json::array();
    for (const MeasuredColumn& column : table.columns) columns.push_back(column.name);
    tables.push_back({{"name", table.name}, {"columns", columns}});
  }
  return {{"name", measurement.name},
          {"parameters", to_json(std::span(measurement.parameters))},
          {"tables", tables}};
}

}  // namespace

Tables all_tables() {
  return {all_extractors(), all_voxelizers(),  case_choices(),
          load_case,        load_changed_case, {all_measurements().begin(), all_measurements().end()}};
}

void serve_job(const Tables& tables, RunContext& context) {
  std::string line;
  std::getline(std::cin, line);
  const AnyJob job = read_job(line);
  auto next = std::chrono::steady_clock::now();
  context.on_progress = [&](std::string_view stage, double fraction) {
    using namespace std::chrono_literals;
    const auto now = std::chrono::steady_clock::now();
    if (now < next) return;
    next = now + 100ms;
    send({{"stage", stage}, {"fraction", fraction}});
  };
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, job.threads);
  try {
    require_data(job.require_data);
    work_on(job, tables, context);
    for (const std::string& note : context.notes) send({{"note", note}});
    context.notes.clear();
    send({{"done", true}});
  } catch (const DataMissing& error) {
    send({{"error", error.what()}, {"missing", true}});
  } catch (const CaseUnreadable& error) {
    send({{"error", error.what()}, {"unreadable", true}});
  } catch (const std::bad_alloc&) {
    send({{"error", "there is not enough memory"}});
  } catch (const std::exception& error) {
    send({{"error", error.what()}});
  }
}

Json vocabulary(const Tables& tables) {
  Json measurements = Json::array();
  for (const Measurement& each : tables.measurements) measurements.push_back(to_json(each));
  return {{"extractors", to_json(std::span(tables.extractors))},
          {"voxelizers", to_json(std::span(tables.voxelizers))},
          {"cases", tables.cases},
          {"measurements", measurements}};
}

}  // namespace hermesh
