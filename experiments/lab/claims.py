"""Claims of the thesis, and the verdict of the rows of results/ on each: reproduced, reproduced in shape,
contradicted,
or untestable. Only the rules are typed by hand (paper/claims.toml, whose head explains the keys)."""

import dataclasses
import json
import pathlib
import re
import tomllib

from . import experiment
from .database import RowDatabase
from .rows import ROOT, LabError, readable, to_json

KINDS = ("measured", "exact", "seen", "untestable")
VERDICTS = ("reproduced", "shape reproduced", "contradicted", "untestable", "missing")


@dataclasses.dataclass(frozen=True)
class Claim:
    """An entry of claims.toml."""

    id: str
    place: str
    says: str
    kind: str
    printed: object = None  # a number, a text, or a table of these; None if the thesis prints nothing
    ours: str = ""  # a query for our values, one column each; empty if tests alone decide
    reproduced: str = ""  # conditions on the columns of `ours` and on `printed`; an empty one is never met
    shape: str = ""
    tests: tuple = ()  # names of tests, all of which must have passed
    passed: str = "reproduced"  # the verdict if tests alone decide and have passed
    doctored: tuple = ()  # statements on rows, each of which must change the verdict
    why: tuple = ()  # sentences that explain the verdict
    untestable: str = ""  # why nothing can decide


@dataclasses.dataclass
class Judged:
    verdict: str = "missing"
    reason: str = ""  # of a missing verdict
    values: dict = dataclasses.field(default_factory=dict)  # ours, by column
    warnings: list = dataclasses.field(default_factory=list)  # rows that cannot be trusted
    accepted: bool = False  # True if rows other than those of the run decided


def read_toml(path):
    """Returns the tables of a TOML file. Raises LabError if it cannot be read."""
    try:
        return tomllib.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise LabError(f"{path}: {error}") from None


def read_claims(path):
    """Returns the claims of a file. Raises LabError for a mistake in it, e.g. a claim that no rule decides.
    """
    claims = experiment.read_table(read_toml(path), path.name, {"claim": experiment.list_of(_claim)})["claim"]
    ids = [claim.id for claim in claims]
    if twice := [each for each in ids if ids.count(each) > 1]:
        raise LabError(f"{path.name}: there are two claims {twice[0]}; each needs an id of its own")
    return claims


def _texts(value, where):
    return tuple(experiment.list_of(experiment.text)(value if isinstance(value, list) else [value], where))


def _printed(value, where):
    return dict(sorted(value.items())) if isinstance(value, dict) else value


_REQUIRED = {"id": experiment.text, "place": experiment.text, "says": experiment.text,
             "kind": experiment.choice("kind", KINDS)}
_OPTIONAL = {"printed": _printed, "passed": experiment.choice("verdict", VERDICTS[:3]),
             **dict.fromkeys(["ours", "reproduced", "shape", "untestable"], experiment.text),
             **dict.fromkeys(["tests", "doctored", "why"], _texts)}


def _claim(entry, where):
    if isinstance(entry, dict):
        where += f" ({entry.get('id', 'without an id')})"
    claim = Claim(**experiment.read_table(entry, where, _REQUIRED, _OPTIONAL))
    decided, untestable, problem = bool(claim.ours or claim.tests), bool(claim.untestable), ""
    if (claim.kind == "untestable") != untestable or decided == untestable:
        problem = 'add a rule ("ours" or "tests"), or make the kind untestable and state why in "untestable"'
    elif claim.ours and not (claim.reproduced or claim.shape):
        problem = 'there is no condition: add "reproduced" or "shape"'
    elif claim.ours and not claim.doctored:
        problem = 'there is no "doctored" row that changes the verdict'
    if problem:
        raise LabError(f"{where}: {problem}")
    return claim


def is_of(claim, number):
    """Returns True if the claim's place includes a table or figure, such as "figure_9_9" or "Figure 9.9"."""
    wanted = re.sub("[ .]", "_", number).lower()
    named = r"(table|figure)s? ([0-9]+)\.([0-9]+)(?: (to|and) [0-9]+\.([0-9]+))?"
    for kind, chapter, first, between, last in re.findall(named, claim.place):
        ends = int(first), int(last or first)
        numbers = ends if between == "and" else range(ends[0], ends[1] + 1)
        if wanted in {f"{kind}_{chapter}_{each}" for each in numbers}:
            return True
    return False


def judge(claim, rows):
    """Evaluates a claim on the rows of a RowDatabase.

    "contradicted" becomes "missing" unless two sentences explain it. Raises LabError for a wrong query.
    """
    if claim.untestable:
        return Judged("untestable")
    judged = Judged()
    try:
        judged.values = rows.first_row(claim.ours) if claim.ours else {}
        judged.reason = _reason(claim, judged.values, rows)
        judged.verdict = "missing" if judged.reason else _verdict(claim, rows)
        judged.warnings = [warning for table in tables_of(claim, rows) for warning in _warnings(table, rows)]
    except LabError as error:
        absent = re.match(r"no such table: (\S+)", str(error))
        if not absent:
            raise LabError(f"claim {claim.id}: {error}") from None
        judged.reason = f"there are no rows of {absent[1]}"
    if judged.verdict == "contradicted" and len(claim.why) < 2:
        judged.verdict, judged.reason = (
            "missing", 'contradicted, but "why" does not explain it in two sentences')
    return judged


def judge_with(claim, rows, accepted):
    """Evaluates a claim on rows, or on other rows (or None) if these give no verdict."""
    judged = judge(claim, rows)
    if judged.verdict == "missing" and accepted:
        other = judge(claim, accepted)
        if other.verdict != "missing":
            return dataclasses.replace(other, accepted=True)
    return judged


def tables_of(claim, rows):
    """Returns the names of the tables that decide a claim."""
    return rows.tables_in(claim.ours + (" tests" if claim.tests else ""))


def _reason(claim, values, rows):
    """Returns why the rows give no verdict, "" if they do."""
    tables = " ".join(rows.tables_in(claim.ours))
    if claim.ours and not values:
        return f"there is no such row of {tables}"
    for name in values:
        if values[name] is None:
            return f"the rows do not have {name}: {tables}"
    for test in claim.tests:
        row = rows.first_row("SELECT passed FROM tests WHERE label = :test", {"test": test})
        if row.get("passed") != 1:
            return f"the test {test} failed" if row else f"there is no row of the test {test}"
    return ""


def _verdict(claim, rows):
    if not claim.ours:
        return claim.passed
    if _holds(claim.reproduced, claim, rows):
        return "reproduced"
    return "shape reproduced" if _holds(claim.shape, claim, rows) else "contradicted"


def _holds(condition, claim, rows):
    if not condition:
        return False
    bound = {"printed": claim.printed}
    if isinstance(claim.printed, dict):
        bound = {f"printed_{key}": value for key, value in claim.printed.items()}
    columns = "".join(f", :{name} AS {name}" for name in bound)
    first = f"SELECT ours.*{columns} FROM ({claim.ours}) AS ours LIMIT 1"
    row = rows.first_row(f"SELECT ({condition}) AS met FROM ({first})", bound)
    return isinstance(row.get("met"), (int, float)) and row["met"] != 0


def _warnings(table, rows):
    found = []
    if rows.has_changed_tree(table):
        found.append(f"{table} has rows of a tree with changes")
    if table not in rows.benchmarks and rows.first_row(f'SELECT 1 FROM "{table}" WHERE stand_in = 1'):
        found.append(f"{table} has rows of stand-ins")
    if stale_row(table, rows):
        found.append(f"{table} has rows that the program no longer makes")
    return found


def stale_row(table, rows):
    """Returns the row of the check of a table whose rows the program no longer makes, {} for other tables."""
    query = "SELECT * FROM stale WHERE label = :table AND differing > 0"
    return rows.first_row(query, {"table": table}) if "stale" in rows.tables else {}


def rules_that_cannot_fail(claim, rows):
    """Tries each statement of claim.doctored, and a failure of each test, and restores the rows.

    Returns a sentence for each that changes no row or does not change the verdict.
    """
    before = judge(claim, rows).verdict
    if before in ("missing", "untestable"):
        return []
    # The sentences that explain one verdict do not apply to another.
    explained = dataclasses.replace(claim, why=("-", "-"))
    failures = [f"UPDATE tests SET passed = 0 WHERE label = '{test}'" for test in claim.tests]
    wrong = []
    for statement in [*claim.doctored, *failures]:
        rows.execute("SAVEPOINT doctored")
        try:
            if rows.execute(statement) < 1:
                wrong.append(f"changes no row: {statement}")
            elif judge(explained, rows).verdict == before:
                wrong.append(f"does not change the verdict: {statement}")
        except LabError as error:
            wrong.append(str(error))
        rows.execute("ROLLBACK TO doctored")
        rows.execute("RELEASE doctored")
    return wrong


def markdown(verdicts):
    """Returns a table of [(claim, judged)], and a line with the number of each verdict."""
    lines = [["id", "place", "the thesis says", "printed", "ours", "verdict"], ["---"] * 6]
    for claim, judged in verdicts:
        printed = claim.printed if isinstance(claim.printed, dict) else {"": claim.printed}
        cells = [claim.id, claim.place, claim.says, list_of_values(printed), _rule_text(claim, judged),
                 _verdict_text(claim, judged)]
        lines.append([cell.replace("|", "\\|").replace("\n", " ") for cell in cells])
    found = [judged.verdict for _, judged in verdicts]
    counts = ", ".join(f"{found.count(verdict)} {verdict}" for verdict in VERDICTS)
    table = "".join("| " + " | ".join(line) + " |\n" for line in lines)
    return table + f"\n{len(found)} claims: {counts}.\n"


def _verdict_text(claim, judged):
    text = f"**{judged.verdict}**" if judged.verdict == "contradicted" else judged.verdict
    if claim.why and judged.verdict != "missing":
        text += ". " + " ".join(claim.why)
    if judged.accepted:
        text += " (decided by accepted rows: this run has no such size or model)"
    return text + "".join(f" ({warning})" for warning in judged.warnings)


def _rule_text(claim, judged):
    if judged.verdict == "missing":
        return judged.reason
    value = claim.untestable or list_of_values(judged.values)
    return "; ".join(([value] if value else []) + [f"test {test}" for test in claim.tests])


def list_of_values(values):
    """Returns the values of a claim for a reader: "4.17", or "open edges: 3, models: 1"."""
    texts = [(name.replace("_", " "), _value_text(value)) for name, value in values.items()]
    return texts[0][1] if len(texts) == 1 else ", ".join(f"{name}: {text}" for name, text in texts)


def _value_text(value):
    if value is None or isinstance(value, str):
        return value or ""
    return readable(value) if isinstance(value, (int, float)) else to_json(value)


def as_json(verdicts):
    """Returns [(claim, judged)] as JSON."""
    entries = [{"id": claim.id, "place": claim.place, "says": claim.says, "kind": claim.kind,
                "printed": claim.printed, "ours": judged.values, "tests": claim.tests,
                "verdict": judged.verdict, "accepted": judged.accepted,
                "reason": judged.reason, "why": claim.why, "warnings": judged.warnings}
               for claim, judged in verdicts]
    return json.dumps(entries, indent=1, ensure_ascii=False) + "\n"


def add_command(subparsers):
    parser = subparsers.add_parser(
        "claims", help="the verdict of the rows on each claim of the thesis; exit code 3 if a claim has none")
    parser.add_argument("--file", type=pathlib.Path, default=ROOT / "paper/claims.toml",
                        help="claims and their rules (default: paper/claims.toml)")
    parser.add_argument("--results", type=pathlib.Path, default=ROOT / "results",
                        help="directory of directories with rows.jsonl (default: results)")
    parser.add_argument("--accepted", type=pathlib.Path,
                        help="directory like that of --results, whose rows decide the claims that those of "
                        "--results do not")
    parser.add_argument("--id", default="", help="only claims whose id contains this text")
    parser.add_argument("--of", help="only claims on this table or figure of the thesis, e.g. table_9_2")
    parser.add_argument("--format", choices=["md", "json"], default="md", help="default: md")
    parser.add_argument("--doctor", action="store_true",
                        help="try each rule on modified rows and list those that cannot fail; if any, exit "
                             "code 3")
    parser.set_defaults(function=run)


def run(arguments):
    claims = [claim for claim in read_claims(arguments.file)
              if arguments.id in claim.id and (not arguments.of or is_of(claim, arguments.of))]
    if not claims:
        raise LabError(f'there is no claim on "{arguments.of}"; names are like figure_9_8 or "figure 9.8"'
                       if arguments.of else f'no claim\'s id contains "{arguments.id}"')
    rows = RowDatabase()
    rows.add_directories(arguments.results)
    if arguments.doctor:
        wrong = [f"{claim.id}: {problem}" for claim in claims
                 for problem in rules_that_cannot_fail(claim, rows)]
        print("".join(problem + "\n" for problem in wrong), end="")
        return 3 if wrong else 0
    accepted = None
    if arguments.accepted:
        accepted = RowDatabase()
        accepted.add_directories(arguments.accepted)
    verdicts = [(claim, judge_with(claim, rows, accepted)) for claim in claims]
    print(markdown(verdicts) if arguments.format == "md" else as_json(verdicts), end="")
    return 3 if any(judged.verdict == "missing" for _, judged in verdicts) else 0
