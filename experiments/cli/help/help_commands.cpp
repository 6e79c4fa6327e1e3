// hermesh doctor, completion and man: what the machine lacks, and what a shell and a reader should know of
// the program.
#include <iostream>
#include <memory>

#include "experiments/cli/cli11.h"
#include "experiments/cli/help/command_table.h"
#include "experiments/cli/help/completion.h"
#include "experiments/cli/help/doctor.h"
#include "experiments/cli/help/man_page.h"
#include "experiments/cli/pipeline/json_report.h"

namespace hermesh::cli {
namespace {

int run_doctor(Session& session) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  std::size_t missing = 0;
  for (const Check& check : all_checks()) {
    missing += check.found.empty();
    list.push_back(
        {{"feature", check.feature},
         {"needs", check.needs},
         {"found", check.found.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(check.found)},
         {"remedy", check.found.empty() ? nlohmann::ordered_json(check.remedy) : nlohmann::ordered_json()}});
    if (session.json) continue;
    std::cout << (check.found.empty() ? "missing  " : "ok       ") << check.needs << ", for " << check.feature
              << ": " << (check.found.empty() ? check.remedy : check.found) << '\n';
  }
  made(session, "checks", list);
  made(session, "missing", missing);
  if (!session.json)
    std::cout << (missing == 0
                      ? "nothing is missing"
                      : std::to_string(missing) +
                            " things are missing; meshes and volumes are read, made and judged without them")
              << '\n';
  return kDone;
}

}  // namespace

void add_help(CLI::App& app, Session& session) {
  CLI::App* command = add_command(
      app, session, "doctor", "What is missing on this machine, for which feature, and how it is installed");
  add_json_option(*command, session);
  command->callback([&session] { session.command = [&session] { return run_doctor(session); }; });

  const auto shell = std::make_shared<std::string>();
  command =
      add_command(app, session, "completion", "A script that lets a shell complete command lines of hermesh");
  command->add_option("SHELL", *shell, "bash or zsh")->required()->check(CLI::IsMember({"bash", "zsh"}));
  command->callback([shell, &app, &session] {
    session.command = [shell, &app] {
      const std::vector<CommandEntry> table = command_table(app);
      std::cout << (*shell == "bash" ? bash_completion(table) : zsh_completion(table));
      return kDone;
    };
  });

  command = add_command(app, session, "man", "The manual page, for man -l");
  command->callback([&app, &session] {
    session.command = [&app, &session] {
      std::cout << man_page(command_table(app), session.version);
      return kDone;
    };
  });
}

}  // namespace hermesh::cli
