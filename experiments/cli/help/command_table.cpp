#include "experiments/cli/help/command_table.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "experiments/cli/cli11.h"
#include "experiments/cli/laboratory.h"
#include "experiments/variants.h"

namespace hermesh::cli {
namespace {

/// The words of a set as CLI11 describes it: "TEXT:{yes,no}".
std::vector<std::string> words_of_set(const std::string& type) {
  const std::size_t from = type.find(":{"), to = type.rfind('}');
  std::vector<std::string> words;
  if (from == std::string::npos || to == std::string::npos || to < from) return words;
  std::istringstream stream(type.substr(from + 2, to - from - 2));
  for (std::string word; std::getline(stream, word, ',');) words.push_back(word);
  return words;
}

template <class Table>
std::vector<std::string> names_of(const Table& table) {
  std::vector<std::string> names;
  for (const auto& variant : table) names.push_back(variant.name);
  return names;
}

template <class Table>
std::vector<std::string> keys_of(const Table& table) {
  std::vector<std::string> keys;
  for (const auto& variant : table)
    for (const OptionSpec& option : variant.options)
      if (std::ranges::find(keys, option.name + "=") == keys.end()) keys.push_back(option.name + "=");
  return keys;
}

void add_options(const CLI::App& command, std::vector<OptionEntry>& entries) {
  for (const CLI::Option* option : command.get_options()) {
    OptionEntry entry;
    for (const std::string& name : option->get_lnames()) entry.names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) entry.names.push_back("-" + name);
    if (entry.names.empty()) entry.place = option->get_name(true);
    entry.help = option->get_description();
    entry.takes_value = option->get_items_expected_max() > 0;
    entry.required = option->get_required();
    entry.choices = words_of_set(option->get_type_name());
    const auto has = [&](const char* name) {
      return std::ranges::find(entry.names, name) != entry.names.end();
    };
    if (has("--extractor") || (has("--variant") && entry.takes_value))
      entry.choices = names_of(all_extractors());
    if (has("--voxelizer")) entry.choices = names_of(all_voxelizers());
    if (has("-o")) entry.choices = keys_of(all_extractors());
    if (has("--voxelizer-option")) entry.choices = keys_of(all_voxelizers());
    entries.push_back(entry);
  }
  // Groups of options are commands without a name.
  for (const CLI::App* group :
       command.get_subcommands([](const CLI::App* one) { return one->get_name().empty(); }))
    add_options(*group, entries);
}

/// Adds the options of commands that the laboratory runs.
void add_options_of_laboratory(std::vector<CommandEntry>& table) {
  const auto output = laboratory_output({"options"});
  if (!output) return;
  const auto listed = nlohmann::json::parse(*output);
  for (CommandEntry& command : table)
    if (const auto options = listed.find(command.name); options != listed.end() && command.options.empty())
      for (const auto& option : *options)
        command.options.push_back({.names = option.at("names"),
                                   .place = option.at("place"),
                                   .help = option.at("help"),
                                   .takes_value = option.at("takes_value"),
                                   .required = option.at("required"),
                                   .choices = option.at("choices")});
}

}  // namespace

std::vector<CommandEntry> command_table(const CLI::App& app) {
  std::vector<CommandEntry> table;
  const auto add = [&](const CLI::App& command, const std::string& name) {
    CommandEntry entry{name, command.get_description(), {}};
    add_options(command, entry.options);
    table.push_back(entry);
  };
  add(app, "");
  for (const CLI::App* command :
       app.get_subcommands([](const CLI::App* one) { return !one->get_group().empty(); }))
    if (!command->get_name().empty()) add(*command, command->get_name());
  add_options_of_laboratory(table);
  return table;
}

}  // namespace hermesh::cli
