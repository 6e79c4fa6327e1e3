#!/usr/bin/env bash
# Builds the paper from the rows of results/: build/paper/hermesh.pdf. It does not need the program. Called by
# ./reproduce --paper; `paper/make_paper.sh --numbers` only makes and checks the numbers, without LaTeX.
set -euo pipefail
cd "$(dirname "$0")/.."
. experiments/install_packages.sh

paper_packages=(python3 python3-scipy texlive-latex-base texlive-latex-recommended texlive-fonts-recommended)
out=build/paper
mkdir -p "$out"

if [ "${1:-}" = --numbers ]; then
  exec /usr/bin/python3 -m experiments.lab.paper --out "$out"
fi
install_packages "${paper_packages[@]}"
/usr/bin/python3 -m experiments.lab.paper --out "$out"

# The same bytes of the same commit: dates of the file are those of the commit.
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct 2>/dev/null || echo 0)
export SOURCE_DATE_EPOCH FORCE_SOURCE_DATE=1
export TEXINPUTS="$PWD/$out:$PWD/paper:$PWD/results:" BIBINPUTS="$PWD/paper:" max_print_line=1000
latex() {
  (cd "$out" && pdflatex -interaction=nonstopmode -halt-on-error hermesh.tex >latex.out 2>&1) || {
    grep -A 4 -m 1 '^!' "$out/hermesh.log" >&2 || tail -n 20 "$out/latex.out" >&2
    echo "The paper could not be typeset; $out/hermesh.log says more." >&2
    exit 1
  }
}
rm -f "$out"/hermesh.{aux,bbl,out,log,pdf}
latex
(cd "$out" && bibtex hermesh >bibtex.out) || { grep -v '^This is' "$out/bibtex.out" >&2; exit 1; }
latex
latex
# The typeset numbers must still be those of the rows. A paper that is refused is kept under another name.
/usr/bin/python3 -m experiments.lab.paper --verify "$out" || {
  mv "$out/hermesh.pdf" "$out/refused.pdf"
  echo "The paper is refused for the reasons above; see $out/refused.pdf." >&2
  exit 1
}
rm -f "$out/refused.pdf"
echo "The paper is $out/hermesh.pdf"
