// hermesh doctor, completion and man, which read the commands and options from CLI11's tables; suggestions.
#include "experiments/cli/help.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <sstream>

#include "experiments/cli/cli11.h"
#include "experiments/cli/laboratory.h"
#include "experiments/variants.h"

namespace hermesh::cli {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

std::string joined(const Words& words, const std::string& between) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : between) + word;
  return text;
}

bool contains(const Words& words, const std::string& word) {
  return std::ranges::find(words, word) != words.end();
}

// ---- The table of commands.

struct OptionEntry {
  Words names;           ///< "--threads", "-o"; empty for a positional argument
  std::string position;  ///< name of a positional argument, such as "IN"
  std::string help;
  bool takes_value = true;  ///< false: a flag
  bool required = false;
  Words choices;  ///< all allowed values; empty: many
};

struct CommandEntry {
  std::string name, summary;
  std::vector<OptionEntry> options;
};

Words names_of(const CLI::Option& option) {
  Words names;
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  return names;
}

/// Calls `use` with each option of the command and of its groups, which are commands without a name.
template <class Use>
void for_each_option(const CLI::App& command, const Use& use) {
  for (const CLI::Option* option : command.get_options()) use(*option);
  for (const CLI::App* group :
       command.get_subcommands([](const CLI::App* one) { return one->get_name().empty(); }))
    for_each_option(*group, use);
}

/// Returns the commands that users see.
std::vector<const CLI::App*> visible_commands(const CLI::App& app) {
  return app.get_subcommands(
      [](const CLI::App* one) { return !one->get_group().empty() && !one->get_name().empty(); });
}

/// Returns the words of a set as CLI11 describes it: "TEXT:{yes,no}".
Words words_of_set(const std::string& type) {
  const std::size_t from = type.find(":{"), to = type.rfind('}');
  Words words;
  if (from == std::string::npos || to == std::string::npos || to < from) return words;
  std::istringstream stream(type.substr(from + 2, to - from - 2));
  for (std::string word; std::getline(stream, word, ',');) words.push_back(word);
  return words;
}

template <class Method>
Words names_of(const std::vector<Method>& table) {
  Words names;
  for (const Method& method : table) names.push_back(method.name);
  return names;
}

template <class Method>
Words keys_of(const std::vector<Method>& table) {
  Words keys;
  for (const Method& method : table)
    for (const OptionSpec& option : method.options)
      if (!contains(keys, option.name + "=")) keys.push_back(option.name + "=");
  return keys;
}

OptionEntry entry_of(const CLI::Option& option) {
  OptionEntry entry{.names = names_of(option),
                    .position = {},
                    .help = option.get_description(),
                    .takes_value = option.get_items_expected_max() > 0,
                    .required = option.get_required(),
                    .choices = words_of_set(option.get_type_name())};
  if (entry.names.empty()) entry.position = option.get_name(true);
  if (contains(entry.names, "--extractor")) entry.choices = names_of(all_extractors());
  if (contains(entry.names, "--voxelizer")) entry.choices = names_of(all_voxelizers());
  if (contains(entry.names, "-o")) entry.choices = keys_of(all_extractors());
  if (contains(entry.names, "--voxelizer-option")) entry.choices = keys_of(all_voxelizers());
  return entry;
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
                                   .position = option.at("place"),
                                   .help = option.at("help"),
                                   .takes_value = option.at("takes_value"),
                                   .required = option.at("required"),
                                   .choices = option.at("choices")});
}

/// Returns the program itself, without a name, and the commands that users see, in their order, with the
/// options of their groups.
std::vector<CommandEntry> command_table(const CLI::App& app) {
  std::vector<const CLI::App*> commands = visible_commands(app);
  commands.insert(commands.begin(), &app);
  std::vector<CommandEntry> table;
  for (const CLI::App* command : commands) {
    CommandEntry entry{command == &app ? "" : command->get_name(), command->get_description(), {}};
    for_each_option(*command, [&](const CLI::Option& option) { entry.options.push_back(entry_of(option)); });
    table.push_back(std::move(entry));
  }
  add_options_of_laboratory(table);
  return table;
}

// ---- Completion.

/// Escapes text for a description in zsh within single quotes, where brackets and colons have a meaning.
std::string zsh_text(const std::string& text) {
  std::string result;
  for (const char c : text.substr(0, text.find_first_of(":;"))) {
    if (c == '\'')
      result += "'\\''";
    else if (c == '[' || c == ']' || c == '\\')
      result += std::string("\\") + c;
    else
      result += c == '\n' ? ' ' : c;
  }
  return result;
}

/// Returns a script for bash that completes commands, options, and values that can be listed; files
/// otherwise.
std::string bash_completion(const std::vector<CommandEntry>& table) {
  Words commands;
  std::string cases;
  for (const CommandEntry& command : table) {
    if (!command.name.empty()) commands.push_back(command.name);
    Words names;
    std::string values;
    for (const OptionEntry& option : command.options) {
      names.insert(names.end(), option.names.begin(), option.names.end());
      if (option.names.empty() || !option.takes_value || option.choices.empty()) continue;
      values += "        " + joined(option.names, "|") + ") words='" + joined(option.choices, " ") + "' ;;\n";
    }
    cases += "    " + (command.name.empty() ? std::string("''") : command.name) + ")\n      options='" +
             joined(names, " ") + "'\n";
    if (!values.empty()) cases += "      case $before in\n" + values + "      esac\n";
    cases += "      ;;\n";
  }
  return R"(# Completion of hermesh for bash, made by `hermesh completion bash`. Put it into
# ~/.local/share/bash-completion/completions/hermesh, or source it.
_hermesh() {
  local here=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} command= words= options= word
  # bash takes --option=value for three words.
  if [[ $here == = ]]; then here=; elif [[ $before == = ]]; then before=${COMP_WORDS[COMP_CWORD-2]}; fi
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    case $word in )" +
         joined(commands, "|") + R"() command=$word; break ;; esac
  done
  case $command in
)" + cases +
         R"(  esac
  COMPREPLY=()
  if [[ -n $words ]]; then
    COMPREPLY=($(compgen -W "$words" -- "$here"))
    # A key of a method's option is followed by its value.
    [[ ${#COMPREPLY[@]} -eq 1 && ${COMPREPLY[0]} == *= ]] && compopt -o nospace
  elif [[ $here == -* ]]; then
    COMPREPLY=($(compgen -W "$options" -- "$here"))
  elif [[ -z $command ]]; then
    COMPREPLY=($(compgen -W ')" +
         joined(commands, " ") + R"(' -- "$here"))
  fi
  return 0
}
complete -o bashdefault -o default -F _hermesh hermesh
)";
}

/// Returns a function file `_hermesh` for zsh, with the same completions and a description of each option.
std::string zsh_completion(const std::vector<CommandEntry>& table) {
  std::string described, cases;
  const auto arguments = [](const CommandEntry& command) {
    std::string lines;
    for (const OptionEntry& option : command.options)
      for (const std::string& name : option.names) {
        const std::string values =
            option.choices.empty() ? "_files" : "(" + joined(option.choices, " ") + ")";
        lines += " \\\n        '" + name + (option.takes_value && name.starts_with("--") ? "=" : "") + "[" +
                 zsh_text(option.help) + "]" + (option.takes_value ? ": :" + values : "") + "'";
      }
    return lines;
  };
  for (const CommandEntry& command : table) {
    if (command.name.empty()) continue;
    described += "    '" + command.name + ":" + zsh_text(command.summary) + "'\n";
    cases += "    " + command.name + ")\n      _arguments" + arguments(command) +
             " \\\n        '*: :_files'\n      ;;\n";
  }
  return "#compdef hermesh\n# Completion of hermesh for zsh, made by `hermesh completion zsh`. Put it into a "
         "folder of $fpath as _hermesh.\n"
         "_hermesh() {\n  local -a commands\n  commands=(\n" +
         described + "  )\n  if (( CURRENT == 2 )); then\n    _describe command commands\n    _arguments" +
         arguments(table[0]) +
         "\n    return\n  fi\n  local command=$words[2]\n  shift words\n  (( CURRENT-- ))\n  case $command "
         "in\n" +
         cases + "  esac\n}\n_hermesh \"$@\"\n";
}

// ---- The manual page, in the language of man(7).

/// Escapes text that roff would interpret as a request or typeset as another character.
std::string roff(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '\\')
      result += "\\e";
    else if (c == '-')
      result += "\\-";
    else if ((c == '.' || c == '\'') && (result.empty() || result.back() == '\n'))
      result += std::string("\\&") + c;
    else
      result += c;
  }
  return result;
}

std::string with_full_stop(const std::string& text) { return roff(text.ends_with('.') ? text : text + "."); }

std::string manual_entry(const OptionEntry& option) {
  std::string text = ".TP\n";
  if (option.names.empty())
    text += ".I " + roff(option.position);
  else
    text += ".B " + roff(joined(option.names, ", ")) + (option.takes_value ? " \\fIvalue\\fP" : "");
  text += "\n" + with_full_stop(option.help) + "\n";
  // Long lists are names of methods, which `hermesh list` prints.
  if (option.choices.empty() || option.choices.size() > 8) return text;
  return text + "One of: " + roff(joined(option.choices, " ")) + ".\n";
}

std::string manual_list(const std::string& title,
                        std::initializer_list<std::pair<const char*, const char*>> items) {
  std::string text = ".SH " + title + "\n";
  for (const auto& [name, meaning] : items)
    text += std::string(".TP\n.B ") + name + "\n" + roff(meaning) + "\n";
  return text;
}

std::string man_page(const std::vector<CommandEntry>& table, const std::string& version) {
  std::string page =
      ".TH HERMESH 1 \"\" \"hermesh " + roff(version) +
      "\" \"User Commands\"\n.SH NAME\nhermesh \\- polygons to sparse volumes and back, with "
      "validation\n.SH SYNOPSIS\n.B hermesh\n.RI [ options ]\n.I command\n.RI [ arguments ]\n.SH "
      "DESCRIPTION\n" +
      roff(
          "hermesh converts meshes to level sets and Hermite data and back, combines and fractures solids, "
          "and validates meshes. A file name - is the standard input or output.") +
      "\n.SH OPTIONS\n";
  for (const OptionEntry& option : table[0].options) page += manual_entry(option);
  page += ".SH COMMANDS\n";
  for (const CommandEntry& command : table) {
    if (command.name.empty()) continue;
    page += ".SS hermesh " + roff(command.name);
    for (const OptionEntry& option : command.options)
      if (option.names.empty())
        page += option.required ? " " + roff(option.position) : " [" + roff(option.position) + "]";
    page += "\n" + with_full_stop(command.summary) + "\n";
    // The options of all commands are listed once.
    for (const OptionEntry& option : command.options) {
      const bool general = std::ranges::any_of(table[0].options, [&](const OptionEntry& one) {
        return !one.names.empty() && one.names == option.names;
      });
      if (!general && (option.names.empty() || option.names[0] != "--help")) page += manual_entry(option);
    }
  }
  return page +
         manual_list("EXIT STATUS", {{"0", "Success."},
                                     {"1", "Invalid input, or a failure; a message on the standard error."},
                                     {"2", "Wrong usage."},
                                     {"3", "A guarantee or a --require is not met."},
                                     {"130", "Interrupted by Ctrl-C; no partial file is left."}}) +
         manual_list("ENVIRONMENT", {{"HERMESH_DATA", "Directory of the models that experiments name."},
                                     {"HERMESH_EXPERIMENTS",
                                      "Directory of the experiments, if not that of the source tree."},
                                     {"TMPDIR", "Directory for copies of the standard input and output."}}) +
         ".SH EXAMPLES\n.nf\n" +
         roff(
             "hermesh remesh scan.ply out.ply --resolution 400\n"
             "hermesh remesh scans/*.stl --out-dir clean --resolution 200 --json summary.jsonl\n"
             "hermesh voxelize - - --resolution 100 < a.ply | hermesh extract - - --format obj | hermesh "
             "validate -\n") +
         ".fi\n.SH SEE ALSO\n.BR vdb_print (1)\n";
}

// ---- The doctor.

struct Check {
  std::string feature;  ///< that needs it
  std::string needs;    ///< program, directory or file
  std::string found;    ///< its path; empty: missing
  std::string remedy;   ///< command or setting that installs it
};

std::string first_existing(const std::vector<fs::path>& paths) {
  std::error_code error;
  for (const fs::path& path : paths)
    if (fs::exists(path, error)) return path.string();
  return "";
}

/// Returns a check for an executable file of that name in the directories of $PATH.
Check of_program(const std::string& feature, const std::string& program, const std::string& packages) {
  Check check{feature, program, "", "apt-get install " + packages};
  const char* directories = std::getenv("PATH");
  std::istringstream stream(directories ? directories : "");
  for (std::string directory; check.found.empty() && std::getline(stream, directory, ':');) {
    const fs::path file = fs::path(directory.empty() ? "." : directory) / program;
    std::error_code error;
    if (fs::is_regular_file(file, error) && access(file.c_str(), X_OK) == 0) check.found = file.string();
  }
  return check;
}

Check of_data() {
  const char* directory = std::getenv("HERMESH_DATA");
  Check check{"experiments on the scans of the thesis, else substitutes", "the folder $HERMESH_DATA", "",
              "export HERMESH_DATA=FOLDER with the models, or install npm, which fetches the Dragon on first "
              "use"};
  std::error_code error;
  if (directory && fs::is_directory(directory, error)) check.found = directory;
  if (directory && check.found.empty())
    check.remedy =
        "HERMESH_DATA names '" + std::string(directory) + "', which is not a directory; " + check.remedy;
  return check;
}

/// Searches for everything that features beyond reading and writing meshes and volumes need; starts no
/// program.
std::vector<Check> all_checks() {
  return {
      {"run, report, claims and other commands of the laboratory", "the directory of experiments",
       first_existing({experiments_directory() / "questions"}).empty() ? ""
                                                                       : experiments_directory().string(),
       "export HERMESH_EXPERIMENTS=CHECKOUT/experiments, from a clone of the project"},
      of_data(),
      of_program("fetching models, peers in JavaScript", "npm", "npm"),
      of_program("the laboratory (run, report, claims, compare), peers in Python", "python3",
                 "python3 python3-scipy python3-matplotlib python3-jinja2"),
      of_program("commits in rows, rows that are kept", "git", "git"),
      of_program("./reproduce --paper", "pdflatex",
                 "texlive-latex-base texlive-latex-recommended texlive-fonts-recommended"),
      {"plots in the paper", "fonts of LaTeX",
       first_existing({"/usr/share/texlive/texmf-dist/fonts/type1/public/amsfonts",
                       "/usr/share/texlive/texmf-dist/fonts/type1/urw"}),
       "apt-get install texlive-fonts-recommended"},
      of_program("panels in a host", "blender", "blender"),
      of_program("tests of the page of results", "chromium", "chromium"),
      of_program("sweeps on all cores", "snakemake", "snakemake"),
      of_program("sweeps on a cluster", "sbatch", "slurm-wlm munge"),
      of_program("inspection of .vdb files by another program", "vdb_print", "libopenvdb-tools"),
      of_program("building, ./test", "cmake", "cmake ninja-build g++"),
      of_program("tests of the manual page", "man", "man-db"),
  };
}

int run_doctor(Session& session) {
  std::size_t missing = 0;
  Json list = Json::array();
  for (const Check& check : all_checks()) {
    const bool found = !check.found.empty();
    missing += !found;
    list.push_back({{"feature", check.feature},
                    {"needs", check.needs},
                    {"found", found ? Json(check.found) : Json()},
                    {"remedy", found ? Json() : Json(check.remedy)}});
    if (!session.json)
      std::cout << (found ? "ok       " : "missing  ") << check.needs << ", for " << check.feature << ": "
                << (found ? check.found : check.remedy) << '\n';
  }
  made(session, "checks", list);
  made(session, "missing", missing);
  if (!session.json)
    std::cout << (missing == 0 ? "nothing is missing"
                               : std::to_string(missing) +
                                     " things are missing; conversions and validation work without them")
              << '\n';
  return kDone;
}

/// Returns the number of letters to insert, delete, change, or swap with their neighbour to turn one word
/// into the other (optimal string alignment).
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

}  // namespace

void add_help(CLI::App& app, Session& session) {
  CLI::App* command = add_command(
      app, session, "doctor", "List missing programs and data, the features that need them, and remedies");
  add_json_option(*command, session);
  set_work(*command, session, [&session] { return run_doctor(session); });

  const auto shell = std::make_shared<std::string>();
  command = add_command(app, session, "completion", "Print a script that completes command lines in a shell");
  command->add_option("SHELL", *shell, "bash or zsh")->required()->check(CLI::IsMember({"bash", "zsh"}));
  set_work(*command, session, [shell, &app] {
    const std::vector<CommandEntry> table = command_table(app);
    std::cout << (*shell == "bash" ? bash_completion(table) : zsh_completion(table));
    return kDone;
  });

  command = add_command(app, session, "man", "Print the manual page, for man -l");
  set_work(*command, session, [&app, &session] {
    std::cout << man_page(command_table(app), session.version);
    return kDone;
  });
}

// ---- Suggestions.

std::string did_you_mean(const std::string& given, const Words& words) {
  constexpr std::size_t kLongest = 100;  // longer words are not typing errors
  if (given.empty() || given.size() > kLongest) return "";
  const std::string* nearest = nullptr;
  std::size_t least = std::max<std::size_t>(1, given.size() / 3) + 1;
  for (const std::string& word : words)
    if (const std::size_t distance = edit_distance(given, word); distance < least)
      least = distance, nearest = &word;
  if (!nearest && given.size() >= 3)
    for (const std::string& word : words)
      if (!nearest && word.starts_with(given)) nearest = &word;
  return nearest ? "; did you mean '" + *nearest + "'?" : "";
}

std::string unknown_word(const CLI::App& app, const Words& arguments) {
  const std::vector<CLI::App*> asked = app.get_subcommands();
  Words commands, options;
  for (const CLI::App* command : visible_commands(app)) commands.push_back(command->get_name());
  const auto add = [&](const CLI::Option& option) {
    for (const std::string& name : names_of(option)) options.push_back(name);
  };
  if (!asked.empty()) for_each_option(*asked[0], add);
  for_each_option(app, add);
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& word = arguments[i];
    if (word == "--") break;
    if (word.starts_with("--")) {
      const std::string name = word.substr(0, word.find('='));
      if (!contains(options, name))
        return (asked.empty() ? "hermesh" : "hermesh " + asked[0]->get_name()) + " has no option " + name +
               did_you_mean(name, options);
    } else if (asked.empty() && !word.starts_with("-") && (i == 0 || !arguments[i - 1].starts_with("-"))) {
      return "there is no command '" + word + "'" + did_you_mean(word, commands);
    }
  }
  return "";
}

}  // namespace hermesh::cli
