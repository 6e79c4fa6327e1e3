#include "experiments/cli/pipeline/batch.h"

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

#include "algorithms/core/shown.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/format.h"
#include "experiments/cli/output_path.h"
#include "experiments/cli/pipeline/child_run.h"
#include "experiments/cli/pipeline/json_report.h"
#include "experiments/cli/signals.h"
#include "experiments/cli/terminal_progress.h"

namespace hermesh::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Options that are the batch's own; the others go to each process.
const std::set<std::string> kOwn = {"--threads", "--quiet", "--json",   "--log",          "--out-dir",
                                    "--pattern", "--jobs",  "--format", "--input-format", "--help"};

/// The options that were given, as words of a command line.
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

std::uint64_t size_of(const std::string& file) {
  std::error_code error;
  const std::uint64_t size = fs::file_size(file, error);
  return error ? 0 : size;
}

/// The lines of JSON: on the standard output, or in a file.
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
    // In one piece, so that no line is there by half, whenever this ends.
    else if (::write(file_, text.data(), text.size()) != ssize_t(text.size()))
      throw Error("cannot write '" + name_ + "': " + std::strerror(errno));
  }

 private:
  std::string name_;
  bool wanted_;
  int file_ = -1;
};

/// What became of one input, as its process told, or as its end tells where it told nothing.
Json told_by(const ChildRun& child, const BatchItem& item) {
  Json line = Json::parse(child.out(), nullptr, false);
  if (line.is_object() && line.contains("status")) return line;
  std::string why = child.err();
  while (why.ends_with('\n')) why.pop_back();
  why = why.substr(why.rfind('\n') + 1);
  if (child.signal() == SIGKILL)
    why = "the program was killed, most likely for want of memory: use larger voxels, or fewer --jobs";
  else if (child.signal() != 0)
    why = "the program crashed (" + std::string(strsignal(child.signal())) + "); please report this file";
  if (why.empty()) why = "the program ended with exit code " + std::to_string(child.exit_code());
  return {{"input", item.input},  {"output", item.output},
          {"status", "failed"},   {"exit_code", child.exit_code()},
          {"error", why},         {"seconds", 0.0},
          {"triangles", nullptr}, {"notes", Json::array()}};
}

std::string about(const std::string& input, const std::string& sentence) {
  return shown(sentence.find(input) == std::string::npos ? input + ": " + sentence : sentence, 1500, true);
}

class Batch {
 public:
  Batch(const CLI::App& command, const CommandFiles& files, const std::vector<BatchItem>& items,
        Session& session)
      : items_(items),
        session_(session),
        lines_(session),
        jobs_(std::min<std::size_t>(std::size_t(files.batch.jobs), items.size())) {
    words_.push_back(command.get_name());
    forward(command, words_);
    const int threads = session.threads.value_or(int(std::max(1u, std::thread::hardware_concurrency())));
    words_.push_back("--threads=" +
                     std::to_string(std::max(1, threads / int(std::max<std::size_t>(jobs_, 1)))));
    words_.insert(words_.end(), {"--json", "--quiet", "--"});
    for (const BatchItem& item : items) total_ += double(size_of(item.input)) + 1.0;
  }

  int run() {
    show_progress();
    for (std::size_t next = 0; next < items_.size() || !running_.empty();) {
      if (session_.context.cancelled()) stop();
      while (next < items_.size() && running_.size() < jobs_) start(next++);
      std::vector<ChildRun*> children;
      for (auto& [number, child] : running_) children.push_back(child.get());
      ChildRun::wait_for_any(children, 20);
      std::erase_if(running_, [&](const auto& entry) {
        if (!entry.second->has_ended()) return false;
        finish(items_[entry.first], *entry.second);
        return true;
      });
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
  }

  /// Ends all, and waits for that. @throws Cancelled
  [[noreturn]] void stop() {
    for (auto& [number, child] : running_) child->ask_to_end();
    running_.clear();
    throw Cancelled();
  }

  void finish(const BatchItem& item, const ChildRun& child) {
    const Json line = told_by(child, item);
    erase_progress_line();
    // What is wrong with the command line is so for all files.
    if (child.exit_code() == kUsage) throw UsageError(line.value("error", std::string("wrong usage")));
    lines_.add(line);
    if (session_.log) log(item, line);
    tell(item, line);
    bytes_done_ += double(size_of(item.input)) + 1.0;
    ++done_;
    show_progress();
  }

  void log(const BatchItem& item, const Json& line) {
    for (const Json& note : line["notes"])
      session_.log("note: " + about(item.input, note.get<std::string>()));
    session_.log(line["error"].is_string() ? "failed: " + about(item.input, line["error"].get<std::string>())
                                           : line["status"].get<std::string>() + ": " + item.input + ", " +
                                                 seconds_text(line["seconds"].get<double>()));
  }

  void tell(const BatchItem& item, const Json& line) {
    if (!session_.quiet)
      for (const Json& note : line["notes"])
        std::cerr << "note: " << about(item.input, note.get<std::string>()) << std::endl;
    const std::string status = line["status"];
    if (status == "failed") {
      ++failed_;
      std::cerr << "hermesh: "
                << about(item.input, line["error"].is_string() ? line["error"].get<std::string>() : "failed")
                << std::endl;
      return;
    }
    if (status != "done") ++unmet_;
    if (session_.quiet || session_.json) return;
    std::cout << item.input;
    if (!item.output.empty()) std::cout << " -> " << item.output;
    std::string said;
    if (line["triangles"].is_number())
      said += ", " + std::to_string(line["triangles"].get<std::uint64_t>()) + " triangles";
    said += ", " + seconds_text(line["seconds"].get<double>());
    std::cout << ": " << said.substr(2);
    if (const Json& result = line["result"]; result.contains("sentences"))
      for (const Json& sentence : result["sentences"]) std::cout << "; " << sentence.get<std::string>();
    if (const Json& result = line["result"]; result.contains("unmet_requirements"))
      for (const Json& name : result["unmet_requirements"])
        std::cout << "; required but not met: " << name.get<std::string>();
    std::cout << std::endl;
  }

  void show_progress() {
    session_.context.progress(std::to_string(done_) + " of " + std::to_string(items_.size()) + " files",
                              bytes_done_ / total_);
  }

  void summarise() {
    erase_progress_line();
    std::string line =
        std::to_string(items_.size() - failed_ - unmet_) + " of " + std::to_string(items_.size()) + " done";
    if (failed_ > 0) line += ", " + std::to_string(failed_) + " failed";
    if (unmet_ > 0) line += ", " + std::to_string(unmet_) + " did not meet what was required";
    if (session_.log) session_.log(line);
    // Where the standard output has lines of JSON, nothing else gets there.
    if (!session_.quiet) (session_.json ? std::cerr : std::cout) << line << std::endl;
  }

  const std::vector<BatchItem>& items_;
  Session& session_;
  LineFile lines_;
  std::size_t jobs_, done_ = 0, failed_ = 0, unmet_ = 0;
  double total_ = 0.0, bytes_done_ = 0.0;
  std::vector<std::string> words_;
  std::map<std::size_t, std::unique_ptr<ChildRun>> running_;
};

void check_output(const std::string& output, FileKind kind) {
  kind == FileKind::volume ? check_volume_output(output) : check_mesh_output(output);
}

}  // namespace

std::string place_of(const std::string& file) {
  std::error_code error;
  const fs::path place = fs::weakly_canonical(fs::absolute(file), error);
  return error ? file : place.string();
}

std::string output_name(const std::string& pattern, const std::string& input, std::size_t number,
                        std::size_t count) {
  const fs::path name = fs::path(input).filename();
  const std::size_t digits = std::to_string(count).size();
  std::string digits_text = std::to_string(number);
  digits_text.insert(0, digits - std::min(digits, digits_text.size()), '0');
  const std::map<std::string, std::string> words = {
      {"stem", without_ending(name)}, {"name", name.string()}, {"number", digits_text}};
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
    throw UsageError("--pattern must give names of files in --out-dir, without a folder, not '" + result +
                     "'");
  return result;
}

std::vector<BatchItem> batch_items(const std::vector<std::string>& inputs, const std::string& folder,
                                   const std::string& pattern) {
  std::vector<BatchItem> items;
  std::map<std::string, std::string> readers, writers;  // by place
  for (const std::string& input : inputs) {
    if (input == "-") throw UsageError("the standard input, -, cannot be one of many inputs");
    if (!readers.emplace(place_of(input), input).second)
      throw UsageError("'" + input + "' is named twice as an input");
  }
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    BatchItem item{inputs[i], ""};
    if (!folder.empty()) {
      item.output = (fs::path(folder) / output_name(pattern, inputs[i], i + 1, inputs.size())).string();
      const std::string place = place_of(item.output);
      if (const auto [other, is_new] = writers.emplace(place, inputs[i]); !is_new)
        throw UsageError("'" + other->second + "' and '" + inputs[i] + "' would both be written to '" +
                         item.output + "': tell them apart with --pattern, such as '{number}-" + pattern +
                         "'");
      if (const auto read = readers.find(place); read != readers.end())
        throw UsageError("'" + read->second +
                         "' is an input and would be overwritten; name another --out-dir or --pattern");
    }
    items.push_back(item);
  }
  return items;
}

bool is_batch(const CLI::App& command, const CommandFiles& files) {
  const BatchArguments& batch = files.batch;
  const bool given = !batch.out_dir.empty();
  if (files.output) {
    if (!given && !batch.more.empty())
      throw UsageError("one input and one output are expected, and '" + batch.more[0] +
                       "' is a third; many inputs need --out-dir");
    if (!given && files.output->empty()) throw UsageError("OUT is required, or --out-dir for many inputs");
  }
  const bool many = given || !batch.more.empty();
  if (!many && files.output)
    refuse_idle(command, {"--pattern", "--jobs"}, "there is no --out-dir for many inputs");
  if (!many && !files.output) refuse_idle(command, {"--jobs"}, "there is one input");
  return many;
}

int run_batch(const CLI::App& command, CommandFiles& files, Session& session) {
  std::vector<std::string> inputs = {*files.inputs[0]};
  // The second word is an input, too, where outputs go into a folder.
  if (files.output && !files.output->empty()) inputs.push_back(*files.output);
  inputs.insert(inputs.end(), files.batch.more.begin(), files.batch.more.end());
  if (!files.format.empty() || !files.input_format.empty())
    throw UsageError(
        "--format is about standard streams; the format of many outputs is told by --pattern, such as "
        "{stem}.obj");
  if (files.overwrite_input)
    throw UsageError("--overwrite-input has no effect: a batch never writes over its inputs");
  std::string pattern = files.batch.pattern;
  if (pattern.empty()) pattern = files.out == FileKind::volume ? "{stem}.vdb" : "{stem}.ply";
  const std::vector<BatchItem> items = batch_items(inputs, files.batch.out_dir, pattern);
  if (!files.batch.out_dir.empty()) {
    std::error_code error;
    fs::create_directories(files.batch.out_dir, error);
    if (error) throw Error("cannot make the folder '" + files.batch.out_dir + "': " + error.message());
    for (const BatchItem& item : items) check_output(item.output, files.out);
  }
  // From here on the batch itself ends when a signal comes, once all of its processes have.
  work_is_finished();
  return Batch(command, files, items, session).run();
}

}  // namespace hermesh::cli
