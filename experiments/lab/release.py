"""The command `release`: checks that all files agree in the version and its date, and prepares a tag.

The version is that of project() in CMakeLists.txt, from which the program, the packages, the wheel and the
C++ header get it. Other files state it again (STATED), because their readers do not run CMake.
"""

import json
import pathlib
import re
import subprocess

from .rows import LabError, ROOT

# (file, pattern of the version, pattern of its date or "")
STATED = [
    ("CITATION.cff", r"^version: (\S+)$", r"^date-released: (\S+)$"),
    ("codemeta.json", r'"version": "([^"]*)"', r'"dateModified": "([^"]*)"'),
    (".zenodo.json", r'"version": "([^"]*)"', r'"publication_date": "([^"]*)"'),
    ("CHANGELOG.md", r"^## (\S+), .*$", r"^## \S+, (\S+)$"),
    ("packages/debian/changelog", r"^hermesh \((.*)-\d+\)", r"^ -- .*>  \w+, (\d+ \w+ \d+) "),
    ("docs/tutorials/reproduce_and_cite.md", r"^ *version = \{(\S+)\}", ""),
    ("packages/python/README.md", r"hermesh-(\d[\d.]*\d)-\*\.whl", ""),
]
# Repeated in every file that archives and indices read.
NAMED = ["CITATION.cff", "codemeta.json", ".zenodo.json"]
REQUIRED = ["LICENSE", "LICENSE-GPL-3.0.txt", "LICENSES/Apache-2.0.txt", "REUSE.toml", "CODE_OF_CONDUCT.md",
            "SECURITY.md", "CONTRIBUTING.md", "packages/dependencies.tsv", "paper/joss/paper.md",
            "paper/joss/paper.bib", "paper/rescience/metadata.yaml"]
PLACEHOLDERS = r"10\.0000/placeholder|[a-z]+@example\.org|https://example\.org/\S+?(?=[\"\s>),]|$)"
MONTHS = "Jan Feb Mar Apr May Jun Jul Aug Sep Oct Nov Dec".split()


def iso_date(text):
    """Returns 2026-11-30 of "30 Nov 2026"; other texts unchanged."""
    day, _, rest = text.partition(" ")
    month, _, year = rest.partition(" ")
    return f"{year}-{1 + MONTHS.index(month):02}-{int(day):02}" if month in MONTHS else text


def read(root, file):
    path = pathlib.Path(root, file)
    if not path.is_file():
        raise LabError(f"{file} is missing")
    return path.read_text(encoding="utf-8")


def version_of(root):
    """Returns the version of project() in CMakeLists.txt."""
    text = read(root, "CMakeLists.txt")
    found = re.search(r"^project\(hermesh VERSION (\d+\.\d+\.\d+) ", text, re.MULTILINE)
    if not found:
        raise LabError("CMakeLists.txt: project(hermesh VERSION x.y.z …) is missing")
    return found[1]


def problems(root=ROOT):
    """Returns a message for each file that is missing, or differs from the others in version or date."""
    found, dates = [], {}
    version = version_of(root)
    for file, of_version, of_date in STATED:
        try:
            text = read(root, file)
        except LabError as error:
            found.append(str(error))
            continue
        stated = re.findall(of_version, text, re.MULTILINE)
        # The latest version is first in a list of changes; elsewhere all must agree.
        stated = stated[:1] if "hangelog" in file.lower() else stated
        if not stated:
            found.append(f"{file} states no version; CMakeLists.txt has {version}")
        found += [f"{file} has version {each}, CMakeLists.txt {version}"
                  for each in stated if each != version]
        if of_date:
            date = re.search(of_date, text, re.MULTILINE)
            dates[file] = iso_date(date[1]) if date else "none"
    if len(set(dates.values())) > 1:
        found.append("the dates of the version differ: "
                     + ", ".join(f"{file} has {date}" for file, date in dates.items()))
    changes = read(root, "CHANGELOG.md")
    if re.search(r"^## Unreleased", changes, re.MULTILINE):
        found.append("CHANGELOG.md has changes under \"Unreleased\"; move them below a version and its date")
    undated = re.findall(r"^## (?!\S+, \d{4}-\d\d-\d\d$)(.*)$", changes, re.MULTILINE)
    found += [f"CHANGELOG.md: \"## {title}\" has no date" for title in undated if title != "Unreleased"]
    for file in NAMED:
        text = read(root, file)
        if file.endswith(".json"):
            try:
                json.loads(text)
            except ValueError as error:
                found.append(f"{file} is not valid JSON: {error}")
    found += [f"{file} is missing" for file in REQUIRED if not pathlib.Path(root, file).is_file()]
    return found


def placeholders(root=ROOT):
    """Returns (file, placeholder) for each DOI and address that is not public yet."""
    files = [*NAMED, "README.md", "packages/debian/changelog", "packages/debian/packages.cmake",
             "paper/joss/paper.md", "paper/rescience/metadata.yaml"]
    return [(file, each) for file in files if pathlib.Path(root, file).is_file()
            for each in sorted(set(re.findall(PLACEHOLDERS, read(root, file))))]


def git(root, *words):
    return subprocess.run(["git", "-C", str(root), *words], capture_output=True, text=True, check=True).stdout


def problems_of_tag(root, version):
    """Returns a message for each reason why the present commit cannot get the tag of the version."""
    found = []
    if git(root, "status", "--porcelain"):
        found.append("the tree has uncommitted changes")
    if git(root, "tag", "--list", f"v{version}"):
        found.append(f"the tag v{version} exists already")
    return found


def notes(root, version):
    """Returns the section of CHANGELOG.md on a version."""
    found = re.search(rf"^## {re.escape(version)}, \S+\n(.*?)(?=^## |\Z)", read(root, "CHANGELOG.md"),
                      re.MULTILINE | re.DOTALL)
    return found[1].strip() if found else ""


def add_command(subparsers):
    parser = subparsers.add_parser(
        "release", help="check that all files agree in the version and its date, and prepare a tag")
    parser.add_argument("--tag", action="store_true",
                        help="create the annotated tag vVERSION with the changes as its message")
    parser.set_defaults(function=run)


def run(arguments):
    version, found = version_of(ROOT), problems()
    found += problems_of_tag(ROOT, version) if arguments.tag else []
    for file, each in placeholders():
        print(f"note: {file} has the placeholder {each}")
    if found:
        print("\n".join(found))
        return 3
    if arguments.tag:
        git(ROOT, "tag", "--annotate", f"v{version}", "--cleanup=verbatim",
            "--message", f"hermesh {version}\n\n{notes(ROOT, version)}\n")
        print(f"tagged v{version}; `git push origin v{version}` publishes it")
    else:
        print(f"all files agree in version {version}")
    return 0
