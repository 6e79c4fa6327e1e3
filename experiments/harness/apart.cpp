#include "experiments/harness/apart.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>

#include "algorithms/core/error.h"
#include "experiments/harness/failures.h"

namespace hermesh {

ApartOutcome run_apart(const Apart& apart, const Json& job, const std::function<void(const Json&)>& row,
                       RunContext& context) {
  ApartOutcome outcome;
  ChildProcess child(apart.program, apart.arguments);
  child.send(job.dump(-1, ' ', false, Json::error_handler_t::replace));
  ChildLimits limits = apart.limits;
  auto step = std::chrono::steady_clock::now();
  bool done = false;
  while (true) {
    // Progress is no sign that a step will end: the time runs from one step to the next.
    const std::chrono::duration<double> used = std::chrono::steady_clock::now() - step;
    if (apart.limits.seconds > 0) limits.seconds = std::max(1e-3, apart.limits.seconds - used.count());
    const auto line = child.receive(limits, context);
    if (!line) break;
    const Json answer = Json::parse(*line, nullptr, false);
    if (answer.is_discarded() || !answer.is_object()) continue;
    if (answer.contains("stage")) {
      context.progress(answer.at("stage").get<std::string>(), answer.value("fraction", 0.0));
      continue;
    }
    step = std::chrono::steady_clock::now();
    if (answer.contains("error")) {
      const std::string sentence = answer.at("error").get<std::string>();
      if (answer.value("missing", false)) throw DataMissing(sentence);
      if (answer.value("unreadable", false)) throw CaseUnreadable(sentence);
      throw Error(sentence);
    }
    if (answer.contains("note")) {
      const std::string note = answer.at("note").get<std::string>();
      if (std::ranges::find(context.notes, note) == context.notes.end()) context.note(note);
    }
    done = done || answer.contains("done");
    if (answer.contains("planned")) outcome.planned.push_back(answer.at("planned"));
    if (answer.contains("at")) outcome.culprit = answer.at("at").get<std::string>();
    if (answer.contains("row")) {
      outcome.rows.push_back(answer.at("row"));
      if (row) row(outcome.rows.back());
    }
  }
  outcome.reason = child.end();
  if (outcome.reason.empty() && !done) outcome.reason = "ended before it was done";
  // Where a step took several answers, receive() knows what was left of its time only.
  if (outcome.reason.starts_with("took longer than")) {
    char text[60];
    std::snprintf(text, sizeof text, "took longer than %g s", apart.limits.seconds);
    outcome.reason = text;
  }
  outcome.crashed = child.crashed();
  if (outcome.reason.empty()) outcome.culprit.clear();
  return outcome;
}

void Answers::send(const Json& answer) const {
  const std::string text = answer.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t written = write(descriptor_, text.data() + done, text.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return;  // nobody listens any more, and the end is near
    done += static_cast<std::size_t>(written);
  }
}

CellWatch Answers::watch() const {
  return {[*this](const Json& row) { send({{"planned", row}}); }, [*this](const std::string& label) { send({{"at", label}}); }};
}

}  // namespace hermesh
