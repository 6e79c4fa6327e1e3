#include "experiments/cli/help/man_page.h"

namespace hermesh::cli {
namespace {

/// The text with what roff would take for a command of its own, or typeset as something else, made plain.
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

std::string sentence(const std::string& text) { return text.ends_with('.') ? text : text + "."; }

std::string options_text(const std::vector<OptionEntry>& options) {
  std::string text;
  for (const OptionEntry& option : options) {
    text += ".TP\n";
    if (option.names.empty()) {
      text += ".I " + roff(option.place) + "\n";
    } else {
      text += ".B ";
      for (std::size_t i = 0; i < option.names.size(); ++i)
        text += (i > 0 ? ", " : "") + roff(option.names[i]);
      if (option.takes_value) text += " \\fIvalue\\fP";
      text += "\n";
    }
    text += roff(sentence(option.help)) + "\n";
    // Long lists, as those of variants, are those of `hermesh list`.
    if (!option.choices.empty() && option.choices.size() <= 8) {
      text += "One of:";
      for (const std::string& choice : option.choices) text += " " + roff(choice);
      text += ".\n";
    }
  }
  return text;
}

}  // namespace

std::string man_page(const std::vector<CommandEntry>& table, const std::string& version) {
  std::string page = ".TH HERMESH 1 \"\" \"hermesh " + roff(version) +
                     "\" \"User Commands\"\n.SH NAME\nhermesh \\- polygons to sparse volumes and back, with "
                     "judges\n.SH SYNOPSIS\n.B hermesh\n"
                     ".RI [ options ]\n.I command\n.RI [ arguments ]\n.SH DESCRIPTION\n";
  page += roff(
      "hermesh makes level sets and Hermite data of polygons, meshes of volumes, combines and breaks solids, "
      "and judges "
      "meshes. Where a file is read or written, - names the standard input or output.");
  page += "\n.SH OPTIONS\n" + options_text(table[0].options) + ".SH COMMANDS\n";
  for (const CommandEntry& command : table) {
    if (command.name.empty()) continue;
    page += ".SS hermesh " + roff(command.name);
    for (const OptionEntry& option : command.options)
      if (option.names.empty())
        page += option.required ? " " + roff(option.place) : " [" + roff(option.place) + "]";
    page += "\n" + roff(sentence(command.summary)) + "\n";
    std::vector<OptionEntry> own;
    // What all commands take is said once.
    for (const OptionEntry& option : command.options) {
      bool general = false;
      for (const OptionEntry& one : table[0].options)
        general |= !one.names.empty() && one.names == option.names;
      if (!general && (option.names.empty() || option.names[0] != "--help")) own.push_back(option);
    }
    page += options_text(own);
  }
  const std::pair<const char*, const char*> codes[] = {
      {"0", "Done."},
      {"1", "Bad input, or a failure; one sentence on the standard error says which."},
      {"2", "Wrong usage."},
      {"3", "A promise or a --require is not met."},
      {"130", "Ended by Ctrl-C; nothing half-written is left behind."}};
  page += ".SH EXIT STATUS\n";
  for (const auto& [code, meaning] : codes)
    page += std::string(".TP\n.B ") + code + "\n" + roff(meaning) + "\n";
  const std::pair<const char*, const char*> variables[] = {
      {"HERMESH_DATA", "Folder of the models that experiments name."},
      {"HERMESH_EXPERIMENTS", "Folder of the experiments, if it is not that of the source tree."},
      {"TMPDIR", "Folder for what comes from the standard input and goes to the standard output."}};
  page += ".SH ENVIRONMENT\n";
  for (const auto& [name, meaning] : variables)
    page += std::string(".TP\n.B ") + name + "\n" + roff(meaning) + "\n";
  return page + ".SH EXAMPLES\n.nf\n" +
         roff(
             "hermesh remesh scan.ply out.ply --resolution 400\n"
             "hermesh remesh scans/*.stl --out-dir clean --resolution 200 --json summary.jsonl\n"
             "hermesh voxelize - - --resolution 100 < a.ply | hermesh extract - - --format obj | hermesh "
             "validate -\n") +
         ".fi\n.SH SEE ALSO\n.BR vdb_print (1)\n";
}

}  // namespace hermesh::cli
