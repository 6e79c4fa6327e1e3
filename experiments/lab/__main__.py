"""python3 -m experiments.lab COMMAND: the laboratory, which `hermesh run`, `report`, `claims` and others
start.
"""

import argparse
import json
import os
import pathlib
import sys

from . import baseline, benchmark, claims, compare, driver, listing, merge, mutants, release, tables
from .rows import LabError

# Options that hermesh passes to each command; commands that do no work of their own ignore them.
COMMON = {"--threads": {"type": int, "help": "number of threads (default: all of the machine)"},
          "--quiet": {"action": "store_true", "help": "print only results and errors"},
          "--log": {"metavar": "FILE", "help": "append a log to a file"}}


class Parser(argparse.ArgumentParser):
    """Reports a mistake in one line, as all commands of hermesh do."""

    def error(self, message):
        self.exit(2, f"hermesh: {message}; see {self.prog} --help\n")


def print_options(commands):
    """Prints the options of all commands as JSON, for the manual and the completion of shells."""
    listed = {}
    for name, parser in commands.choices.items():
        listed[name] = [{"names": action.option_strings,
                         "place": "" if action.option_strings else action.metavar or action.dest,
                         "help": (action.help or "").replace("%%", "%"), "takes_value": action.nargs != 0,
                         "required": action.required, "choices": list(map(str, action.choices or []))}
                        for action in parser._actions if action.help != argparse.SUPPRESS]
    print(json.dumps(listed))
    return 0


def check_log(parser, arguments):
    """Exits if the log would be appended to a file that the command reads."""
    log = getattr(arguments, "log", None)
    others = [str(value) for name, value in vars(arguments).items() if name != "log"
              and isinstance(value, (str, pathlib.Path))]
    if log and os.path.exists(log) and any(os.path.exists(each) and os.path.samefile(log, each)
                                           for each in others):
        parser.error(f"--log '{log}' is a file that the command reads; choose another name")


def main(words=None):
    parser = Parser(prog="hermesh", description="Runs experiments and reads their rows.")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for module in (driver, tables, claims, compare, baseline, merge, listing, benchmark,
                   mutants, release):
        module.add_command(commands)
    for command in commands.choices.values():
        for option, settings in COMMON.items():
            if option not in command._option_string_actions:
                command.add_argument(option, **settings)
    commands.add_parser("options").set_defaults(function=lambda arguments: print_options(commands))
    arguments = parser.parse_args(words)
    check_log(parser, arguments)
    try:
        status = arguments.function(arguments)
        sys.stdout.flush()
        return status
    except (LabError, OSError) as error:
        if isinstance(error, BrokenPipeError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # the reader has seen enough
            return 1
        print(f"hermesh: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())
