#!/usr/bin/env bash
# Runs one shard to its end: experiments/sweep/run_shard.sh PROGRAM EXPERIMENT TIER I/N THREADS FOLDER. Cells that the folder
# has rows of are not made again. Exits with 0 if the shard has a row for each of its cells, also where some of these say that
# they failed or broke a promise; otherwise as the program did.
set -euo pipefail
[ $# = 6 ] || { sed -n '2,4s/^# //p' "$0"; exit 2; }
program=$1 experiment=$2 tier=$3 shard=$4 threads=$5 folder=$6

code=0
"$program" run "$experiment" --tier "$tier" --shard "$shard" --threads "$threads" --out "$folder" || code=$?
case $code in
  # 1 says that a cell failed, or that the run did; the manifest tells which.
  0 | 1 | 3) if grep -q '"finished": true' "$folder/shard.json"; then exit 0; fi ;;
esac
echo "shard $shard ended with exit code $code before it was done" >&2
exit $((code == 0 ? 1 : code))
