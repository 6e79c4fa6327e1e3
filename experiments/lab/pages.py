"""Numbers of the text that come from rows: markers of pages are filled from the rows and checked against
them.

  <!--=NAME-->8.9 to 10.8<!--/-->                   the number or the table NAME of paper/numbers.toml
  <!--=table DIR SUBJECT [RESOLUTION]-->…<!--/-->   the tables of results/DIR with that case (or table)
  <!--=legend DIR-->…<!--/-->                       the meanings of their headers
  <!--=claims-->…<!--/-->                           the claims of paper/claims.toml with their verdicts
  <!--=ablations-->…<!--/-->                        the effects of the full tiers of all ablations
  <!--=count VERDICT-->…<!--/-->                    the number of claims with that verdict; without one, of
                                                    all
"""

import functools
import hashlib
import pathlib
import re

from . import ablations, claims, experiment, plots, tables
from .database import RowDatabase
from .rows import LabError, find, latest_groups, readable, text_at

# What may have digits without a marker; other phrases with digits are listed in numbers.toml.
PLACES = (r"(?:\b(?i:chapters?|sections?|tables?|figures?|figs?\.?|eqs?\.?|equations?|algorithms?|trap|steps?)|§|\\S)"
          r"(?:~|\s|\{\})*\d+(?:\.\d+)*(?:\s*(?i:,|to|and|or|–|--)(?:~|\s)*\d+(?:\.\d+)*)*")
HIDDEN = [r"<!--.*?(?:-->|\Z)", r"```.*?(?:```|\Z)", r"`.*?(?:`|\Z)", r"\]\(.*?(?:\)|\Z)"]
NUMBER = r"\d+(?:[.,]\d+)*"
NAMES = rf"(?:(?<=[A-Za-z+])|(?<=[^ ]-)){NUMBER}"  # such as x86-64 or C++20
MARKER = re.compile(r"<!--=(?P<name>[^<>]*)-->(?P<content>(?:(?!<!--=).)*?)<!--/-->", re.DOTALL)


def check(root):
    """Returns a sentence for each problem.

    Problems are pages and tables that differ from the rows, numbers in the text of a page without a marker,
    rows that differ from results/SHA256SUMS, inputs of rows whose hash is not in cases.toml, and rows of
    ablations whose prediction was not committed before them.
    """
    pages = Pages(root)
    found = [problem for page in pages.names for problem in pages.problems_of(page)]
    found += [f"{file} is not what `hermesh report` makes of its rows; run `hermesh report --fill`"
              for file, text in pages.tables().items() if pages.read(file) != text]
    if pages.read("results/SHA256SUMS") != pages.sums():
        found.append("results/SHA256SUMS: rows differ from the hashes that were written when they were "
                     "accepted")
    return found + sorted(pages.problems_of_rows())


def fill(root):
    """Writes all pages, each results/*/table.md, and results/SHA256SUMS; returns the files that changed."""
    pages = Pages(root)
    changed = []
    for file, text in [*pages.tables().items(), ("results/SHA256SUMS", pages.sums()),
                       *((page, pages.filled(page)) for page in pages.names)]:
        if pages.read(file) != text:
            (pages.root / file).write_bytes(text.encode())
            changed.append(file)
    return changed


def read_numbers(path):
    """Returns the lists and tables of numbers.toml, whose head explains them. Raises LabError for a mistake
    in it.
    """
    phrases = experiment.list_of(experiment.text)
    keys = {"pages": phrases, "numbers": table_of(query_and_format), "tables": table_of(experiment.text),
            "plain": table_of(phrases)}
    read = experiment.read_table(claims.read_toml(path), path.name, {}, keys)
    return {"pages": [], "numbers": {}, "tables": {}, "plain": {}} | read


def table_of(check_value):
    """Returns a checker of tables with any keys."""
    def check_table(value, where):
        keys = value if isinstance(value, dict) else ()
        return experiment.read_table(value, where, {}, dict.fromkeys(keys, check_value))
    return check_table


def query_and_format(entry, where):
    """Checks a number; returns its query and its printf format, where "" stands for three significant digits.
    """
    entry = {"query": entry} if isinstance(entry, str) else entry
    text = experiment.text
    read = {"format": ""} | experiment.read_table(entry, where, {"query": text}, {"format": text})
    if not re.fullmatch("|[^%]*%[0-9.+]*[fge][^%]*", read["format"]):
        raise LabError(f"{where}: \"format\" must hold one of printf's %f, %g or %e")
    return read["query"], read["format"]


def formatted(value, form=""):
    """Returns a value for a reader."""
    return value if isinstance(value, str) else form % value if form else readable(value)


def rows_of_query(query, rows):
    """Returns (names of the columns, rows). Raises LabError if there are no rows."""
    names, found = rows.query(query)
    if not found:
        raise LabError(f"there is no row for: {query}")
    return names, found


def number_text(query, form, rows, write=formatted):
    """Returns the text of a number: "8.9", or "8.9 to 10.8" for a query with two columns. `write` formats one
    value.

    Raises LabError if the query returns no row, or NULL.
    """
    names, found = rows_of_query(query, rows)
    if None in found[0]:
        raise LabError(f"the rows give no {names[found[0].index(None)]} for: {query}")
    return " to ".join(dict.fromkeys(write(value, form) for value in found[0]))


def table_text(query, rows):
    """Returns the rows of a query as a table of Markdown. Raises LabError if there are none."""
    names, found = rows_of_query(query, rows)
    rule = ["---" if value is None or isinstance(value, str) else "--:" for value in found[0]]
    body = [["–" if value is None else formatted(value) for value in row] for row in found]
    return "\n" + "".join("| " + " | ".join(line) + " |\n" for line in [names, rule, *body])


def markers(text, page):
    """Returns the matches of MARKER. Raises LabError for a marker that does not end before the next one
    begins.
    """
    found = list(MARKER.finditer(text))
    starts = [start.start() for start in re.finditer("<!--=", text)]
    if unended := sorted(set(starts) - {marker.start() for marker in found}):
        raise LabError(f"{page}:{line_of(text, unended[0])}: this marker has no end <!--/-->")
    return found


def begins_line(marker):
    """Returns true if the marker of a number is the first of a line."""
    before = marker.string[:marker.start()].rpartition("\n")[2]
    return not before.strip() and "\n" not in marker["content"]


def line_of(text, at):
    return text.count("\n", 0, at) + 1


def typed_numbers(text, hidden, number):
    """Returns [(line, number)] for the matches of `number` in a text, except years and in matches of
    `hidden`.
    """
    for pattern in hidden:
        text = re.sub(pattern, lambda match: re.sub(r"[^\n]", " ", match[0]), text, flags=re.DOTALL)
    return [(line_of(text, found.start()), found[0]) for found in re.finditer(number, text)
            if not re.fullmatch(r"(19|20)\d\d", found[0])]


def orphans(text, plain):
    """Returns [(line, number)] for each number of a page that is in no marker, code, link, or phrase of
    `plain`.

    Years, and numbers of chapters, sections, tables, figures, equations and algorithms, do not count. A
    phrase may be broken between lines.
    """
    phrases = [re.escape(phrase).replace(r"\ ", r"\s+") for phrase in plain]
    return typed_numbers(text, [MARKER.pattern, *HIDDEN, *phrases, NAMES, PLACES], NUMBER)


def hash_line(root, table):
    """Returns the line of results/SHA256SUMS on a table, as sha256sum prints it."""
    file = f"{table}/rows.jsonl"
    if not (root / "results" / file).exists():
        file = f"{table}/rows.ndjson"  # of a benchmark
    return f"{hashlib.sha256((root / 'results' / file).read_bytes()).hexdigest()}  {file}\n"


class Pages:
    """The pages of a checkout with the sources of their numbers: paper/numbers.toml, paper/claims.toml and
    results/.
    """

    def __init__(self, root):
        self.root = pathlib.Path(root)
        read = read_numbers(self.root / "paper/numbers.toml")
        self.names, self.numbers, self.queries, self.plain = read.values()
        self.rows = RowDatabase()
        self.rows.add_directories(self.root / "results")
        self.shown = {name: plots.as_asked_today(rows, self.root / "results" / name)
                      for name, rows in self.rows.rows_of.items()}

    @functools.cached_property
    def verdicts(self):
        """[(claim, its verdict and values)]"""
        read = claims.read_claims(self.root / "paper/claims.toml")
        return [(claim, claims.judge(claim, self.rows)) for claim in read]

    def tables(self):
        """Returns {path from the root: text} of the table.md of each directory."""
        return {f"results/{name}/table.md": tables.markdown_report(rows)
                for name, rows in self.shown.items()}

    def sums(self):
        """Returns the hashes of all files of rows."""
        names = [*self.rows.tables, *self.rows.benchmarks]
        return "".join(hash_line(self.root, name) for name in sorted(names, key=lambda name: name + "/"))

    def read(self, file):
        """Returns the text of a file, None if there is none."""
        path = self.root / file
        return path.read_bytes().decode(errors="replace") if path.exists() else None

    def content_of(self, marker):
        """Returns what belongs into a marker. Raises LabError for an unknown name, or if rows are missing."""
        kind, *words = marker.split() or [""]
        if kind == "table" and len(words) in (2, 3):
            return "\n" + self._tables_of(*words) + "\n"
        if kind == "legend" and len(words) == 1:
            return "\n" + tables.legend(self._rows_of(words[0])).rstrip("\n") + "\n"
        if marker == "ablations":
            judged = [each for rows in self.rows.rows_of.values() for each in ablations.judge_ablations(rows)]
            return ablations.summary_of([each for each in judged if each.tier == "full"])
        if marker == "claims":
            return "\n" + claims.markdown(self.verdicts)
        if kind == "count":
            wanted = [" ".join(words)] if words else claims.VERDICTS
            return str(sum(judged.verdict in wanted for _, judged in self.verdicts))
        if marker in self.queries:
            return table_text(self.queries[marker], self.rows)
        if marker not in self.numbers:
            raise LabError(f"paper/numbers.toml has no number {marker}")
        return number_text(*self.numbers[marker], self.rows)

    def _rows_of(self, directory):
        if directory not in self.shown:
            raise LabError(f"there is no results/{directory}/rows.jsonl")
        return self.shown[directory]

    def _tables_of(self, directory, subject, resolution=None):
        groups = [group for group in latest_groups(self._rows_of(directory))
                  if text_at(group.rows[0], "/case/name") == subject
                  and resolution in (None, text_at(group.rows[0], "/resolution"))]
        if not groups:
            raise LabError("there is no such table")
        # Headings belong to a report of its own; within a page, the title of a table is a line.
        return re.sub(r"### ([^\n]*)", r"**\1**", "".join(map(tables.markdown_table, groups))).rstrip("\n")

    def _contents(self, page):
        """Returns the text of a page, and (its marker, "page:line", what belongs into it or the error) for
        each.
        """
        text, found = self.read(page), []
        if text is None:
            raise LabError(f"there is no page {page}, which paper/numbers.toml lists")
        for marker in markers(text, page):
            try:
                content = self.content_of(marker["name"])
            except LabError as error:
                content = error
            found.append((marker, f"{page}:{line_of(text, marker.start())}", content))
        return text, found

    def filled(self, page):
        """Returns the page's text with its markers filled."""
        text, contents = self._contents(page)
        result, done = "", 0
        for marker, where, content in contents:
            if isinstance(content, LabError):
                raise LabError(f"{where}: {content}")
            start, end = marker.span("content")
            result, done = result + text[done:start] + content, end
        return result + text[done:]

    def problems_of(self, page):
        """Returns a sentence for each marker of a page that differs from the rows or begins a line, and for
        each number without one.
        """
        text, contents = self._contents(page)
        found = []
        for marker, where, right in contents:
            if isinstance(right, LabError):
                found.append(f"{where}: {right}")
            elif begins_line(marker):
                found.append(f"{where}: {marker['name']} begins a line, which Markdown takes for HTML that "
                             "ends the paragraph; move a word before it")
            elif marker["content"] != right:
                is_short = len(marker["content"]) + len(right) < 200
                differs = (f'is "{marker["content"]}", by the rows "{right}"' if is_short
                           else "differs from the rows")
                found.append(f"{where}: {marker['name']} {differs}")
        plain = self.plain.get("all", []) + self.plain.get(page, [])
        return found + [f"{page}:{line}: {number} comes from no row: give it a marker, or name the phrase in "
                        "paper/numbers.toml" for line, number in orphans(text, plain)]

    def problems_of_rows(self):
        """Returns sentences on inputs that cases.toml does not list, and on predictions made after their
        rows.
        """
        cases = claims.read_toml(self.root / "experiments/cases.toml")["case"]
        known = {entry.get("sha256") for case in cases for entry in [case, *case.get("files", [])]} - {None}
        found = set()
        for name, rows in self.rows.rows_of.items():
            found |= {f"results/{name}: {problem}"
                      for problem in ablations.prediction_problems(rows, self.root)}
            for row in rows:
                for given in [row["case"], *(find(row, "/inputs") or [])]:
                    is_file, digest = (
                        given.get("origin") in ("data folder", "package registry"), given.get("sha256"))
                    if is_file and digest not in known:
                        found.add(f"results/{name}: the input {given.get('name')} has the SHA-256 {digest}, "
                                  "which experiments/cases.toml does not have")
        return found
