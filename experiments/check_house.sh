#!/usr/bin/env bash
# Whether the house is kept: experiments/check_house.sh; seconds, builds nothing. Prints figures, and exits with 1 if
#   - a folder shows more than 25 topics (a header with its source and test is one);
#   - a /// comment begins with a word that leaves its subject out;
#   - less than a tenth of the lines of a room's sources in algorithms/, tests aside, are comments;
#   - the README has more than 150 lines.
set -euo pipefail
cd "$(dirname "$0")/.."
bad=0

topics() {  # of each folder: its files without ends and tests, each once
  find algorithms reference validation experiments packages/cpp -type f ! -path '*/node_modules/*' ! -path '*/inputs/*' ! -path '*/foreign_meshes/*' |
    sed -E '/_test\.cpp$|_for_tests\./d; s#\.[A-Za-z0-9]+$##' | sort -u | sed -E 's#/[^/]*$##' | sort | uniq -c
}
topics | awk '$1 > 25 { print "topics: " $2 " shows " $1; bad = 1 } $1 > most { most = $1 } END {
  print "topics: at most " most " in a folder"; exit bad }' || bad=1

headless='^[[:space:]]*///<?[[:space:]]*(Of|By|Those|That|The same|Does)[^A-Za-z]'
find algorithms reference validation experiments packages/cpp -name node_modules -prune -o \( -name '*.h' -o -name '*.cpp' -o -name '*.inc' \) -print | sort |
  xargs awk -v headless="$headless" '
    FNR == 1 { before = 0 }
    { here = $0 ~ /^[[:space:]]*\/\/\//
      if (here && !before && $0 ~ headless) { print "subjects: " FILENAME ":" FNR ": " $0; bad = 1; n++ }
      before = here }
    END { print "subjects: " n + 0 " comments leave theirs out"; exit bad }' || bad=1

find algorithms -name '*.cpp' ! -name '*_test.cpp' | sort | xargs awk '
    { room = FILENAME; sub(/\/[^\/]*$/, "", room); all[room]++; lines++ }
    /^[[:space:]]*\/\// { said[room]++; comments++ }
    END {
      for (room in all) if (said[room] < 0.1 * all[room]) {
        printf "comments: %s has %.1f %% in %d lines\n", room, 100 * said[room] / all[room], all[room]; bad = 1 }
      printf "comments: %.1f %% of the lines of sources in algorithms/\n", 100 * comments / lines
      exit bad }' || bad=1

find algorithms reference validation experiments packages/cpp -name node_modules -prune -o \( -name '*.h' -o -name '*.cpp' -o -name '*.inc' \) -print | xargs awk '
    !/^[[:space:]]*(\/\/.*)?$/ { n++ } END { print "source lines: " n " that are neither blank nor comments" }'
lines=$(wc -l < README.md)
[ "$lines" -le 150 ] || { echo "README.md: $lines lines; what a newcomer can do without belongs beside what it describes"; bad=1; }
exit $bad
