#!/usr/bin/env python3
"""Runs the commands of the tutorials: run_tutorials.py PROGRAM MODULES, where MODULES is the folder that
contains the built package hermesh.

Each tutorial gets a directory with the files of docs/tutorials. The blocks marked `sh` are run, line by line;
`# exit code N` at the end of a line is the exit code that is expected instead of 0. Blocks marked `console`
are not run, because they take minutes or concern the reader's own paths.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import textwrap

program, module = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
tutorials = pathlib.Path(__file__).resolve().parent / "tutorials"
environment = {**os.environ, "PATH": f"{program.parent}:{os.environ['PATH']}", "PYTHONPATH": str(module)}
version = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout
bad = 0


def commands(page):
    blocks = re.findall(r"(?ms)^( *)```sh\n(.*?)^ *```", page.read_text(encoding="utf-8"))
    return [line for indent, block in blocks for line in textwrap.dedent(block).splitlines() if line.strip()]


for page in sorted(tutorials.glob("*.md")):
    lines = commands(page)
    if any("hermesh accept" in line for line in lines) and "with changes" in version:
        print(f"{page.name}: skipped, because rows of uncommitted sources cannot be accepted")
        continue
    with tempfile.TemporaryDirectory() as folder:
        for file in (*tutorials.glob("*.py"), *tutorials.glob("*.toml")):
            shutil.copy(file, folder)
        for line in lines:
            expected = int((re.search(r"# exit code (\d+)$", line) or [0, 0])[1])
            done = subprocess.run(["bash", "-c", line], cwd=folder, env=environment, text=True,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
            if done.returncode != expected:
                print(f"{page.name}: {line}\nexit code {done.returncode}, not {expected}\n{done.stdout}")
                bad = 1
                break
        else:
            print(f"{page.name}: {len(lines)} commands")
sys.exit(bad)
