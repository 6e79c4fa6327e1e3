// hermesh compare, accept and merge: rows held against a baseline, rows made one, and shards of an experiment joined.
#include "experiments/ledger/compare.h"

#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "experiments/cases/cases.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/session.h"
#include "experiments/harness/rows.h"
#include "experiments/harness/provenance.h"
#include "experiments/ledger/baseline.h"
#include "experiments/ledger/merge.h"

namespace hermesh::cli {
namespace {

/// "1%" or "0.01". @throws UsageError.
double tolerance_of(const std::string& given) {
  const bool percent = given.ends_with('%');
  double value = 0.0;
  if (!CLI::detail::lexical_cast(percent ? given.substr(0, given.size() - 1) : given, value) ||
      !(value >= 0.0) || (percent ? value / 100.0 : value) > 1.0)
    throw UsageError("--tolerance must be a share such as 1% or 0.01, at most 100%, not '" + given + "'");
  return percent ? value / 100.0 : value;
}

std::filesystem::path baselines_folder() {
  return experiments_folder().parent_path() / "results" / "baselines";
}

void add_comparing(CLI::App& app, Session& session) {
  struct Arguments {
    std::filesystem::path baseline, candidate;
    std::string tolerance = "1%", times = "yes", format = "md";
    bool pool = false, allow_missing = false;
  };
  CLI::App* command = add_command(
      app, session, "compare",
      "Hold rows against a baseline: what changed for the worse, or is missing; if anything, exit code 3");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("BASELINE", arguments->baseline, "Folder with rows.jsonl, or such a file")->required();
  command->add_option("CANDIDATE", arguments->candidate, "Folder with rows.jsonl, or such a file")
      ->required();
  command->add_option("--tolerance", arguments->tolerance,
                      "By which share of the baseline an error may grow (default: 1%)");
  command
      ->add_option("--times", arguments->times,
                   "Whether times and memory are compared, where the machine is one (default: yes)")
      ->check(CLI::IsMember({"yes", "no"}));
  command->add_flag("--pool", arguments->pool,
                    "Take the repetitions of all runs of a cell together, not those of the last run");
  command->add_flag("--allow-missing", arguments->allow_missing,
                    "Take cells that the candidate lacks, or has under another label, for no regression");
  command->add_option("--format", arguments->format, "md, json or junit (default: md)")
      ->check(CLI::IsMember({"md", "json", "junit"}));
  command->callback([arguments, &session] {
    session.command = [arguments] {
      CompareSettings settings;
      settings.tolerance = tolerance_of(arguments->tolerance);
      settings.costs = arguments->times == "yes";
      settings.pool = arguments->pool;
      settings.allow_missing = arguments->allow_missing;
      const Comparison comparison =
          compare_rows(read_rows(arguments->baseline), read_rows(arguments->candidate), settings);
      std::cout << text(comparison, arguments->format);
      return comparison.fine() ? kDone : kNotMet;
    };
  });
}

void add_accept(CLI::App& app, Session& session) {
  struct Arguments {
    std::filesystem::path folder, baselines;
    std::string reason;
    bool with_failures = false;
  };
  CLI::App* command =
      add_command(app, session, "accept",
                  "Make the rows of a folder the baseline of their experiment, and say what that changes");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("DIR", arguments->folder, "Folder with rows.jsonl, made by a clean commit")->required();
  command->add_option("--reason", arguments->reason, "Why these rows are right")->required();
  command->add_flag("--with-failures", arguments->with_failures,
                    "Accept rows that failed or broke a promise, too");
  command->add_option("--baselines", arguments->baselines,
                      "Folder of the baselines (default: results/baselines)");
  command->callback([arguments, &session] {
    session.command = [arguments] {
      const AcceptedRows rows =
          accepted(read_rows(arguments->folder), arguments->reason, arguments->with_failures);
      const std::filesystem::path folder =
          arguments->baselines.empty() ? baselines_folder() : arguments->baselines;
      if (const auto before = folder / rows.experiment / "rows.jsonl"; exists(before))
        std::cout << "Beside the baseline before: " << text(compare_rows(read_rows(before), rows.rows), "md")
                  << '\n';
      std::cout << "accepted " << rows.rows.size() << " rows as " << write_baseline(rows, folder).string()
                << '\n';
      return kDone;
    };
  });
}

void add_merge(CLI::App& app, Session& session) {
  struct Arguments {
    std::filesystem::path out;
    std::vector<std::filesystem::path> shards;
  };
  CLI::App* command = add_command(app, session, "merge",
                                  "Join the shards of an experiment (hermesh run --shard) to the rows of the whole; if one or a "
                                  "cell is missing, or they are not of one program and file, exit code 1");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("OUT", arguments->out, "Folder for the rows, meshes and pictures of all shards")->required();
  command->add_option("DIR", arguments->shards, "Folders of the shards, in any order")->required();
  command->callback([arguments, &session] {
    session.command = [arguments] {
      check_may_be_kept(arguments->out, experiments_folder().parent_path(), source_state());
      merge_shards(arguments->out, arguments->shards, std::cout);
      return kDone;
    };
  });
}

}  // namespace

void add_compare(CLI::App& app, Session& session) {
  add_comparing(app, session);
  add_accept(app, session);
  add_merge(app, session);
}

}  // namespace hermesh::cli
