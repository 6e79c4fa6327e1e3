#include "experiments/cli/batch.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <map>
#include <set>
#include <thread>

#include "algorithms/core/number_text.h"
#include "algorithms/core/shown.h"
#include "experiments/cli/child_run.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/signals.h"
#include "experiments/cli/terminal_progress.h"

namespace hermesh::cli {
namespace {

namespace fs = std::filesystem;

/// Options of the batch itself; the others are passed to each process.
const std::set<std::string> kOwn = {"--threads", "--quiet", "--json",   "--log",          "--out-dir",
                                    "--pattern", "--jobs",  "--format", "--input-format", "--help"};

/// Appends the given options as words of a command line.
void forward(const CLI::App& command, std::vector<std::string>& words) {
  for (const CLI::Option* option : command.get_options()) {
    if (option->count() == 0 || option->get_lnames().size() + option->get_snames().size() == 0) continue;
    const std::string name = option->get_name();
    if (kOwn.contains(name)) continue;
    const bool flag = option->get_items_expected_max() == 0;
    for (const std::string& value : option->results()) {
      words.push_back(flag || !name.starts_with("--") ? name : name + "=" + value);
      if (!flag && !name.starts_with("--")) words.push_back(value);
    }
  }
  // Groups of options are commands, too.
  for (const CLI::App* group : command.get_subcommands([](const CLI::App*) { return true; }))
    forward(*group, words);
}

std::string without_ending(fs::path name) {
  if (name.extension() == ".gz") name = name.stem();
  return name.stem().string();
}

/// Returns the weight of an input in the progress: its bytes, and one for each file.
double weight_of(const std::string& file) {
  std::error_code error;
  const std::uint64_t size = fs::file_size(file, error);
  return error ? 1.0 : double(size) + 1.0;
}

/// Writes lines of JSON to the standard output or a file.
class LineFile {
 public:
  explicit LineFile(const Session& session)
      : name_(session.json_file), wanted_(session.json || !name_.empty()) {
    if (name_.empty()) return;
    file_ = open(name_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (file_ < 0) throw Error("cannot write '" + name_ + "': " + std::strerror(errno));
  }
  ~LineFile() {
    if (file_ >= 0) close(file_);
  }
  LineFile(const LineFile&) = delete;
  LineFile& operator=(const LineFile&) = delete;

  void add(const Json& line) {
    if (!wanted_) return;
    const std::string text = json_text(line, -1);
    if (file_ < 0) std::cout << text << std::flush;
    // In one call, so that no partial line is left, whenever the process ends.
    else if (::write(file_, text.data(), text.size()) != ssize_t(text.size()))
      throw Error("cannot write '" + name_ + "': " + std::strerror(errno));
  }

 private:
  std::string name_;
  bool wanted_;
  int file_ = -1;
};

/// Returns the result of one input: the JSON line of its process, or its exit status if it printed none.
Json result_of(const ChildRun& child, const BatchItem& item) {
  Json line = Json::parse(child.out(), nullptr, false);
  if (line.is_object() && line.contains("status")) return line;
  std::string why = child.err();
  while (why.ends_with('\n')) why.pop_back();
  why = why.substr(why.rfind('\n') + 1);
  if (child.signal() == SIGKILL)
    why = "the program was killed, most likely for lack of memory: use larger voxels, or fewer --jobs";
  else if (child.signal() != 0)
    why = "the program crashed (" + std::string(strsignal(child.signal())) + "); please report this file";
  if (why.empty()) why = "the program ended with exit code " + std::to_string(child.exit_code());
  return {{"input", item.input},  {"output", item.output},
          {"status", "failed"},   {"exit_code", child.exit_code()},
          {"error", why},         {"seconds", 0.0},
          {"triangles", nullptr}, {"notes", Json::array()}};
}

/// Returns the message with the name of the input prepended, unless it already contains it.
std::string about(const std::string& input, const Json& message) {
  const std::string text = message;
  return shown(text.find(input) == std::string::npos ? input + ": " + text : text, 1500, true);
}

class Batch {
 public:
  Batch(const CLI::App& command, const CommandFiles& files, const std::vector<BatchItem>& items,
        Session& session)
      : items_(items),
        session_(session),
        lines_(session),
        jobs_(std::min<std::size_t>(std::size_t(files.jobs), items.size())) {
    words_.push_back(command.get_name());
    if (const CLI::Option* units = command.get_option_no_throw("--units"); units && units->count() > 0)
      unit_ = " " + units->as<std::string>();
    forward(command, words_);
    const int threads = session.threads.value_or(int(std::max(1u, std::thread::hardware_concurrency())));
    words_.push_back("--threads=" +
                     std::to_string(std::max(1, threads / int(std::max<std::size_t>(jobs_, 1)))));
    words_.insert(words_.end(), {"--json", "--quiet", "--"});
    for (const BatchItem& item : items) total_ += weight_of(item.input);
  }

  int run() {
    for (std::size_t next = 0; next < items_.size() || !running_.empty();) {
      if (session_.context.cancelled()) stop();
      while (next < items_.size() && running_.size() < jobs_) start(next++);
      std::vector<ChildRun*> children;
      for (auto& [number, child] : running_) children.push_back(child.get());
      ChildRun::wait_for_any(children, 20);
      const std::size_t ended = std::erase_if(running_, [&](const auto& entry) {
        if (!entry.second->has_ended()) return false;
        finish(items_[entry.first], *entry.second);
        return true;
      });
      if (ended > 0) show_progress();
    }
    summarise();
    return failed_ > 0 ? kFailed : unmet_ > 0 ? kNotMet : kDone;
  }

 private:
  void start(std::size_t number) {
    std::vector<std::string> words = words_;
    words.push_back(items_[number].input);
    if (!items_[number].output.empty()) words.push_back(items_[number].output);
    running_.emplace(number, std::make_unique<ChildRun>("/proc/self/exe", words));
    show_progress();
  }

  /// Ends all processes and waits for them. @throws Cancelled
  [[noreturn]] void stop() {
    for (auto& [number, child] : running_) child->ask_to_end();
    running_.clear();
    throw Cancelled();
  }

  void finish(const BatchItem& item, const ChildRun& child) {
    const Json line = result_of(child, item);
    erase_progress_line();
    // A wrong command line is wrong for all files.
    if (child.exit_code() == kUsage) throw UsageError(line.value("error", std::string("wrong usage")));
    lines_.add(line);
    report(item, line);
    bytes_done_ += weight_of(item.input);
    ++done_;
  }

  /// Logs and prints the result of one input.
  void report(const BatchItem& item, const Json& line) {
    const std::string status = line["status"], seconds = seconds_text(line["seconds"].get<double>());
    const bool failed = status == "failed";
    const std::string error = line["error"].is_string() ? about(item.input, line["error"]) : "";
    (failed ? failed_ : unmet_) += status != "done";
    for (const Json& note : line["notes"]) {
      if (session_.log) session_.log("note: " + about(item.input, note));
      if (!session_.quiet) std::cerr << "note: " << about(item.input, note) << std::endl;
    }
    if (session_.log)
      session_.log(error.empty() ? status + ": " + item.input + ", " + seconds : "failed: " + error);
    if (failed)
      std::cerr << "hermesh: " << (error.empty() ? about(item.input, "failed") : error) << std::endl;
    if (failed || session_.quiet || session_.json) return;
    std::cout << item.input << (item.output.empty() ? "" : " -> ") << item.output << ": ";
    if (line["triangles"].is_number()) std::cout << line["triangles"].get<std::uint64_t>() << " triangles, ";
    std::cout << seconds;
    const auto print_each = [&](const char* key, const char* before) {
      for (const Json& message : line["result"].value(key, Json::array()))
        std::cout << before << message.get<std::string>();
    };
    print_certified(line);
    print_each("sentences", "; ");
    print_each("unmet_requirements", "; required but not met: ");
    std::cout << std::endl;
  }

  /// Prints the certified distance of `remesh --error` and `--triangles`, with its exceptions.
  void print_certified(const Json& line) const {
    const Json figures = line.value("figures", Json::object());
    if (!figures.contains("certified_to_polygons")) return;
    std::cout << "; certified within "
              << text(std::max(figures["certified_to_polygons"].get<double>(),
                               figures["certified_from_polygons"].get<double>()))
              << unit_;
    if (figures.contains("hole_area")) std::cout << ", holes closed";
    if (const std::size_t balls = line["result"].value("exceptions", Json::array()).size(); balls > 0)
      std::cout << ", except in " << balls << (balls == 1 ? " ball" : " balls");
  }

  /// Reports the number of finished files, and the name of the one that has been processed longest.
  void show_progress() {
    std::string stage = std::to_string(done_) + " of " + std::to_string(items_.size()) + " files";
    if (!running_.empty())
      stage +=
          ", now " + shown(fs::path(items_[running_.begin()->first].input).filename().string(), 60, true);
    if (running_.size() > 1) stage += " and " + std::to_string(running_.size() - 1) + " more";
    session_.context.progress(stage, bytes_done_ / total_);
  }

  void summarise() {
    erase_progress_line();
    std::string line =
        std::to_string(items_.size() - failed_ - unmet_) + " of " + std::to_string(items_.size()) + " done";
    if (failed_ > 0) line += ", " + std::to_string(failed_) + " failed";
    if (unmet_ > 0) line += ", " + std::to_string(unmet_) + " did not meet what was required";
    if (session_.log) session_.log(line);
    // The standard output has only lines of JSON if these go there.
    if (!session_.quiet) (session_.json ? std::cerr : std::cout) << line << std::endl;
  }

  const std::vector<BatchItem>& items_;
  Session& session_;
  LineFile lines_;
  std::size_t jobs_, done_ = 0, failed_ = 0, unmet_ = 0;
  double total_ = 0.0, bytes_done_ = 0.0;
  std::vector<std::string> words_;
  std::string unit_;  ///< " mm", or empty if no unit is given
  std::map<std::size_t, std::unique_ptr<ChildRun>> running_;
};

}  // namespace

std::string output_name(const std::string& pattern, const std::string& input, std::size_t number,
                        std::size_t count) {
  const fs::path name = fs::path(input).filename();
  const std::size_t digits = std::to_string(count).size();
  std::string index = std::to_string(number);
  index.insert(0, digits - std::min(digits, index.size()), '0');
  const std::map<std::string, std::string> words = {
      {"stem", without_ending(name)}, {"name", name.string()}, {"number", index}};
  std::string result;
  for (std::size_t at = 0; at < pattern.size();) {
    if (pattern[at] != '{') {
      result += pattern[at++];
      continue;
    }
    const std::size_t end = pattern.find('}', at);
    const std::string word =
        end == std::string::npos ? pattern.substr(at) : pattern.substr(at + 1, end - at - 1);
    const auto found = words.find(word);
    if (end == std::string::npos || found == words.end())
      throw UsageError("--pattern knows {stem}, {name} and {number}, not '" + word + "'");
    result += found->second;
    at = end + 1;
  }
  if (result.empty() || result.find('/') != std::string::npos)
    throw UsageError("--pattern must give names of files in --out-dir, without a directory, not '" + result +
                     "'");
  return result;
}

std::vector<BatchItem> batch_items(const std::vector<std::string>& inputs, const std::string& directory,
                                   const std::string& pattern) {
  std::vector<BatchItem> items;
  std::map<std::string, std::string> readers, writers;  // by canonical path
  for (const std::string& input : inputs) {
    if (input == "-") throw UsageError("the standard input, -, cannot be one of many inputs");
    if (!readers.emplace(canonical_path(input), input).second)
      throw UsageError("'" + input + "' is named twice as an input");
  }
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    BatchItem item{inputs[i], ""};
    if (!directory.empty()) {
      item.output = (fs::path(directory) / output_name(pattern, inputs[i], i + 1, inputs.size())).string();
      const std::string path = canonical_path(item.output);
      if (const auto [other, is_new] = writers.emplace(path, inputs[i]); !is_new)
        throw UsageError("'" + other->second + "' and '" + inputs[i] + "' would both be written to '" +
                         item.output + "': distinguish them with --pattern, such as '{number}-" + pattern +
                         "'");
      if (const auto read = readers.find(path); read != readers.end())
        throw UsageError("'" + read->second +
                         "' is an input and would be overwritten; name another --out-dir or --pattern");
    }
    items.push_back(item);
  }
  return items;
}

bool is_batch(const CLI::App& command, const CommandFiles& files) {
  const bool given = !files.out_dir.empty();
  if (files.output) {
    if (!given && !files.more.empty())
      throw UsageError("one input and one output are expected, and '" + files.more[0] +
                       "' is a third; many inputs need --out-dir");
    if (!given && files.output->empty()) throw UsageError("OUT is required, or --out-dir for many inputs");
  }
  const bool many = given || !files.more.empty();
  if (!many && files.output)
    refuse_idle(command, {"--pattern", "--jobs"}, "there is no --out-dir for many inputs");
  if (!many && !files.output) refuse_idle(command, {"--jobs"}, "there is one input");
  return many;
}

int run_batch(const CLI::App& command, CommandFiles& files, Session& session) {
  std::vector<std::string> inputs = {*files.inputs[0]};
  // With an output directory the second word is an input, too.
  if (files.output && !files.output->empty()) inputs.push_back(*files.output);
  inputs.insert(inputs.end(), files.more.begin(), files.more.end());
  if (!files.format.empty() || !files.input_format.empty())
    throw UsageError(
        "--format concerns standard streams; --pattern gives the format of many outputs, such as "
        "{stem}.obj");
  if (const CLI::Option* certificate = command.get_option_no_throw("--certificate");
      certificate && certificate->count() > 0)
    throw UsageError("--certificate is a file for one output, and a batch has many");
  if (files.overwrite_input)
    throw UsageError("--overwrite-input has no effect: a batch never writes over its inputs");
  std::string pattern = files.pattern;
  if (pattern.empty()) pattern = files.out == FileKind::volume ? "{stem}.vdb" : "{stem}.ply";
  const std::vector<BatchItem> items = batch_items(inputs, files.out_dir, pattern);
  if (!files.out_dir.empty()) {
    std::error_code error;
    fs::create_directories(files.out_dir, error);
    if (error) throw Error("cannot make the directory '" + files.out_dir + "': " + error.message());
    for (const BatchItem& item : items)
      (files.out == FileKind::volume ? check_volume_output : check_mesh_output)(item.output);
  }
  // From here on a signal ends the batch after all of its processes have ended.
  work_is_finished();
  return Batch(command, files, items, session).run();
}

}  // namespace hermesh::cli
