"""The command list: experiments and cases, which `hermesh list` appends to its variants."""

import json

from . import experiment, models


def cases():
    """Returns the name, summary, kind (file, generated or volume) and privacy of each case."""
    return [{"name": name, "summary": case["summary"], "kind": models.kind_of(case),
             "private": models.is_private(name)}
            for name, case in models.catalogue().items()]


def add_command(subparsers):
    parser = subparsers.add_parser("list", help="list experiments and cases")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.set_defaults(function=run)


def run(arguments):
    experiments = experiment.list_experiments()
    if arguments.json:
        print(json.dumps({"experiments": experiments, "cases": cases()}, default=str))
        return 0
    print("\nexperiments (hermesh run NAME), and the tables and figures of the thesis that they make")
    for each in experiments:
        print(f"  {each['name']:<23} {each['question']}")
        if each["shows"]:
            print(f"  {'':<23} makes {', '.join(each['shows'])}")
    print("\ncases (inputs that experiments name); the files of a private case have no public source: without "
          "them in $HERMESH_DATA, a stand-in of the same size replaces it")
    for case in cases():
        print(f"  {case['name']:<23} {case['summary']} [{case['kind']}{', private' * case['private']}]")
    return 0
