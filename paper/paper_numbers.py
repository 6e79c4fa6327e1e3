#!/usr/bin/env python3
"""Makes the paper's numbers and tables from the rows of results/, and refuses what does not come from them.

  paper_numbers.py [--root DIR] --out DIR    checks the text, and writes DIR/numbers.tex and DIR/tables/*.tex
  paper_numbers.py [--root DIR] --verify DIR says what in DIR is not what the rows give

A sentence and exit code 1 if a number has no row, or comes from a folder of rows that is dirty, stale, or not the one of
results/SHA256SUMS; if the text has a digit that is no number of the rows; if what was written was changed by hand.
"""

import argparse
import fnmatch
import hashlib
import pathlib
import re
import subprocess
import sys
import tomllib

import ablations
import claims as ledger
from row_database import PaperError, RowDatabase, readable

SYMBOLS = {
    "×": r"$\times$", "÷": r"$\div$", "°": r"\textdegree{}", "–": "--", "—": "---", "−": "$-$", "→": r"$\to$",
    "√": r"$\surd$", "²": r"\textsuperscript{2}", "³": r"\textsuperscript{3}", "Δ": r"$\Delta$", "△": r"$\triangle$",
    "∪": r"$\cup$", "∩": r"$\cap$", "∅": r"$\emptyset$", "≤": r"$\le$", "≥": r"$\ge$", "µ": r"$\mu$", "π": r"$\pi$",
    "₂": r"\textsubscript{2}", "é": r"\'e", "ö": r'\"o', "ä": r'\"a', "æ": r"\ae{}", "’": "'", "…": r"\dots{}",
    "§": r"\S{}", "·": r"$\cdot$", "±": r"$\pm$", "⅓": r"$\frac13$", "½": r"$\frac12$", "ᵀ": r"\textsuperscript{T}",
}
SPECIAL = {"&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_", "{": r"\{", "}": r"\}", "~": r"\textasciitilde{}",
           "^": r"\textasciicircum{}", "\\": r"\textbackslash{}", "<": r"$<$", ">": r"$>$", "|": r"$|$"}


def escaped(text):
    """Text of a row or a rule for LaTeX."""
    out = []
    for c in str(text):
        if c not in SPECIAL and c not in SYMBOLS and ord(c) > 126:
            raise PaperError(f"paper/paper_numbers.py does not know how to write the character {c!r} of \"{text}\"")
        out.append(SPECIAL.get(c) or SYMBOLS.get(c) or c)
    return "".join(out)


def scientific(text):
    """1.9e-06 -> $1.9\\cdot10^{-6}$, -5.8 -> $-$5.8"""
    power = re.fullmatch(r"(-?[\d.]+)e([+-]\d+)", text)
    if power:
        return rf"${power[1]}\cdot10^{{{int(power[2])}}}$"
    return re.sub(r"^-", "$-$", text)


def said(query):
    """A query within a sentence."""
    line = " ".join(query.split())
    return line if len(line) < 160 else line[:157] + "..."


def formatted(value, form=""):
    if isinstance(value, str):
        return escaped(value)
    return scientific(form % value if form else readable(float(value)))


class Paper:
    def __init__(self, root):
        self.root = pathlib.Path(root)
        with open(self.root / "paper/paper.toml", "rb") as file:
            self.settings = tomllib.load(file)
        with open(self.root / "paper/numbers.toml", "rb") as file:
            shared = tomllib.load(file)["numbers"]
        own = self.settings.get("numbers", {})
        twice = sorted(set(own) & set(shared))
        if twice:
            raise PaperError(f"paper/paper.toml and paper/numbers.toml both have the number {twice[0]}")
        self.numbers = {**shared, **own}
        self.tables = self.settings.get("tables", {})
        self.rows = RowDatabase(self.root)
        self.claims = ledger.read_claims(self.root)
        self.trusted = {}
        self.verdicts = None
        self.judged_effects = None

    # ---- The text.

    def sources(self):
        """The files that the paper is made of: the frame, and each section that paper.toml lists."""
        names = ["paper/hermesh.tex"] + [f"paper/sections/{name}.tex" for name in self.settings["sections"]]
        for name in names:
            if not (self.root / name).exists():
                raise PaperError(f"paper/paper.toml lists a section that is not there: {name}")
        return names

    def asked(self):
        """{"number": {name: where}, "table": {name: where}}: what the text asks for, and where first."""
        found = {"N": {}, "T": {}}
        for name in self.sources():
            for at, line in enumerate((self.root / name).read_text().splitlines(), 1):
                for kind, what in re.findall(r"\\([NT])\{([^{}]*)\}", re.sub(r"(?<!\\)%.*", "", line)):
                    found[kind].setdefault(what, f"{name}:{at}")
        return found

    def orphans(self):
        """Digits of the text that no row explains, a sentence each."""
        found = []
        plain = self.settings.get("plain", [])
        for name in self.sources():
            text = (self.root / name).read_text()
            start = text.find(r"\begin{document}")
            found += [f"{name}:{line}: the number {number} is typed, not taken from results/: use \\N{{...}}, or name the "
                      "phrase in paper/paper.toml" for line, number in orphans(text, plain, max(start, 0))]
        return found

    # ---- The rows.

    def check_tables(self, query, what):
        """Raises PaperError if the query reads rows that must not be cited, or none."""
        tables = self.rows.tables_in(query)
        if not tables:
            raise PaperError(f"{what} reads no folder of results/ that has rows: {said(query)}")
        for table in tables:
            if table not in self.trusted:
                self.trusted[table] = self.rows.untrusted(table)
            if self.trusted[table]:
                raise PaperError(f"{what}: {self.trusted[table][0]}")

    def judged(self):
        """[(claim, verdict, figures)]"""
        if self.verdicts is None:
            self.verdicts = []
            for claim in self.claims:
                for table in ledger.tables_of(claim, self.rows):
                    self.check_tables(table, f"the claim {claim['id']}")
                verdict, figures = ledger.judge(claim, self.rows)
                if verdict == "missing":
                    raise PaperError(f"the claim {claim['id']} has no verdict: rows or tests are missing")
                self.verdicts.append((claim, verdict, figures))
        return self.verdicts

    def ask(self, query, what):
        """(columns, rows) of a query, of which there is at least one row. `what` asks, as errors say."""
        self.check_tables(query, what)
        try:
            columns, rows = self.rows.query(query)
        except PaperError as error:
            raise PaperError(f"{what}: {error}") from None
        if not rows:
            raise PaperError(f"{what} has no row: {said(query)}")
        return columns, rows

    def number(self, name):
        """The text of a number."""
        if name == "ablations" or name.startswith("ablations_"):
            return self.number_of_ablations(name)
        if name.startswith("claim "):
            return self.figure_of_claim(name)
        if name.startswith("count"):
            verdict = name[6:].replace("_", " ")
            if name != "count" and verdict not in ledger.VERDICTS:
                raise PaperError(f"the number {name} names no verdict")
            return str(sum(name == "count" or each == verdict for _, each, _ in self.judged()))
        entry = self.numbers.get(name)
        if entry is None:
            raise PaperError(f"there is no number {name} in paper/paper.toml or paper/numbers.toml")
        if isinstance(entry, dict) and "constant" in entry:
            return self.constant(name, entry)
        query, form = (entry, "") if isinstance(entry, str) else (entry["query"], entry.get("format", ""))
        names, found = self.ask(query, f"the number {name}")
        parts = []
        for column, value in zip(names, found[0]):
            if value is None:
                raise PaperError(f"the number {name}: the rows give no {column}: {said(query)}")
            part = formatted(value, form)
            if part not in parts:
                parts.append(part)
        return " to ".join(parts)

    def effects(self, what):
        """[(folder, its effects)] of all folders that have rows of an ablation."""
        if self.judged_effects is None:
            self.judged_effects = []
            for folder, rows in self.rows.rows_of.items():
                if ablations.is_ablation(rows):
                    self.check_tables(folder, what)
                    table = self.root / "results" / folder / "table.md"
                    self.judged_effects.append((folder, ablations.judged(
                        rows, table.read_text() if table.exists() else "", self.rows.value, f"results/{folder}")))
            if not self.judged_effects:
                raise PaperError(f"{what} has no row: no folder of results/ has rows of an ablation")
        return self.judged_effects

    def number_of_ablations(self, name):
        """ "ablations", or "ablations_holds" and so on: how many there are, or how many of their predictions have a verdict."""
        found = self.effects(f"the number {name}")
        if name == "ablations":
            return str(len(found))
        verdict = name.removeprefix("ablations_")
        if verdict not in ablations.VERDICTS:
            raise PaperError(f"the number {name} names no verdict on a prediction")
        return str(sum(effect["verdict"].startswith(verdict) for _, effects in found for effect in effects))

    def table_of_effects(self, entry, name):
        lines = [["factor", "level", "against", "column", head_of("effect|(95 %)", False), "predicted", "verdict"]]
        for _, effects in self.effects(f"the table {name}"):
            for effect in effects[:entry["ablations"]]:
                lines.append([escaped(effect["factor"]), escaped(effect["level"]), escaped(effect["baseline"]),
                              escaped(effect["column"] + {"ratio": ", ÷", "count-ratio": ", ÷", "difference": ", −"}[effect["measure"]]),
                              escaped(f"{effect['effect']} ({effect['interval']})"), escaped(effect["predicted"]),
                              escaped(effect["verdict"])])
        rules = changes(lines)
        return tabular(r"@{}>{\raggedright}p{0.2\textwidth}>{\raggedright}p{0.13\textwidth}>{\raggedright}p{0.1\textwidth}"
                       r">{\raggedright}p{0.14\textwidth}>{\raggedright}p{0.15\textwidth}>{\raggedright}p{0.09\textwidth}"
                       r">{\raggedright\arraybackslash}p{0.08\textwidth}@{}", lines, rules)

    def figure_of_claim(self, name):
        """ "claim ID FIGURE": a figure by which the claim was decided."""
        words = name.split()
        for claim, _, figures in self.judged():
            if claim["id"] == words[1] and words[2] in dict(figures):
                return formatted(dict(figures)[words[2]])
        raise PaperError(f"the number {name} names no figure of a claim")

    def constant(self, name, entry):
        """A constant of the program that the text promises, as its header has it."""
        path = self.root / entry["source"]
        value = re.search(rf"constexpr \w+ {entry['constant']} = ([\d.e+-]+);", path.read_text() if path.exists() else "")
        if not value:
            raise PaperError(f"the number {name}: {entry['source']} has no constant {entry['constant']}")
        return formatted(float(value[1]))

    def table(self, name):
        """The tabular of a table."""
        entry = self.tables.get(name)
        if entry is None:
            raise PaperError(f"there is no table {name} in paper/paper.toml")
        if "claims" in entry:
            return self.table_of_claims(entry["claims"], name)
        if entry.get("by_chapter"):
            return self.table_by_chapter()
        if "ablations" in entry:
            return self.table_of_effects(entry, name)
        heads, found = self.answer(entry, name)
        formats = entry.get("formats", {})
        numeric = [any(isinstance(row[c], (int, float)) for row in found) for c in range(len(heads))]
        align = "".join("r" if n else "l" for n in numeric)
        lines = [[head_of(h, n) for h, n in zip(heads, numeric)]]
        for row in found:
            lines.append(["--" if v is None else formatted(v, formats.get(h, "") if not isinstance(v, str) else "")
                          for h, v in zip(heads, row)])
        rule = entry.get("rule_before", "")
        return tabular(align, lines, [i for i in range(1, len(lines)) if i > 1 and lines[i][0].startswith(rule)] if rule else
                       changes(lines) if entry.get("groups") else [])

    def answer(self, entry, name):
        """What a table's query gives; with `folders`, one after another for each folder that the pattern meets."""
        queries = [entry["query"]]
        if "folders" in entry:
            queries = [entry["query"].replace("{folder}", f'"{folder}"') for folder in sorted(self.rows.rows_of)
                       if fnmatch.fnmatchcase(folder, entry["folders"])]
            if not queries:
                raise PaperError(f"the table {name} has no row: there is no results/{entry['folders']}")
        heads, found = [], []
        for query in queries:
            heads, rows = self.ask(query, f"the table {name}")
            found += rows
        return heads, found

    def table_of_claims(self, ids, name):
        by_id = {claim["id"]: (claim, verdict, figures) for claim, verdict, figures in self.judged()}
        lines = [["place", "the thesis says", "our rows"]]
        for each in ids:
            if each not in by_id:
                raise PaperError(f"the table {name}: there is no claim {each}")
            claim, verdict, figures = by_id[each]
            if verdict != "contradicted":
                raise PaperError(f"the table {name}: the claim {each} is {verdict}, not contradicted")
            place = claim["place"].split(";")[0].split(", figure")[0].split(", implied")[0]
            ours = ledger.text_of_figures(figures) if figures else "a test shows the contrary"
            lines.append([escaped(place[0].upper() + place[1:]), escaped(claim["says"]), escaped(ours)])
        return tabular(r"@{}>{\raggedright}p{0.12\textwidth}>{\raggedright}p{0.46\textwidth}"
                       r">{\raggedright\arraybackslash}p{0.36\textwidth}@{}", lines, [])

    def table_by_chapter(self):
        counts = {}
        for claim, verdict, _ in self.judged():
            counts.setdefault(ledger.chapter_of(claim), {}).setdefault(verdict, []).append(claim)
        order = sorted(counts, key=lambda c: (c != "abstract", int(c) if c.isdigit() else 0))
        lines = [["chapter", "repro-\\\\duced", "shape", "contra-\\\\dicted", "untest-\\\\able"]]
        lines[0] = [lines[0][0]] + [rf"\shortstack[r]{{{h}}}" for h in lines[0][1:]]
        for chapter in order:
            lines.append([chapter] + [str(len(counts[chapter].get(v, []))) for v in ledger.VERDICTS[:4]])
        lines.append(["all"] + [str(sum(v == verdict for _, v, _ in self.judged())) for verdict in ledger.VERDICTS[:4]])
        return tabular("lrrrr", lines, [len(lines) - 1])

    # ---- Files.

    def files(self):
        """{path below the output: its text}"""
        asked, files = self.asked(), {}
        lines = []
        for name, where in asked["N"].items():
            try:
                lines.append(rf"\papernumber{{{name}}}{{{self.number(name)}}}")
            except PaperError as error:
                raise PaperError(f"{where}: {error}") from None
        files["numbers.tex"] = sealed("\n".join(lines) + "\n")
        for name, where in asked["T"].items():
            try:
                files[f"tables/{name}.tex"] = sealed(self.table(name))
            except PaperError as error:
                raise PaperError(f"{where}: {error}") from None
        files["sections.tex"] = sealed("".join(rf"\input{{sections/{name}}}" + "\n" for name in self.settings["sections"]))
        return files

    def write(self, out):
        out = pathlib.Path(out)
        for path in sorted(out.glob("**/*.tex")):
            if not is_sealed(path.read_text()):
                raise PaperError(f"{path} was changed by hand: numbers come from results/ alone; remove the file")
        found = self.orphans()
        if found:
            raise PaperError("\n".join(found))
        files = self.files()
        self.check_experiments()
        for path in out.glob("tables/*.tex"):
            path.unlink()
        for name, text in files.items():
            (out / name).parent.mkdir(parents=True, exist_ok=True)
            (out / name).write_text(text)
        return len(self.asked()["N"]), len(self.asked()["T"])

    def verify(self, out):
        """What in `out` differs from the rows, a sentence each."""
        found = []
        for name, right in self.files().items():
            path = pathlib.Path(out) / name
            if not path.exists():
                found.append(f"{path} is missing")
                continue
            lines, rights = path.read_text().splitlines()[1:], right.splitlines()[1:]
            differing = [(a, b) for a, b in zip(lines, rights) if a != b] or ([("", "")] if lines != rights else [])
            if differing:
                found.append(f"{path} has \"{differing[0][0]}\", by the rows it is \"{differing[0][1]}\"")
            elif not is_sealed(path.read_text()):
                found.append(f"{path} was changed by hand")
        return found

    def used_tables(self):
        """The folders of results/ that the paper's numbers, tables and verdicts read."""
        asked, queries = self.asked(), []
        for name in asked["N"]:
            entry = self.numbers.get(name, "")
            queries.append(entry if isinstance(entry, str) else entry.get("query", ""))
        queries += [self.tables[name].get("query", "") for name in asked["T"] if name in self.tables]
        used = {table for query in queries for table in self.rows.tables_in(query)}
        if self.verdicts is not None:
            used.update(table for claim in self.claims for table in ledger.tables_of(claim, self.rows))
        return sorted(used)

    def check_experiments(self):
        """Raises PaperError where an experiment's file describes a variant otherwise than when its rows were made, and
        paper.toml does not say why the rows stand."""
        for table in self.used_tables():
            stands = self.settings.get("changed", {}).get(table, {})
            for experiment, commit, labels in changed_since(self.root, self.rows.rows_of[table]):
                left = [label for label in labels if label not in stands.get("labels", [])]
                if left:
                    raise PaperError(f"results/{table} is stale: {experiment}.toml has changed {', '.join(left)} since "
                                     f"commit {commit[:12]} made the rows; make these anew, or say in paper/paper.toml why they stand")


def changed_since(root, rows):
    """[(experiment, commit, labels)]: the variants of rows that the experiment's file, as it is now, describes otherwise than at
    the rows' commit. Nothing where git does not have the commit, or the experiment has no file."""
    found = []
    for commit, experiment in sorted({(r["commit"], r["experiment"]) for r in rows}):
        path = next(iter(sorted((root / "experiments").glob(f"**/{experiment}.toml"))), None)
        if path is None:
            continue
        there = subprocess.run(["git", "-C", str(root), "ls-tree", "-r", "--name-only", commit, "experiments"],
                               capture_output=True, text=True).stdout.split("\n")
        place = next((name for name in there if name.endswith(f"/{experiment}.toml")), "")  # files move between commits
        shown = subprocess.run(["git", "-C", str(root), "show", f"{commit}:{place}"], capture_output=True, text=True)
        if shown.returncode != 0:
            continue
        old, new = tomllib.loads(shown.stdout), tomllib.loads(path.read_text())
        for key in ("variants", "voxelizers"):
            before, after = ({v if isinstance(v, str) else v.get("label", v.get("name")): v for v in file.get(key, [])}
                             for file in (old, new))
            labels = {r["variant"].get("label") for r in rows if r["commit"] == commit}
            other = sorted(l for l in labels & set(before) if before[l] != after.get(l))
            if other:
                found.append((experiment, commit, other))
    return found


def head_of(text, numeric):
    parts = [escaped(part) for part in text.split("|")]
    side = "r" if numeric else "l"
    # The braces keep LaTeX from taking "[s]" for a distance between the lines.
    return parts[0] if len(parts) == 1 else rf"\shortstack[{side}]{{" + "\\\\{}".join(parts) + "}"


def changes(lines):
    """Numbers of the lines before which the first column changes; a repeated first entry is left out."""
    rules, last = [], None
    for i in range(1, len(lines)):
        if lines[i][0] == last:
            lines[i][0] = ""
        else:
            last = lines[i][0]
            if i > 1:
                rules.append(i)
    return rules


def tabular(align, lines, rules):
    if not align.startswith("@"):
        align = "@{}" + align + "@{}"
    out = [rf"\begin{{tabular}}{{{align}}}", r"\toprule", " & ".join(lines[0]) + r" \\", r"\midrule"]
    for i, line in enumerate(lines[1:], 1):
        if i in rules:
            out.append(r"\addlinespace")
        out.append(" & ".join(line) + r" \\")
    return "\n".join(out + [r"\bottomrule", r"\end{tabular}"]) + "\n"


def sealed(text):
    return f"% Made by paper/paper_numbers.py from results/; sha256 of what follows {hashlib.sha256(text.encode()).hexdigest()}\n{text}"


def is_sealed(text):
    head, _, rest = text.partition("\n")
    return head.endswith(hashlib.sha256(rest.encode()).hexdigest())


PLACES = (r"(?:chapters?|sections?|tables?|figures?|fig\.|figs\.?|eq\.|eqs\.?|equations?|algorithms?|\\S)(?:~|\s|\{\})*"
          r"\d+(?:\.\d+)*(?:\s*(?:,|to|and|or|--)(?:~|\s)*\d+(?:\.\d+)*)*")


def orphans(text, plain, start=0):
    """[(line, number)] of the digits that stand in the text and are neither macros nor names of places nor years."""
    def blank(match):
        return re.sub(r"[^\n]", " ", match[0])

    text = re.sub(r"[^\n]", " ", text[:start]) + text[start:]
    text = re.sub(r"(?<!\\)%.*", blank, text)
    for phrase in sorted(plain, key=len, reverse=True):
        text = re.sub(r"\s+".join(re.escape(word) for word in phrase.split()), blank, text)
    for pattern in [
            r"\\(?:N|T|ref|label|eqref|pageref|cite[pt]?|input|bibliography|bibliographystyle|url|begin|end|texttt)\{[^{}]*\}",
            r"\\(?:includegraphics|picture)(?:\[[^\]]*\])?\{[^{}]*\}", r"\\(?:vspace|hspace|setlength|addtolength)\*?\{[^{}]*\}(?:\{[^{}]*\})?",
            r"\{[\d.]*\\(?:text|line|column)width\}", r"\\\\\[[^\]]*\]", r"[_^]\{?\d\}?"]:
        text = re.sub(pattern, blank, text)
    text = re.sub(PLACES, blank, text, flags=re.I)
    text = re.sub(r"\\[A-Za-z]+", blank, text)
    found = []
    for match in re.finditer(r"(?<![A-Za-z\d+])\d+(?:[.,]\d+)*", text):
        if re.fullmatch(r"(?:19|20)\d\d", match[0]):
            continue
        found.append((text.count("\n", 0, match.start()) + 1, match[0]))
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", default=pathlib.Path(__file__).resolve().parent.parent, type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path)
    parser.add_argument("--verify", type=pathlib.Path)
    options = parser.parse_args()
    if not (options.out or options.verify):
        parser.error("--out or --verify is needed")
    try:
        paper = Paper(options.root)
        if options.verify:
            found = paper.verify(options.verify) + paper.orphans()
            if found:
                raise PaperError("\n".join(found))
        if options.out:
            numbers, tables = paper.write(options.out)
            print(f"{numbers} numbers and {tables} tables from results/")
    except PaperError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
