#include "experiments/ledger/compare.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "experiments/harness/measure.h"
#include "experiments/harness/rows.h"
#include "experiments/harness/table.h"
#include "experiments/ledger/rank_test.h"
#include "experiments/ledger/value_class.h"

namespace hermesh {
namespace {

/// Below this a floating-point value cannot become worse, in the unit of its column: a millionth of a voxel
/// is what single precision leaves of a point.
constexpr double kFloor = 1e-6;
/// Times of a cell: which p counts as a change, and how large a change matters.
constexpr double kLargestP = 0.01, kSlower = 1.1;
constexpr std::size_t kFewestRepetitions = 5;
/// Memory: the system counts in pages, and allocators ask for more than they are asked for.
constexpr double kMoreMemory = 1.2, kLeastMebibytes = 1.0;

using State = CellVerdict::State;

// ---- Cells.

struct Cell {
  std::string place;   ///< all but the labels
  std::string labels;  ///< of the voxelizer and the variant
  std::string which;   ///< of several rows that agree in both
  Json row;

  std::string name() const { return place + labels + which; }
};

Cell cell_of(Json row) {
  Cell cell;
  cell.place = text_at(row, "/experiment");
  if (const std::string tier = text_at(row, "/tier"); !tier.empty()) cell.place += ", " + tier;
  cell.place += ": " + text_at(row, "/case/name");
  const std::string size = find(row, "/resolution") ? "/resolution" : "/nominal_voxel_size";
  for (const std::string& part : {size, std::string("/values/resolution"), std::string("/sweep/value")})
    if (const std::string text = text_at(row, part); !text.empty())
      cell.place += " / " + (part == "/sweep/value" ? text_at(row, "/sweep/parameter") + " " : "") + text;
  for (const char* part : {"/voxelization/label", "/variant/label"})
    if (const std::string text = text_at(row, part); !text.empty()) cell.labels += " / " + text;
  cell.row = std::move(row);
  return cell;
}

bool is_cost(ValueClass value_class) {
  return value_class == ValueClass::kTime || value_class == ValueClass::kMemory ||
         value_class == ValueClass::kDerived;
}

/// The values of a column where each row has another one, otherwise nothing.
std::set<std::string> distinct_values(const std::vector<Cell*>& cells, const Column& column) {
  std::set<std::string> values;
  for (const Cell* cell : cells)
    if (const Json* value = find(cell->row, column.pointer)) values.insert(value->dump());
  return values.size() == cells.size() ? values : std::set<std::string>();
}

/// Rows of one name get the value of the column that tells most of them apart on both sides; where there is
/// no such column, their number.
void tell_apart(std::vector<Cell*>& before, std::vector<Cell*>& after) {
  if (before.size() <= 1 && after.size() <= 1) return;
  std::optional<Column> axis;
  std::size_t most = 0;
  const Json& first = (before.empty() ? after : before).front()->row;
  for (const Column& column : own_columns(first)) {
    const Json* value = find(first, column.pointer);
    if (!value || is_cost(class_of(column, *value, first))) continue;
    const std::set<std::string> ours = distinct_values(before, column),
                                theirs = distinct_values(after, column);
    std::vector<std::string> both;
    std::ranges::set_intersection(ours, theirs, std::back_inserter(both));
    if (both.size() > most) axis = column, most = both.size();
  }
  for (std::vector<Cell*>* cells : {&before, &after})
    for (std::size_t i = 0; i < cells->size(); ++i) {
      Cell& cell = *(*cells)[i];
      cell.which =
          axis ? " / " + axis->name + " " + text_at(cell.row, axis->pointer) : " #" + std::to_string(i + 1);
    }
}

void tell_apart(std::vector<Cell>& before, std::vector<Cell>& after) {
  std::map<std::string, std::array<std::vector<Cell*>, 2>> named;
  for (Cell& cell : before) named[cell.name()][0].push_back(&cell);
  for (Cell& cell : after) named[cell.name()][1].push_back(&cell);
  for (auto& [name, cells] : named) tell_apart(cells[0], cells[1]);
}

bool same_at(const Json& a, const Json& b, const std::string& place) {
  return text_at(a, place) == text_at(b, place);
}

bool same_machine(const Json& a, const Json& b) {
  return find(a, "/machine/cpu") && same_at(a, b, "/machine/cpu") && same_at(a, b, "/machine/cores") &&
         same_at(a, b, "/threads");
}

std::vector<double> repetitions_at(const Json& row, const std::string& place) {
  const Json* all = find(row, place + "/all");
  return all ? all->get<std::vector<double>>() : std::vector<double>();
}

/// Gives each cell the repetitions of all rows of its name that were made on its machine.
void pool(std::vector<Cell>& cells, const std::vector<Json>& rows) {
  std::map<std::string, std::vector<const Json*>> runs;
  for (const Json& row : rows) runs[cell_of(row).name()].push_back(&row);
  for (Cell& cell : cells)
    for (const std::string place : {"/seconds", "/voxelization/seconds"}) {
      std::vector<double> all, medians;
      for (const Json* row : runs[cell.name()]) {
        const std::vector<double> own = repetitions_at(*row, place);
        if (!same_machine(*row, cell.row) || own.empty()) continue;
        all.insert(all.end(), own.begin(), own.end());
        medians.push_back(median(own));
      }
      if (all.empty() || repetitions_at(cell.row, place).empty()) continue;
      Json& seconds = cell.row[Json::json_pointer(place)];
      seconds["median"] = median(all);
      seconds["repetitions"] = all.size();
      seconds["all"] = all;
      seconds["medians_of_runs"] = medians;
    }
}

std::vector<Cell> cells_of(const std::vector<Json>& rows, bool pooled) {
  std::vector<Cell> cells;
  for (RowGroup& group : latest_groups(rows))
    for (Json& row : group.rows) cells.push_back(cell_of(std::move(row)));
  if (pooled) pool(cells, rows);
  return cells;
}

// ---- Values.

/// A value of a row that is no column.
Column at(const std::string& place) { return {place.substr(1), "", "", place}; }

std::string number(double value) {
  std::array<char, 32> digits{};
  std::snprintf(digits.data(), digits.size(), "%.6g", value);
  return digits.data();
}

std::string shown(const Json& value) {
  if (value.is_number_float()) return number(value.get<double>());
  return value.is_string() ? value.get<std::string>() : value.dump();
}

std::string percent(double from, double to) {
  if (from == 0.0) return "";
  std::array<char, 32> digits{};
  std::snprintf(digits.data(), digits.size(), " (%+.1f %%)", 100.0 * (to - from) / std::abs(from));
  return digits.data();
}

/// What was not compared, with the number of cells.
class Notes {
 public:
  void add(const std::string& note) {
    if (++counts_[note] == 1) order_.push_back(note);
  }
  std::vector<std::string> all() const {
    std::vector<std::string> result;
    for (const std::string& note : order_) {
      const std::size_t count = counts_.at(note);
      result.push_back(note + " (" + std::to_string(count) + (count == 1 ? " cell)" : " cells)"));
    }
    return result;
  }

 private:
  std::map<std::string, std::size_t> counts_;
  std::vector<std::string> order_;
};

/// Compares the two rows of a cell.
class Judge {
 public:
  Judge(const Json& before, const Json& after, const CompareSettings& settings, bool first_of_grid,
        CellVerdict& verdict, Notes& notes)
      : before_(before),
        after_(after),
        settings_(settings),
        first_of_grid_(first_of_grid),
        verdict_(verdict),
        notes_(notes) {}

  void judge() {
    if (!inputs()) return;
    asked_for();
    if (!failures()) return;
    promises();
    for (const char* place : {"/digest", "/voxelization/digest"}) exact(at(place));
    if (find(before_, "/measurement")) {
      measured();
    } else {
      for (const Column& each : all_columns())
        if (each.name != "options" && each.name != "promises") column(each);
      if (find(before_, "/report") && find(after_, "/report"))
        counts(before_["report"], after_["report"], "/report");
    }
  }

 private:
  void regression(const std::string& sentence) { verdict_.regressions.push_back(sentence); }
  void better(const std::string& sentence) { verdict_.better.push_back(sentence); }
  void otherwise(const std::string& what, const std::string& was, const std::string& is) {
    regression(what + " was " + (was.empty() ? "nothing" : was) + ", now " + (is.empty() ? "nothing" : is));
  }

  /// False where the cells are about different inputs.
  bool inputs() {
    if (find(before_, "/case/sha256") && find(after_, "/case/sha256") &&
        !same_at(before_, after_, "/case/sha256")) {
      regression("the input is another: " + text_at(before_, "/case/origin") + " " +
                 text_at(before_, "/case/sha256").substr(0, 12) + ", now " + text_at(after_, "/case/origin") +
                 " " + text_at(after_, "/case/sha256").substr(0, 12));
      return false;
    }
    const Json *ours = find(before_, "/inputs"), *theirs = find(after_, "/inputs");
    if (!ours || !theirs) return true;
    for (const Json& input : *ours)
      for (const Json& other : *theirs)
        if (text_at(input, "/name") == text_at(other, "/name") && !same_at(input, other, "/sha256")) {
          regression("the input " + text_at(input, "/name") + " is another");
          return false;
        }
    return true;
  }

  /// What was to be done: options, and how thoroughly it is judged.
  void asked_for() {
    for (const char* place :
         {"/variant/name", "/voxelization/name", "/voxel_size", "/samples", "/band/exterior",
          "/band/interior", "/judged_by/signs", "/judged_by/solid", "/measurement/name", "/measurement/seed"})
      if (find(before_, place) && find(after_, place) && !same_at(before_, after_, place))
        otherwise(std::string(place).substr(1), text_at(before_, place), text_at(after_, place));
    for (const char* place : {"/variant/options", "/voxelization/options", "/measurement/parameters"}) {
      const auto ours = options_in(text_at(before_, place)), theirs = options_in(text_at(after_, place));
      for (const auto& [option, value] : ours) {
        if (option == "repetitions" || option == "pixels") continue;  // of the times and the pictures
        const auto now = theirs.find(option);
        if (now == theirs.end())
          notes_.add("the baseline alone has the option " + option);
        else if (now->second != value)
          otherwise("the option " + option, value, now->second);
      }
      for (const auto& [option, value] : theirs)
        if (!ours.contains(option)) notes_.add("the candidate alone has the option " + option);
    }
  }

  /// False where one of the two failed, so that there is nothing else to compare.
  bool failures() {
    const bool failed = find(before_, "/failed"), fails = find(after_, "/failed");
    ++verdict_.compared;
    if (!failed && !fails) return true;
    if (!failed)
      regression("fails: " + text_at(after_, "/failed"));
    else if (!fails)
      better("no longer fails; it did with: " + text_at(before_, "/failed"));
    else if (!same_at(before_, after_, "/failed"))
      notes_.add("fails as before, with another sentence");
    return false;
  }

  static std::set<std::string> sentences_at(const Json& row, const std::string& place) {
    std::set<std::string> sentences;
    const Json* found = find(row, place);
    if (!found || *found == false) return sentences;
    if (!found->is_array()) return {found->is_string() ? found->get<std::string>() : std::string()};
    for (const Json& sentence : *found) sentences.insert(sentence.get<std::string>());
    return sentences;
  }

  /// Sentences that say what a row lacks may become fewer, but not more or others.
  void promises() {
    for (const auto& [place, what] : {std::pair("/broken", "broken: "),
                                      {"/unchecked", "no longer checked: the promise of "},
                                      {"/disagreements", "disagreement of the judges: "},
                                      {"/not_judged", "not judged: "},
                                      {"/repetitions_differ", "repetitions differ from each other"}}) {
      const std::set<std::string> ours = sentences_at(before_, place), theirs = sentences_at(after_, place);
      ++verdict_.compared;
      for (const std::string& sentence : theirs)
        if (!ours.contains(sentence)) regression(what + sentence);
      for (const std::string& sentence : ours)
        if (!theirs.contains(sentence))
          better("no longer " + (sentence.empty() ? what : std::string(place + 1) + ": " + sentence));
    }
    if (find(before_, "/variant/promises") && find(after_, "/variant/promises"))
      exact(at("/variant/promises"));
    // The letters say once more whether something broke, which is judged above where that was so before.
    if (sentences_at(before_, "/broken").empty() && sentences_at(before_, "/unchecked").empty())
      exact(at("/promise_letters"));
  }

  void measured() {
    std::vector<Column> columns = own_columns(before_);
    for (const Column& theirs : own_columns(after_))
      if (std::ranges::find(columns, theirs.name, &Column::name) == columns.end()) columns.push_back(theirs);
    for (const Column& each : columns) column(each);
  }

  /// False where one side has no value, of which it says what it means. A value that is there but is no
  /// number any more (not finite, or asked for and not to be had) is a change; one of which the rows know
  /// nothing is not.
  bool both_have(const Column& column) {
    const Json *ours = find(before_, column.pointer), *theirs = find(after_, column.pointer);
    if (ours && theirs) return true;
    if (ours && after_.contains(Json::json_pointer(column.pointer)))
      otherwise(column.name, shown(value_of(column, before_)), "");
    else if (ours || theirs)
      notes_.add(std::string("the ") + (ours ? "baseline" : "candidate") + " alone has " + column.name);
    return false;
  }

  void exact(const Column& column) {
    if (!both_have(column)) return;
    ++verdict_.compared;
    const Json &ours = *find(before_, column.pointer), &theirs = *find(after_, column.pointer);
    if (ours == theirs) return;
    const auto failed = [](const Json& value) {
      return value.is_string() && value.get<std::string>().starts_with("failed");
    };
    if (failed(ours) && failed(theirs))
      notes_.add("fails as before, with another sentence");
    else if (failed(ours))
      better(column.name + " is no longer: " + shown(ours));
    else
      otherwise(column.name, shown(value_of(column, before_)), shown(value_of(column, after_)));
  }

  void error(const Column& column) {
    if (!both_have(column)) return;
    const Json ours = value_of(column, before_), theirs = value_of(column, after_);
    if (!ours.is_number() || !theirs.is_number()) return exact(column);
    const double was = ours.get<double>(), is = theirs.get<double>();
    const Worse worse = worse_of(column);
    if (is_count(column, was) && is_count(column, is)) return exact(column);
    ++verdict_.compared;
    const double allowed = std::max(kFloor, settings_.tolerance * std::abs(was));
    const double worse_by = worse == Worse::kLarger    ? is - was
                            : worse == Worse::kSmaller ? was - is
                                                       : std::abs(is - was);
    const std::string sentence =
        column.name + " was " + number(was) + ", now " + number(is) + percent(was, is);
    if (worse_by > allowed)
      regression(sentence);
    else if (worse != Worse::kEither && -worse_by > allowed)
      better(sentence);
  }

  void slope(const Column& column) {
    const std::string folder = column.pointer.substr(0, column.pointer.size() - column.name.size());
    const auto interval = [&](const Json& row) {
      return std::pair(number_at(row, folder + lower_bound_of(column.name)),
                       number_at(row, folder + upper_bound_of(column.name)));
    };
    const auto [low_was, high_was] = interval(before_);
    const auto [low, high] = interval(after_);
    ++verdict_.compared;
    if (low <= high_was && low_was <= high) return;
    const auto text = [&](const Json& row, double from, double to) {
      return number(number_at(row, column.pointer)) + " (" + number(from) + " to " + number(to) + ")";
    };
    otherwise(column.name, text(before_, low_was, high_was), text(after_, low, high));
  }

  bool costs_count(const std::string& what) {
    if (!settings_.costs) return false;
    if (same_machine(before_, after_)) return true;
    notes_.add(what + " not compared: other machine");
    return false;
  }

  /// Whether all runs of one side are faster than all of the other. Repetitions of a run share what else the
  /// machine did then, so that those of pooled runs are not independent, as the test has it.
  bool runs_are_apart(const std::string& place) const {
    const Json *ours = find(before_, place + "/medians_of_runs"),
               *theirs = find(after_, place + "/medians_of_runs");
    if (!ours || !theirs) return true;
    const auto [fastest, slowest] = std::ranges::minmax(ours->get<std::vector<double>>());
    const auto [fastest_now, slowest_now] = std::ranges::minmax(theirs->get<std::vector<double>>());
    return slowest < fastest_now || slowest_now < fastest;
  }

  void time(const Column& column) {
    const std::string end = "/median";
    if (!column.pointer.ends_with("seconds" + end)) {
      if (settings_.costs && find(before_, column.pointer))
        notes_.add(column.name + " not compared: no repetitions");
      return;
    }
    const std::string place = column.pointer.substr(0, column.pointer.size() - end.size());
    const std::vector<double> ours = repetitions_at(before_, place), theirs = repetitions_at(after_, place);
    if (ours.empty() && theirs.empty()) return;
    if (!costs_count(column.name)) return;
    if (std::min(ours.size(), theirs.size()) < kFewestRepetitions)
      return notes_.add(column.name + " not compared: too few repetitions");
    ++verdict_.compared;
    const double was = median(ours), is = median(theirs), p = rank_test(theirs, ours).p;
    if (p >= kLargestP || was <= 0.0 || is <= 0.0) return;
    if (std::max(was, is) > kSlower * std::min(was, is) && !runs_are_apart(place))
      return notes_.add(column.name + " not told: the runs of a side differ more than the sides");
    const std::string sentence = column.name + " was " + number(was) + " s, now " + number(is) + " s" +
                                 percent(was, is) + ", p = " + number(p) + " over " +
                                 std::to_string(ours.size()) + " and " + std::to_string(theirs.size()) +
                                 " repetitions";
    if (is / was > kSlower)
      regression(sentence);
    else if (was / is > kSlower)
      better(sentence);
  }

  void memory(const Column& column) {
    if (!find(before_, column.pointer) && !find(after_, column.pointer)) return;
    if (!costs_count(column.name) || !both_have(column)) return;
    const Json ours = value_of(column, before_), theirs = value_of(column, after_);
    if (!ours.is_number() || !theirs.is_number()) return;
    ++verdict_.compared;
    const double was = ours.get<double>(), is = theirs.get<double>();
    const std::string sentence =
        column.name + " was " + number(was) + " MiB, now " + number(is) + " MiB" + percent(was, is);
    if (is > kMoreMemory * was && is - was > kLeastMebibytes)
      regression(sentence);
    else if (was > kMoreMemory * is && was - is > kLeastMebibytes)
      better(sentence);
  }

  void column(const Column& column) {
    const Json *ours = find(before_, column.pointer), *theirs = find(after_, column.pointer);
    const auto class_in = [&](const Json* value, const Json& row) {
      return class_of(column, value ? *value : Json(), row);
    };
    // What is a whole number on one side alone is a number.
    const ValueClass before = class_in(ours ? ours : theirs, before_),
                     after = class_in(theirs ? theirs : ours, after_);
    const ValueClass value_class = before == after ? before : ValueClass::kError;
    if (is_cost(value_class) && column.pointer.starts_with("/voxelization/") && !first_of_grid_)
      return;  // told with the first of the meshes that were made of the grid
    switch (value_class) {
      case ValueClass::kExact:
        return exact(column);
      case ValueClass::kError:
        return error(column);
      case ValueClass::kSlope:
        return slope(column);
      case ValueClass::kTime:
        return time(column);
      case ValueClass::kMemory:
        return memory(column);
      case ValueClass::kDerived:
        return;
    }
  }

  /// All whole numbers and truth values of a report, those of columns included: that is cheap, and tells
  /// where to look.
  void counts(const Json& ours, const Json& theirs, const std::string& place) {
    for (const auto& [key, value] : ours.items()) {
      const bool is_column =
          std::ranges::find(all_columns(), place + "/" + key, &Column::pointer) != all_columns().end();
      // How many samples there are follows from the points; libraries only confirm, and disagreements are
      // told.
      if (is_column || key == "libraries" || key == "samples") continue;
      if (value.is_object() && theirs.contains(key) && theirs[key].is_object())
        counts(value, theirs[key], place + "/" + key);
      else if (value.is_number_integer() || value.is_boolean())
        exact(at(place + "/" + key));
    }
  }

  const Json &before_, &after_;
  const CompareSettings& settings_;
  const bool first_of_grid_;
  CellVerdict& verdict_;
  Notes& notes_;
};

std::string digest_of(const Json& row) {
  const std::string digest = text_at(row, "/digest");
  return digest.empty() ? text_at(row, "/values/digest") : digest;
}

/// The names and options of what made a row; empty where the row does not say.
std::string made_by(const Json& row) {
  if (find(row, "/measurement")) return {};
  std::string made;
  for (const char* place :
       {"/variant/name", "/variant/options", "/voxelization/name", "/voxelization/options"})
    made += text_at(row, place) + "\n";
  return made;
}

using CellsByName = std::map<std::string, const Cell*>;

/// The new cell that a missing one has become, if there is one.
const Cell* renamed(const Cell& missing, const CellsByName& added) {
  for (const auto key : {made_by, digest_of})
    for (const auto& [name, cell] : added)
      if (cell->place == missing.place && cell->which == missing.which && !key(missing.row).empty() &&
          key(missing.row) == key(cell->row))
        return cell;
  return nullptr;
}

std::string trimmed(std::string labels) { return labels.starts_with(" / ") ? labels.substr(3) : labels; }

}  // namespace

std::size_t Comparison::count(State state) const {
  return std::size_t(std::ranges::count(cells, state, &CellVerdict::state));
}

bool Comparison::is_regression(const CellVerdict& cell) const {
  const bool gone = cell.state == State::kMissing || cell.state == State::kRenamed;
  return !cell.regressions.empty() || (gone && !settings.allow_missing);
}

std::size_t Comparison::regressions() const {
  return std::size_t(
      std::ranges::count_if(cells, [&](const CellVerdict& cell) { return is_regression(cell); }));
}

bool Comparison::fine() const {
  return regressions() == 0 &&
         std::ranges::any_of(cells, [](const CellVerdict& cell) { return cell.compared > 0; });
}

Comparison compare_rows(const std::vector<Json>& baseline, const std::vector<Json>& candidate,
                        const CompareSettings& settings) {
  std::vector<Cell> before = cells_of(baseline, settings.pool), after = cells_of(candidate, settings.pool);
  tell_apart(before, after);
  CellsByName added;
  for (const Cell& cell : after) added[cell.name()] = &cell;
  std::vector<const Cell*> partners;
  for (const Cell& cell : before) {
    const auto found = added.find(cell.name());
    partners.push_back(found == added.end() ? nullptr : found->second);
    if (found != added.end()) added.erase(found);
  }
  Comparison result;
  result.settings = settings;
  Notes notes;
  std::set<std::string> grids;  // whose times and memory were compared
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Cell& cell = before[i];
    CellVerdict verdict;
    verdict.cell = cell.name();
    const Cell* partner = partners[i];
    if (!partner) {
      partner = renamed(cell, added);
      verdict.state = partner ? State::kRenamed : State::kMissing;
      if (partner) {
        verdict.label = trimmed(partner->labels);
        added.erase(partner->name());
      }
    }
    if (partner) {
      const bool first = grids.insert(cell.place + text_at(cell.row, "/voxelization/label")).second;
      Judge(cell.row, partner->row, settings, first, verdict, notes).judge();
    }
    result.cells.push_back(std::move(verdict));
  }
  for (const Cell& cell : after)
    if (added.contains(cell.name())) {
      CellVerdict verdict;
      verdict.cell = cell.name();
      verdict.state = State::kNew;
      result.cells.push_back(std::move(verdict));
    }
  result.notes = notes.all();
  return result;
}

}  // namespace hermesh
