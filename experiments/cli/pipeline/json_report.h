// What a command did, as one JSON object with the same keys for all commands.
//
// | key           | is | | ------------- |
// ----------------------------------------------------------------------------------------------- | | command
// | name of the command                                                                             | |
// program       | "hermesh" and its version | | input, inputs | the first file that was read; all of them;
// "-" is the standard input                            | | output        | the file or folder that was
// written; null where the command writes none                        | | status        | "done", "not met" (a
// promise or a requirement, exit code 3) or "failed"                         | | exit_code     | that of the
// program                                                                             | | error         | the
// sentence of a failure; null without one                                                     | | seconds |
// from the start of the command to its end                                                        | |
// triangles     | of the mesh that was made, a quad counting as two; validate has quads apart; null without a
// mesh | | result        | what was made or found; its keys depend on the command | | notes         |
// sentences that a user should read although the work went on                                     | | figures
// | numbers of the work by name                                                                     | |
// stage_seconds | the stages in the order of their ends, each {stage, seconds} | | peak_bytes    | the most
// memory that the process had resident                                                   |
//
// `validate` has the keys of validation/report_json.h beside them.
#pragma once

#include <chrono>
#include <nlohmann/json.hpp>
#include <string>

#include "experiments/cli/session.h"

namespace hermesh::cli {

/// Gathers what a command made, for the object.
struct JsonReport {
  nlohmann::ordered_json result = nlohmann::ordered_json::object();
  nlohmann::json beside = nlohmann::json::object();  ///< keys that stand beside the common ones
  std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
};

/// Sets a key of `result`. Does nothing where nobody wants JSON.
void made(Session& session, const std::string& key, const nlohmann::ordered_json& value);

/// The object. `error` is empty where nothing failed.
nlohmann::ordered_json json_report(const Session& session, int exit_code, const std::string& error);

/// JSON text of the value, with a line break at its end; names of files that are no UTF-8 get question marks.
/// `indent` −1 puts all on one line.
std::string json_text(const nlohmann::ordered_json& value, int indent);

/// Writes the object where session.json or session.json_file say, if they do.
/// @throws Error if the file cannot be written.
void write_json_report(const Session& session, int exit_code, const std::string& error);

}  // namespace hermesh::cli
