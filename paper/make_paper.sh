#!/usr/bin/env bash
# Builds the paper from the rows of results/: build/paper/hermesh.pdf. Nothing of the program need be built. Called by
# ./reproduce --paper; `paper/make_paper.sh --numbers` makes and checks the numbers alone, for which Python is enough.
set -euo pipefail
cd "$(dirname "$0")/.."
. experiments/install_packages.sh

paper_packages=(python3 texlive-latex-base texlive-latex-recommended texlive-fonts-recommended)
out=build/paper
mkdir -p "$out"

if [ "${1:-}" = --numbers ]; then
  exec python3 paper/paper_numbers.py --out "$out"
fi
install_packages "${paper_packages[@]}"
python3 paper/paper_numbers.py --out "$out"

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
# What was typeset must still be what the rows give. A paper that is refused keeps another name, to be looked at.
python3 paper/check_log.py "$out" && python3 paper/paper_numbers.py --verify "$out" || {
  mv "$out/hermesh.pdf" "$out/refused.pdf"
  echo "The paper is refused for what is said above; $out/refused.pdf shows it." >&2
  exit 1
}
rm -f "$out/refused.pdf"
echo "The paper is $out/hermesh.pdf"
