#include "experiments/ablations/prediction.h"

#include <nlohmann/json.hpp>
#include <sstream>

#include "algorithms/core/error.h"
#include "experiments/cases/cases.h"
#include "experiments/harness/sha256.h"
#include "experiments/harness/shell.h"

namespace hermesh {
namespace {

ShellOutput git_in(const std::filesystem::path& folder, const std::string& arguments) {
  // Dates are in UTC, as those of rows are.
  return shell_output("TZ=UTC git -C " + shell_quoted(folder.string()) + " " + arguments + " 2>/dev/null");
}

}  // namespace

Json prediction_of(const std::filesystem::path& file) {
  const std::filesystem::path whole = std::filesystem::weakly_canonical(file);
  const std::filesystem::path folder = whole.parent_path();
  const std::string name = shell_quoted(whole.filename().string());
  Json prediction = {{"file", whole.filename().string()}, {"sha256", sha256_of_file(whole)}};
  const ShellOutput place = git_in(folder, "ls-files --full-name -- " + name);
  const ShellOutput last =
      git_in(folder, "log -1 --date=format-local:%Y-%m-%dT%H:%M:%SZ --format='%H %cd' -- " + name);
  const ShellOutput changes = git_in(folder, "status --porcelain -- " + name);
  if (place.status != 0 || place.text.empty() || last.status != 0 || last.text.empty()) {
    prediction["note"] = "the prediction in " + whole.filename().string() + " is not committed";
  } else if (changes.status != 0 || !changes.text.empty()) {
    prediction["note"] =
        "the prediction in " + whole.filename().string() + " was changed since it was committed";
  } else {
    std::istringstream words(last.text);
    std::string commit, date;
    words >> commit >> date;
    prediction["file"] = place.text;
    prediction["commit"] = commit;
    prediction["date"] = date;
  }
  return prediction;
}

void check_prediction(const Json& prediction, const std::filesystem::path& out) {
  const std::filesystem::path results =
      std::filesystem::weakly_canonical(experiments_folder().parent_path() / "results");
  const std::filesystem::path way =
      std::filesystem::weakly_canonical(std::filesystem::absolute(out)).lexically_relative(results);
  const bool is_kept = !way.empty() && *way.begin() != ".." && *way.begin() != "local";
  if (const std::string note = text_at(prediction, "/note"); is_kept && !note.empty())
    throw Error(out.string() + " takes rows of a committed prediction alone, and " + note +
                ": commit it before the run, or name a folder such as results/local/" +
                way.filename().string());
}

std::string prediction_problem(const Json& row, const std::filesystem::path& checkout) {
  if (!find(row, "/ablation")) return "";
  const std::string commit = text_at(row, "/ablation/prediction/commit"), own = text_at(row, "/commit");
  const std::string file = text_at(row, "/ablation/prediction/file"),
                    sha256 = text_at(row, "/ablation/prediction/sha256");
  if (commit.empty()) return text_at(row, "/ablation/prediction/note");
  // Both are of the form 2026-11-27T11:00:00Z, whose order is that of the letters.
  if (text_at(row, "/ablation/prediction/date") > text_at(row, "/date"))
    return "the prediction in " + file + " is younger than the row";
  const auto is_there = [&](const std::string& name) {
    return git_in(checkout, "cat-file -e " + shell_quoted(name + "^{commit}")).status == 0;
  };
  if (!is_there(commit) || !is_there(own)) return "";
  if (git_in(checkout, "merge-base --is-ancestor " + shell_quoted(commit) + " " + shell_quoted(own)).status !=
      0)
    return "the prediction's commit " + commit.substr(0, 12) + " is not before the row's " +
           own.substr(0, 12);
  const ShellOutput hash = git_in(checkout, "show " + shell_quoted(commit + ":" + file) + " | sha256sum");
  if (hash.text.substr(0, 64) != sha256)
    return file + " of commit " + commit.substr(0, 12) + " is not the file that the row names";
  return "";
}

}  // namespace hermesh
