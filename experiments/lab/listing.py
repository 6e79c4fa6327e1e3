"""The command list: experiments and cases, which `hermesh list` appends to its variants."""

import json
import tomllib

from . import experiment
from .rows import ROOT


def cases():
    """Returns (name, summary, kind) of each case; its kind is file, generated or volume."""
    document = tomllib.loads((ROOT / "experiments/cases.toml").read_text())
    return [(case["name"], case["summary"],
             "volume" if "volume" in case else "file" if "files" in case else "generated")
            for case in document["case"]]


def add_command(subparsers):
    parser = subparsers.add_parser("list", help="list experiments and cases")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.set_defaults(function=run)


def run(arguments):
    experiments = experiment.list_experiments()
    if arguments.json:
        keys = "name", "summary", "kind"
        listed = {"experiments": experiments, "cases": [dict(zip(keys, case)) for case in cases()]}
        print(json.dumps(listed, default=str))
        return 0
    print("\nexperiments (hermesh run NAME), and the tables and figures of the thesis that they make")
    for each in experiments:
        print(f"  {each['name']:<23} {each['question']}")
        if each["shows"]:
            print(f"  {'':<23} also called {', '.join(each['shows'])}")
    print("\ncases (inputs that experiments name)")
    for name, summary, kind in cases():
        print(f"  {name:<23} {summary} [{kind}]")
    return 0
