#include "experiments/cli/help/suggestions.h"

#include <algorithm>

#include "experiments/cli/cli11.h"

namespace hermesh::cli {

std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> least(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i)
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        least[i][j] = i + j;
        continue;
      }
      least[i][j] =
          std::min({least[i - 1][j] + 1, least[i][j - 1] + 1, least[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        least[i][j] = std::min(least[i][j], least[i - 2][j - 2] + 1);
    }
  return least[a.size()][b.size()];
}

std::string did_you_mean(const std::string& given, const std::vector<std::string>& words) {
  constexpr std::size_t kLongest = 100;  // nobody mistypes that much
  if (given.empty() || given.size() > kLongest) return "";
  const std::string* nearest = nullptr;
  std::size_t least = std::max<std::size_t>(1, given.size() / 3) + 1;
  for (const std::string& word : words) {
    const std::size_t distance = edit_distance(given, word);
    if (distance < least) {
      least = distance;
      nearest = &word;
    }
  }
  if (!nearest && given.size() >= 3)
    for (const std::string& word : words)
      if (!nearest && word.starts_with(given)) nearest = &word;
  return nearest ? "; did you mean '" + *nearest + "'?" : "";
}

std::vector<std::string> option_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  }
  // Groups of options are commands without a name.
  for (const CLI::App* group :
       command.get_subcommands([](const CLI::App* one) { return one->get_name().empty(); }))
    for (const std::string& name : option_names(*group)) names.push_back(name);
  return names;
}

std::string unknown_word(const CLI::App& app, const std::vector<std::string>& arguments) {
  std::vector<std::string> commands;
  for (const CLI::App* command :
       app.get_subcommands([](const CLI::App* one) { return !one->get_group().empty(); }))
    commands.push_back(command->get_name());
  const std::vector<CLI::App*> asked = app.get_subcommands();
  const std::vector<std::string> general = option_names(app);
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& word = arguments[i];
    if (word == "--") break;
    if (word.starts_with("--")) {
      const std::string name = word.substr(0, word.find('='));
      std::vector<std::string> options = asked.empty() ? general : option_names(*asked[0]);
      options.insert(options.end(), general.begin(), general.end());
      if (std::ranges::find(options, name) == options.end())
        return (asked.empty() ? "hermesh" : "hermesh " + asked[0]->get_name()) + " has no option " + name +
               did_you_mean(name, options);
    } else if (asked.empty() && !word.starts_with("-") && (i == 0 || !arguments[i - 1].starts_with("-"))) {
      return "there is no command '" + word + "'" + did_you_mean(word, commands);
    }
  }
  return "";
}

}  // namespace hermesh::cli
