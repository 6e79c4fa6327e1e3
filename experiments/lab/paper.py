"""Makes the paper's numbers and tables from the rows of results/, and refuses those that do not come from
them.

  python3 -m experiments.lab.paper --out DIR     checks the text, writes DIR/numbers.tex and DIR/tables/*.tex
  python3 -m experiments.lab.paper --verify DIR  lists differences of DIR from the rows, and complaints of
                                                 LaTeX

The exit code is 1 if a number has no row, or its rows are of a tree with changes, stale, or differ from
results/SHA256SUMS; if the text has a digit that is no number of the rows; or if a file in DIR was edited.
"""

import argparse
import fnmatch
import functools
import hashlib
import pathlib
import re
import subprocess
import sys
import tomllib

from . import ablations, claims, pages
from .rows import ROOT, LabError, find

SYMBOLS = {
    "×": r"$\times$", "÷": r"$\div$", "°": r"\textdegree{}", "–": "--", "—": "---", "−": "$-$", "→": r"$\to$",
    "√": r"$\surd$", "²": r"\textsuperscript{2}", "³": r"\textsuperscript{3}", "Δ": r"$\Delta$",
    "△": r"$\triangle$",
    "∪": r"$\cup$", "∩": r"$\cap$", "∅": r"$\emptyset$", "≤": r"$\le$", "≥": r"$\ge$", "µ": r"$\mu$",
    "π": r"$\pi$",
    "₂": r"\textsubscript{2}", "é": r"\'e", "ö": r'\"o', "ä": r'\"a', "æ": r"\ae{}", "’": "'",
    "…": r"\dots{}",
    "§": r"\S{}", "·": r"$\cdot$", "±": r"$\pm$", "⅓": r"$\frac13$", "½": r"$\frac12$",
    "ᵀ": r"\textsuperscript{T}",
    "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_", "{": r"\{", "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}", "\\": r"\textbackslash{}", "<": r"$<$", ">": r"$>$", "|": r"$|$"}
WIDEST = 1.0  # points by which a line may be wider than its column

# ---- LaTeX


def escaped(text):
    """Returns a text of a row or a rule for LaTeX."""
    for letter in text:
        if letter not in SYMBOLS and ord(letter) > 126:
            raise LabError(f'there is no LaTeX for the character {letter!r} of "{text}"; add it to '
                           f'lab/paper.py')
    # Two hyphens, e.g. of an option, would become a dash.
    return "-{}-".join(part.translate(str.maketrans(SYMBOLS)) for part in text.split("--"))


def formatted(value, form=""):
    """Returns a value for LaTeX: 1.9e-06 -> $1.9\\cdot10^{-6}$, -5.8 -> $-$5.8"""
    if isinstance(value, str):
        return escaped(value)
    text = pages.formatted(value, form)
    power = re.fullmatch(r"(-?[\d.]+)e([+-]\d+)", text)
    return rf"${power[1]}\cdot10^{{{int(power[2])}}}$" if power else re.sub("^-", "$-$", text)


def head_of(text, numeric):
    """Returns the head of a column; "|" breaks it into lines."""
    parts = [escaped(part) for part in text.split("|")]
    # The braces keep LaTeX from taking "[s]" for a distance between the lines.
    return (parts[0] if len(parts) == 1
            else rf"\shortstack[{'r' if numeric else 'l'}]{{" + r"\\{}".join(parts) + "}")


def changes(lines):
    """Returns the indices of the lines before which the first column changes, and clears its repeated cells.
    """
    rules = [i for i in range(2, len(lines)) if lines[i][0] != lines[i - 1][0]]
    for i in range(2, len(lines)):
        lines[i][0] = lines[i][0] if i in rules else ""
    return rules


def tabular(columns, lines, rules=()):
    """Returns a table of lines, the head first, with space before those whose index is in `rules`."""
    out = [rf"\begin{{tabular}}{{@{{}}{columns}@{{}}}}", r"\toprule", " & ".join(lines[0]) + r" \\",
           r"\midrule"]
    for i, line in enumerate(lines[1:], 1):
        out += [r"\addlinespace"] * (i in rules) + [" & ".join(line) + r" \\"]
    return "\n".join([*out, r"\bottomrule", r"\end{tabular}"]) + "\n"


def paragraphs(*widths):
    """Returns columns of text with these shares of the page's width."""
    columns = [rf">{{\raggedright}}p{{{width}\textwidth}}" for width in widths]
    return "".join(columns[:-1]) + columns[-1].replace(r"\raggedright", r"\raggedright\arraybackslash")


def sealed(text):
    digest = hashlib.sha256(text.encode()).hexdigest()
    return f"% Made by experiments/lab/paper.py from results/; sha256 of what follows {digest}\n{text}"


# ---- Text

_HIDDEN = [
    r"\\(?:N|T|ref|label|eqref|pageref|cite[pt]?|input|bibliography|bibliographystyle|url|begin|end|texttt)"
    r"\{[^{}]*\}",
    r"\\(?:includegraphics|picture)(?:\[[^\]]*\])?\{[^{}]*\}",
    r"\\(?:vspace|hspace|setlength|addtolength)\*?\{[^{}]*\}(?:\{[^{}]*\})?",
    r"\{[\d.]*\\(?:text|line|column)width\}", r"\\\\\[[^\]]*\]", r"[_^]\{?\d\}?", pages.PLACES,
    r"\\[A-Za-z]+"]


def orphans(text, plain, start=0):
    """Returns [(line, number)] from `start` on, except in macros, places, years, and the phrases `plain`."""
    phrases = [r"\s+".join(map(re.escape, phrase.split())) for phrase in sorted(plain, key=len, reverse=True)]
    text = re.sub(r"[^\n]", " ", text[:start]) + text[start:]
    hidden = [r"(?<!\\)%[^\n]*", *phrases, *_HIDDEN]
    return pages.typed_numbers(text, hidden, r"(?<![A-Za-z\d+])" + pages.NUMBER)


def problems_of_log(log, bibtex=""):
    """Returns what LaTeX and BibTeX report that a reader would see, a sentence each."""
    found = []
    for box in re.finditer(r"Overfull \\(hbox|vbox) \(([\d.]+)pt too (?:wide|high)\)([^\n]*)", log):
        if float(box[2]) > WIDEST:
            near = re.findall(r"\(([^\s()]*?\.tex)", log[:box.start()])
            what = "a line is wider than its column" if box[1] == "hbox" else "a page is too high"
            found.append(f"{what} by {box[2]} pt{box[3]}, in or after {near[-1] if near else 'hermesh.tex'}")
    for what, name in re.findall(r"LaTeX Warning: (Reference|Citation) `([^']*)'[^\n]* undefined", log):
        found.append(f"the {what.lower()} {name} is undefined")
    return found + re.findall(r"Warning--([^\n]*)", bibtex)


# ---- Numbers and tables


class Paper:
    """The paper of a checkout; its numbers are those of the pages and of paper/paper.toml."""

    def __init__(self, root):
        self.pages = pages.Pages(root)
        self.root, self.rows = self.pages.root, self.pages.rows
        self.settings = claims.read_toml(self.root / "paper/paper.toml")
        self.tables = self.settings.get("tables", {})
        own = pages.table_of(pages.query_and_format)(self.settings.get("numbers", {}), "paper.toml: numbers")
        if twice := sorted(own.keys() & self.pages.numbers.keys()):
            raise LabError(f"paper/paper.toml and paper/numbers.toml both have the number {twice[0]}")
        self.numbers = self.pages.numbers | own

    def sources(self):
        """Returns {name: text} of the files of the paper: the frame, and each section that paper.toml lists.
        """
        names = ["paper/hermesh.tex"] + [f"paper/sections/{name}.tex" for name in self.settings["sections"]]
        texts = {name: self.pages.read(name) for name in names}
        for name in names:
            if texts[name] is None:
                raise LabError(f"paper/paper.toml lists a section that does not exist: {name}")
        return texts

    def asked(self):
        """Returns {"N": {name: position}, "T": …}: the numbers and tables of the text, and where each is
        first.
        """
        found = {"N": {}, "T": {}}
        for name, text in self.sources().items():
            for at, line in enumerate(text.splitlines(), 1):
                for kind, what in re.findall(r"\\([NT])\{([^{}]*)\}", re.sub(r"(?<!\\)%.*", "", line)):
                    found[kind].setdefault(what, f"{name}:{at}")
        return found

    def orphans(self):
        """Returns a sentence for each number of the text that is not taken from the rows."""
        found, plain = [], self.settings.get("plain", [])
        for name, text in self.sources().items():
            start = max(text.find(r"\begin{document}"), 0)
            found += [f"{name}:{line}: the number {number} is typed, not taken from results/; use \\N{{…}}, "
                      "or add the phrase to paper/paper.toml" for line, number in orphans(text, plain, start)]
        return found

    @functools.cache
    def trust_table(self, table):
        """Raises LabError if the rows of a directory must not be cited."""
        line = pages.hash_line(self.root, table)
        if line not in (self.pages.read("results/SHA256SUMS") or ""):
            raise LabError(f"results/{line.split()[-1]} differs from the hash in results/SHA256SUMS")
        if table in self.rows.benchmarks:
            if self.rows.has_changed_tree(table):
                raise LabError(f"results/{table} has rows of a tree with changes")
            return
        rows = self.rows.rows_of[table]
        if dirty := sum(row.get("dirty") is not False for row in rows):
            raise LabError(f"results/{table} has {dirty} rows of a tree with changes")
        if stale := claims.stale_row(table, self.rows):
            raise LabError(f"results/{table} is stale: {stale['difference']}")
        accepted = self.settings.get("changed", {}).get(table, {}).get("labels", [])
        for experiment, commit, labels in changed_since(self.root, rows):
            if left := [label for label in labels if label not in accepted]:
                raise LabError(f"results/{table} is stale: {experiment}.toml has changed {', '.join(left)} "
                               f"since commit {commit[:12]} made the rows; run it again, or state in "
                               "paper/paper.toml why they may be cited")

    def trust(self, query):
        """Raises LabError if the query reads rows that must not be cited, or none."""
        tables = self.rows.tables_in(query)
        if not tables:
            raise LabError(f"it reads no directory of results/ that has rows: {query}")
        for table in tables:
            self.trust_table(table)

    @functools.cached_property
    def verdicts(self):
        """[(claim, its verdict and values)]"""
        for claim, judged in self.pages.verdicts:
            for table in claims.tables_of(claim, self.rows):
                self.trust_table(table)
            if judged.verdict == "missing":
                raise LabError(f"the claim {claim.id} has no verdict: {judged.reason}")
        return self.pages.verdicts

    @functools.cached_property
    def effects(self):
        """The cells of the effects of each ablation that results/ has."""
        result = []
        for table, rows in self.rows.rows_of.items():
            if any(find(row, "/ablation") for row in rows):
                self.trust_table(table)
                result.append(ablations.effects_of_paper(rows))
        if not result:
            raise LabError("it has no row: no directory of results/ has rows of an ablation")
        return result

    def number(self, name):
        """Returns the text of a number: one of paper.toml or numbers.toml, "claim ID VALUE", "count" (of
        claims),
        "count_VERDICT", "ablations", or "ablations_VERDICT" (predictions with that verdict)."""
        if name in self.numbers:
            self.trust(self.numbers[name][0])
            return pages.number_text(*self.numbers[name], self.rows, formatted)
        kind, _, verdict = name.replace("_", " ").partition(" ")
        if name == "count":
            return str(len(self.verdicts))
        if kind == "count" and verdict in claims.VERDICTS:
            return str(sum(judged.verdict == verdict for _, judged in self.verdicts))
        if name == "ablations":
            return str(len(self.effects))
        if kind == "ablations" and verdict in ablations.VERDICTS:
            return str(sum(effect["verdict"].startswith(verdict) for effects in self.effects
                           for effect in effects))
        for claim, judged in self.verdicts if kind == "claim" else []:
            for column, value in judged.values.items():
                if name == f"claim {claim.id} {column}":
                    return formatted(value)
        raise LabError("it is in neither paper/paper.toml nor paper/numbers.toml")

    def table(self, name):
        """Returns the LaTeX of a table."""
        entry = self.tables.get(name)
        if entry is None:
            raise LabError("it is not in paper/paper.toml")
        if "claims" in entry:
            return self.table_of_claims(entry["claims"])
        if "by_chapter" in entry:
            return self.table_by_chapter()
        if "ablations" in entry:
            return self.table_of_effects(entry["ablations"])
        heads, found = self.answer(entry)
        numeric = [any(isinstance(cell, (int, float)) for cell in cells) for cells in zip(*found)]
        lines = [[head_of(*head) for head in zip(heads, numeric)]]
        lines += [["--" if value is None else formatted(value, entry.get("formats", {}).get(head, ""))
                   for head, value in zip(heads, row)] for row in found]
        columns = "".join("r" if each else "l" for each in numeric)
        return tabular(columns, lines, changes(lines) if entry.get("groups") else ())

    def answer(self, entry):
        """Returns the heads and rows of a table's query, or of one for each directory that matches `folders`.
        """
        queries = [entry["query"]]
        if "folders" in entry:
            queries = [entry["query"].replace("{folder}", f'"{table}"')
                       for table in fnmatch.filter(self.rows.tables, entry["folders"])]
        heads, found = [], []
        for query in queries:
            self.trust(query)
            heads, rows = self.rows.query(query)
            found += rows
        if not found:
            raise LabError(f"it has no row: "
                           f"{queries[0] if queries else 'there is no results/' + entry['folders']}")
        return heads, found

    def table_of_effects(self, most):
        lines = [["factor", "level", "against", "column", head_of("effect|(95 %)", False), "predicted",
                  "verdict"]]
        for effect in (effect for effects in self.effects for effect in effects[:most]):
            column = effect["column"] + (", −" if effect["measure"] == "difference" else ", ÷")
            size = f"{effect['effect']} ({effect['95 % interval']})"
            cells = (effect["factor"], effect["level"], effect["against"], column.replace("_", " "),
                     size, effect["predicted"], effect["verdict"])
            lines.append([escaped(re.sub(r"(?<![\w.])-(?=\d)", "−", cell)) for cell in cells])
        return tabular(paragraphs(0.2, 0.13, 0.1, 0.14, 0.15, 0.09, 0.08), lines, changes(lines))

    def table_of_claims(self, ids):
        by_id = {claim.id: (claim, judged) for claim, judged in self.verdicts}
        lines = [["place", "the thesis says", "our rows"]]
        for each in ids:
            if each not in by_id or by_id[each][1].verdict != "contradicted":
                raise LabError(f"the claim {each} is not contradicted")
            claim, judged = by_id[each]
            place = re.split(";|, figure|, implied", claim.place)[0]
            ours = claims.list_of_values(judged.values) or "a test shows the contrary"
            lines.append([escaped(place[0].upper() + place[1:]), escaped(claim.says), escaped(ours)])
        return tabular(paragraphs(0.12, 0.46, 0.36), lines)

    def table_by_chapter(self):
        """Returns the number of claims by verdict for each chapter, 0 being the abstract."""
        shown, places = claims.VERDICTS[:4], []
        for claim, judged in self.verdicts:
            number = re.search(r"\d+", claim.place)
            in_abstract = not number or claim.place.startswith("abstract")
            places.append((0 if in_abstract else int(number[0]), judged.verdict))
        heads = [r"repro-\\duced", "shape", r"contra-\\dicted", r"untest-\\able"]
        lines = [["chapter"] + [rf"\shortstack[r]{{{head}}}" for head in heads]]
        lines += [[str(chapter or "abstract")] + [str(places.count((chapter, verdict))) for verdict in shown]
                  for chapter in sorted({chapter for chapter, _ in places})]
        lines.append(["all"] + [str(sum(verdict == each for _, each in places)) for verdict in shown])
        return tabular("lrrrr", lines, [len(lines) - 1])

    # ---- Files

    def files(self):
        """Returns {path below the output: text}. Raises LabError for a number or table that the rows do not
        give.
        """
        made = {}
        for kind, names in self.asked().items():
            for name, where in names.items():
                try:
                    made[kind, name] = self.number(name) if kind == "N" else self.table(name)
                except LabError as error:
                    raise LabError(
                        f"{where}: the {'number' if kind == 'N' else 'table'} {name}: {error}") from None
        files = {"numbers.tex": "".join(rf"\papernumber{{{name}}}{{{text}}}" + "\n"
                                        for (kind, name), text in made.items() if kind == "N"),
                 **{f"tables/{name}.tex": text for (kind, name), text in made.items() if kind == "T"},
                 "sections.tex": "".join(rf"\input{{sections/{name}}}" + "\n"
                                         for name in self.settings["sections"])}
        return {name: sealed(text) for name, text in files.items()}

    def write(self, out):
        """Writes the files. Raises LabError if there is one that was edited, or if the text has typed
        numbers.
        """
        out = pathlib.Path(out)
        for path in sorted(out.glob("**/*.tex")):
            text = path.read_text()
            if sealed(text.partition("\n")[2]) != text:
                raise LabError(f"{path} was edited, but numbers come only from results/; remove the file")
        if found := self.orphans():
            raise LabError("\n".join(found))
        files = self.files()
        for path in out.glob("tables/*.tex"):
            path.unlink()
        (out / "tables").mkdir(parents=True, exist_ok=True)
        for name, text in files.items():
            (out / name).write_text(text)
        return f"{len(self.asked()['N'])} numbers and {len(self.asked()['T'])} tables from results/"

    def verify(self, out):
        """Returns a sentence for each file in `out` that differs from the rows."""
        found = []
        for name, right in self.files().items():
            path = pathlib.Path(out) / name
            text = path.read_text() if path.exists() else ""
            lines = zip(text.splitlines()[1:], right.splitlines()[1:])
            differing = [f'has "{line}", by the rows it is "{wanted}"' for line, wanted in lines
                         if line != wanted]
            if text != right:
                found.append(f"{path} {differing[0] if differing else 'is missing, or was edited'}")
        return found


def changed_since(root, rows):
    """Returns [(experiment, commit, labels)]: the variants that an experiment's file has changed since its
    rows.

    Skips rows whose commit git does not have, or whose experiment has no file.
    """
    found = []
    git = lambda *words: subprocess.run(["git", "-C", str(root), *words], capture_output=True, text=True)
    for commit, experiment in sorted({(row["commit"], row["experiment"]) for row in rows}):
        path = min((root / "experiments").glob(f"**/{experiment}.toml"), default=None)
        there = git("ls-tree", "-r", "--name-only", commit, "experiments").stdout.split("\n")
        # files move between commits
        old = next((name for name in there if name.endswith(f"/{experiment}.toml")), "")
        if not (path and old):
            continue
        before, after = tomllib.loads(git("show", f"{commit}:{old}").stdout), tomllib.loads(path.read_text())
        labels = {find(row, "/variant/label") for row in rows if row["commit"] == commit}
        for key in ("variants", "voxelizers"):
            was, now = ({v if isinstance(v, str) else v.get("label", v.get("name")): v
                         for v in file.get(key, [])}
                        for file in (before, after))
            if other := sorted(label for label in labels & set(was) if was[label] != now.get(label)):
                found.append((experiment, commit, other))
    return found


def check_log(out):
    """Prints the number of pages and the widest line that LaTeX reported in `out`; returns what is wrong."""
    log, bibtex = out / "hermesh.log", out / "bibtex.out"
    if not log.exists():
        return []
    text = log.read_text(errors="replace")
    pages_made = re.search(r"Output written on [^(]*\((\d+) pages", text)
    widest = max((float(points) for points in re.findall(r"Overfull \\hbox \(([\d.]+)pt", text)), default=0.0)
    print(f"{pages_made[1] if pages_made else '?'} pages; the widest overfull line is {widest:g} pt too wide")
    return problems_of_log(text, bibtex.read_text(errors="replace") if bibtex.exists() else "")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    action = parser.add_mutually_exclusive_group(required=True)
    action.add_argument("--out", type=pathlib.Path)
    action.add_argument("--verify", type=pathlib.Path)
    options = parser.parse_args()
    try:
        paper = Paper(ROOT)
        if options.out:
            print(paper.write(options.out))
        elif found := paper.verify(options.verify) + paper.orphans() + check_log(options.verify):
            raise LabError("\n".join(found))
    except LabError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
