#include "experiments/cli/session.h"

#include "experiments/cli/cli11.h"

namespace hermesh::cli {
namespace {

/// Most threads that can be asked for: TBB reserves memory for as many as it is told that there may be.
constexpr int kMostThreads = 1024;

}  // namespace

void add_common_options(CLI::App& app, Session& session) {
  app.add_option("--threads", session.threads, "Number of threads, 1 to 1024 (default: all of the machine)")
      ->check([](const std::string& given) {
        int count = 0;
        return CLI::detail::lexical_cast(given, count) && count >= 1 && count <= kMostThreads
                   ? std::string()
                   : "must be a whole number from 1 to " + std::to_string(kMostThreads) + ", not '" + given +
                         "'";
      });
  app.add_flag("--quiet", session.quiet, "Print results and errors only: no progress, notes or summaries");
  app.add_option(
      "--log", session.log_file,
      "Keep a log in a file, behind what is there: stages, notes and summaries, each with its time");
}

CLI::App* add_command(CLI::App& app, Session& session, const std::string& name, const std::string& summary) {
  CLI::App* command = app.add_subcommand(name, summary);
  add_common_options(*command, session);
  return command;
}

void refuse_idle(const CLI::App& command, std::initializer_list<const char*> options,
                 const std::string& why) {
  for (const char* option : options)
    if (command.count(option) > 0) throw UsageError(std::string(option) + " has no effect: " + why);
}

void add_json_option(CLI::App& command, Session& session) {
  command.add_flag(
      "--json", session.json_file,
      "Print one JSON object instead of summaries, or write it to a file that ends in .json or .jsonl: "
      "--json FILE");
}

std::string Session::named(std::string sentence) const {
  for (const auto& [temporary, name] : stream_names)
    for (const std::string& word : {"'" + temporary + "'", temporary})
      for (std::size_t at = 0; (at = sentence.find(word, at)) != std::string::npos; at += name.size())
        sentence.replace(at, word.size(), name);
  return sentence;
}

}  // namespace hermesh::cli
