"""Runs the examples, and the script of the README, in a fresh virtual environment in which the wheel is
installed, and compares what they print with the comments at their ends: run_examples.py WHEEL [--write]. With
--write it writes these comments; with --installed instead of a wheel the environment uses the module of the
distribution's package.

The models of $HERMESH_DATA are used if they exist; without them each example uses shapes of its own, and has
another comment.
"""

import os
import pathlib
import re
import subprocess
import sys
import tempfile
import venv

ours = pathlib.Path(__file__).resolve().parent.parent
wheel, write = sys.argv[1], "--write" in sys.argv
without, with_models = "# Without models it prints\n", "# With that of $HERMESH_DATA it prints\n"
bad = 0


def commented(printed):
    return "".join(f"#   {line}".rstrip() + "\n" for line in printed.splitlines())


def run(command, **options):
    done = subprocess.run(command, capture_output=True, text=True, **options)
    if done.returncode != 0:
        sys.exit(f"{command}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


with tempfile.TemporaryDirectory() as folder:
    # numpy is the distribution's.
    venv.create(folder, system_site_packages=True, with_pip=True)
    python = os.path.join(folder, "bin", "python")
    environment = {key: value for key, value in os.environ.items()
                   if key not in ("HERMESH_DATA", "PYTHONPATH")}
    environment["PYTHONIOENCODING"] = "utf-8"
    places = [folder, os.path.realpath(folder)]
    if wheel == "--installed":
        places = ["/usr/lib/python3/dist-packages"]
    else:
        run([python, "-m", "pip", "install", "--quiet", "--no-index", "--no-deps", wheel], env=environment)
    where = run([python, "-c", "import hermesh; print(hermesh.__file__)"], env=environment, cwd=folder)
    if not any(where.startswith(place) for place in places):
        sys.exit(f"the module was not taken from {places[0]}, but from {where}")

    for example in sorted(ours.glob("examples/*.py")):
        source = example.read_text(encoding="utf-8")
        model = re.search(r'shapes\.model\("([^"]+)"\)', source)
        if not model:
            continue
        code = re.split(f"(?m)^(?={re.escape(without)})", source)[0].rstrip() + "\n"
        comments = {without: "", with_models: ""}
        for title in comments:
            if title in source:
                comments[title] = re.match("(#   .*\n|#\n)*", source.split(title, 1)[1]).group(0)
        data = os.environ.get("HERMESH_DATA")
        runs = {without: environment}
        if data and pathlib.Path(data, model.group(1)).exists():
            runs[with_models] = {**environment, "HERMESH_DATA": data}
        for title, variables in runs.items():
            printed = commented(run([python, example], env=variables, cwd=folder))
            if write:
                comments[title] = printed
            elif comments[title] != printed:
                print(f"{example.name} says:\n{title}{comments[title]}but prints\n{printed}")
                bad = 1
            else:
                print(f"{example.name}: as its comment says ({len(printed.splitlines())} lines)")
        if write:
            example.write_text(code + "\n" + "\n".join(title + text for title, text in comments.items()),
                               encoding="utf-8")

    # The script of the README reads scan.ply where it is started.
    script = re.search("```python\n(.*?)```", (ours / "README.md").read_text(encoding="utf-8"),
                       re.DOTALL).group(1)
    if len(script.splitlines()) > 10:
        sys.exit("the script of the README has more than ten lines")
    run([python, "-c", "import shapes, hermesh; hermesh.write_mesh('scan.ply', shapes.torus())"], cwd=folder,
        env={**environment, "PYTHONPATH": str(ours / "examples")})
    pathlib.Path(folder, "readme.py").write_text(script, encoding="utf-8")
    print("README:", run([python, "readme.py"], cwd=folder, env=environment).strip().replace("\n", "; "))
sys.exit(bad)
