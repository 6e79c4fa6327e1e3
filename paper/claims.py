"""The verdicts on the claims of the thesis, by the rules of claims.toml (experiments/ledger/claims.h)."""

import re
import tomllib

from row_database import PaperError, readable

VERDICTS = ["reproduced", "shape reproduced", "contradicted", "untestable", "missing"]


def read_claims(root):
    with open(root / "paper/claims.toml", "rb") as file:
        return tomllib.load(file)["claim"]


def _passed(claim, rows):
    for test in _texts(claim, "tests"):
        found = rows.query("SELECT label, passed FROM tests WHERE label = ?", (test,))[1]
        if not found or any(passed != 1 for _, passed in found):
            return False
    return True


def _texts(claim, key):
    value = claim.get(key, [])
    return [value] if isinstance(value, str) else value


def _holds(condition, claim, rows):
    if not condition:
        return False
    printed = claim.get("printed")
    named = {f"printed_{k}": v for k, v in printed.items()} if isinstance(printed, dict) else {"printed": printed}
    columns = "".join(f", :{name} AS {name}" for name in named)
    found = rows.query(f"SELECT ({condition}) FROM (SELECT ours.*{columns} FROM ({claim['ours']}) AS ours LIMIT 1)", named)[1]
    return bool(found) and isinstance(found[0][0], (int, float)) and found[0][0] != 0


def judge(claim, rows):
    """(verdict, [(name of a figure, value)])."""
    if claim.get("untestable"):
        return "untestable", []
    if not claim.get("ours"):
        return (claim.get("passed", "reproduced") if _passed(claim, rows) else "missing"), []
    names, found = rows.query(claim["ours"])
    if not found or None in found[0] or not _passed(claim, rows):
        return "missing", []
    figures = list(zip(names, found[0]))
    if _holds(claim.get("reproduced"), claim, rows):
        return "reproduced", figures
    if _holds(claim.get("shape"), claim, rows):
        return "shape reproduced", figures
    return ("contradicted" if len(_texts(claim, "why")) > 1 else "missing"), figures


def tables_of(claim, rows):
    return rows.tables_in(claim.get("ours", "") + (" tests" if claim.get("tests") else ""))


def text_of_figures(figures):
    """ "worst missed 0.339, median missed 0.169" """
    texts = [(name.replace("_", " "), readable(v) if isinstance(v, (int, float)) else str(v)) for name, v in figures]
    return texts[0][1] if len(texts) == 1 else ", ".join(f"{name} {value}" for name, value in texts)


def chapter_of(claim):
    """ "2" to "11", or "abstract": where the thesis says it first."""
    number = re.search(r"\d+", claim["place"])
    return number[0] if number and not claim["place"].startswith("abstract") else "abstract"
