// hermesh run, conform, report and claims: experiments, the tables made of them, and what the rows say of the thesis.
#include <tbb/global_control.h>
#include <unistd.h>

#include <iostream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "experiments/cases/cases.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/session.h"
#include "experiments/cli/terminal_progress.h"
#include "experiments/harness/experiment_file.h"
#include "experiments/harness/harness.h"
#include "experiments/harness/run_cells.h"
#include "experiments/harness/rows.h"
#include "experiments/sweep/shards.h"
#include "experiments/ledger/claims.h"
#include "experiments/ledger/compare.h"
#include "experiments/ledger/pages.h"
#include "experiments/measurements/measurements.h"
#include "experiments/page/page.h"

namespace hermesh::cli {
namespace {

int run(RunSettings settings, const std::optional<Shard>& shard, Session& session) {
  if (settings.out.empty())
    settings.out = std::filesystem::path("results/local") / settings.experiment.stem();
  // The table is printed in one piece, since the line of progress would cut through it.
  std::ostringstream table;
  const int exit_code =
      shard ? run_shard(*shard, settings, session.context, table) : run_experiment(settings, session.context, table);
  erase_progress_line();
  std::cout << table.str();
  return exit_code;
}

void add_run(CLI::App& app, Session& session) {
  CLI::App* command =
      add_command(app, session, "run", "Run an experiment: validate, time, append rows, print the table");
  auto settings = std::make_shared<RunSettings>();
  auto name = std::make_shared<std::string>();
  command
      ->add_option("EXPERIMENT", *name,
                   "Experiment file (.toml), the name of one of experiments/questions, or a table or figure of the thesis "
                   "that it makes (figure_9_8)")
      ->required();
  command->add_option("--tier", settings->tier, "Sizes to run (default: quick)")
      ->check(CLI::IsMember({"quick", "full"}));
  command->add_option(
      "--out", settings->out,
      "Folder for rows.jsonl, meshes and pictures (default: results/local/ and the file's name)");
  command->add_option("--filter", settings->filter,
                      "Only cells whose case/resolution/variant contains this text");
  command->add_option("--variant", settings->overrides.variants,
                      "Only these variants (labels or names in the file, else names from `hermesh list`)");
  command->add_option("--case", settings->overrides.cases,
                      "Only these cases (of the file, else from `hermesh list`, or mesh files)");
  command->add_option("--resolution", settings->overrides.resolutions, "These resolutions for all cases")
      ->check(CLI::Range(2, 100'000));
  command->add_option("--repetitions", settings->overrides.repetitions, "At most so many timed runs of each variant")
      ->check(CLI::Range(1, 1000));
  auto parameters = std::make_shared<std::vector<std::string>>();
  command->add_option("--set", *parameters,
                      "Parameters of a measurement as NAME=VALUE, before those of the file; every row says which it was made with");
  auto again = std::make_shared<bool>(false);
  command->add_flag("--again", *again,
                    "Make cells anew of which the folder has rows by this program, of the same data (default: take up where "
                    "an earlier run stopped)");
  struct Limits {
    double seconds = 0.0, mib = 0.0;
    bool in_process = false;
  };
  auto limits = std::make_shared<Limits>();
  command->add_option("--timeout", limits->seconds,
                      "Seconds that a step of a cell may take, or a measurement from row to row (default: the file's, else "
                      "3600, and none for a measurement)")
      ->check(CLI::Range(0.01, 1e7));
  command->add_option("--memory", limits->mib,
                      "MiB of memory that a cell may take (default: the file's, else 80 % of the machine's)")
      ->check(CLI::Range(16.0, 1e9));
  command->add_flag("--in-process", limits->in_process,
                    "Work in this process instead of one of its own, for a debugger: a crash then ends the run");
  auto shard = std::make_shared<std::string>();
  command->add_option("--shard", *shard,
                      "Only the part I of N of the file's groups of cells, as I/N; `hermesh merge` joins the folders of all parts");
  auto with_data = std::make_shared<bool>(false);
  command->add_flag("--require-data", *with_data,
                    "Take no stand-in for a model that is not at hand: its cells fail, and the exit code is 3");
  command->callback([=, &session] {
    if (!shard->empty()) {
      as_usage([&] { return shard_of(*shard); });
      for (const char* option : {"--filter", "--variant", "--case", "--resolution", "--repetitions", "--set"})
        if (command->count(option) > 0)
          throw UsageError("--shard is a part of the whole file, of which " + std::string(option) + " leaves out or changes something");
      if (settings->out.empty()) throw UsageError("--shard needs --out, a folder for each shard");
    }
    if (limits->in_process) refuse_idle(*command, {"--timeout", "--memory"}, "--in-process cannot end what takes too much");
    as_usage([&] {
      for (const std::string& text : *parameters)
        if (const auto parameter = parse_option(text); !settings->overrides.parameters.insert(parameter).second)
          throw Error("--set " + parameter.first + " is given twice");
    });
    session.command = [=, &session] {
      settings->experiment = experiment_file(*name);
      settings->resume = !*again;
      if (!limits->in_process)
        settings->apart = {"/proc/self/exe", {"cell"}, {limits->seconds, static_cast<std::int64_t>(limits->mib * (1 << 20))}};
      if (!session.quiet && !isatty(STDERR_FILENO))
        settings->log = [](const std::string& line) { std::cerr << line << std::endl; };
      require_data(*with_data);
      return run(*settings, shard->empty() ? std::nullopt : std::optional(shard_of(*shard)), session);
    };
  });
}

/// The checkout that the experiments are read from.
std::filesystem::path project_root() { return experiments_folder().parent_path(); }

int fill_pages() {
  for (const std::string& file : Pages(project_root()).fill()) std::cout << "filled " << file << '\n';
  return kDone;
}

int check_pages() {
  const std::vector<std::string> problems = Pages(project_root()).problems();
  for (const std::string& problem : problems) std::cout << problem << '\n';
  if (problems.empty()) std::cout << "all numbers of the pages come from the rows\n";
  return problems.empty() ? kDone : kNotMet;
}

/// Makes a sample of the cells behind each folder of results/ again, and names the folders that come out otherwise.
int print_stale(const std::string& folder, Session& session) {
  Experiment experiment;
  experiment.name = experiment.measurement = "stale";
  experiment.kind = ExperimentKind::kMeasurement;
  std::size_t folders = 0, tried = 0, differing = 0;
  const auto tell = [&](const Json& row) {
    if (row.contains("failed")) throw Error(text_at(row, "/failed"));
    const std::string name = text_at(row, "/variant/label");
    ++folders;
    tried += row.at("values").at("tried").get<std::size_t>();
    differing += row.at("values").at("differing").get<std::size_t>();
    erase_progress_line();
    if (row.contains("broken"))
      std::cout << name << ": " << text_at(row, "/values/differing") << " of " << text_at(row, "/values/tried")
            << " cells differ; first " << text_at(row, "/values/difference") << std::endl;
    if (const std::string why = text_at(row, "/values/skipped"); !why.empty())
      std::cout << name << ": not tried: " << why << std::endl;
  };
  run_measurement(experiment, {}, all_tables(), {}, folder.empty() ? "" : "stale/folders/" + folder, Json::object(),
                  session.context, tell);
  erase_progress_line();
  if (folders == 0) throw Error("results/ has no folder \"" + folder + "\" with rows");
  std::cout << folders << " folders, " << tried << " cells made again, " << differing << " differ\n";
  return differing == 0 ? kDone : kNotMet;
}

int print_query(const std::string& query) {
  RowDatabase rows;
  rows.add_folders(project_root() / "results");
  const std::vector<RowDatabase::Row> found = rows.rows(query, std::numeric_limits<std::size_t>::max());
  const auto line = [](const RowDatabase::Row& row, const auto& text) {
    std::cout << '|';
    for (const auto& column : row) std::cout << ' ' << text(column) << " |";
    std::cout << '\n';
  };
  if (found.empty()) std::cout << "no rows\n";
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (i == 0) {
      line(found[0], [](const auto& column) { return column.first; });
      line(found[0], [](const auto&) { return std::string("---"); });
    }
    line(found[i], [](const auto& column) {
      return column.second.is_string() ? column.second.template get<std::string>() : column.second.dump();
    });
  }
  return kDone;
}

void add_report(CLI::App& app, Session& session) {
  struct Arguments {
    std::filesystem::path folder;
    std::string format = "md", meshes;
    bool fill = false, check = false, stale = false;
    std::string query;
  };
  CLI::App* command = add_command(
      app, session, "report", "Tables from the rows of earlier runs; and the numbers of the project's pages, filled or checked");
  auto arguments = std::make_shared<Arguments>();
  auto* folder = command->add_option("DIR", arguments->folder, "Folder with rows.jsonl");
  auto* fill = command->add_flag("--fill", arguments->fill,
                                 "Write into pages and results/*/table.md of the checkout what the rows of results/ say");
  auto* check = command->add_flag("--check", arguments->check,
                                  "Name each number of these that the rows do not give; if there are any, exit code 3");
  auto* query = command->add_option("--query", arguments->query,
                                    "Print what SQL gives on the rows of results/: each folder is a table "
                                    "(experiments/ledger/row_database.h lists the columns)");
  auto* stale = command->add_flag("--stale", arguments->stale,
                                  "Make a sample of the cells behind results/*, or results/DIR alone, again with this program, "
                                  "and name what comes out otherwise; if anything, exit code 3");
  folder->excludes(fill)->excludes(check)->excludes(query);
  stale->excludes(fill)->excludes(check)->excludes(query);
  query->excludes(fill)->excludes(check);
  fill->excludes(check);
  command
      ->add_option("--format", arguments->format,
                   "md, csv, tex, plots to draw those of the rows into DIR, or html for DIR/report.html, a page with "
                   "tables, figures and meshes that needs no network (default: md)")
      ->check(CLI::IsMember({"md", "csv", "tex", "plots", "html"}));
  command->add_option("--meshes", arguments->meshes,
                      "Which of DIR/meshes the page of html holds: all, none, or a number, of the largest (default: 10)")
      ->check([](const std::string& text) {
        try {
          mesh_choice(text);
          return std::string();
        } catch (const Error& error) {
          return std::string(error.what());
        }
      });
  command->callback([arguments, &session] {
    if (arguments->folder.empty() && !arguments->fill && !arguments->check && !arguments->stale && arguments->query.empty())
      throw CLI::RequiredError("DIR, --query, --fill, --check or --stale");
    if (!arguments->meshes.empty() && arguments->format != "html")
      throw CLI::ValidationError("--meshes", "has no effect without --format html");
    session.command = [arguments, &session] {
      if (arguments->stale) return print_stale(arguments->folder.filename().string(), session);
      if (arguments->fill) return fill_pages();
      if (arguments->check) return check_pages();
      if (!arguments->query.empty()) return print_query(arguments->query);
      if (arguments->format == "html") {
        const MeshChoice choice = arguments->meshes.empty() ? MeshChoice{} : mesh_choice(arguments->meshes);
        std::ostringstream said;
        write_page(arguments->folder, choice, session.context, said);
        erase_progress_line();
        std::cout << said.str();
        return static_cast<int>(kDone);
      }
      write_report(arguments->folder, arguments->format, std::cout);
      return static_cast<int>(kDone);
    };
  });
}

void add_claims(CLI::App& app, Session& session) {
  struct Arguments {
    std::filesystem::path file, results;
    std::string id, of, format = "md";
    bool doctor = false;
  };
  CLI::App* command = add_command(app, session, "claims",
                                  "What the rows say of each claim of the thesis; exit code 3 if one has no verdict");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("--file", arguments->file, "Claims and their rules (default: paper/claims.toml)");
  command->add_option("--results", arguments->results, "Folder of folders with rows.jsonl (default: results)");
  command->add_option("--id", arguments->id, "Only claims whose id contains this text");
  command->add_option("--of", arguments->of, "Only claims on this table or figure of the thesis, such as table_9_2");
  command->add_option("--format", arguments->format, "md or json (default: md)")->check(CLI::IsMember({"md", "json"}));
  command->add_flag("--doctor", arguments->doctor,
                    "Try each rule on doctored rows instead, and name those that cannot fail; if any, exit code 3");
  command->callback([arguments, &session] {
    session.command = [arguments] {
      if (arguments->file.empty()) arguments->file = project_root() / "paper" / "claims.toml";
      if (arguments->results.empty()) arguments->results = project_root() / "results";
      std::vector<Claim> claims = read_claims(arguments->file);
      std::erase_if(claims, [&](const Claim& claim) {
        return claim.id.find(arguments->id) == std::string::npos ||
               (!arguments->of.empty() && !is_of(claim, arguments->of));
      });
      if (claims.empty())
        throw Error(arguments->of.empty() ? "no claim's id contains \"" + arguments->id + "\""
                                          : "there is no claim on '" + arguments->of + "'; names are like figure_9_8 or 'figure 9.8'");
      RowDatabase rows;
      rows.add_folders(arguments->results);
      bool fine = true;
      std::vector<Judged> verdicts;
      for (const Claim& claim : claims) {
        if (arguments->doctor)
          for (const std::string& wrong : rules_that_cannot_fail(claim, rows)) {
            fine = false;
            std::cout << claim.id << ": " << wrong << '\n';
          }
        verdicts.push_back(judge(claim, rows));
        fine = fine && (arguments->doctor || verdicts.back().verdict != Verdict::missing);
      }
      if (!arguments->doctor) write_claims(claims, verdicts, arguments->format, std::cout);
      return fine ? kDone : kNotMet;
    };
  });
}

}  // namespace

/// One variant on the shapes of experiments/questions/upkeep/conform.toml, with one thread and with all.
int conform(const std::string& variant, std::filesystem::path out, Session& session) {
  if (out.empty()) out = std::filesystem::path("results/local") / ("conform-" + variant);
  RunSettings settings{experiment_file("conform"), "quick", out, ""};
  settings.overrides.variants = {variant};
  settings.apart = Apart{"/proc/self/exe", {"cell"}, {}};
  std::ostringstream table;
  std::vector<std::vector<Json>> runs;
  int worst = kDone;
  for (const std::size_t threads : {std::size_t(1), std::size_t(2), std::size_t(7)}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    settings.out = out / (std::to_string(threads) + "-threads");
    std::filesystem::remove_all(settings.out);
    std::ostringstream another;
    worst = std::max(worst, run_experiment(settings, session.context, runs.empty() ? table : another));
    runs.push_back(read_rows(settings.out));
  }
  erase_progress_line();
  std::cout << table.str() << '\n';
  for (std::size_t i = 1; i < runs.size(); ++i) {
    const Comparison comparison = compare_rows(runs[0], runs[i], {.costs = false});
    if (comparison.fine()) continue;
    worst = kNotMet;
    std::cout << "Not the same bytes with one thread and with " << (i == 1 ? 2 : 7) << ":\n" << text(comparison, "md");
  }
  std::cout << (worst == kDone ? variant + " conforms: its promises hold on all shapes, and its bytes do not depend on the number of threads\n"
                               : variant + " does not conform: see what is in capitals, or differs, above\n");
  return worst;
}

void add_conform(CLI::App& app, Session& session) {
  struct Arguments {
    std::string variant;
    std::filesystem::path out;
  };
  CLI::App* command = add_command(app, session, "conform",
                                  "Whether a variant keeps its promises on awkward shapes, with the same bytes at any number "
                                  "of threads; if not, exit code 3");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("NAME", arguments->variant, "Extractor from `hermesh list`")->required();
  command->add_option("--out", arguments->out, "Folder for rows and meshes (default: results/local/conform-NAME)");
  command->callback([arguments, &session] {
    session.command = [arguments, &session] { return conform(arguments->variant, arguments->out, session); };
  });
}

/// What `hermesh run` starts for its cells; not for users.
void add_cell(CLI::App& app, Session& session) {
  CLI::App* command = add_command(app, session, "cell", "What `hermesh run` starts for its cells");
  command->group("");
  command->callback([&session] { session.command = [&session] { return serve_cells(session.context); }; });
}

void add_experiments(CLI::App& app, Session& session) {
  add_cell(app, session);
  add_conform(app, session);
  add_run(app, session);
  add_report(app, session);
  add_claims(app, session);
}

}  // namespace hermesh::cli
