#include "experiments/cli/help/completion.h"

namespace hermesh::cli {
namespace {

std::string joined(const std::vector<std::string>& words, const std::string& between) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : between) + word;
  return text;
}

/// The text as a description of zsh, within quotes of one stroke: brackets and colons mean something there.
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

}  // namespace

std::string bash_completion(const std::vector<CommandEntry>& table) {
  std::vector<std::string> commands;
  std::string cases;
  for (const CommandEntry& command : table) {
    if (!command.name.empty()) commands.push_back(command.name);
    std::vector<std::string> names;
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
    # A key of a variant's option is followed by its value.
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

}  // namespace hermesh::cli
