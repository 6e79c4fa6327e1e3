"""Configuration of Sphinx for the documentation site, which docs/build.sh builds.

The source folder is the whole checkout, so that its pages are part of the site without copies.
Environment: HERMESH is the program, HERMESH_PYTHON the folder of the unpacked wheel, HERMESH_DOXYGEN
the folder of Doxygen's XML.
"""

import os
import pathlib
import subprocess
import sys
import textwrap
import tomllib

from docutils import nodes
from docutils.parsers.rst import Directive

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = os.environ.get("HERMESH", str(ROOT / "build/release/hermesh"))
sys.path.insert(0, os.environ.get("HERMESH_PYTHON", str(ROOT / "build/docs/python")))
import hermesh  # noqa: E402

project = "hermesh"
author = "The hermesh project"
project_copyright = "The hermesh project"
version = release = hermesh.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "numpydoc", "breathe"]

root_doc = "docs/index"
include_patterns = [
    "docs/**", "README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md", "CODE_OF_CONDUCT.md",
    "SECURITY.md", "algorithms/*/README.md", "validation/README.md", "reference/peers/README.md",
    "experiments/cli/*.md", "experiments/lab/*.md", "experiments/questions/README.md",
    "experiments/sweep/README.md", "experiments/fuzzing/README.md", "packages/*/README.md",
    "paper/README.md", "paper/claims.md", "paper/readings.md", "paper/ablations.md", "results/README.md"
]
exclude_patterns = ["build", ".git", ".cache", "results/local", "**/node_modules", "docs/README.md"]

html_theme = "furo"
html_title = f"hermesh {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_last_updated_fmt = None

default_role = "code"
pygments_style = "friendly"
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 4
suppress_warnings = ["myst.header"]

autodoc_member_order = "bysource"
autodoc_typehints = "none"
numpydoc_show_class_members = False
numpydoc_xref_param_type = False

breathe_projects = {"hermesh": os.environ.get("HERMESH_DOXYGEN", str(ROOT / "build/docs/doxygen/xml"))}
breathe_default_project = "hermesh"
cpp_id_attributes = ["HERMESH_API"]


class CommandHelp(Directive):
    """The help of all commands of the program, each in a section of its own."""

    def run(self):
        # The page is read again after a change of the program.
        self.state.document.settings.env.note_dependency(PROGRAM)
        # The width of the help does not depend on the terminal.
        environment = {**os.environ, "COLUMNS": "100"}
        text = lambda *words: subprocess.run([PROGRAM, *words, "--help"], check=True, capture_output=True,
                                             text=True, env=environment).stdout
        overview = text()
        made = [self.literal(overview)]
        for name in commands(overview):
            section = nodes.section(ids=["hermesh-" + name])
            section += nodes.title(text=name)
            section += self.literal(text(name))
            made.append(section)
        return made

    @staticmethod
    def literal(text):
        # The descriptions of options begin in column 30.
        text = "\n".join("\n".join(textwrap.wrap(line, 118, subsequent_indent=" " * 30)) or line
                         for line in text.splitlines())
        return nodes.literal_block(text, text, language="text")


class Columns(Directive):
    """A table of the columns of experiments/lab/columns.toml."""

    def run(self):
        listed = ROOT / "experiments/lab/columns.toml"
        self.state.document.settings.env.note_dependency(str(listed))
        with open(listed, "rb") as file:
            columns = tomllib.load(file)["column"]
        table, group, body = nodes.table(), nodes.tgroup(cols=3), nodes.tbody()
        group += [nodes.colspec(colwidth=width) for width in (2, 2, 5)]
        group += [nodes.thead("", row(["name", "header", "meaning"])), body]
        body += [row([column["name"], column["header"], column["meaning"]]) for column in columns]
        table += group
        return [table]


def row(texts):
    made = nodes.row()
    for text in texts:
        made += nodes.entry("", nodes.paragraph(text=text))
    return made


def commands(overview):
    """Returns the names of the commands that the overview lists."""
    names = []
    for line in overview.partition("Subcommands:")[2].splitlines():
        if line.startswith("  ") and line[2:3].strip():
            names.append(line.split()[0])
    return names


def without_site(app, env, node, child):
    """Shows a link to a file that is no page of the site as text: the path in the checkout."""
    target = node.get("reftarget", "").partition("#")[0]
    page = pathlib.Path(env.doc2path(node["refdoc"]))
    folder = page.parent
    path = (folder / target).resolve()
    if not path.exists():
        return None
    readme = path / "README.md"
    if readme.is_file():
        name = str(readme.relative_to(ROOT).with_suffix(""))
        if name in env.found_docs:
            made = nodes.reference("", "", internal=True,
                                   refuri=app.builder.get_relative_uri(node["refdoc"], name))
            made += child
            return made
    made = nodes.inline()
    made += child
    return made


def setup(app):
    app.add_directive("hermesh-help", CommandHelp)
    app.add_directive("hermesh-columns", Columns)
    app.connect("missing-reference", without_site)
    return {"parallel_read_safe": True}
