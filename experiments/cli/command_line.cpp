#include "experiments/cli/command_line.h"

#include <algorithm>
#include <filesystem>

#include "algorithms/io/mesh_file.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/help.h"
#include "experiments/cli/laboratory.h"

namespace hermesh::cli {
namespace {

/// Returns the name of an option whose value is an empty string, as an unset variable of a script leaves it;
/// it would be taken for a missing option. Empty if there is no such option.
std::string option_without_value(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options())
    for (const std::string& given : option->results())
      if (given.empty()) return option->get_name();
  const auto all = [](const CLI::App*) { return true; };  // groups of options are commands, too
  for (const CLI::App* command : app.get_subcommands(all))
    if (const std::string found = option_without_value(*command); !found.empty()) return found;
  return {};
}

/// Returns a message about an empty word, as an unset variable of a script leaves it; empty if there is none.
/// CLI11 finds an option group, whose name is empty, by such a word, and parses it forever. Words for the
/// laboratory are not parsed here.
std::string message_about_empty_word(const CLI::App& app, const std::vector<std::string>& words) {
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i].empty() && i > 0 && words[i - 1].starts_with("--"))
      return words[i - 1] + " was given an empty value";
    if (words[i].empty()) return "argument " + std::to_string(i + 1) + " is empty";
    const auto is_passed_on = [&](const CLI::App* command) {
      return command->get_name() == words[i] && command->get_prefix_command();
    };
    if (!app.get_subcommands(is_passed_on).empty()) return {};
  }
  return {};
}

/// Returns a message about a word after --json that is meant as its file but would be an input because of its
/// ending; empty if there is none.
std::string misnamed_json_file(const std::vector<std::string>& words) {
  const auto at = std::ranges::find(words, "--json");
  if (at == words.end() || at + 1 == words.end()) return {};
  const std::filesystem::path word = *(at + 1);
  const std::string ending = word.extension().string();
  if (word.string().starts_with('-') || ending.empty() || is_mesh_path(word)) return {};
  // No command reads or writes files with these endings; a file that does not exist is not an input, but may
  // be an output.
  const bool is_report = ending == ".txt" || ending == ".log" || ending == ".csv";
  const auto endings = {".json", ".jsonl", ".vdb", ".nii", ".raw", ".gz", ".toml"};
  const bool is_ours = std::ranges::find(endings, ending) != endings.end();
  std::error_code error;
  if (is_ours || (!is_report && std::filesystem::exists(word, error))) return {};
  return "--json takes the next word as its file only if that ends in .json or .jsonl, and '" +
         word.string() + "' would be an input: write --json='" + word.string() + "' if it is the file";
}

/// Returns the arguments in the order that CLI11 expects, the last one first. The file of --json is attached
/// to it, because a flag takes no separate value; no file that a command reads or writes has that extension.
std::vector<std::string> with_json_files(std::vector<std::string> words) {
  for (std::size_t i = 0; i + 1 < words.size(); ++i)
    if (words[i] == "--json" && (words[i + 1].ends_with(".json") || words[i + 1].ends_with(".jsonl"))) {
      words[i] += "=" + words[i + 1];
      words.erase(words.begin() + std::ptrdiff_t(i) + 1);
    }
  return {words.rbegin(), words.rend()};
}

}  // namespace

void add_commands(CLI::App& app, Session& session) {
  add_common_options(app, session);
  add_list(app, session);
  add_voxelize(app, session);
  add_import(app, session);
  add_conversions(app, session);
  add_combine(app, session);
  add_fracture(app, session);
  add_validate(app, session);
  add_info(app, session);
  add_laboratory(app, session);
  add_help(app, session);
}

CommandFiles* parse_command_line(CLI::App& app, Session& session, const std::vector<std::string>& words) {
  if (const std::string message = misnamed_json_file(words); !message.empty()) throw UsageError(message);
  if (const std::string message = message_about_empty_word(app, words); !message.empty())
    throw UsageError(message);
  for (const std::string& word : words)
    session.command_line += (session.command_line.empty() ? "" : " ") + word;
  try {
    app.parse(with_json_files(words));
  } catch (const CLI::Success&) {
    throw;
  } catch (const CLI::ParseError& error) {
    std::string message = unknown_word(app, words);
    if (message.empty() && dynamic_cast<const CLI::RequiredError*>(&error))
      message = missing_output(app, session);
    throw UsageError(message.empty() ? error.what() : message);
  }
  if (const std::string option = option_without_value(app); !option.empty())
    throw UsageError(option + " was given an empty value");
  if (!session.command) throw UsageError("a command is missing");
  CommandFiles* const files = files_of_command(app, session);
  check_written_files(app, files, session);
  return files;
}

}  // namespace hermesh::cli
