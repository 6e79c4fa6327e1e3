#include "experiments/cli/pipeline/json_report.h"

#include <sys/resource.h>

#include <fstream>
#include <iostream>

#include "algorithms/io/atomic_file.h"

namespace hermesh::cli {
namespace {

using Json = nlohmann::ordered_json;

std::int64_t peak_bytes() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return std::int64_t(usage.ru_maxrss) * 1024;
}

const char* status_of(int exit_code) {
  if (exit_code == kDone) return "done";
  return exit_code == kNotMet ? "not met" : "failed";
}

}  // namespace

void made(Session& session, const std::string& key, const Json& value) {
  if (session.report) session.report->result[key] = value;
}

Json json_report(const Session& session, int exit_code, const std::string& error) {
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - session.report->start;
  Json json;
  json["command"] = session.command_name;
  json["program"] = "hermesh " + session.version;
  json["input"] = session.inputs.empty() ? Json() : Json(session.inputs[0]);
  json["inputs"] = session.inputs;
  json["output"] = session.output.empty() ? Json() : Json(session.output);
  json["status"] = status_of(exit_code);
  json["exit_code"] = exit_code;
  json["error"] = error.empty() ? Json() : Json(error);
  json["seconds"] = elapsed.count();
  json["triangles"] =
      session.report->result.contains("triangles") ? session.report->result["triangles"] : Json();
  json["result"] = session.report->result;
  json["notes"] = session.context.notes;
  json["figures"] = Json::object();
  for (const auto& [name, value] : session.context.figures) json["figures"][name] = value;
  json["stage_seconds"] = Json::array();
  for (const auto& [stage, seconds] : session.context.stage_seconds)
    json["stage_seconds"].push_back({{"stage", stage}, {"seconds", seconds}});
  json["peak_bytes"] = peak_bytes();
  // A report of judges has counts of its own by the name of ours.
  for (const auto& [key, value] : session.report->beside.items()) json[key] = value;
  return json;
}

std::string json_text(const Json& value, int indent) {
  return value.dump(indent, ' ', false, Json::error_handler_t::replace) + "\n";
}

void write_json_report(const Session& session, int exit_code, const std::string& error) {
  if (!session.json && session.json_file.empty()) return;
  const std::string text = json_text(json_report(session, exit_code, error), 2);
  if (session.json) {
    std::cout << text;
    return;
  }
  AtomicFile aside(session.json_file);
  std::ofstream out(aside.path(), std::ios::binary);
  out << text;
  out.close();
  if (!out) throw Error("cannot write '" + session.json_file + "'");
  aside.commit();
}

}  // namespace hermesh::cli
