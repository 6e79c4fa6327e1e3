#!/usr/bin/env python3
"""check_log.py DIR: what LaTeX and BibTeX have noted in DIR that a reader would see: lines wider than their column by more
than a point, references and citations that lead nowhere. A sentence each, and exit code 1."""

import pathlib
import re
import sys

WIDEST = 1.0  # points


def problems(log, bibtex=""):
    found = []
    for box in re.finditer(r"Overfull \\(hbox|vbox) \(([\d.]+)pt too (?:wide|high)\)([^\n]*)", log):
        if float(box[2]) > WIDEST:
            near = re.findall(r"\(([^\s()]*?\.tex)", log[:box.start()])
            what = "a line is wider than its column" if box[1] == "hbox" else "a page is too high"
            found.append(f"{what} by {box[2]} pt{box[3]}, in or after {near[-1] if near else 'hermesh.tex'}")
    for what, name in re.findall(r"LaTeX Warning: (Reference|Citation) `([^']*)'[^\n]* undefined", log):
        found.append(f"the {what.lower()} {name} leads nowhere")
    found += re.findall(r"Warning--([^\n]*)", bibtex)
    return found


def main():
    out = pathlib.Path(sys.argv[1])
    log = (out / "hermesh.log").read_text(errors="replace")
    bibtex = (out / "bibtex.out").read_text(errors="replace") if (out / "bibtex.out").exists() else ""
    found = problems(log, bibtex)
    for sentence in found:
        print(f"paper: {sentence}", file=sys.stderr)
    pages = re.search(r"Output written on [^(]*\((\d+) pages", log)
    widest = max([float(p) for p in re.findall(r"Overfull \\hbox \(([\d.]+)pt", log)], default=0.0)
    print(f"{pages[1] if pages else '?'} pages; the widest overfull line sticks out by {widest:g} pt")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
