"""Code mutants: the command `mutants` changes algorithms/ and validation/ in one place at a time, and records
which test notices.

A sample of all possible changes, the same at any time for the same files, is tried in a worktree of the last
commit. Only the files that a mutant changes are compiled. The tests of its folder come first, then those of
its directory, then the default tier. The same command continues after an interruption, and shards can share
the work. A mutant whose test program has the same bytes as before is equivalent; others are argued for in
experiments/changed_constants/equivalent_mutants.tsv, by their identity.
"""

import collections
import hashlib
import itertools
import json
import os
import pathlib
import re
import subprocess
import sys
import time

from .driver import shard_of
from .rates import rate
from .rows import ROOT, LabError, append_rows, drop_torn_row

DIRECTORIES = ("algorithms", "validation")
EQUIVALENT = ROOT / "experiments/changed_constants/equivalent_mutants.tsv"
SECONDS = 1200  # of one build or test; a mutant that takes longer is noticed
ROWS = "rows.ndjson"
# Operator: [(what is matched, what replaces it)]. Binary operators have spaces, template brackets do not.
_SWAPS = {
    "comparison": [(r" < ", " <= "), (r" <= ", " < "), (r" > ", " >= "), (r" >= ", " > "), (r" == ", " != "),
                   (r" != ", " == ")],
    "arithmetic": [(r" \+ ", " - "), (r" - ", " + "), (r" \* ", " / "), (r" \+= ", " -= "),
                   (r" -= ", " += ")],
    "logic": [(r" && ", " || "), (r" \|\| ", " && "), (r"\btrue\b", "false"), (r"\bfalse\b", "true"),
              (r"!(?=[a-z(])", "")],
    "axis": [(r"\.x\(\)", ".y()"), (r"\.y\(\)", ".z()"), (r"\.z\(\)", ".x()"), (r"\+ 1\) % 3", "+ 2) % 3"),
             (r"\+ 2\) % 3", "+ 1) % 3"), (r"\[0\]", "[1]"), (r"\[1\]", "[0]"), (r"\[2\]", "[1]")],
    "extreme": [(r"std::min\b", "std::max"), (r"std::max\b", "std::min"), (r"\bcwiseMin\b", "cwiseMax"),
                (r"\bcwiseMax\b", "cwiseMin")],
    "number": [(r"(?<![\w.<\[])(\d{1,4})(?![\w.>\]]|\) % 3)", lambda m: str(int(m[1]) + 1))],
    "threshold": [(r"(?<![\w.])(\d+\.\d+(?:e-?\d+)?|\d+e-?\d+)(f?)\b",
                   lambda m: f"{2 * float(m[1]) or 1.0!r}{m[2]}")],
    "jump": [(r"\bcontinue;", "break;"), (r"\bbreak;", "continue;")],
    # A statement that only calls a function, such as a proof's step, a lock or a cancellation point.
    "dropped step": [(r"^ +(?:const std::(?:lock_guard|scoped_lock)\b.*|[\w.:>-]+\([^{}]*\));$", ";")],
}
OPERATORS = [(name, re.compile(pattern), to) for name, swaps in _SWAPS.items() for pattern, to in swaps]
_NO_CODE = re.compile(r"^\s*(//|#|\*|using |namespace |template|static_assert|throw |assert|[}\]);]*\s*$)")
_TEXT = re.compile(r'"(?:\\.|[^"\\])*"|//.*$')


def mutants_of(name, text):
    """Yields the mutants of a file: {id, file, line, operator, before, after}, in the order of its lines."""
    for number, line in enumerate(text.split("\n"), 1):
        if _NO_CODE.search(line):
            continue
        code = _TEXT.sub(lambda match: "\0" * len(match[0]), line)  # nothing in texts and comments
        for operator, pattern, to in OPERATORS:
            for match in pattern.finditer(code):
                new = to(match) if callable(to) else to
                after = line[:match.start()] + new + line[match.end():]
                identity = hashlib.sha256(f"{name}\n{line}\n{after}\n{match.start()}".encode()).hexdigest()
                yield {"id": identity[:12], "file": name, "line": number, "operator": operator,
                       "before": line.strip(), "after": after.strip(), "text": after}


def all_mutants(root, directories=DIRECTORIES, endings=(".cpp",)):
    """Returns the mutants of all sources that are no tests, in a random order that depends only on them."""
    found = {}
    for directory in directories:
        for path in sorted(pathlib.Path(root, directory).rglob("*")):
            if path.suffix in endings and "test" not in path.name:
                name = str(path.relative_to(root))
                found |= {mutant["id"]: mutant for mutant in mutants_of(name, path.read_text())}
    return [found[identity] for identity in sorted(found)]  # a hash is a random order


def sample(mutants, count):
    """Returns a number of mutants, of each operator as many as of the others where there are enough."""
    kinds = collections.defaultdict(list)
    for mutant in mutants:
        kinds[mutant["operator"]].append(mutant)
    turns = itertools.zip_longest(*(kinds[kind] for kind in sorted(kinds)))
    return [mutant for turn in turns for mutant in turn if mutant][:count]


def equivalents():
    """Returns {id: argument} of the mutants that change nothing."""
    if not EQUIVALENT.exists():
        return {}
    lines = [line for line in EQUIVALENT.read_text().splitlines() if line and not line.startswith("#")]
    return dict(line.split("\t", 1) for line in lines)


class Bench:
    """A worktree with a build of its own, without unity batches, so that little is compiled for a mutant."""

    def __init__(self, keep, jobs):
        self.tree, self.jobs = pathlib.Path(keep).resolve() / "tree", str(jobs)
        if not self.tree.exists():
            subprocess.run(["git", "worktree", "add", "--quiet", "--detach", self.tree, "HEAD"], cwd=ROOT,
                           check=True)
        self.commit = self.run("git", "rev-parse", "HEAD").stdout.strip()
        self.digests, self.seconds = {}, {}  # by directory: of the program, and most of its tests

    def run(self, *command, seconds=SECONDS):
        return subprocess.run(command, cwd=self.tree, capture_output=True, text=True, errors="replace",
                              timeout=seconds)

    def build(self, *targets, seconds=SECONDS):
        """Returns why the build failed, or ""."""
        try:
            built = self.run("ninja", "-C", "build/release", f"-j{self.jobs}", *targets, seconds=seconds)
        except subprocess.TimeoutExpired:
            return "time limit of the compiler"
        return (built.stdout.strip() or "ninja").splitlines()[-1] if built.returncode else ""

    def test(self, *selection):
        """Returns the name of the first test that fails, or ""."""
        try:
            tested = self.run("ctest", "--preset", "release", "--stop-on-failure", f"-j{self.jobs}",
                              *selection)
        except subprocess.TimeoutExpired:
            return "time limit"
        failed = re.findall(r"^\s*\d+ - (\S+) \(", tested.stdout, re.M)
        return (failed[0] if failed else "ctest") if tested.returncode else ""

    def program(self, directory):
        return self.tree / f"build/release/{directory}/{directory}_test"

    def digest(self, directory):
        return hashlib.sha256(self.program(directory).read_bytes()).hexdigest()

    def test_directory(self, directory, folder=None):
        """Returns the name of the first test of a directory that fails, or ""; a folder's come first."""
        own = {suite for path in (folder.glob("*_test.cpp") if folder else ())
               for suite in re.findall(r"^TEST\w*\((\w+),", path.read_text(), re.M)}
        for tests in filter(None, (":".join(f"{suite}.*:*/{suite}.*" for suite in sorted(own)), "*")):
            try:
                tested = self.run(self.program(directory), f"--gtest_filter={tests}-Slow.*",
                                  "--gtest_fail_fast", "--gtest_brief=1",
                                  seconds=self.seconds.get(directory, SECONDS))
            except subprocess.TimeoutExpired:
                return "time limit"
            if tested.returncode:
                failed = re.search(r"^\[  FAILED  \] ([^\s,]+)", tested.stdout, re.M)
                return failed[1] if failed else f"exit code {tested.returncode}"
        return ""

    def prepare(self, directories, say):
        """Builds the tests of the commit, which must succeed."""
        configured = self.run("cmake", "--preset", "release", "-DCMAKE_UNITY_BUILD=OFF")
        if configured.returncode:
            raise LabError(f"cmake failed: {configured.stderr.strip()[-300:]}")
        for directory in directories:
            say(f"building {directory}_test without a mutant")
            why, start = self.build(f"{directory}_test", seconds=None), time.monotonic()
            if why := why or self.test_directory(directory):
                raise LabError(f"the tests of {directory} fail without a mutant: {why}")
            self.seconds[directory] = min(SECONDS, 60 + 3 * (time.monotonic() - start))
            self.digests[directory] = self.digest(directory)

    def attempt(self, mutant, tier):
        """Returns the outcome of a mutant, and which test noticed it."""
        path, directory = self.tree / mutant["file"], mutant["file"].split("/")[0]
        text = path.read_text()
        lines = text.split("\n")
        lines[mutant["line"] - 1] = mutant["text"]
        try:
            path.write_text("\n".join(lines))
            if why := self.build(f"{directory}_test"):
                return ("noticed", why) if why.startswith("time") else ("not compiled", "")
            if self.digest(directory) == self.digests[directory]:
                return "equivalent", "the same machine code"
            if test := self.test_directory(directory, path.parent):
                return "noticed", test
            if tier == "directory":
                return "survived its directory", ""
            if why := self.build():
                return "not compiled", why
            test = self.test()
            return ("noticed", test) if test else ("survived", "")
        finally:
            path.write_text(text)


def read_rows(out):
    """Returns {id: row} of all shards in a directory; the last of a mutant counts."""
    rows = {}
    for file in sorted(pathlib.Path(out).glob("rows*.ndjson")):
        drop_torn_row(file)
        rows |= {row["id"]: row for row in map(json.loads, file.read_text().splitlines())}
    return rows


def report(rows):
    """Returns the table of outcomes by directory and operator, and the survivors."""
    argued = equivalents()
    outcome = {key: row["outcome"] for key, row in rows.items()}
    outcome |= {key: "equivalent" for key in argued if outcome.get(key, "").startswith("survived")}
    counts = collections.Counter((row["file"].split("/")[0], row["operator"], outcome[key])
                                 for key, row in rows.items())
    commits = sorted({row["commit"][:12] for row in rows.values()})
    lines = [f"{len(rows)} mutants, commits {', '.join(commits)}", "",
             "| directory | operator | noticed | survived | equivalent | not compiled | noticed, % |",
             "| --- | --- | --: | --: | --: | --: | --- |"]
    groups = sorted({key[:2] for key in counts})
    for directory, operator in [*groups, ("all", "all")]:
        chosen = collections.Counter()
        for (where, kind, what), count in counts.items():
            if (directory, operator) in ((where, kind), ("all", "all")):
                chosen[what.split()[0]] += count
        decided = chosen["noticed"] + chosen["survived"]
        lines.append(f"| {directory} | {operator} | {chosen['noticed']} | {chosen['survived']} | "
                     f"{chosen['equivalent']} | {chosen['not']} | "
                     f"{rate(chosen['noticed'], decided) if decided else '–'} |")
    lines += ["", "Mutants that no test noticed:", ""]
    lines += [f"- `{key}` {row['file']}:{row['line']}: `{row['before']}` → `{row['after']}`"
              for key, row in sorted(rows.items()) if outcome[key].startswith("survived")]
    by = collections.Counter(row["by"].split(".")[0] for row in rows.values() if row["outcome"] == "noticed")
    lines += ["", "Noticed by: " + ", ".join(f"{name} {count}" for name, count in by.most_common())]
    return "\n".join(lines) + "\n"


def add_command(subparsers):
    parser = subparsers.add_parser(
        "mutants", help="change the code in one place at a time and record which test notices; exit code 3 "
        "if none notices a mutant that is not argued to be equivalent")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("results/local/mutants"),
                        help="directory of the rows (default: %(default)s)")
    parser.add_argument("--keep", type=pathlib.Path, default=pathlib.Path("results/local/mutants/bench"),
                        help="directory of the worktree and its build (default: %(default)s)")
    parser.add_argument("--directory", choices=DIRECTORIES, help="mutants of this directory only")
    parser.add_argument("--headers", action="store_true",
                        help="mutants of headers, too, which recompile a large part of the program")
    parser.add_argument("--count", type=int, default=300, help="number of mutants (default: %(default)s)")
    parser.add_argument("--shard", type=shard_of, metavar="I/N", default=(1, 1), help="only part I of N")
    parser.add_argument("--tier", choices=("directory", "default"), default="default",
                        help="tests of the mutant's directory only, or the default tests, too")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes of builds and tests")
    parser.add_argument("--only-list", action="store_true", help="print the mutants")
    parser.set_defaults(function=run)


def run(arguments):
    directories = [arguments.directory] if arguments.directory else list(DIRECTORIES)
    endings = (".cpp", ".h") if arguments.headers else (".cpp",)
    number, of = arguments.shard
    if arguments.only_list:
        for mutant in sample(all_mutants(ROOT, directories, endings), arguments.count)[number - 1::of]:
            print("\t".join(str(value) for key, value in mutant.items() if key != "text"))
        return 0
    arguments.out.mkdir(parents=True, exist_ok=True)
    bench = Bench(arguments.keep, arguments.jobs)
    chosen = sample(all_mutants(bench.tree, directories, endings), arguments.count)[number - 1::of]
    done = read_rows(arguments.out)
    # A survivor of its directory's tests is tried again if more tests are asked for.
    todo = [mutant for mutant in chosen if mutant["id"] not in done or arguments.tier == "default"
            and done[mutant["id"]]["outcome"] == "survived its directory"]
    if todo:
        bench.prepare(sorted({mutant["file"].split("/")[0] for mutant in todo}),
                      lambda text: print(text, file=sys.stderr))
    for mutant in todo:
        start = time.monotonic()
        outcome, by = bench.attempt(mutant, arguments.tier)
        row = {key: value for key, value in mutant.items() if key != "text"} | {
            "outcome": outcome, "by": by, "seconds": round(time.monotonic() - start, 1),
            "commit": bench.commit}
        append_rows(arguments.out / (ROWS if of == 1 else f"rows-{number}-of-{of}.ndjson"), [row])
        print(f"{mutant['file']}:{mutant['line']}\t{mutant['operator']}\t{outcome}\t{by}", flush=True)
    text = report(read_rows(arguments.out))
    (arguments.out / "table.md").write_text(text)
    print(text)
    argued = equivalents()
    return 3 if any(row["outcome"] == "survived" and key not in argued
                    for key, row in read_rows(arguments.out).items()) else 0
