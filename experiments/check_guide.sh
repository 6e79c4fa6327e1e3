#!/usr/bin/env bash
# Checks that the extractor in CONTRIBUTING.md still compiles, with its entry in the table of variants:
# experiments/check_guide.sh BUILD-FOLDER; seconds. Exits with 1 and the compiler's messages.
set -euo pipefail
cd "$(dirname "$0")/.."
build=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# The guide's files, each after the line of a diff that names it.
awk -v work="$work" '
  /^```diff$/ { inside = 1; next }
  /^```/ { inside = 0 }
  !inside { next }
  /^(---|\+\+\+) [ab]\// { file = work "/" substr($2, 3); folder = file; sub("/[^/]*$", "", folder); system("mkdir -p " folder); next }
  sub(/^\+/, "") { print > file }' CONTRIBUTING.md
source=$(cd "$work" && find algorithms/extraction -name '*.cpp')
test -n "$source" || { echo "guide: CONTRIBUTING.md shows no extractor" >&2; exit 1; }

# The table of variants with the guide's lines in it: includes above its own, the rest as its first entry.
awk '
  NR == FNR { if (/^#include/) includes = includes $0 "\n"; else entry = entry $0 "\n"; next }
  /^#include/ && !above++ { printf "%s", includes }
  /\{\.name = / && !entries++ { printf "%s", entry }
  { print }
  END { exit !(above && entries) }' "$work/algorithms/variants.cpp" algorithms/variants.cpp > "$work/variants.cpp"

# Both are compiled as the build compiles the extractor that the guide points to.
command=$(sed -n 's/^ *"command": "\(.*\) -o [^ ]* -c [^ ]*dual_contouring\/dual_contouring\.cpp",*$/\1/p' "$build/compile_commands.json")
test -n "$command" || { echo "guide: $build/compile_commands.json does not say how dual_contouring.cpp is compiled" >&2; exit 1; }
for file in "$work/$source" "$work/variants.cpp"; do
  $command -I"$work" -fsyntax-only "$file"
done
echo "guide: its extractor and the entry of it compile"
