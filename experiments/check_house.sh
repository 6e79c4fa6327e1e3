#!/usr/bin/env bash
# Whether the house is kept: experiments/check_house.sh; seconds, builds nothing. Prints the number of source lines, and exits with 1 if
# the README has more than 150 lines.
set -euo pipefail
cd "$(dirname "$0")/.."
bad=0

find algorithms reference validation experiments packages/cpp -name node_modules -prune -o \( -name '*.h' -o -name '*.cpp' -o -name '*.inc' \) -print | xargs awk '
    !/^[[:space:]]*(\/\/.*)?$/ { n++ } END { print "source lines: " n " that are neither blank nor comments" }'
lines=$(wc -l < README.md)
[ "$lines" -le 150 ] || { echo "README.md: $lines lines; what a newcomer can do without belongs beside what it describes"; bad=1; }
exit $bad
