#include "experiments/cli/pipeline/log_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <ctime>

#include "algorithms/core/shown.h"
#include "experiments/cli/format.h"

namespace hermesh::cli {
namespace {

std::string time_now() {
  const auto now = std::chrono::system_clock::now();
  const std::time_t seconds = std::chrono::system_clock::to_time_t(now);
  const auto milliseconds =
      std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count() % 1000;
  std::tm parts = {};
  gmtime_r(&seconds, &parts);
  char date[32], text[40];
  std::strftime(date, sizeof date, "%Y-%m-%dT%H:%M:%S", &parts);
  std::snprintf(text, sizeof text, "%s.%03dZ", date, int(milliseconds));
  return text;
}

}  // namespace

LogFile::LogFile(Session& session, const std::string& path, const std::string& command_line)
    : session_(session) {
  file_ = open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  if (file_ < 0) throw Error("cannot write the log '" + path + "': " + std::strerror(errno));
  line("hermesh " + session.version + ": " + command_line);
  session.log = [this](const std::string& text) { line(text); };
  session.context.on_progress = [this, shown_before = session.context.on_progress](std::string_view stage,
                                                                                   double fraction) {
    if (shown_before) shown_before(stage, fraction);
    if (fraction >= 1.0 && !session_.context.stage_seconds.empty() &&
        stage.ends_with(session_.context.stage_seconds.back().first)) {
      line("end of stage '" + std::string(stage) + "', " +
           seconds_text(session_.context.stage_seconds.back().second));
      stage_.clear();
    } else if (stage != stage_) {
      stage_ = stage;
      line("stage '" + stage_ + "'");
    }
  };
}

LogFile::~LogFile() {
  add_notes();
  session_.log = nullptr;
  session_.context.on_progress = nullptr;
  close(file_);
}

void LogFile::write_line(const std::string& text) {
  const std::string all = time_now() + " " + shown(session_.named(text), 4000, true) + "\n";
  // A log that cannot be written must not end the work; the next line is tried again.
  [[maybe_unused]] const ssize_t written = write(file_, all.data(), all.size());
}

void LogFile::line(const std::string& text) {
  add_notes();
  write_line(text);
}

void LogFile::add_notes() {
  for (; notes_ < session_.context.notes.size(); ++notes_)
    write_line("note: " + session_.context.notes[notes_]);
}

}  // namespace hermesh::cli
