#!/usr/bin/env bash
# Whether the program still makes what was accepted: experiments/check_regression.sh PROGRAM EXPERIMENT FOLDER. Runs the
# experiment into the folder, which is emptied first, and holds its rows against those of results/baselines, times and memory
# aside. Exits with 3 if something became worse, with the sentences of `hermesh compare`.
set -euo pipefail
[ $# = 3 ] || { sed -n '2,4s/^# //p' "$0"; exit 2; }
program=$1 experiment=$2 folder=$3
root=$(cd "$(dirname "$0")/.." && pwd)

rm -rf "$folder"
# Exit codes 1 and 3 mean that a variant failed or violated a guarantee, as in some accepted rows; the
# comparison decides.
code=0
"$program" run "$experiment" --out "$folder" --quiet >/dev/null || code=$?
case $code in 0 | 1 | 3) ;; *) exit "$code" ;; esac
exec "$program" compare "$root/results/baselines/$experiment" "$folder" --times no
