"""Statements that occur in more than one page (paper/statements.toml), compared with each other and with the
program.
"""

import pathlib
import re
import subprocess

from . import experiment
from .claims import read_toml
from .rows import LabError

FILE = "paper/statements.toml"
_texts = experiment.list_of(experiment.text)


def _place(value, where):
    return experiment.read_table(value, where, {"in": experiment.text, "pattern": experiment.text})


def _statement(value, where):
    required = {"name": experiment.text, "places": experiment.list_of(_place)}
    return {"everywhere": ""} | experiment.read_table(value, where, required, {"everywhere": experiment.text})


def _contradiction(value, where):
    required = {"pattern": experiment.text, "why": experiment.text}
    return {"pages": []} | experiment.read_table(value, where, required, {"pages": _texts})


def read_statements(path):
    """Returns the statements and contradictions of a file, whose head explains them."""
    keys = {"statement": experiment.list_of(_statement), "contradiction": experiment.list_of(_contradiction)}
    return experiment.read_table(read_toml(path), path.name, keys)


def pages_of(root):
    """Returns the pages of a checkout: its Markdown and LaTeX files, except rows as tables."""
    found = [path for pattern in ("*.md", "*.tex") for path in pathlib.Path(root).rglob(pattern)]
    names = sorted(str(path.relative_to(root)) for path in found)
    ignored = ("build", "node_modules", ".cache", "local")
    return [name for name in names if not set(ignored) & set(name.split("/"))
            and not re.match(r"results/.*/table\.md", name)]


def flat(text):
    """Returns a text on one line, without the prefixes of comments and the pointers to values of rows."""
    text = re.sub(r"\n\s*(//[/!]?|#)(?= )", "\n", text)
    return re.sub(r"[ \t\r]*\n[ \t\r\n]*|[ \t]{2,}", " ", text)


def flat_pattern(pattern):
    """Returns a pattern for texts on one line: \\n at its beginning stands for any white space."""
    return pattern.replace(r"\n", r"\s")


def value_of(text):
    """Returns what a group states, without differences of spelling: 2,000 is 2000, Cubes is cubes."""
    text = re.sub(r"(?<=\d),(?=\d{3})", "", text).strip()
    return text[:1].lower() + text[1:]


class Checkout:
    """The texts of a checkout, and the output of its program if it is built."""

    def __init__(self, root, program=None):
        self.root, self.program, self.texts = pathlib.Path(root), program, {}

    def text(self, name):
        """Returns _read() of a name, which it reads once."""
        if name not in self.texts:
            self.texts[name] = self._read(name)
        return self.texts[name]

    def _read(self, name):
        """Returns a file or the output of a command on one line; None if the program is not built.

        Raises LabError if there is no such file, or if the command fails.
        """
        if not name.startswith("$ "):
            path = self.root / name
            if not path.is_file():
                raise LabError(f"{name}: there is no such file, which {FILE} lists")
            return flat(path.read_text(encoding="utf-8"))
        if not self.program:
            return None
        done = subprocess.run([self.program, *name[2:].split()], capture_output=True, text=True)
        if done.returncode:
            raise LabError(f"hermesh {name[2:]} fails: {done.stderr.strip()}")
        return flat(done.stdout)


def problems_of_statement(statement, checkout, pages):
    """Returns a message for each place that lacks the statement or differs from the first one."""
    found, problems = [], []
    for place in statement["places"]:
        try:
            text = checkout.text(place["in"])
        except LabError as error:
            problems.append(str(error))
            continue
        if text is None:
            continue
        matches = re.findall(flat_pattern(place["pattern"]), text)
        found += [(place["in"], value_of(match)) for match in matches]
        if not matches:
            problems.append(f"{place['in']} does not state the {statement['name']}; change the page, or its "
                            f"pattern in {FILE}")
    for page in pages if statement["everywhere"] else []:
        matches = re.findall(flat_pattern(statement["everywhere"]), checkout.text(page))
        found += [(page, value_of(match)) for match in matches]
    if found:
        decides, right = found[0]
        problems += [f"{place}: the {statement['name']} is \"{value}\", but \"{right}\" in {decides}"
                     for place, value in dict.fromkeys(found) if value != right]
    return problems


def problems(checkout):
    """Returns a message for each contradiction in a Checkout."""
    read, pages = read_statements(checkout.root / FILE), pages_of(checkout.root)
    found = [problem for statement in read["statement"]
             for problem in problems_of_statement(statement, checkout, pages)]
    for each in read["contradiction"]:
        for page in each["pages"] or pages:
            match = re.search(flat_pattern(each["pattern"]), checkout.text(page))
            if match:
                found.append(f"{page}: \"{match[0].strip()}\" is wrong: {each['why']}")
    return found
