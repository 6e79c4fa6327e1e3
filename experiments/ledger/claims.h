// Claims of the thesis, and what the rows of results/ say of each: reproduced, reproduced in shape, contradicted, or
// untestable. Nothing but rules is typed by hand.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "experiments/ledger/row_database.h"

namespace hermesh {

/// An entry of paper/claims.toml, whose head explains the keys.
struct Claim {
  std::string id, place, says;
  std::string kind;     ///< "measured", "exact", "seen" or "untestable"
  Json printed;         ///< the figure that the thesis prints; null where it prints none
  std::string ours;     ///< a query for our figures, a column each; empty where tests decide alone
  std::string reproduced, shape;     ///< conditions on the columns of `ours` and on `printed`; empty is never met
  std::vector<std::string> tests;    ///< names of tests, all of which must have passed
  std::string passed;                ///< the verdict when tests decide alone and have passed
  std::vector<std::string> doctored; ///< statements on rows, each of which must change the verdict
  std::vector<std::string> why;      ///< what explains the verdict, sentences
  std::string untestable;            ///< why nothing can decide
  int line = 0;                      ///< in the file
};

enum class Verdict { reproduced, shape, contradicted, untestable, missing };
std::string_view name(Verdict verdict);

struct Judged {
  Verdict verdict = Verdict::missing;
  std::string reason;                                 ///< of `missing`: what is not there
  std::vector<std::pair<std::string, Json>> figures;  ///< ours
  std::vector<std::string> warnings;                  ///< rows that cannot be trusted: of a dirty tree, stale, stand-ins
};

/// @throws Error "claims.toml:12: …" for a mistake in the file, an id that is used twice, a claim that no rule decides, or
/// one without a doctored row.
std::vector<Claim> read_claims(const std::filesystem::path& path);

/// Whether the claim's place names a table or figure: "figure_9_9", or "Figure 9.9", is in "figures 9.8 to 9.10".
bool is_of(const Claim& claim, const std::string& number);

/// Evaluates one claim on the rows. A claim of the verdict `contradicted` needs two sentences that explain it, and is
/// `missing` without. @throws Error for a query that is no SQL, or names what there is not.
Judged judge(const Claim& claim, const RowDatabase& rows);

/// Tries each statement in claim.doctored, and for each test a failure of it; returns a sentence for each that changes no
/// row or does not change the verdict. The rows are as before afterwards.
std::vector<std::string> rules_that_cannot_fail(const Claim& claim, RowDatabase& rows);

/// "md" or "json": every claim with its verdict, the printed figure beside ours, and how many there are of each verdict.
void write_claims(const std::vector<Claim>& claims, const std::vector<Judged>& verdicts, const std::string& format,
                  std::ostream& out);

}  // namespace hermesh
