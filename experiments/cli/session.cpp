#include "experiments/cli/session.h"

#include <sys/resource.h>

#include <cstdio>
#include <fstream>
#include <iostream>

#include "algorithms/io/atomic_file.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/terminal_progress.h"

namespace hermesh::cli {

std::string Session::named(std::string message) const {
  for (const auto& [temporary, name] : stream_names)
    for (const std::string& word : {"'" + temporary + "'", temporary})
      for (std::size_t at = 0; (at = message.find(word, at)) != std::string::npos; at += name.size())
        message.replace(at, word.size(), name);
  return message;
}

void print_summary(const Session& session, const std::string& line) {
  if (session.log) session.log(line);
  if (session.quiet || session.json) return;
  erase_progress_line();
  std::cout << session.named(line) << '\n';
}

std::string length_text(const Session& session, double length) {
  return text(length) + (session.metres > 0.0 ? " " + unit_of(session.metres) : "");
}

std::string seconds_text(double seconds) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.3f s", seconds);
  return buffer;
}

std::string json_text(const Json& value, int indent) {
  return value.dump(indent, ' ', false, Json::error_handler_t::replace) + "\n";
}

void write_json_report(const Session& session, int exit_code, const std::string& error) {
  if (!session.json && session.json_file.empty()) return;
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - session.start;
  const auto or_null = [](const std::string& text) { return text.empty() ? Json() : Json(text); };
  Json json;
  json["command"] = session.command_name;
  json["program"] = "hermesh " + session.version;
  json["input"] = session.inputs.empty() ? Json() : Json(session.inputs[0]);
  json["inputs"] = session.inputs;
  json["output"] = or_null(session.output);
  json["status"] = exit_code == kDone ? "done" : exit_code == kNotMet ? "not met" : "failed";
  json["exit_code"] = exit_code;
  json["error"] = or_null(error);
  json["seconds"] = elapsed.count();
  json["triangles"] = session.result.value("triangles", Json());
  json["result"] = session.result;
  json["notes"] = session.context.notes;
  json["figures"] = Json::object();
  for (const auto& [name, value] : session.context.figures) json["figures"][name] = value;
  json["stage_seconds"] = Json::array();
  for (const auto& [stage, seconds] : session.context.stage_seconds)
    json["stage_seconds"].push_back({{"stage", stage}, {"seconds", seconds}});
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  json["peak_bytes"] = std::int64_t(usage.ru_maxrss) * 1024;
  // A validation report has counts under some of the common names.
  for (const auto& [key, value] : session.beside.items()) json[key] = value;

  const std::string text = json_text(json, 2);
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

void add_common_options(CLI::App& app, Session& session) {
  // TBB reserves memory for the number of threads that it is given.
  app.add_option("--threads", session.threads, "Number of threads, 1 to 1024 (default: all of the machine)")
      ->transform(whole_number(1, 1024));
  app.add_flag("--quiet", session.quiet, "Print only results and errors: no progress, notes or summaries");
  app.add_option("--log", session.log_file,
                 "Append a log to this file: stages, notes and summaries, each with its time");
}

CLI::App* add_command(CLI::App& app, Session& session, const std::string& name, const std::string& summary) {
  CLI::App* command = app.add_subcommand(name, summary);
  add_common_options(*command, session);
  return command;
}

void add_json_option(CLI::App& command, Session& session) {
  command.add_flag("--json", session.json_file,
                   "Print one JSON object in place of summaries, or write it to a file whose name ends in "
                   ".json or .jsonl: --json FILE");
}

void refuse_idle(const CLI::App& command, std::initializer_list<const char*> options,
                 const std::string& why) {
  for (const char* option : options)
    if (command.count(option) > 0) throw UsageError(std::string(option) + " has no effect: " + why);
}

}  // namespace hermesh::cli
