// hermesh run, report and compare: experiments, the tables made of them, and two runs beside each other.
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "experiments/cli/cli11.h"
#include "experiments/cli/session.h"
#include "experiments/cli/terminal_progress.h"
#include "experiments/harness/compare.h"
#include "experiments/harness/harness.h"
#include "experiments/harness/rows.h"

namespace hermesh::cli {
namespace {

int run(RunSettings settings, Session& session) {
  if (settings.out.empty())
    settings.out = std::filesystem::path("results/local") / settings.experiment.stem();
  // The table is printed in one piece, since the line of progress would cut through it.
  std::ostringstream table;
  const int exit_code = run_experiment(settings, session.context, table);
  erase_progress_line();
  std::cout << table.str();
  return exit_code;
}

void add_run(CLI::App& app, Session& session) {
  CLI::App* command =
      add_command(app, session, "run", "Run an experiment: validate, time, append rows, print the table");
  auto settings = std::make_shared<RunSettings>();
  command->add_option("EXPERIMENT", settings->experiment, "Experiment file (.toml)")->required();
  command->add_option("--tier", settings->tier, "Sizes to run (default: quick)")
      ->check(CLI::IsMember({"quick", "full"}));
  command->add_option(
      "--out", settings->out,
      "Folder for rows.jsonl, meshes and pictures (default: results/local/ and the file's name)");
  command->add_option("--filter", settings->filter,
                      "Only cells whose case/resolution/variant contains this text");
  command->callback(
      [settings, &session] { session.command = [settings, &session] { return run(*settings, session); }; });
}

void add_report(CLI::App& app, Session& session) {
  struct Arguments {
    std::filesystem::path folder;
    std::string format = "md";
  };
  CLI::App* command = add_command(app, session, "report", "Tables from the rows of earlier runs");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("DIR", arguments->folder, "Folder with rows.jsonl")->required();
  command
      ->add_option("--format", arguments->format,
                   "md, csv, tex, or plots to draw those of the rows into DIR (default: md)")
      ->check(CLI::IsMember({"md", "csv", "tex", "plots"}));
  command->callback([arguments, &session] {
    session.command = [arguments] {
      write_report(arguments->folder, arguments->format, std::cout);
      return kDone;
    };
  });
}

void add_compare(CLI::App& app, Session& session) {
  struct Arguments {
    std::filesystem::path before, after;
  };
  CLI::App* command = add_command(
      app, session, "compare", "Whether the cells of two runs made the same, by their digests; if not, exit code 3");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("BEFORE", arguments->before, "Folder with rows.jsonl")->required();
  command->add_option("AFTER", arguments->after, "Folder with rows.jsonl")->required();
  command->callback([arguments, &session] {
    session.command = [arguments] {
      const RunComparison comparison = compare_runs(read_rows(arguments->before), read_rows(arguments->after));
      std::cout << text(comparison);
      return comparison.same() ? kDone : kNotMet;
    };
  });
}

}  // namespace

void add_experiments(CLI::App& app, Session& session) {
  add_run(app, session);
  add_report(app, session);
  add_compare(app, session);
}

}  // namespace hermesh::cli
