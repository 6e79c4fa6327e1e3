#include "experiments/ledger/claims.h"

#include <toml++/toml.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <nlohmann/json.hpp>
#include <ostream>
#include <regex>
#include <set>

#include "algorithms/core/error.h"
#include "experiments/harness/toml_section.h"

namespace hermesh {
namespace {

/// A value of the file as JSON: a number, a text, or a table of these.
Json json_of(const toml::node& node) {
  if (const auto* table = node.as_table()) {
    Json json = Json::object();
    for (const auto& [key, value] : *table) json[std::string(key.str())] = json_of(value);
    return json;
  }
  if (const auto* whole = node.as_integer()) return whole->get();
  if (const auto* number = node.as_floating_point()) return number->get();
  if (const auto* text = node.as_string()) return text->get();
  return nullptr;
}

std::vector<std::string> texts(const toml::table& table, const std::string& key, const Section& section) {
  std::vector<std::string> list;
  const toml::node* const node = table.get(key);
  if (!node) return list;
  if (const auto* one = node->as_string()) return {one->get()};
  const toml::array* const array = node->as_array();
  if (!array) section.fail_at(key, "\"" + key + "\" must be a text or a list of texts");
  for (const toml::node& each : *array) {
    if (!each.is_string()) section.fail_at(key, "\"" + key + "\" must be a list of texts");
    list.push_back(each.as_string()->get());
  }
  return list;
}

Claim claim_of(const std::string& file, const toml::table& table) {
  const Section section(file, table, "[[claim]]",
                        {"id", "place", "says", "kind", "printed", "ours", "reproduced", "shape", "tests", "passed",
                         "doctored", "why", "untestable"});
  Claim claim;
  claim.line = static_cast<int>(section.line());
  claim.id = section.text("id");
  claim.place = section.text("place");
  claim.says = section.text("says");
  claim.kind = section.text("kind");
  if (claim.kind != "measured" && claim.kind != "exact" && claim.kind != "seen" && claim.kind != "untestable")
    section.fail_at("kind", "\"kind\" must be measured, exact, seen or untestable");
  if (const toml::node* printed = table.get("printed")) claim.printed = json_of(*printed);
  claim.ours = section.text_or("ours", "");
  claim.reproduced = section.text_or("reproduced", "");
  claim.shape = section.text_or("shape", "");
  claim.tests = texts(table, "tests", section);
  claim.passed = section.text_or("passed", "reproduced");
  claim.doctored = texts(table, "doctored", section);
  claim.why = texts(table, "why", section);
  claim.untestable = section.text_or("untestable", "");
  const bool decided = !claim.ours.empty() || !claim.tests.empty();
  if ((claim.kind == "untestable") != !claim.untestable.empty() || decided != claim.untestable.empty())
    section.fail(section.line(), "the claim " + claim.id +
                                     " needs a rule (\"ours\" or \"tests\"), or is of the kind untestable and says why");
  if (!claim.ours.empty() && claim.reproduced.empty() && claim.shape.empty())
    section.fail_at("ours", "the claim " + claim.id + " has no condition: \"reproduced\" or \"shape\"");
  if (!claim.ours.empty() && claim.doctored.empty())
    section.fail_at("ours", "the claim " + claim.id + " has no \"doctored\" row that changes its verdict");
  if (claim.passed != "reproduced" && claim.passed != "shape reproduced" && claim.passed != "contradicted")
    section.fail_at("passed", "\"passed\" must be a verdict: reproduced, shape reproduced or contradicted");
  return claim;
}

Verdict verdict_named(const std::string& name) {
  return name == "reproduced" ? Verdict::reproduced : name == "contradicted" ? Verdict::contradicted : Verdict::shape;
}

/// Whether all tests have passed; else what is missing is said.
bool tests_passed(const Claim& claim, const RowDatabase& rows, Judged& judged) {
  for (const std::string& test : claim.tests) {
    const auto row = rows.first_row("SELECT passed FROM tests WHERE label = :test", {{"test", test}});
    if (row.empty()) judged.reason = "there is no row of the test " + test;
    else if (row[0].second != 1) judged.reason = "the test " + test + " failed";
    if (!judged.reason.empty()) return false;
  }
  return true;
}

/// Warnings about the rows that a query reads.
void warn_of_rows(const std::string& query, const RowDatabase& rows, std::vector<std::string>& warnings) {
  for (const std::string& table : rows.tables_in(query)) {
    const auto count = [&](const std::string& condition) {
      return rows.first_row("SELECT count(*) FROM \"" + table + "\" WHERE " + condition)[0].second.get<int>();
    };
    if (count("dirty IS NOT 0") > 0) warnings.push_back(table + " has rows of a tree with changes");
    if (count("stand_in = 1") > 0) warnings.push_back(table + " has rows of stand-ins");
    if (std::ranges::find(rows.tables(), "stale") != rows.tables().end() &&
        !rows.first_row("SELECT 1 FROM stale WHERE label = :table AND differing > 0", {{"table", table}}).empty())
      warnings.push_back(table + " has rows that the program no longer makes");
  }
}

bool holds(const std::string& condition, const Claim& claim, const RowDatabase& rows) {
  if (condition.empty()) return false;
  std::map<std::string, Json> bound;
  std::string columns;
  if (claim.printed.is_object()) {
    for (const auto& [key, value] : claim.printed.items()) {
      bound["printed_" + key] = value;
      columns += ", :printed_" + key + " AS printed_" + key;
    }
  } else {
    bound["printed"] = claim.printed;
    columns = ", :printed AS printed";
  }
  const auto row = rows.first_row("SELECT (" + condition + ") FROM (SELECT ours.*" + columns + " FROM (" + claim.ours +
                                      ") AS ours LIMIT 1)",
                                  bound);
  return !row.empty() && row[0].second.is_number() && row[0].second.get<double>() != 0.0;
}

Judged judge_by_rows(const Claim& claim, const RowDatabase& rows) {
  Judged judged;
  judged.figures = rows.first_row(claim.ours);
  if (judged.figures.empty()) {
    judged.reason = "there is no such row of";
    for (const std::string& table : rows.tables_in(claim.ours)) judged.reason += " " + table;
  }
  for (const auto& [name, value] : judged.figures)
    if (value.is_null() && judged.reason.empty()) {
      judged.reason = "the rows do not have " + name + ":";
      for (const std::string& table : rows.tables_in(claim.ours)) judged.reason += " " + table;
    }
  if (!judged.reason.empty() || !tests_passed(claim, rows, judged)) return judged;
  judged.verdict = holds(claim.reproduced, claim, rows) ? Verdict::reproduced
                   : holds(claim.shape, claim, rows)    ? Verdict::shape
                                                        : Verdict::contradicted;
  return judged;
}

std::string text_of(const Json& value) {
  return value.is_null() ? "" : value.is_number() ? readable(value.get<double>()) : value.is_string() ? value.get<std::string>() : value.dump();
}

std::string list_of(const Json& printed) {
  if (!printed.is_object()) return text_of(printed);
  std::string text;
  for (const auto& [key, value] : printed.items()) text += (text.empty() ? "" : ", ") + key + " " + text_of(value);
  return text;
}

std::string list_of(const std::vector<std::pair<std::string, Json>>& figures) {
  if (figures.size() == 1) return text_of(figures[0].second);
  std::string text;
  for (const auto& [key, value] : figures) text += (text.empty() ? "" : ", ") + key + " " + text_of(value);
  return text;
}

std::string cell(const std::string& text) {
  std::string result;
  for (const char c : text) result += c == '|' ? std::string("\\|") : c == '\n' ? " " : std::string(1, c);
  return result;
}

std::string join(const std::vector<std::string>& sentences) {
  std::string text;
  for (const std::string& each : sentences) text += (text.empty() ? "" : " ") + each;
  return text;
}

/// What decides, for the reader of the table.
std::string rule_of(const Claim& claim, const Judged& judged) {
  std::string text = judged.verdict == Verdict::untestable ? claim.untestable : list_of(judged.figures);
  for (const std::string& test : claim.tests) text += (text.empty() ? "" : "; ") + ("test " + test);
  if (judged.verdict == Verdict::missing) text = judged.reason;
  return text;
}

void write_markdown(const std::vector<Claim>& claims, const std::vector<Judged>& verdicts, std::ostream& out) {
  out << "| id | place | the thesis says | printed | ours | verdict |\n| --- | --- | --- | --- | --- | --- |\n";
  for (std::size_t i = 0; i < claims.size(); ++i) {
    const Claim& claim = claims[i];
    std::string verdict(name(verdicts[i].verdict));
    if (verdicts[i].verdict == Verdict::contradicted) verdict = "**" + verdict + "**";
    if (!claim.why.empty() && verdicts[i].verdict != Verdict::missing) verdict += ". " + join(claim.why);
    for (const std::string& warning : verdicts[i].warnings) verdict += " (" + warning + ")";
    out << "| " << cell(claim.id) << " | " << cell(claim.place) << " | " << cell(claim.says) << " | "
        << cell(list_of(claim.printed)) << " | " << cell(rule_of(claim, verdicts[i])) << " | " << cell(verdict) << " |\n";
  }
}

void write_json(const std::vector<Claim>& claims, const std::vector<Judged>& verdicts, std::ostream& out) {
  Json all = Json::array();
  for (std::size_t i = 0; i < claims.size(); ++i) {
    const Claim& claim = claims[i];
    Json figures = Json::object();
    for (const auto& [key, value] : verdicts[i].figures) figures[key] = value;
    all.push_back({{"id", claim.id}, {"place", claim.place}, {"says", claim.says}, {"kind", claim.kind},
                   {"printed", claim.printed}, {"ours", figures}, {"tests", claim.tests},
                   {"verdict", name(verdicts[i].verdict)}, {"reason", verdicts[i].reason},
                   {"why", claim.why}, {"warnings", verdicts[i].warnings}});
  }
  out << all.dump(1, ' ', false, Json::error_handler_t::replace) << '\n';
}

}  // namespace

std::string_view name(Verdict verdict) {
  switch (verdict) {
    case Verdict::reproduced: return "reproduced";
    case Verdict::shape: return "shape reproduced";
    case Verdict::contradicted: return "contradicted";
    case Verdict::untestable: return "untestable";
    default: return "missing";
  }
}

std::vector<Claim> read_claims(const std::filesystem::path& path) {
  const std::string file = path.filename().string();
  toml::table document;
  try {
    document = toml::parse_file(path.string());
  } catch (const toml::parse_error& error) {
    throw Error(file + ":" + std::to_string(error.source().begin.line) + ": " + std::string(error.description()));
  }
  const Section section(file, document, "the file", {"claim"});
  const toml::array* const list = document.get("claim") ? document.get("claim")->as_array() : nullptr;
  if (!list) throw Error(file + ": there is no [[claim]]");
  std::vector<Claim> claims;
  std::set<std::string> ids;
  for (const toml::node& node : *list) {
    if (!node.is_table()) section.fail(node.source().begin.line, "a [[claim]] must be a table");
    claims.push_back(claim_of(file, *node.as_table()));
    if (!ids.insert(claims.back().id).second)
      section.fail(claims.back().line, "there are two claims " + claims.back().id);
  }
  return claims;
}

bool is_of(const Claim& claim, const std::string& spelt) {
  std::string number = spelt;
  for (char& c : number)
    c = c == ' ' || c == '.' ? '_' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  static const std::regex kNamed("(table|figure)s? ([0-9]+)\\.([0-9]+)(?: (to|and) ([0-9]+)\\.([0-9]+))?");
  for (std::sregex_iterator found(claim.place.begin(), claim.place.end(), kNamed), end; found != end; ++found) {
    const auto text = [&](int group) { return (*found)[group].str(); };
    const int first = std::stoi(text(3)), last = text(6).empty() ? first : std::stoi(text(6));
    for (int i = first; i <= last; ++i)
      if (number == text(1) + "_" + text(2) + "_" + std::to_string(i) && (text(4) != "and" || i == first || i == last))
        return true;
  }
  return false;
}

Judged judge(const Claim& claim, const RowDatabase& rows) {
  Judged judged;
  if (!claim.untestable.empty()) {
    judged.verdict = Verdict::untestable;
    return judged;
  }
  try {
    if (!claim.ours.empty())
      judged = judge_by_rows(claim, rows);
    else if (tests_passed(claim, rows, judged))
      judged.verdict = verdict_named(claim.passed);
    warn_of_rows(claim.ours + (claim.tests.empty() ? "" : " tests"), rows, judged.warnings);
  } catch (const Error& error) {
    const std::string sentence = error.what();
    if (!sentence.starts_with("no such table: ")) throw Error("claim " + claim.id + ": " + sentence);
    judged.reason = "there are no rows of " + sentence.substr(15, sentence.find(' ', 15) - 15);
  }
  if (judged.verdict == Verdict::contradicted && claim.why.size() < 2) {
    judged.verdict = Verdict::missing;
    judged.reason = "contradicted, but \"why\" does not explain it in two sentences";
  }
  return judged;
}

std::vector<std::string> rules_that_cannot_fail(const Claim& claim, RowDatabase& rows) {
  std::vector<std::string> statements = claim.doctored, wrong;
  for (const std::string& test : claim.tests)
    statements.push_back("UPDATE tests SET passed = 0 WHERE label = '" + test + "'");
  const Judged before = judge(claim, rows);
  if (before.verdict == Verdict::missing || before.verdict == Verdict::untestable) return {};
  Claim explained = claim;  // an explanation written for one verdict says nothing about another
  explained.why = {"-", "-"};
  for (const std::string& statement : statements) {
    rows.execute("SAVEPOINT doctored");
    try {
      if (rows.execute(statement) == 0) wrong.push_back("changes no row: " + statement);
      else if (judge(explained, rows).verdict == before.verdict) wrong.push_back("does not change the verdict: " + statement);
    } catch (const Error& error) {
      wrong.push_back(error.what());
    }
    rows.execute("ROLLBACK TO doctored");
    rows.execute("RELEASE doctored");
  }
  return wrong;
}

void write_claims(const std::vector<Claim>& claims, const std::vector<Judged>& verdicts, const std::string& format,
                  std::ostream& out) {
  if (format == "json") return write_json(claims, verdicts, out);
  write_markdown(claims, verdicts, out);
  std::map<Verdict, int> counts;
  for (const Judged& each : verdicts) ++counts[each.verdict];
  out << "\n" << claims.size() << " claims";
  for (const Verdict each : {Verdict::reproduced, Verdict::shape, Verdict::contradicted, Verdict::untestable, Verdict::missing})
    out << (each == Verdict::reproduced ? ": " : ", ") << counts[each] << ' ' << name(each);
  out << ".\n";
}

}  // namespace hermesh
